"""The shared library of an FMU, built by the compiler of this machine."""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bfppc_synth.interop.fmu import Standard, source_of

if TYPE_CHECKING:
    from collections.abc import Mapping

COMPILERS = ("cc", "gcc", "clang")
# Nothing of the machine but its instructions: no paths, no build id, and no contraction.
_FLAGS = (
    *("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden", "-ffp-contract=off"),
    *("-fno-ident", "-Wl,--build-id=none"),
)
# What the two standards call the folder of a platform.
_FOLDERS = {
    (Standard.FMI2, "x86_64"): "linux64",
    (Standard.FMI3, "x86_64"): "x86_64-linux",
    (Standard.FMI3, "aarch64"): "aarch64-linux",
}
_SECONDS = 60


@dataclass(frozen=True, slots=True, kw_only=True)
class Binary:
    """Path in the archive, and the bytes."""

    path: str
    content: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class NoBinary:
    """Why there is none."""

    reason: str


def build_binary(sources: Mapping[str, str], name: str, standard: Standard) -> Binary | NoBinary:
    """Compile the sources of an FMU.

    Parameters
    ----------
    sources : Mapping[str, str]
        Path in the archive -> text; only what stands under sources/ is used.
    name : str
        Model identifier.
    standard : Standard
        Says which file to compile and where the binary belongs.

    Returns
    -------
    Binary | NoBinary
        The same bytes from the same compiler; a reason where there is no compiler, it fails or
        takes a minute, or the standard has no name for the platform.
    """
    folder = _FOLDERS.get((standard, platform.machine()))
    if not sys.platform.startswith("linux") or folder is None:
        return NoBinary(reason=f"FMI {standard} has no folder for {platform.machine()} here")
    compiler = next((found for found in map(shutil.which, COMPILERS) if found), None)
    if compiler is None:
        return NoBinary(reason=f"no compiler: none of {', '.join(COMPILERS)} is on PATH")
    library = f"{name}.so"
    command = (compiler, *_FLAGS, source_of(standard), "-o", library, "-lm")
    try:
        with tempfile.TemporaryDirectory(prefix="bfppc-synth-") as scratch:
            for path, text in sources.items():
                if path.startswith("sources/"):
                    Path(scratch, Path(path).name).write_text(text, encoding="utf-8")
            # A list, no shell; the compiler is the caller's own, found on PATH.
            run = subprocess.run(  # noqa: S603
                command, cwd=scratch, capture_output=True, timeout=_SECONDS, check=False
            )
            if run.returncode != 0:
                said = run.stderr.decode(errors="replace").strip().splitlines()
                what = said[0] if said else "no word why"
                return NoBinary(reason=f"{Path(compiler).name} failed: {what}")
            content = Path(scratch, library).read_bytes()
    except (OSError, subprocess.TimeoutExpired) as error:
        return NoBinary(reason=f"{Path(compiler).name} failed: {type(error).__name__}")
    return Binary(path=f"binaries/{folder}/{library}", content=content)
