"""The nearest miss: which inequality presses, and by how much everything is missed."""

import pytest

from bfppc_synth.gains.elastic import judged, nearest_miss
from bfppc_synth.gains.search import search
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.prepare import prepare

TEXT = """name: plant
states: [x1, x2]
dynamics: {{x1: {{f: 0.5*x1}}, x2: {{f: x1*x2}}}}
initial: {{x1: 0.5, x2: 0}}
performance: {{accuracy: 0.1}}
sampling: {{period: {period}}}
{limit}
synthesis: {{center: performance}}
"""


@pytest.fixture
def problem_of(tmp_path):
    def make(period, limit=""):
        path = tmp_path / "plant.yaml"
        path.write_text(TEXT.format(period=period, limit=limit), encoding="utf-8")
        return prepare(load_spec(path))[0]

    return make


def test_the_miss_grows_with_the_period_and_its_sign_is_what_the_search_finds(problem_of):
    misses = []
    near = None
    for period in (0.0005, 0.002, 0.01, 0.05):
        problem = problem_of(period)
        near = nearest_miss(problem, near)
        misses.append(near.log_factor)
        assert near.holds == (search(problem, lambda _message: None) is not None)
    assert misses == sorted(misses)
    assert misses[0] < 0.0 < misses[-1]


def test_a_limit_that_is_too_low_presses_and_a_high_one_does_not(problem_of):
    def pressure(limit):
        miss = nearest_miss(problem_of(0.0005, f"actuator: {{limit: {limit}}}"))
        return dict(miss.pressures)["limit", 1], miss.holds

    pressed, holds = pressure(0.5)
    assert pressed > 0.1
    assert not holds
    free, holds = pressure(1e6)
    assert free < 1e-3
    assert holds


def test_what_misses_is_evaluated_with_the_shortfall_that_the_program_tells(problem_of):
    problem = problem_of(0.05)
    miss = nearest_miss(problem)
    found = judged(problem, miss)
    assert found is not None
    assert found.shortfall > 0.0
