"""What asking less would buy: estimates that a design anew confirms."""

import pytest

from bfppc_synth.reasons.sensitivities import with_sensitivities
from bfppc_synth.report.sensitivities import sensitivity_entries
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

TEXT = """name: plant
states: [x1, x2]
dynamics: {{x1: {{f: 0.5*x1}}, x2: {{f: x1*x2, disturbance: 0.1}}}}
initial: {{x1: 0.5, x2: 0}}
performance: {{accuracy: {accuracy}}}
sampling: {{period: {period}}}
synthesis: {{center: performance, objective: peak-input{more}}}
"""


@pytest.fixture
def design_of(tmp_path):
    def make(accuracy="0.1", period="0.002", more=""):
        path = tmp_path / "plant.yaml"
        text = TEXT.format(accuracy=accuracy, period=period, more=more)
        path.write_text(text, encoding="utf-8")
        return synthesize(load_spec(path))

    return make


def test_the_estimates_are_those_of_designs_with_the_eased_requirement(design_of):
    design = with_sensitivities(design_of())
    found = {one.path: one for one in design.sensitivities}
    wider = design_of(accuracy=found["performance.accuracy"].eased).bounds.U
    faster = design_of(period=found["sampling.period"].eased).bounds.U
    known = design.bounds.U
    assert found["performance.accuracy"].peak_input == pytest.approx(wider / known - 1, abs=5e-3)
    assert found["sampling.period"].peak_input == pytest.approx(faster / known - 1, abs=5e-3)
    assert found["performance.accuracy"].peak_input < 0.0


def test_every_requirement_is_there_once_and_the_best_buy_first(design_of):
    rows = with_sensitivities(design_of()).sensitivities
    paths = [one.path for one in rows]
    assert len(paths) == len(set(paths))
    assert {"performance.accuracy", "sampling.period", "dynamics.x2.disturbance"} <= set(paths)
    assert [one.peak_input for one in rows] == sorted(one.peak_input for one in rows)


def test_the_same_design_has_the_same_estimates(design_of):
    design = design_of()
    assert with_sensitivities(design) == with_sensitivities(design)


def test_the_report_has_percents_and_calls_them_estimates(design_of):
    design = with_sensitivities(design_of())
    first, row = design.sensitivities[0], sensitivity_entries(design)[0]
    assert row["U_percent"] == pytest.approx(100.0 * first.peak_input, abs=0.006)
    assert row["kind"] == "estimate"


def test_gains_that_are_all_fixed_have_no_estimates(design_of):
    found = design_of()
    gains = ", ".join(
        f"x{i}: {{k: {g.k + 1e-9!r}, M: {g.M!r}, epsilon: {g.epsilon!r}, c: {g.c!r}}}"
        for i, g in enumerate(found.gains, start=1)
    )
    fixed = design_of(more=f", gains: {{{gains}}}, p: {{x2: {found.omega[1]!r}}}")
    assert with_sensitivities(fixed).sensitivities == ()
    assert sensitivity_entries(fixed) == []
