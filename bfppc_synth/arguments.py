"""Words of the command line: what stands where, and the options that commands share."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bfppc_synth.errors import UsageError
from bfppc_synth.model.arithmetic import Mathematics, Real

if TYPE_CHECKING:
    from collections.abc import MutableMapping, Sequence

COMMANDS = (
    *("synth", "check", "simulate", "verify", "campaign", "sweep", "compare", "export"),
    *("new", "schema", "doctor"),
)
# Options that take the next word; needed to find the command behind them.
VALUED = frozenset(
    {
        *("--out", "--seed", "--real", "--math", "--horizon", "--x0", "--to", "--budget"),
        *("--run", "--runs", "--workers", "--cluster", "--over", "--template"),
    }
)

Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Only errors.")]
Seed = Annotated[int | None, typer.Option("--seed", help="Seed of the simulated adversaries.")]
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A generated folder.")]
Plant = Annotated[Path, typer.Argument(metavar="PLANT", help="The plant file.")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Where to write [generated/NAME].")]
Allow = Annotated[bool, typer.Option("--allow-uncertified", help="Write without a certificate.")]
Force = Annotated[bool, typer.Option("--force", help="Replace the folder of another plant.")]
Pdf = Annotated[bool, typer.Option("--pdf", help="Write report.pdf too (needs typst).")]
Numbers = Annotated[
    Real, typer.Option("--real", help="Numbers of the code: binary64, or binary32 if it is enough.")
]
Functions = Annotated[
    Mathematics,
    typer.Option("--math", help="tanh, sin, cos, exp of the libm, or the code's own everywhere."),
]
Horizon = Annotated[float | None, typer.Option(metavar="SECONDS", help="Length of the run.")]
Start = Annotated[list[str] | None, typer.Option(metavar="x1=1.5,x2=0", help="Initial state.")]
Starts = Annotated[
    list[str] | None,
    typer.Option("--x0", metavar="x1=1.5,x2=0", help="One more initial state; repeatable."),
]
Written = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Write the audit there [nowhere].")
]
Named = Annotated[str, typer.Argument(metavar="NAME", help="Its name, a folder before it.")]
Template = Annotated[
    str | None, typer.Option(metavar="EXAMPLE", help="Begin as one of the examples.")
]
Replace = Annotated[bool, typer.Option("--force", help="Replace a file that is there.")]
Over = Annotated[
    list[str] | None,
    typer.Option(
        "--over",
        metavar="PATH=a:b:n",
        help="Path of the plant file and n values from a to b (:lin or :log); twice: a surface.",
    ),
]
Swept = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Write the sweep there [nowhere].")
]
To = Annotated[
    str,
    typer.Option("--to", metavar="FORMAT", help="smt2, coq, fmu2, fmu3, control or casadi."),
]
Runs = Annotated[int | None, typer.Option(metavar="N", help="How many runs [1000].")]
Workers = Annotated[
    int | None,
    typer.Option(metavar="W", help="How many at once [one per processor]; same results."),
]
Cluster = Annotated[
    str | None, typer.Option(metavar="tcp://HOST:PORT", help="Dask scheduler to run on instead.")
]
Resume = Annotated[bool, typer.Option("--resume", help="Go on where a campaign was stopped.")]
Number = Annotated[
    int | None, typer.Option("--run", metavar="K", help="Run K of the folder's campaign again.")
]
Plot = Annotated[bool, typer.Option("--plot", help="Write a picture of the run into DIR.")]
Compared = Annotated[int, typer.Option("--runs", metavar="N", help="Simulated runs.")]
Budget = Annotated[int, typer.Option("--budget", metavar="N", help="Sets of gains tried a method.")]


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
    if word.lower().endswith((".yaml", ".yml")) or Path(word).is_file():
        return ["synth", *words]
    near = difflib.get_close_matches(word, COMMANDS, n=1)
    fix = f"did you mean {near[0]}?" if near else "see bfppc-synth --help"
    raise UsageError(f"{word} is neither a command ({choice}) nor a file; fix: {fix}")


def arrange_completion(environment: MutableMapping[str, str]) -> None:
    """Put ``synth`` before a plant file also where a shell asks what may follow it."""
    for key in ("COMP_WORDS", "_TYPER_COMPLETE_ARGS"):
        program, _, rest = environment.get(key, "").partition(" ")
        first, more, _ = rest.partition(" ")
        if more and first.lower().endswith((".yaml", ".yml")):
            environment[key] = f"{program} synth {rest}"
            place = environment.get("COMP_CWORD", "")
            if key == "COMP_WORDS" and place.isdigit():
                environment["COMP_CWORD"] = str(int(place) + 1)


def initial_state(words: Sequence[str]) -> dict[str, float]:
    """Read ``--x0 x1=1.5,x2=0``, repeatable.

    Raises
    ------
    UsageError
        If a part is not STATE=NUMBER.
    """
    start = {}
    for part in ",".join(words).split(",") if words else ():
        name, _, text = part.partition("=")
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not abs(value) < float("inf"):
            raise UsageError(f"--x0 {part}: not STATE=NUMBER; fix: write --x0 x1=1.5,x2=0")
        start[name.strip()] = value
    return start


def require_folder(folder: Path) -> None:
    """Refuse a folder that is not there.

    Raises
    ------
    UsageError
        If it is none.
    """
    if not folder.is_dir():
        raise UsageError(f"{folder}: no such folder; fix: name one that bfppc-synth wrote")
