"""U of peak-input at a requirement, taken as the limit, gives the requirement back."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from bfppc_synth.expressions.parse import parse_constant
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.spec import Objective
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.questions import (
    largest_period,
    largest_resolution,
    smallest_accuracy,
)
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec

ROOT = Path(__file__).parents[2]
QUANTIZED = "measurement: {quantizer: {kind: uniform, step: 0.001}}\n"
SURGE, SMALL = "examples/compressor_surge.yaml", "tests/plants/small_exponential.yaml"
TIGHT = "bounds: tight"
A, P, R = Objective.ACCURACY, Objective.PERIOD, Objective.RESOLUTION
# Every example that synthesizes, and what of it can be asked for.
CASES = [(SURGE, A, ""), (SURGE, P, "")]
MORE = [
    (SMALL, R, QUANTIZED),
    (SURGE, R, QUANTIZED),
    *((f"examples/{name}.yaml", A, "") for name in ("paper_example_1", "paper_example_2")),
    *((f"examples/{name}.yaml", A, "") for name in ("van_der_pol", "cart_pendulum", "motor_arm")),
    *((f"examples/{name}.yaml", P, "") for name in ("van_der_pol", "cart_pendulum", "motor_arm")),
    *(("examples/motor_arm_nominal.yaml", objective, "") for objective in (A, P, R)),
    ("examples/switching_example_2.yaml", A, ""),
    *(("examples/theorem1_example_1.yaml", objective, "") for objective in (A, R)),
    *((SURGE, objective, TIGHT) for objective in (A, P)),
    ("examples/paper_example_2.yaml", A, TIGHT),
]
ALL = os.environ.get("BFPPC_TESTS") == "all"
ASKED = {
    Objective.ACCURACY: smallest_accuracy,
    Objective.PERIOD: largest_period,
    Objective.RESOLUTION: largest_resolution,
}


def cheapest(path: Path) -> tuple[PlantSpec, Design]:
    """Read a plant and design it for the least peak input, its document to match."""
    spec = load_spec(path)
    synthesis = replace(spec.synthesis, objective=((Objective.PEAK_INPUT, 1.0),))
    spec = replace(spec, synthesis=synthesis)
    return spec, synthesize(spec)


def stated(spec: PlantSpec, section: str, key: str, value: object) -> PlantSpec:
    """Set one entry of the frozen document: a text, or what is written as a mapping."""
    entries: dict[str, object] = dict(spec.document[1])  # type: ignore[index]
    kept = entries.get(section, ("mapping", ()))
    pairs = dict(kept[1]) | {key: value}  # type: ignore[index]
    entries[section] = ("mapping", tuple(pairs.items()))
    return replace(spec, document=("mapping", tuple(entries.items())))


def limited(spec: PlantSpec, limit: float) -> PlantSpec:
    """Give the plant this actuator limit, in its document too."""
    actuator = replace(spec.actuator, limit=parse_constant(repr(limit)))
    return stated(replace(spec, actuator=actuator), "actuator", "limit", repr(limit))


def answered(found: PlantSpec, spec: PlantSpec) -> PlantSpec:
    """Write the file that gives what was found, without a limit, as the first file was."""
    free = replace(found, actuator=spec.actuator, chosen=None, synthesis=spec.synthesis)
    free = replace(free, document=spec.document)
    if found.performance.accuracy != spec.performance.accuracy:
        assert found.performance.accuracy is not None
        free = stated(free, "performance", "accuracy", found.performance.accuracy.text)
    if found.sampling != spec.sampling:
        free = stated(free, "sampling", "period", found.sampling.period.text)
    if found.measurement != spec.measurement:
        steps = [
            (state, ("mapping", (("kind", "uniform"), ("step", quantizer.step.text))))
            for state, quantizer in zip(found.states, found.measurement.quantizers, strict=True)
            if quantizer.step is not None
        ]
        free = stated(free, "measurement", "quantizer", ("mapping", tuple(steps)))
    return free


def given(spec: PlantSpec, objective: Objective) -> float:
    if objective is Objective.ACCURACY:
        assert spec.performance.accuracy is not None
        return spec.performance.accuracy.approximate
    return spec.sampling.period.approximate if objective is Objective.PERIOD else 1.0


def round_trip(path: Path, objective: Objective) -> None:
    spec, first = cheapest(path)
    assert first.certificate.verdict is Verdict.CERTIFIED
    found = ASKED[objective](limited(spec, first.bounds.U))
    assert found.certificate.verdict is Verdict.CERTIFIED
    assert found.bounds.U <= first.bounds.U
    assert found.spec.chosen is not None
    value, wanted = found.spec.chosen.value, given(spec, objective)
    if objective is Objective.ACCURACY:
        assert found.omega[0] == value <= 1.01 * wanted
    else:
        assert value >= 0.99 * wanted
    back = synthesize(answered(found.spec, spec))
    assert back.certificate.verdict is Verdict.CERTIFIED
    assert pytest.approx(first.bounds.U, rel=0.03) == back.bounds.U


@pytest.mark.parametrize(("path", "objective", "more"), CASES + MORE * ALL)
def test_the_peak_input_of_a_requirement_gives_the_requirement_back(
    path: str, objective: Objective, more: str, tmp_path: Path
) -> None:
    asked, text = tmp_path / "plant.yaml", (ROOT / path).read_text()
    if more == TIGHT:
        text = text.replace("synthesis:\n", f"synthesis:\n  {TIGHT}\n")
    asked.write_text(text + more * (more != TIGHT))
    round_trip(asked, objective)
