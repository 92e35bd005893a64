"""Command line: argv to exit code.

Nothing heavy is imported here: ``--help`` and the mistakes of a plant file answer at once.
"""

from __future__ import annotations

import io
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from bfppc_synth.arguments import (
    COMMANDS,
    LATER,
    Allow,
    Folder,
    Force,
    Functions,
    Horizon,
    Json,
    Numbers,
    Out,
    Plant,
    Quiet,
    Seed,
    Start,
    Starts,
    To,
    Written,
    arrange,
    initial_state,
    require_folder,
)
from bfppc_synth.errors import UsageError
from bfppc_synth.model.arithmetic import Arithmetic, Mathematics, Real
from bfppc_synth.voice import Voice

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["COMMANDS", "LATER", "arrange", "main"]

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


@app.command()
def synth(
    plant: Plant,
    *,
    out: Out = None,
    allow_uncertified: Allow = False,
    force: Force = False,
    real: Numbers = Real.DOUBLE,
    math: Functions = Mathematics.LIBM,
    as_json: Json = False,
    quiet: Quiet = False,
    seed: Seed = None,
) -> None:
    """Gains, certificate, code, simulation and report of a plant file."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        from bfppc_synth import pipeline

        doubtful, existing = pipeline.Uncertified, pipeline.Overwrite
        with voice.progress() as progress:
            options = pipeline.Options(
                out=out,
                uncertified=doubtful.WRITE if allow_uncertified else doubtful.REFUSE,
                overwrite=existing.FORCE if force else existing.REFUSE,
                seed=seed,
                arithmetic=Arithmetic(real=real, mathematics=math),
                progress=progress,
            )
            outcome = pipeline.run(plant, options)
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))


@app.command()
def check(
    plant: Plant,
    *,
    x0: Starts = None,
    out: Written = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
    seed: Seed = None,
) -> None:
    """Audit the gains of a plant file: both forms of every inequality, then simulations."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        starts = tuple(initial_state([words]) for words in x0 or [])
        with voice.progress() as progress:
            progress("importing")
            from bfppc_synth.pipeline import Overwrite
            from bfppc_synth.pipeline_check import CheckOptions
            from bfppc_synth.pipeline_check import check as check_plant

            existing = Overwrite.FORCE if force else Overwrite.REFUSE
            options = CheckOptions(starts=starts, out=out, overwrite=existing, progress=progress)
            outcome = check_plant(plant, options)
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
        require_folder(folder)
        if horizon is not None and not 0.0 < horizon < float("inf"):
            raise UsageError(f"--horizon {horizon}: not a positive time; fix: write --horizon 10")
        from bfppc_synth import pipeline

        start = initial_state(x0 or [])
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
        require_folder(folder)
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
        code = app(args=words or ["--help"], prog_name="bfppc-synth", standalone_mode=False)
    except Exception as error:
        told = getattr(error, "format_message", None)
        if told is None:
            raise
        shown = " ".join(["bfppc-synth", *(word for word in words[:1] if word in COMMANDS)])
        raise UsageError(f"{told()}; fix: see {shown} --help") from error
    return code if isinstance(code, int) else 0
