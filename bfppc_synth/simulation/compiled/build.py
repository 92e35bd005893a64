"""C text to a loaded library: once per process, in a folder that nobody else can name."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from bfppc_synth.errors import BfppcError

if TYPE_CHECKING:
    from collections.abc import Sequence

#: The first one on PATH is taken.
COMPILERS = ("gcc", "cc", "clang")

#: A compiler folds these of a constant with other last digits than the platform's own function.
_FUNCTIONS = (
    *("exp", "log", "sin", "cos", "tan", "tanh", "sinh", "cosh", "atan", "asinh", "pow"),
    *("expf", "logf", "sinf", "cosf", "tanf", "tanhf", "sinhf", "coshf", "atanf", "asinhf", "powf"),
)

#: No -ffast-math, no contraction: every operation rounds as Python's does.
FLAGS = (
    "-O3",
    "-std=c99",
    "-ffp-contract=off",
    *(f"-fno-builtin-{name}" for name in _FUNCTIONS),
    "-fPIC",
    # What nobody outside can replace may be inlined.
    "-fvisibility=hidden",
    "-shared",
    "-w",
)

_SECONDS = 120.0


class NoCompilerError(BfppcError):
    """There is no C compiler, or it refuses the loop: runs are then made in Python."""


_loaded: dict[tuple[tuple[str, str], ...], ctypes.CDLL] = {}
_lock = threading.Lock()


def build(files: Sequence[tuple[str, str]], main: str) -> ctypes.CDLL:
    """Compile and load C files; the same texts are compiled once per process.

    Parameters
    ----------
    files : sequence of (str, str)
        Names and texts.
    main : str
        The one that is compiled; the others are included.

    Returns
    -------
    ctypes.CDLL
        Its functions release the interpreter while they run.

    Raises
    ------
    NoCompilerError
        If no compiler is found, or it fails.
    """
    key = tuple(files)
    with _lock:
        if key not in _loaded:
            _loaded[key] = _compile(key, main)
        return _loaded[key]


def find_compiler() -> str | None:
    """Return the path of the C compiler, None where there is none."""
    return next((found for name in COMPILERS if (found := shutil.which(name))), None)


def _compile(files: Sequence[tuple[str, str]], main: str) -> ctypes.CDLL:
    compiler = find_compiler()
    if compiler is None:
        raise NoCompilerError(f"no C compiler ({', '.join(COMPILERS)}) on PATH")
    # A folder of this process alone: no race, and nothing that another user could put there.
    with tempfile.TemporaryDirectory(prefix="bfppc-synth-loop-") as scratch:
        folder = Path(scratch)
        for name, text in files:
            (folder / name).write_text(text, encoding="utf-8")
        library = folder / "loop.so"
        command = [compiler, *FLAGS, "-o", str(library), main, "-lm"]
        try:
            done = subprocess.run(  # noqa: S603 -- a fixed command on our own text
                command,
                cwd=folder,
                capture_output=True,
                text=True,
                errors="replace",
                check=False,
                timeout=_SECONDS,
                stdin=subprocess.DEVNULL,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise NoCompilerError(f"{compiler}: {error}") from error
        if done.returncode != 0:
            first = next((line for line in done.stderr.splitlines() if "error" in line), "")
            raise NoCompilerError(f"{compiler} refuses the loop: {first or done.stderr[:200]}")
        try:
            # Loaded before the folder goes: the mapping outlives the file.
            return ctypes.CDLL(str(library))
        except OSError as error:
            raise NoCompilerError(f"{library.name}: cannot be loaded: {error}") from error
