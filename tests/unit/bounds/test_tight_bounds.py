"""Tight loads and rates: analytic and gridded suprema, both centers."""

import math
from pathlib import Path

import numpy as np
import pytest

from bfppc_synth.bounds.nominal.model import nominal_model
from bfppc_synth.bounds.signals import bound_signals, performance_center
from bfppc_synth.bounds.tight.bounds import tight_search
from bfppc_synth.bounds.tight.search import Effort
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.model.shapes import Shape
from bfppc_synth.spec.load import load_spec

EFFORT = Effort()
ONE = """name: one
{parameters}states: [x1]
dynamics:
  x1: {{{x1}}}
reference: {reference}
initial: {{x1: {start}}}
performance: {{accuracy: 0.1, {performance}}}
synthesis: {{center: {center}, bounds: tight}}
"""
TANH = Shape(k=0.0, M=2.0, epsilon=0.5, c=0.0, N=3)
CUBIC = Shape(k=0.7, M=0.5, epsilon=0.3, c=1.5, N=3)


@pytest.fixture
def finder_of(tmp_path):
    def make(text):
        path = tmp_path / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        spec = load_spec(path)
        plant = build_plant(spec)
        signals = bound_signals(plant)
        if spec.synthesis.center == "nominal":
            model = nominal_model(plant, spec.performance.transition.approximate)
            return tight_search(plant, signals, None, model)
        return tight_search(plant, signals, performance_center(plant, signals), None)

    return make


@pytest.fixture
def one(finder_of):
    def make(x1, reference, *, center="performance", start="0", parameters=""):
        performance = "rho: {kind: cosine, t_s: 1}"
        if center == "nominal":
            performance = "transition: 1"
        text = ONE.format(
            x1=x1,
            reference=reference,
            center=center,
            start=start,
            parameters=f"parameters: {{{parameters}}}\n" if parameters else "",
            performance=performance,
        )
        return finder_of(text)

    return make


def load_of(finder, p=0.1):
    return finder.load(0, (TANH,), (p,), EFFORT)


def on_a_circle(function):
    """Maximum over one turn of a smooth function, to nine digits."""
    t = np.linspace(0.0, 2.0 * math.pi, 200_001)
    return float(np.max(function(t)))


# (f, reference, sup of s (f - dr) on e = s 0.1 in closed form or on a fine grid)
PERFORMANCE = [
    ("f_bound: 2", "sin(t)", 3.0),
    ("f_bound: 'x1**2'", "0", 0.01),
    (
        "f_bound: 'x1**2'",
        "sin(t)",
        on_a_circle(lambda t: (np.sin(t) + 0.1) ** 2 - np.cos(t)),
    ),
    (
        # Center performance knows |f| only, but at the same t as dr.
        "f: '-4*x1'",
        "sin(t)",
        math.sqrt(17.0) + 0.4,
    ),
    (
        "f_bound: 'Abs(x1)', disturbance: 0.5",
        "sin(t)",
        math.sqrt(2.0) + 0.6,
    ),
    (
        # N / g is largest at the least gain where N is positive.
        "f_bound: 1, g_min: '2', g_bound: '2 + x1**2'",
        "sin(t)",
        1.0,
    ),
]


@pytest.mark.parametrize(("x1", "reference", "expected"), PERFORMANCE)
def test_one_dimension_meets_the_analytic_supremum_around_performance(one, x1, reference, expected):
    found = load_of(one(x1, reference))
    assert expected * (1.0 - 1e-9) <= found.upper <= expected * 1.001
    assert expected * 0.998 <= found.lower <= expected * (1.0 + 1e-9)


