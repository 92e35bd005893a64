"""Runs of a law in stages: the switch, the errors behind it, adversaries."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bfppc_synth.artifacts import simulate_design
from bfppc_synth.report.tables import report_document, trajectory_csv
from bfppc_synth.simulation.staged import Rollback, StagedTracking, stage_widths
from bfppc_synth.simulation.tracking import Start
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

PLANT = (Path(__file__).parents[2] / "plants" / "switching.yaml").read_text(encoding="utf-8")
SHORT = ("horizon: 10, period: 0.002", "horizon: 2, period: 0.002")
SAMPLED = (
    "simulation: {horizon: 10, period: 0.002",
    (
        "sampling: {period: 0.0001}\nmeasurement: {noise: [0.0005, 0.01]}\n"
        "simulation: {horizon: 0.3, period: 0.0001"
    ),
)
CONTAINED = ("method: theorem3", "method: theorem3\n  handover: containment")
NARROW = ("p: {x1: 0.04, x2: 1}", "p: {x1: 0.01, x2: 1}")
CASES = {
    "continuous": (SHORT,),
    "downward": (SHORT, ("x1: 0.5, x2: 2}", "x1: 0.5, x2: -2}")),
    "third": (SHORT, ("x1: 0.5, x2: 2}", "x1: 0.9, x2: 0}")),
    "sampled": (SAMPLED,),
    "contained": (SHORT, CONTAINED, NARROW),
    "three": (
        SHORT,
        (
            "  stages:\n",
            "  stages:\n    - p: {x1: 0.03, x2: 0.8}\n      gains: {x1: {k: 2}, x2: {k: 1}}\n",
        ),
    ),
}


# Both handovers, held and continuous.
SAMPLE = ("contained", "sampled")


def sampled(cases):
    return [pytest.param(c, marks=[] if c in SAMPLE else pytest.mark.full) for c in cases]


@pytest.fixture(scope="module")
def evidence(tmp_path_factory):
    known = {}

    def simulate(case):
        if case not in known:
            text = PLANT
            for old, new in CASES[case]:
                assert old in text
                text = text.replace(old, new)
            path = tmp_path_factory.mktemp(case) / "plant.yaml"
            path.write_text(text, encoding="utf-8")
            design = synthesize(load_spec(path))
            known[case] = design, simulate_design(design)
        return known[case]

    return simulate


@pytest.mark.parametrize("case", sampled(sorted(CASES)))
def test_every_run_stays_in_the_tube_of_its_stage_and_below_the_peak_input(evidence, case):
    design, runs = evidence(case)
    assert runs.within_bounds
    assert any(run.stages[-1].stage == len(design.stages) + 1 for run in runs.adversaries)
    assert len(runs.adversaries) == 20
    assert set(runs.nominal.status) == {0}


@pytest.mark.parametrize(
    "case", sampled(["continuous", "downward", "sampled", "contained", "three"])
)
def test_the_nominal_run_goes_through_every_stage_in_order(evidence, case):
    design, runs = evidence(case)
    stage = runs.nominal.stage
    assert list(np.unique(stage)) == list(range(1, len(design.stages) + 2))
    assert (np.diff(stage) >= 0).all()
    assert [entry.stage for entry in runs.nominal.stages] == list(np.unique(stage))


def test_the_errors_start_again_from_almost_nothing_at_a_reanchored_switch(evidence):
    _, runs = evidence("sampled")
    nominal = runs.nominal
    switch = int(np.argmax(nominal.stage == 2))
    assert abs(nominal.e[switch - 1, 1]) > 0.9
    assert abs(nominal.e[switch]).max() < 1e-9


def test_containment_keeps_the_first_error_and_lets_the_second_jump(evidence):
    design, runs = evidence("contained")
    nominal = runs.nominal
    switch = int(np.argmax(nominal.stage == 2))
    start = np.array([nominal.y_d[switch], 0.0])
    assert nominal.r[switch, 0] == pytest.approx(start[0] + 0.5, abs=1e-3)
    assert nominal.stages[-1].half_widths == design.omega == stage_widths(design)[-1]


def test_the_table_and_the_report_show_the_stages(evidence):
    design, runs = evidence("continuous")
    header, first, *_, last = trajectory_csv(design, runs.nominal).splitlines()
    assert header.endswith(",u,y_d,stage")
    assert first.endswith(",1")
    assert last.endswith(",2")
    document = report_document(design, runs.nominal, runs.adversaries)
    assert [len(entry["gains"]) for entry in document["stages"]] == [2, 2]
    assert document["stages"][-1]["omega"] == document["omega"]
    assert document["stages"][0]["omega"]["p"] == [0.04, 1.0]
    assert document["handover"]["excess"] == pytest.approx(0.04, rel=1e-5)
    assert [entry["stage"] for entry in document["simulation"]["stages"]] == [1, 2]


def test_the_center_after_two_switches_is_the_sum_of_what_was_handed_over(evidence):
    design, _ = evidence("three")
    tracking = StagedTracking(design, Start(true=(0.5, 2.0), measured=(0.5, 2.0), reference=0.0))
    tracking.switch(2, 1.0, (0.8, -1.0), 0.3)
    tracking.switch(3, 2.0, (0.7, 0.5), 0.2)

    def rho(t):
        return 0.5 * (1.0 + np.cos(t))

    first = 0.8 - 0.3 - 0.5 * rho(1.0)
    second = 0.7 - 0.2 - 0.5 * rho(2.0) - first * rho(1.0)
    expected = [
        [0.1 + 0.5 * rho(0.5), 2.0 * rho(0.5)],
        [0.1 + 0.5 * rho(1.5) + first * rho(0.5), -rho(0.5)],
        [0.1 + 0.5 * rho(2.5) + first * rho(1.5) + second * rho(0.5), 0.5 * rho(0.5)],
    ]
    times = [0.5, 1.5, 2.5]
    assert tracking.stages(times) == [1, 2, 3]
    np.testing.assert_allclose(tracking.center(times, np.full(3, 0.1)), expected, atol=1e-12)
    now = tracking.now(2.5, (0.3, -0.2), 0.1)
    r = tracking.center([2.5], np.array([0.1]))
    batch = tracking.errors([2.5], np.array([[0.3, -0.2]]), r)
    np.testing.assert_allclose(batch[0], now, atol=1e-12)


def test_a_trial_is_taken_back_and_a_kept_step_is_not():
    class Counter:
        __slots__ = ("stage", "status")

        def __init__(self):
            self.stage, self.status = 1, 0

        def step(self, t, x, y_d=None):
            del t, x, y_d
            self.stage += 1
            return 0.0

    counter = Counter()
    back = Rollback(counter)
    back.trial(0.0, (), None)
    back.trial(0.0, (), None)
    assert back.stage == 2
    back.keep()
    back.trial(0.0, (), None)
    assert back.stage == 3


def test_the_printed_text_lets_the_second_error_jump_out_of_its_tube(tmp_path):
    # research: e_2 from 1.00 to 4.69 against p_{2,2} = 2, from x(0) = (0.5, 2).
    printed = (
        "method: theorem3\n  form: printed\n  p: {x2: 2}\n  gains: {x1: {k: 2, M: 13.31441, "
        "epsilon: 0.5, c: 0.1}, x2: {k: 2, M: 13000, epsilon: 0.5, c: 0, N: 5}}"
    )
    text = PLANT.replace("method: theorem3", printed).replace("horizon: 10", "horizon: 0.2")
    (tmp_path / "plant.yaml").write_text(text, encoding="utf-8")
    nominal = simulate_design(synthesize(load_spec(tmp_path / "plant.yaml"))).nominal
    assert nominal.stages[1].max_abs_e[1] == pytest.approx(4.69, rel=0.01)
    assert not nominal.within_bounds
