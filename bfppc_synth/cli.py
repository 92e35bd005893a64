"""Command line: argv to exit code; the only file that prints.

Nothing heavy is imported here: ``--help`` and the mistakes of a plant file answer at once.
"""

from __future__ import annotations

import difflib
import io
import json
import os
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bfppc_synth.errors import BfppcError, PlantFileError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from bfppc_synth.pipeline import Outcome

COMMANDS = ("synth", "simulate", "verify", "export")
LATER = ("campaign", "check", "compare", "doctor", "new", "schema", "sweep")
# Options that take the next word; needed to find the command behind them.
VALUED = frozenset({"--out", "--seed", "--real", "--math", "--horizon", "--x0", "--to"})

app = typer.Typer(
    epilog="A word that ends in .yaml or .yml, or names a file, means `synth` of that file.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Voice:
    """How to speak: results on stdout, everything else on stderr."""

    as_json: bool
    quiet: bool

    def tell(self, outcome: Outcome) -> int:
        """Print what came of a command; its exit code."""
        from bfppc_synth.report.summary import summary

        for message in outcome.messages:
            if outcome.exit_code:
                print(message, file=sys.stderr)
            elif not self.quiet:
                print(f"note: {message}", file=sys.stderr)
        document: dict[str, Any] = {**outcome.document, "exit_code": outcome.exit_code}
        if outcome.folder is not None:
            document["folder"] = outcome.folder.as_posix()
        if self.as_json:
            print(json.dumps(document, indent=2))
        elif not self.quiet:
            print("\n".join(summary(document)))
        return outcome.exit_code

    def complain(self, error: Exception, exit_code: int, sentence: str) -> int:
        """Print why nothing came of it; with --json also as the object on stdout."""
        print(sentence, file=sys.stderr)
        if self.as_json:
            mistakes = error.mistakes if isinstance(error, PlantFileError) else ()
            rows = [{key: getattr(row, key) for key in row.__slots__} for row in mistakes]
            document: dict[str, Any] = {"format": "bfppc-synth/error/1", "exit_code": exit_code}
            document |= {"kind": type(error).__name__, "message": sentence, "mistakes": rows}
            print(json.dumps(document, indent=2))
        return exit_code

    @contextmanager
    def progress(self) -> Iterator[Callable[[str], None]]:
        """Yield what shows the current step; silent unless stderr is a terminal."""
        if self.quiet or not sys.stderr.isatty():
            yield lambda _message: None
            return
        from rich.console import Console
        from rich.markup import escape

        with Console(stderr=True).status("reading") as status:
            yield lambda message: status.update(escape(message))

    def settle(self, work: Callable[[], int]) -> int:
        """Run ``work``; whatever happens becomes an exit code, nobody sees a traceback unasked."""
        try:
            return work()
        except BfppcError as error:
            prefix = "" if isinstance(error, PlantFileError) else "error: "
            return self.complain(error, error.exit_code, f"{prefix}{error}")
        except KeyboardInterrupt:
            print("interrupted", file=sys.stderr)
            return 130
        except Exception as error:
            if os.environ.get("BFPPC_TRACEBACK") == "1":
                raise
            what = f"unexpected {type(error).__name__}: {error} (BFPPC_TRACEBACK=1 shows where)"
            return self.complain(error, 1, what)


Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Only errors.")]
Seed = Annotated[int | None, typer.Option("--seed", help="Seed of the simulated adversaries.")]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A generated folder.")]
Plant = Annotated[Path, typer.Argument(metavar="PLANT", help="The plant file.")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Where to write [generated/NAME].")]
Allow = Annotated[bool, typer.Option("--allow-uncertified", help="Write without a certificate.")]
Force = Annotated[bool, typer.Option("--force", help="Replace the folder of another plant.")]
Hidden = Annotated[str, typer.Option(hidden=True)]
Horizon = Annotated[float | None, typer.Option(metavar="SECONDS", help="Length of the run.")]
Start = Annotated[list[str] | None, typer.Option(metavar="x1=1.5,x2=0", help="Initial state.")]
To = Annotated[str, typer.Option("--to", metavar="FORMAT", help="smt2 or coq.")]


def _print_version(wanted: bool) -> None:
    from importlib.metadata import version

    if wanted:
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


@app.command()
def synth(
    plant: Plant,
    *,
    out: Out = None,
    allow_uncertified: Allow = False,
    force: Force = False,
    real: Hidden = "double",
    math: Hidden = "libm",
    as_json: Json = False,
    quiet: Quiet = False,
    seed: Seed = None,
) -> None:
    """Gains, certificate, code, simulation and report of a plant file."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        for option, value, only in (("--real", real, "double"), ("--math", math, "libm")):
            if value != only:
                raise UsageError(
                    f"{option} {value} is not available in this version; fix: {option} {only}"
                )
        from bfppc_synth import pipeline

        doubtful, existing = pipeline.Uncertified, pipeline.Overwrite
        with voice.progress() as progress:
            options = pipeline.Options(
                out=out,
                uncertified=doubtful.WRITE if allow_uncertified else doubtful.REFUSE,
                overwrite=existing.FORCE if force else existing.REFUSE,
                seed=seed,
                progress=progress,
            )
            outcome = pipeline.run(plant, options)
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))


@app.command()
def simulate(
    folder: Folder,
    *,
    horizon: Horizon = None,
    x0: Start = None,
    as_json: Json = False,
    quiet: Quiet = False,
    seed: Seed = None,
) -> None:
    """Run the generated controller of a folder against its plant."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        _require_folder(folder)
        if horizon is not None and not 0.0 < horizon < float("inf"):
            raise UsageError(f"--horizon {horizon}: not a positive time; fix: write --horizon 10")
        from bfppc_synth import pipeline

        start = pipeline.initial_state(x0 or [])
        with voice.progress() as progress:
            outcome = pipeline.simulate(
                folder, horizon=horizon, start=start, seed=seed, progress=progress
            )
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))


