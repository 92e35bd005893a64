"""Instructions and bytes of a step, measured by what ``make target`` in a C folder runs.

The measurement is an extra: whatever goes wrong with compiler or emulator becomes a reason, and
the synthesis goes on.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bfppc_synth.model.target import NotMeasured, TargetCost

if TYPE_CHECKING:
    from collections.abc import Mapping

COMPILER: Final = "arm-none-eabi-gcc"
SIZE: Final = "arm-none-eabi-size"
EMULATOR: Final = "qemu-system-arm"
#: Seconds for one command. Each takes below 1; a busy machine must not change the report.
TIME_LIMIT: Final = 10.0
#: Characters of a tool's own words in a reason.
LONGEST: Final = 120

# As in templates/c/Makefile.jinja: a test compares these commands with `make -n target`.
_M4F: Final = (
    *("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-O2"),
    *("-ffunction-sections", "-fdata-sections"),
)
_STRICT: Final = (
    *("-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow"),
    *("-Wmissing-prototypes", "-Wstrict-prototypes", "-Wundef", "-Wdouble-promotion"),
    *("-Wfloat-conversion", "-Wcast-qual", "-Wvla", "-ffp-contract=off"),
)
_BOARD: Final = ("--specs=rdimon.specs", "-T", "target/mps2_an386.ld", "-Wl,--gc-sections")
_EMULATE: Final = (
    *(EMULATOR, "-M", "mps2-an386", "-icount", "shift=0", "-nographic", "-monitor", "none"),
    *("-serial", "none", "-semihosting-config", "enable=on,target=native", "-kernel"),
)
_SAID: Final = re.compile(
    r"step: (\d+) least, (\d+) on average, (\d+) most .* stack (\d+) bytes.* state (\d+) bytes"
)
# The folders before a file's name, of either family of systems.
_FOLDERS: Final = re.compile(r"(?:\b[A-Za-z]:)?(?:[^\s'\"`:;,()/\\]*[/\\])+")


class _Failed(Exception):  # noqa: N818  it is no error of the synthesis
    """A tool is missing, failed, or took too long; the text is the reason."""


def commands(name: str) -> tuple[tuple[str, ...], ...]:
    """List what ``make target`` runs, in its order.

    Parameters
    ----------
    name : str
        Name of the controller, an identifier.

    Returns
    -------
    tuple[tuple[str, ...], ...]
        Commands for the folder c/, which needs build/target: the object, two programs for
        the board, a run of each, the sizes of the object.
    """
    plain = f"build/target/{name}.o"
    compiled = (COMPILER, *_M4F, *_STRICT, "-Iinclude", "-c", f"src/{name}.c", "-o", plain)
    linked = tuple(
        (
            *(COMPILER, *_M4F, "-std=c99", "-Iinclude", source, "target/startup.c", plain),
            *(*_BOARD, "-o", program, "-lm"),
        )
        for source, program in (
            ("test/golden.c", "build/target/golden.elf"),
            ("target/measure.c", "build/target/measure.elf"),
        )
    )
    runs = tuple((*_EMULATE, f"build/target/{which}.elf") for which in ("golden", "measure"))
    return (compiled, *linked, *runs, (SIZE, plain))


def measure_step(code: Mapping[str, str], name: str) -> TargetCost | NotMeasured:
    """Compile a generated package for a Cortex-M4F and count what a step takes under QEMU.

    Parameters
    ----------
    code : Mapping[str, str]
        Path under the generated folder -> text; only what stands under c/ is used.
    name : str
        Name of the controller.

    Returns
    -------
    TargetCost | NotMeasured
        The same numbers each time with the same compiler: QEMU counts instructions, no time
        is taken. A reason where a tool is missing or fails, where the answers on the target
        are not those of controller.py, or a command takes longer than 10 s.

    References
    ----------
    docs/targets.md for what is counted.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="bfppc-synth-") as scratch:
            folder = Path(scratch)
            for path, text in code.items():
                if path.startswith("c/"):
                    place = folder / path.removeprefix("c/")
                    place.parent.mkdir(parents=True, exist_ok=True)
                    place.write_text(text, encoding="utf-8")
            return _measured(folder, name)
    except _Failed as failure:
        return NotMeasured(reason=str(failure))
    except OSError as error:
        words = error.strerror or type(error).__name__
        return NotMeasured(reason=f"no folder to compile in: {_shortened(words)}")


