"""The command ``bfppc-synth``, also as ``python -m bfppc_synth``.

It stands before ``cli`` for what cannot wait until a command line is parsed: Ctrl-C while modules
are still being imported, and the mistakes of a plant file, which need none of the parser's modules.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    argv : Sequence[str], optional
        The words after the program's name; default ``sys.argv[1:]``.

    Returns
    -------
    int
        As ``cli.main``: 0 certified or done, 1 unexpected, 2 usage or plant file, 3 no design
        found, 4 not certified, 130 interrupted.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        from bfppc_synth.arguments import VALUED
        from bfppc_synth.cli import main as run
        from bfppc_synth.voice import Voice

        if plant := _plant_file(words, VALUED):
            voice = Voice(as_json="--json" in words, quiet=False)
            if code := voice.settle(lambda: _read(plant)):
                return code
        return run(words)
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        return INTERRUPTED


def _read(plant: str) -> int:
    from bfppc_synth.spec.load import load_spec

    load_spec(plant)
    return 0


def _plant_file(words: Sequence[str], valued: Collection[str]) -> str:
    """Return the plant file that a command line is about, an empty text where it has none."""
    plain: list[str] = []
    rest = iter(words)
    for word in rest:
        if word in ("--help", "--version"):
            return ""
        if word in valued:
            next(rest, None)
        elif not word.startswith("-"):
            plain.append(word)
    *command, last = plain or [""]
    named = last.lower().endswith((".yaml", ".yml"))
    return last if named and command in ([], ["synth"], ["check"]) else ""


if __name__ == "__main__":
    sys.exit(main())