@app.command()
def verify(
    folder: Folder, *, as_json: Json = False, quiet: Quiet = False, seed: Seed = None
) -> None:
    """Check a generated folder again with the separate checker."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        _require_folder(folder)
        from bfppc_synth import pipeline

        with voice.progress() as progress:
            progress("checking the certificate")
            outcome = pipeline.verify(folder)
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))


@app.command()
def export(folder: Folder, *, to: To, as_json: Json = False, quiet: Quiet = False) -> None:
    """Write a certified folder's claims for other provers into DIR/interop."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        from bfppc_synth import pipeline

        return voice.tell(pipeline.export(folder, to))

    raise typer.Exit(voice.settle(work))


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
    for stream in (sys.stdout, sys.stderr):
        # A title may have letters that the terminal's encoding lacks.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    return Voice(as_json="--json" in words, quiet=False).settle(lambda: _dispatch(arrange(words)))


def _dispatch(words: list[str]) -> int:
    try:
        app(args=words, prog_name="bfppc-synth")
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 1
    return 0


def arrange(words: Sequence[str]) -> list[str]:
    """Put the command first: options may stand before it, and a file means ``synth``.

    Raises
    ------
    UsageError
        If the first word that is no option is neither a command nor a file.
    """
    if "--version" in words:
        return ["--version"]
    index = 0
    while index < len(words) and words[index].startswith("-"):
        index += 2 if words[index] in VALUED else 1
    if index >= len(words):
        return list(words)
    word = words[index]
    if word in COMMANDS:
        return [word, *words[:index], *words[index + 1 :]]
    choice = ", ".join(COMMANDS)
    if word in LATER:
        raise UsageError(f"command {word} is not available in this version; fix: use {choice}")
    if word.lower().endswith((".yaml", ".yml")) or Path(word).is_file():
        return ["synth", *words]
    near = difflib.get_close_matches(word, COMMANDS, n=1)
    fix = f"did you mean {near[0]}?" if near else "see bfppc-synth --help"
    raise UsageError(f"{word} is neither a command ({choice}) nor a file; fix: {fix}")


def _require_folder(folder: Path) -> None:
    if not folder.is_dir():
        raise UsageError(f"{folder}: no such folder; fix: name one that bfppc-synth wrote")
