"""Measure every committed controller on an emulated Cortex-M4F: ``make targets``.

Runs the commands of ``make target`` on a copy of each c/ folder of generated/ and writes
docs/targets.md. QEMU counts instructions, so the numbers do not depend on the machine; they do
on the compiler, which the page names.
"""

from __future__ import annotations

import re
from pathlib import Path

from bfppc_synth.codegen.measuring import measure_step
from bfppc_synth.model.target import NotMeasured, TargetCost

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


def measure(place: Path) -> TargetCost:
    """Run one package on the emulated processor."""
    folder = place / "c"
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    code = {
        path.relative_to(place).as_posix(): path.read_text()
        for path in paths
        if "build" not in path.relative_to(folder).parts
    }
    found = measure_step(code, place.name)
    if isinstance(found, NotMeasured):
        raise SystemExit(f"{place.name}: {found.reason}")
    return found


def row(place: Path, cost: TargetCost) -> str:
    """Lay out one row of the table."""
    header = (place / "c" / "include" / f"{place.name}.h").read_text()
    order = re.findall(r"_ORDER (\d+)", header)[0]
    numbers = (cost.least, cost.average, cost.most, cost.code, cost.stack, cost.state)
    return f"| {place.name} | {order} | {' | '.join(map(str, numbers))} |\n"


def main() -> None:
    """Write the page."""
    places = sorted(path for path in (ROOT / "generated").iterdir() if path.is_dir())
    costs = [measure(place) for place in places]
    text = HEAD.format(compiler=costs[0].compiler, emulator=costs[0].emulator)
    PAGE.write_text(text + "".join(map(row, places, costs)))


if __name__ == "__main__":
    main()