# s R / g = s (f(r + 0.1 s) - f^(r)) + what is unknown, r = sin t; see each.
NOMINAL = [
    # s (1 - a) sin t - 0.1 a at a = 0.9: damping takes 0.09 of the model error 0.1 away.
    ("f: '-a*x1'", "a: [0.9, 1.1]", 0.1 - 0.09),
    # 1.1 (r + 0.1)^2 - r^2 is convex: its maximum is at r = 1.
    ("f: 'a*x1**2'", "a: [0.9, 1.1]", 1.1 * 1.21 - 1.0),
    ("f: 'x1**2', disturbance: 0.5", "", 1.21 - 1.0 + 0.5),
    # With f unknown and g = a: s cos t (a - 1) / a + 2 / a at a = 0.9.
    ("f_bound: 2, g: a", "a: [0.9, 1.1]", (0.1 + 2.0) / 0.9),
    # A kink that f^ leaves out stays in f with its sign: 0.2 |1.1| at r = 1.
    ("f: 'x1**2 + 0.2*abs(x1)'", "", 0.21 + 0.22),
]


@pytest.mark.parametrize(("x1", "parameters", "expected"), NOMINAL)
def test_one_dimension_meets_the_analytic_supremum_around_nominal(one, x1, parameters, expected):
    found = load_of(one(x1, "sin(t)", center="nominal", parameters=parameters))
    assert expected * (1.0 - 1e-9) <= found.upper <= expected * 1.001 + 1e-12
    assert expected * 0.998 <= found.lower <= expected * (1.0 + 1e-9)


def test_a_start_away_from_the_reference_counts_with_its_own_time(one):
    # r = sin t + rho(t): |f| <= 1 gives 1 + sup |dr|, at one and the same t.
    found = load_of(one("f_bound: 1", "sin(t)", start="1"))
    t = np.linspace(0.0, math.pi, 400_001)
    rate = np.cos(t) - 0.5 * np.sin(t)
    expected = 1.0 + float(np.max(np.abs(rate)))
    assert expected * (1.0 - 1e-9) <= found.upper <= expected * 1.001


def test_an_exponential_rho_is_followed_and_its_tail_is_kept(finder_of):
    text = ONE.format(
        x1="f_bound: 'x1**2'",
        reference="0",
        center="performance",
        start="[0.5, 1]",
        parameters="",
        performance="rho: {kind: exponential, rate: 2, floor: 0.25}",
    )
    found = load_of(finder_of(text))
    # At t = 0 from x1 = 1: 1.1^2 + 0.75 * 2.
    assert 2.71 * (1.0 - 1e-9) <= found.upper <= 2.71 * 1.001


def test_a_reference_known_by_its_bounds_only_ranges_over_them(finder_of):
    text = ONE.format(
        x1="f_bound: 'x1**2'",
        reference="{value: abs(sin(t)), bound: 1, rate: 1}",
        center="performance",
        start="0",
        parameters="",
        performance="rho: {kind: cosine, t_s: 1}",
    )
    found = load_of(finder_of(text))
    assert 1.21 + 1.0 <= found.upper <= (1.21 + 1.0) * 1.001


@pytest.mark.parametrize(
    ("reference", "most"),
    # What fades too slowly for its enclosure is taken by its bounds alone: 1.21 + 1 + 1.
    [("sin(t) + 0.5*sin(sqrt(2)*t)", 1.01), ("tanh(t)*sin(t)", 1.33), ("exp(-t)", 1.01)],
)
def test_other_references_are_covered_for_all_times(one, reference, most):
    found = load_of(one("f_bound: 'x1**2 + 1'", reference, start="0"))
    t = np.concatenate((np.linspace(0.0, 40.0, 400_001), np.linspace(0.0, 4000.0, 400_001)))
    root = math.sqrt(2.0)
    signals = {
        "sin(t) + 0.5*sin(sqrt(2)*t)": (
            np.sin(t) + 0.5 * np.sin(root * t),
            np.cos(t) + 0.5 * root * np.cos(root * t),
        ),
        "tanh(t)*sin(t)": (
            np.tanh(t) * np.sin(t),
            np.tanh(t) * np.cos(t) + np.sin(t) / np.cosh(np.minimum(t, 300.0)) ** 2,
        ),
        "exp(-t)": (np.exp(-t), -np.exp(-t)),
    }
    y, rate = signals[reference]
    offset = -y[0]
    rho = np.where(t < math.pi, 0.5 * (1.0 + np.cos(t)), 0.0)
    slope = np.where(t < math.pi, -0.5 * np.sin(t), 0.0)
    r, dr = y + rho * offset, rate + slope * offset
    sampled = max(float(np.max((r + 0.1 * s) ** 2 + 1.0 - s * dr)) for s in (1.0, -1.0))
    assert sampled * (1.0 - 1e-9) <= found.upper <= sampled * most


