"""``doctor``: what is installed, what each thing is for, and how to get what is not."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from enum import StrEnum
from importlib.metadata import PackageNotFoundError, version
from typing import Final

from bfppc_synth.pipeline import Outcome

_SECONDS: Final = 10.0
_NUMBER: Final = re.compile(r"\d+(?:\.\d+)+(?:[-+.\w]*\w)?")


class Need(StrEnum):
    """Whether a synthesis works without it."""

    REQUIRED = "required"
    OPTIONAL = "optional"


@dataclass(frozen=True, slots=True, kw_only=True)
class Package:
    """A Python package, by the name it is installed under."""

    name: str
    purpose: str
    need: Need = Need.REQUIRED
    get: str = "pip install bfppc-synth"


@dataclass(frozen=True, slots=True, kw_only=True)
class Tool:
    """A program; the first of ``commands`` that is there counts. ``words`` make it tell itself."""

    commands: tuple[str, ...]
    purpose: str
    get: str
    words: tuple[str, ...] = ("--version",)


PACKAGES: Final = (
    Package(name="bfppc-synth", purpose="this program"),
    Package(name="sympy", purpose="the plant's expressions and their bounds"),
    Package(name="casadi", purpose="the search of gains (IPOPT)"),
    Package(name="numpy", purpose="simulations"),
    Package(name="scipy", purpose="simulations"),
    Package(name="ruamel.yaml", purpose="plant files"),
    Package(name="jinja2", purpose="generated code and reports"),
    Package(name="latex2mathml", purpose="formulas of the report"),
    Package(name="matplotlib", purpose="pictures"),
    Package(name="typer", purpose="the command line"),
    Package(name="rich", purpose="progress"),
    Package(
        name="distributed",
        purpose="campaigns on a cluster (Dask)",
        need=Need.OPTIONAL,
        get="pip install distributed",
    ),
)
TOOLS: Final = (
    Tool(
        commands=("cc", "gcc", "clang"),
        purpose="compiles the generated C",
        get="apt-get install gcc, or xcode-select --install",
    ),
    Tool(commands=("make",), purpose="the Makefile of a C package", get="apt-get install make"),
    Tool(commands=("cmake",), purpose="the CMake file of a C package", get="apt-get install cmake"),
    Tool(
        commands=("clang",),
        purpose="a second compiler for the tests of a C package",
        get="apt-get install clang",
    ),
    Tool(
        commands=("frama-c",),
        purpose="proves that the C code has no run-time error",
        get="apt-get install frama-c-base, or opam install frama-c",
        words=("-version",),
    ),
    Tool(
        commands=("arm-none-eabi-gcc",),
        purpose="compiles for a Cortex-M4F",
        get="apt-get install gcc-arm-none-eabi libnewlib-arm-none-eabi",
    ),
    Tool(
        commands=("qemu-system-arm",),
        purpose="counts the instructions of a step on a Cortex-M4F",
        get="apt-get install qemu-system-arm",
    ),
    Tool(
        commands=("coqc", "rocq"),
        purpose="checks what export --to coq writes",
        get="apt-get install coq",
    ),
    Tool(
        commands=("z3", "cvc5"),
        purpose="checks what export --to smt2 writes",
        get="apt-get install z3",
    ),
    Tool(
        commands=("typst",),
        purpose="prints a report as PDF",
        get="cargo install typst-cli, or a release of typst",
    ),
)


def doctor() -> Outcome:
    """Look at what is installed.

    Returns
    -------
    Outcome
        Exit code 0 whatever is missing; one entry per package and program, with its version.
    """
    entries = [_system(), *map(_package, PACKAGES), *map(_tool, TOOLS)]
    missing = [entry for entry in entries if not entry["ok"]]
    document: dict[str, object] = {
        "format": "bfppc-synth/doctor/1",
        "ready": not any(entry["need"] == Need.REQUIRED for entry in missing),
        "entries": entries,
    }
    return Outcome(exit_code=0, folder=None, document=document, lines=_lines(entries))


def _entry(name: str, need: Need, found: str, purpose: str, get: str) -> dict[str, object]:
    return {
        "name": name,
        "need": str(need),
        "ok": bool(found),
        "version": found or None,
        "purpose": purpose,
        "get": None if found else get,
    }


def _system() -> dict[str, object]:
    found = f"{platform.python_version()} on {platform.system()} {platform.machine()}"
    fine = sys.version_info >= (3, 11)
    return _entry("Python", Need.REQUIRED, found if fine else "", "3.11 or newer", "python.org")


def _package(package: Package) -> dict[str, object]:
    try:
        found = version(package.name)
    except PackageNotFoundError:
        found = ""
    return _entry(package.name, package.need, found, package.purpose, package.get)


def _tool(tool: Tool) -> dict[str, object]:
    name = next((word for word in tool.commands if shutil.which(word)), "")
    found = _version(name, tool.words) if name else ""
    shown = name or tool.commands[0]
    return _entry(shown, Need.OPTIONAL, found, tool.purpose, tool.get)


def _version(command: str, words: tuple[str, ...]) -> str:
    """Ask a program what it is; one that does not answer is there all the same."""
    place = shutil.which(command)
    if place is None:
        return ""
    try:
        done = subprocess.run(  # noqa: S603 -- a name of the table above, found on the path
            [place, *words],
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            timeout=_SECONDS,
            stdin=subprocess.DEVNULL,
        )
    except (OSError, subprocess.SubprocessError):
        return "there, but it does not run"
    said = _NUMBER.search(done.stdout) or _NUMBER.search(done.stderr)
    return said.group() if said else "there"


def _lines(entries: list[dict[str, object]]) -> tuple[str, ...]:
    width = max(len(str(entry["name"])) for entry in entries)
    wide = max(len(str(entry["version"] or "")) for entry in entries)
    lines = []
    for entry in entries:
        word = "ok" if entry["ok"] else "missing"
        text = f"{word:7}  {entry['name']!s:{width}}  {entry['version'] or '':{wide}}"
        lines.append(f"{text}  {entry['purpose']}")
        if not entry["ok"]:
            lines.append(f"{'':7}  {'':{width}}  to get it: {entry['get']}")
    needed = [entry for entry in entries if not entry["ok"] and entry["need"] == Need.REQUIRED]
    verdict = "everything that a synthesis needs is there"
    if needed:
        verdict = "a synthesis needs: " + ", ".join(str(entry["name"]) for entry in needed)
    return (*lines, verdict)
