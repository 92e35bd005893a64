"""Command line: argv to exit code.

Nothing heavy is imported here: ``--help`` and the mistakes of a plant file answer at once.
"""

from __future__ import annotations

import io
import os
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from bfppc_synth.arguments import COMMANDS, arrange, arrange_completion
from bfppc_synth.commands import (
    campaign,
    check,
    compare,
    doctor,
    export,
    new,
    schema,
    simulate,
    sweep,
    synth,
    verify,
)
from bfppc_synth.errors import UsageError
from bfppc_synth.voice import Voice

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["COMMANDS", "arrange", "main"]

app = typer.Typer(
    epilog="A word that ends in .yaml or .yml, or names a file, means `synth` of that file.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        others = ", ".join(f"{name} {version(name)}" for name in ("casadi", "sympy"))
        python = ".".join(map(str, sys.version_info[:3]))
        print(f"bfppc-synth {version('bfppc-synth')} ({others}, Python {python})")
        raise typer.Exit


Version = Annotated[
    bool, typer.Option("--version", is_eager=True, callback=_print_version, help="Versions.")
]


@app.callback()
def _common(*, version: Version = False) -> None:
    """Certified quantized controllers from a plant file: `bfppc-synth plant.yaml`."""


for _command in (
    synth.synth,
    check.check,
    simulate.simulate,
    verify.verify,
    campaign.campaign,
    sweep.sweep,
    compare.compare,
    export.export,
    new.new,
    schema.schema,
    doctor.doctor,
):
    app.command()(_command)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Parameters
    ----------
    argv : Sequence[str], optional
        The words after the program's name; default ``sys.argv[1:]``.

    Returns
    -------
    int
        0 certified or done, 1 unexpected, 2 usage or plant file, 3 no design found,
        4 not certified, 130 interrupted.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    arrange_completion(os.environ)
    for stream in (sys.stdout, sys.stderr):
        # A title may have letters that the terminal's encoding lacks.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    return Voice(as_json="--json" in words, quiet=False).settle(lambda: _dispatch(arrange(words)))


def _dispatch(words: list[str]) -> int:
    try:
        code = app(args=words or ["--help"], prog_name="bfppc-synth", standalone_mode=False)
    except Exception as error:
        told = getattr(error, "format_message", None)
        if told is None:
            raise
        shown = " ".join(["bfppc-synth", *(word for word in words[:1] if word in COMMANDS)])
        # The parser below typer puts the kind of its own exception before the sentence.
        said = told().replace("Value error, ", "").rstrip(".")
        raise UsageError(f"{said}; fix: see {shown} --help") from error
    return code if isinstance(code, int) else 0