def _measured(folder: Path, name: str) -> TargetCost:
    """Run everything in a folder that holds the package."""
    tools = {tool: _found(tool) for tool in (COMPILER, EMULATOR, SIZE)}
    compiler = _version(_said_by((COMPILER, "--version"), tools, folder), COMPILER)
    emulator = _version(_said_by((EMULATOR, "--version"), tools, folder), EMULATOR)
    (folder / "build" / "target").mkdir(parents=True)
    said = [_said_by(command, tools, folder) for command in commands(name)]
    counted = _SAID.search(said[-2])
    sizes = re.search(r"^\s*(\d+)\s", said[-1], re.MULTILINE)
    if counted is None or sizes is None:
        raise _Failed(f"{EMULATOR if counted is None else SIZE} gave no numbers")
    least, average, most, stack, state = map(int, counted.groups())
    return TargetCost(
        compiler=compiler,
        emulator=emulator,
        least=least,
        average=average,
        most=most,
        stack=stack,
        code=int(sizes[1]),
        state=state,
    )


def _found(tool: str) -> str:
    """Find a program; its place is absolute, as commands run in another folder."""
    found = shutil.which(tool)
    if found is None:
        raise _Failed(f"{tool} is not on PATH")
    return str(Path(found).absolute())


def _version(said: str, tool: str) -> str:
    """Shorten the first line of a version: no distribution's package, QEMU to two numbers.

    Corrections of QEMU appear every month and count the same instructions.
    """
    first = re.sub(r" \(.*?\)", "", said.partition("\n")[0])
    qemu = re.match(r"QEMU emulator version (\d+\.\d+)", first)
    words = f"QEMU {qemu[1]}" if qemu else _shortened(first)
    return words or tool


def _said_by(command: tuple[str, ...], tools: Mapping[str, str], folder: Path) -> str:
    """Return what a command prints; nothing of it is left running."""
    try:
        # A list, no shell; the programs are the caller's own, found on PATH.
        process = subprocess.Popen(  # noqa: S603
            (tools[command[0]], *command[1:]),
            cwd=folder,
            env={**os.environ, "LC_ALL": "C"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        )
    except OSError as error:
        raise _Failed(f"{command[0]} does not start: {_shortened(error.strerror or '')}") from error
    with process:
        try:
            said, complaint = process.communicate(timeout=TIME_LIMIT)
        except subprocess.TimeoutExpired:
            raise _Failed(f"{command[0]} took longer than {TIME_LIMIT:g} s") from None
        finally:
            # Not poll(): until the process is waited for, its number is the group's.
            if process.returncode is None:
                _end(process)
    if process.returncode:
        raise _Failed(_complaint(command[0], process.returncode, complaint or said))
    return said


def _end(process: subprocess.Popen[str]) -> None:
    """End a command and what it started: a compiler's parts hold its pipes open."""
    if sys.platform == "win32":
        process.kill()
    else:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)


def _complaint(tool: str, status: int, words: str) -> str:
    """Say how a command ended, with the line that tells most."""
    lines = [line for line in map(_shortened, words.splitlines()) if line]
    telling = [line for line in lines if "error" in line] or lines
    reason = f"{tool} ended with {status}"
    return f"{reason}: {telling[0]}" if telling else reason


def _shortened(words: str) -> str:
    """Keep the printable part of a tool's words; of every path in them the last part."""
    printable = "".join(letter if letter.isprintable() else " " for letter in words)
    line = " ".join(_FOLDERS.sub("", printable).split())
    return line if len(line) <= LONGEST else f"{line[: LONGEST - 3]}..."