TWO = """name: two
states: [x1, x2]
dynamics:
  x1: {f: 'x1**2 - sin(x1)', f_bound: 'x1**2 + 1'}
  x2: {f: 'x1*x2**2'}
initial: {x1: 1, x2: 0}
performance: {accuracy: 0.15, rho: {kind: cosine, t_s: 1}}
synthesis: {center: performance, bounds: tight}
"""


@pytest.mark.parametrize("shape", [TANH, CUBIC])
def test_a_facet_of_two_states_is_a_little_above_its_gridded_supremum(finder_of, shape):
    finder, p_1, p_2 = finder_of(TWO), 0.15, 0.8
    found = finder.load(1, (shape, TANH), (p_1, p_2), EFFORT)
    t = np.linspace(0.0, math.pi, 301)[:, None]
    e = np.linspace(-p_1, p_1, 301)[None, :]
    rho, slope = 0.5 * (1.0 + np.cos(t)), -0.5 * np.sin(t)
    bent = np.tanh(shape.M * e / shape.epsilon)
    phi = shape.k * e + shape.M * bent + shape.c * e**3
    rate = shape.k + shape.M**2 / shape.epsilon * (1.0 - bent**2) + 3.0 * shape.c * e**2
    x_1, sampled = rho + e, -math.inf
    for s in (1.0, -1.0):
        x_2 = s * p_2 - phi
        for push in (1.0, -1.0):
            de_1 = push * (x_1**2 + 1.0) + x_2 - slope
            own = np.abs(x_1 * x_2**2)
            sampled = max(sampled, float(np.max(own + s * rate * de_1)))
    assert sampled <= found.upper <= 1.01 * sampled
    assert found.lower <= 1.001 * sampled


def test_the_rate_holds_on_all_of_the_tube_and_the_load_on_its_walls(finder_of):
    finder = finder_of(TWO)
    shapes, widths = (TANH, TANH), (0.15, 0.8)
    load = finder.load(1, shapes, widths, EFFORT)
    rate = finder.rate(shapes, widths, EFFORT)
    # g_2 = 1, so the walls are a part of the tube.
    assert load.lower <= rate.upper
    assert rate.lower <= rate.upper <= 1.002 * max(rate.lower, load.lower)


def test_more_cuts_never_loosen_a_bound(finder_of):
    finder = finder_of(TWO)
    bounds = [
        finder.load(1, (TANH, TANH), (0.15, 0.8), Effort(cuts=cuts)).upper for cuts in (0, 32, 300)
    ]
    assert bounds[0] >= bounds[1] > bounds[2]


def test_a_worst_point_moves_with_the_tube(finder_of):
    finder = finder_of(TWO)
    found = finder.load(1, (TANH, TANH), (0.15, 0.8), EFFORT)
    for point in found.points:
        assert len(point.r) == 3
        assert len(point.rates) == 2
        assert point.errors[1] == point.side
        assert abs(point.errors[0]) <= 1.0


def test_the_examples_of_the_paper_lie_between_point_and_bound():
    path = Path(__file__).parents[3] / "examples" / "paper_example_2.yaml"
    plant = build_plant(load_spec(path))
    signals = bound_signals(plant)
    finder = tight_search(plant, signals, performance_center(plant, signals), None)
    first = finder.load(0, (TANH, TANH), (0.05, 1.3), EFFORT)
    # Termwise bounds have 4.95 there.
    assert 4.0403 <= first.upper <= 4.0403 * 1.001
