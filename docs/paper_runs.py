"""Controllers and runs for ``docs/draw_paper_figures.py``: generated into build/figures."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.spec import Form
from bfppc_synth.simulation.loop import load_controller, simulate_nominal
from bfppc_synth.simulation.staged import stage_widths
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.trajectory import Trajectory

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
BUILD = ROOT / "build" / "figures"


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One panel: a design, a run of its controller, and what the panel is called."""

    title: str
    design: Design
    run: Trajectory

    @property
    def widths(self) -> NDArray[np.float64]:
        """p_i of the stage in force at every row, shape (N, n)."""
        table = np.array(stage_widths(self.design))
        stage = np.ones(len(self.run.t), dtype=int) if self.run.stage is None else self.run.stage
        chosen: NDArray[np.float64] = table[stage - 1]
        return chosen


def generated(text: str, name: str) -> Design:
    """Write a plant file and its controller into build/figures; what is open is solved for."""
    folder = BUILD / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "plant.yaml").write_text(text, encoding="utf-8")
    spec = load_spec(folder / "plant.yaml")
    design = synthesize(spec)
    if (design.certificate.verdict is Verdict.CERTIFIED) is (spec.synthesis.form is Form.PRINTED):
        raise SystemExit(f"{name}: {design.certificate.verdict}, {design.certificate.failures}")
    code = render_controller(build_law(design), make_provenance(design))
    (folder / "controller.py").write_text(code, encoding="utf-8")
    return design


def case(
    title: str,
    design: Design,
    *,
    horizon: float,
    start: tuple[float, ...] | None = None,
    step: float | None = None,
) -> Case:
    """Run the generated controller of a design against its nominal plant."""
    controller = load_controller(BUILD / design.spec.name / "controller.py")
    if step is not None:
        spec = replace(design.spec, simulation=replace(design.spec.simulation, period=step))
        design = replace(design, spec=spec, plant=replace(design.plant, spec=spec))
    run = simulate_nominal(design, controller, horizon=horizon, start=start)
    return Case(title=title, design=design, run=run)


def example(name: str, *changes: tuple[str, str]) -> Design:
    """Generate an example, or a variant of it under another name."""
    text = (EXAMPLES / f"{name}.yaml").read_text(encoding="utf-8")
    for old, new in changes:
        if old not in text:
            raise SystemExit(f"{name}: no {old!r} to replace")
        text = text.replace(old, new)
    found = re.search(r"^name: (\w+)$", text, flags=re.MULTILINE)
    return generated(text, name if found is None else found[1])
