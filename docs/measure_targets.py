"""Measure every committed controller on an emulated Cortex-M4F: ``make targets``.

Copies each c/ folder of generated/ to a scratch place, runs its ``make target`` and writes
docs/targets.md. QEMU counts instructions, so the numbers do not depend on the machine; they do
on the compiler, which the page names.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "targets.md"
HEAD = """\
# Cost on a Cortex-M4F

Made by `make targets`: `make target` in each generated/NAME/c, compiled by {compiler} with
-O2 and the hardware's single-precision unit, run by {emulator} with `-icount shift=0`.
Instructions are those of one step over the samples of test/vectors.h that are OK; stack is what a
step writes to, the libm's part included; code is the object of NAME.c without the libm. Double
arithmetic is done in software there: `--real float` is what this processor is made for.

| controller | n | instructions, least | on average | most | code, bytes | stack | state |
|---|---|---|---|---|---|---|---|
"""
SAID = re.compile(
    r"step: (\d+) least, (\d+) on average, (\d+) most .* stack (\d+) bytes.* state (\d+) bytes"
)


def said_by(command: list[str], folder: Path) -> str:
    """Return what a command prints."""
    done = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)  # noqa: S603
    return done.stdout


def measure(name: str, folder: Path) -> str:
    """Run one package on the emulated processor; a row of the table."""
    said = said_by(["make", "-s", "target"], folder)
    found = SAID.search(said)
    if found is None:
        raise SystemExit(f"{name}: make target says no numbers:\n{said}")
    least, average, most, stack, state = found.groups()
    code = said.splitlines()[-1].split()[0]
    header = (folder / "include" / f"{name}.h").read_text()
    order = re.findall(r"_ORDER (\d+)", header)[0]
    numbers = (order, least, average, most, code, stack, state)
    return f"| {name} | {' | '.join(numbers)} |\n"


def main() -> None:
    """Write the page."""
    compiler = said_by(["arm-none-eabi-gcc", "--version"], ROOT).splitlines()[0]
    emulator = said_by(["qemu-system-arm", "--version"], ROOT).splitlines()[0]
    short = re.sub(r" \(.*", "", emulator)
    rows = []
    for place in sorted((ROOT / "generated").iterdir()):
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch) / "c"
            shutil.copytree(place / "c", folder, ignore=shutil.ignore_patterns("build"))
            rows.append(measure(place.name, folder))
    text = HEAD.format(compiler=re.sub(r" \(.*\)", "", compiler), emulator=short)
    PAGE.write_text(text + "".join(rows))


if __name__ == "__main__":
    main()
