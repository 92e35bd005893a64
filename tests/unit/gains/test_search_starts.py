"""Where the search of the gains begins: resumed, and where a load says nothing of a width."""

import math
from pathlib import Path

import pytest

from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.gains.problem import Weights, assemble, patterns, slots
from bfppc_synth.gains.search import _resumed, search
from bfppc_synth.gains.transition import choose_transition
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.nominal import prepare_nominal

PLANTS = Path(__file__).parents[2] / "plants"
PEAK_INPUT = Weights(peak_input=1.0, slope=0.01)
MARGIN = 2e-4


def posed(path, transition=None):
    problem, _ = prepare_nominal(load_spec(path), PEAK_INPUT, MARGIN, transition=transition)
    return problem


def level(shape, p):
    """phi(p) of a shape without a power term."""
    assert shape.c == 0.0
    return shape.k * p + shape.M * math.tanh(shape.M * p / shape.epsilon)


def searched(problem, **more):
    said = []
    return search(problem, said.append, **more), len(said)


@pytest.mark.parametrize("name", ["motor_arm", "jerk"])
def test_a_resumed_search_takes_one_start_and_ends_as_well(name):
    path = PLANTS / f"nominal_{name}.yaml"
    known, _ = searched(posed(path))
    other = posed(path, 4.0)
    fresh, starts = searched(other)
    resumed, more = searched(other, resume=known)
    assert (starts >= 2, more) == (True, 0)
    assert resumed.holds(MARGIN / 2)
    assert resumed.cost == pytest.approx(fresh.cost, abs=2e-4)


def test_a_search_is_resumed_where_it_ended():
    problem = posed(PLANTS / "nominal_jerk.yaml")
    known, _ = searched(problem)
    free = slots(problem, tuple(patterns(gains)[0] for gains in problem.gains))
    values, inner = _resumed(known, free)
    assert all(value > 0.0 for value in values.values())
    assert inner < known.half_widths[-1]
    shapes, widths = assemble(problem, values, FloatNumbers())
    assert widths == pytest.approx(known.half_widths, rel=1e-12)
    for again, shape, p in zip(shapes, known.shapes, known.half_widths, strict=True):
        assert level(again, p) == pytest.approx(level(shape, p), rel=1e-9)


def test_a_resumed_search_that_leads_nowhere_starts_anew():
    path = PLANTS / "nominal_jerk.yaml"
    from_another_plant, _ = searched(posed(PLANTS / "nominal_motor_arm.yaml"))
    found, _ = searched(posed(path), resume=from_another_plant)
    fresh, _ = searched(posed(path))
    assert found.cost <= fresh.cost + 2e-4


def test_noise_beside_a_step_without_a_load_is_no_end(tmp_path):
    path = tmp_path / "plant.yaml"
    text = (PLANTS / "nominal_levitation.yaml").read_text("utf-8")
    noise = "measurement: {noise: {z: 1e-7, v: 1e-6, w: 1e-5}}\nsampling: {period: 1e-5}\n"
    path.write_text(text.replace("synthesis:", noise + "synthesis:"), "utf-8")
    found, starts = searched(posed(path))
    assert starts > 4
    assert found.holds(MARGIN / 2)
    assert found.bounds.U < 17.0


def test_the_transition_is_searched_from_the_middle_outward():
    path = PLANTS / "nominal_jerk.yaml"
    asked = []

    def pose(transition):
        asked.append(transition)
        return posed(path, transition)

    chosen = choose_transition(pose, lambda _message: None, longest=16.0)
    assert asked[0] == 2.0
    assert sorted(asked[:8]) == [0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0]
    assert chosen in asked


@pytest.mark.parametrize("longest", [0.7, 3.0])
def test_no_transition_beyond_the_longest_is_asked_for(longest):
    # Without a limit 4 s is the best.
    path = PLANTS / "nominal_jerk.yaml"
    asked = []

    def pose(transition):
        asked.append(transition)
        return posed(path, transition)

    assert choose_transition(pose, lambda _message: None, longest=longest) <= longest
    assert max(asked) <= longest
