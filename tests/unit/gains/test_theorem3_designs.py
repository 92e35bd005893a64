"""Method theorem3: free stages and a certified last one (docs/theory.md section 8)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bfppc_synth.errors import NoDesignError
from bfppc_synth.gains.evaluation import Judge
from bfppc_synth.gains.methods.theorem3 import retimed, stage_demands
from bfppc_synth.gains.period import largest_period
from bfppc_synth.gains.search import search
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.shapes import Shape
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.prepare import prepare
from bfppc_synth.synthesis.synthesize import synthesize

PLANT = (Path(__file__).parents[2] / "plants" / "switching.yaml").read_text(encoding="utf-8")
START = "x1: 0.5, x2: 2}"
SAMPLED = ("simulation:", "sampling: {period: 0.0001}\nsimulation:")
DELAYED = ("simulation:", "sampling: {period: 0.00002, delay: 0.00001}\nsimulation:")
QUANTIZED = ("simulation:", "measurement: {noise: [0.001, 0.01]}\nsimulation:")
CONTAINED = ("method: theorem3", "method: theorem3\n  handover: containment")
NARROW = ("p: {x1: 0.04, x2: 1}", "p: {x1: 0.01, x2: 1}")
PRINTED_P = ("  stages:", "  p: {x2: 2}\n  stages:")


@pytest.fixture
def spec(tmp_path):
    def load(*changes):
        text = PLANT
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        return load_spec(path)

    return load


def found_for(given):
    problem, _ = prepare(given)
    return problem, search(problem, lambda _: None)


@pytest.mark.parametrize("start", [START, "x1: 0.5, x2: -2}", "x1: 0.9, x2: 0}"])
@pytest.mark.parametrize("timing", [(), (SAMPLED,), (DELAYED, QUANTIZED)])
def test_reanchoring_has_a_design_from_every_start_that_breaks_the_printed_text(
    spec, start, timing
):
    problem, found = found_for(spec((START, start), *timing))
    assert found.holds(1e-5)
    assert all(demand.lhs > demand.rhs for demand in (*stage_demands(problem), *found.demands))
    # Assumption 3 holds where x_1 stays below sqrt(pi): the handover must not spoil that.
    assert found.bounds.X[0] < 1.7724
    assert found.bounds.U < 2e4


def test_the_last_stage_is_designed_for_the_center_of_the_handover(spec):
    problem, found = found_for(spec())
    (stage,) = problem.staging.stages
    reached = stage.bounds.X[1]
    assert problem.center.feed[0] == pytest.approx(reached)
    first = replace(problem, center=problem.staging.around.center)
    assert Judge(first).best(found.shapes, found.half_widths).shortfall < found.shortfall


def test_the_peak_input_counts_the_commands_of_the_free_stages(spec):
    loud = ("x2: {k: 1, M: 0.1", "x2: {k: 1, M: 40000")
    problem, found = found_for(spec(loud))
    (stage,) = problem.staging.stages
    assert stage.peak > 4e4
    assert pytest.approx(stage.peak) == found.bounds.U


def test_commands_in_flight_count_only_with_a_delay(spec):
    loud = ("x2: {k: 1, M: 0.1", "x2: {k: 1, M: 9000")
    speeds = []
    for timing in (SAMPLED, (SAMPLED[0], SAMPLED[1].replace("}", ", delay: 1e-9}"))):
        problem, _ = prepare(spec(loud, timing))
        shapes = (Shape(k=1.0, M=0.0, epsilon=1.0, c=0.0, N=3),) * 2
        speeds.append(Judge(problem).best(shapes, (0.05, 0.01)).bounds.V)
    assert speeds[1] > 3.0 * speeds[0]


def test_containment_exists_where_the_free_stage_is_well_inside(spec):
    problem, found = found_for(spec(CONTAINED, NARROW))
    assert problem.center.r_upper[1] == 2.0
    handover = [demand for demand in found.demands if demand.name == "T3.handover1"]
    assert [demand.step for demand in handover] == [0, 1]
    assert all(demand.lhs > demand.rhs for demand in handover)
    assert handover[1].rhs > 2.0 * problem.staging.stages[0].widened[1]
    assert found.bounds.U < 3e3


def test_containment_is_refused_for_the_printed_half_widths(spec):
    assert found_for(spec(CONTAINED, PRINTED_P))[1] is None


def test_containment_near_the_accuracy_costs_an_order_of_magnitude(spec):
    _, near = found_for(spec(CONTAINED))
    _, far = found_for(spec(CONTAINED, NARROW))
    assert near.bounds.U > 8.0 * far.bounds.U


def test_containment_with_a_delay_leaves_the_second_form_out(spec):
    assert prepare(spec(CONTAINED, NARROW))[0].theorem.alternatives() == ("U2", "U2'")
    problem, found = found_for(spec(CONTAINED, NARROW, DELAYED))
    assert problem.theorem.alternatives() == ("U2",)
    assert found.holds(1e-5)


def test_three_stages_have_a_design(spec):
    more = (
        "  stages:\n",
        "  stages:\n    - p: {x1: 0.03, x2: 0.8}\n      gains: {x1: {k: 2}, x2: {k: 1}}\n",
    )
    problem, found = found_for(spec(more))
    assert len(problem.staging.stages) == 2
    assert found.holds(1e-5)


def test_a_stage_that_no_sampling_holds_is_refused_with_its_number(spec):
    with pytest.raises(NoDesignError, match=r"synthesis\.stages\.0: .*\(0\.1 s\)"):
        prepare(spec((SAMPLED[0], SAMPLED[1].replace("0.0001", "0.1"))))


def test_a_longer_period_widens_the_free_stages_too(spec):
    problem, found = found_for(spec(SAMPLED))
    longer = retimed(problem, replace(problem.conditions, hold=2e-4))
    assert longer.staging.stages[0].widened > problem.staging.stages[0].widened
    assert longer.center.feed[0] > problem.center.feed[0]
    assert retimed(problem, replace(problem.conditions, hold=0.1)) is None
    assert largest_period(problem, found.shapes, found.half_widths) >= 1e-4


@pytest.mark.parametrize(
    ("changes", "more"),
    [((), set()), ((CONTAINED, NARROW), {"T3.handover1[x1]", "T3.handover1[x2]"})],
)
def test_the_stages_are_certified_with_the_design(spec, changes, more):
    design = synthesize(spec(*changes))
    assert design.certificate.verdict is Verdict.CERTIFIED
    assert len(design.stages) == 1
    names = {entry.id for entry in design.certificate.inequalities}
    assert {"T3.stage1[x1]", "T3.stage1[x2]", "U1[x1]", *more} <= names


def test_the_printed_form_is_evaluated_and_never_certified(spec):
    design = synthesize(spec(("method: theorem3", "method: theorem3\n  form: printed"), PRINTED_P))
    assert design.certificate.verdict is Verdict.PRINTED
    assert design.center.r_upper[0] == pytest.approx(1.5)
