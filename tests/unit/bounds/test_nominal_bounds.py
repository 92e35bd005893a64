"""The bounds of the nominal center and its residual hold for every start, time and parameter."""

import random
from pathlib import Path

import pytest
import sympy as sp

from bfppc_synth.bounds.latch import starts
from bfppc_synth.bounds.nominal.model import nominal_model
from bfppc_synth.bounds.nominal.residual import (
    DISTURBANCE,
    LEFT_OUT,
    MODEL_ERROR,
    NominalResidual,
)
from bfppc_synth.bounds.nominal.signals import nominal_center
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.expressions.nominal import center_series, start_series, transition_series
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.majorants.targets import FloatArithmetic
from bfppc_synth.spec import availability
from bfppc_synth.spec.load import load_spec

PLANTS = Path(__file__).parents[2] / "plants"
TEMPLATE = """name: plant
parameters: {{a: [0.8, 1.2], b: {b}}}
states: [x1, x2]
dynamics:
  x1: {{f: {f1}, g: {g1}}}
  x2: {{f: {f2}, g: 2 + sin(x1)*b, disturbance: {d}}}
reference: {reference}
initial: {initial}
performance: {{accuracy: 0.1, transition: 1.5}}
{more}
synthesis: {{center: nominal}}
"""


@pytest.fixture(scope="module", autouse=True)
def center_to_come():
    """Open center nominal, which the plant file refuses until the checker proves it."""
    rows = tuple(row for row in availability.UNAVAILABLE if row.key != "center")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(availability, "UNAVAILABLE", rows)
        yield


@pytest.fixture
def plant_of(tmp_path):
    def make(**changes):
        given = {
            "b": "[0.4, 0.6]",
            "f1": "-a*x1**3",
            "g1": "1",
            "f2": "a*x1*x2 + b",
            "d": "0",
            "reference": "sin(t)",
            "initial": "{x1: [0.1, 0.3], x2: [-0.2, 0.1]}",
            "more": "",
        }
        path = tmp_path / "plant.yaml"
        path.write_text(TEMPLATE.format(**(given | changes)))
        return build_plant(load_spec(path))

    return make


def center_of(plant, model, start, t):
    """r_1..r_n, v and their rates at one time from one start."""
    order, functions = plant.order, FLOAT_FUNCTIONS
    y_d = evaluate(plant.reference, {plant.time: (t, 1.0)}, TaylorFunctions(functions, order + 2))
    b = ()
    if t < model.transition:
        short = TaylorFunctions(functions, order)
        begun = evaluate(plant.reference, {plant.time: (0.0, 1.0)}, short)
        beta = short.sub(start_series(model, functions, start), begun)
        beta = (*beta, *[0.0] * (order - len(beta)))
        share = t / model.transition
        b = transition_series(functions, beta, share, model.transition, length=order + 2)
    r, v = center_series(model, functions, y_d, b, length=order + 2)
    return [(series[0], series[1] if len(series) > 1 else 0.0) for series in (*r, v)]


def draws(plant, model, count=1500, end=14.0):
    generator = random.Random(3)  # noqa: S311 -- reproducible, no secret
    for _ in range(count):
        begin = [
            generator.choice(
                [float(s.lower), float(s.upper), generator.uniform(float(s.lower), float(s.upper))]
            )
            for s in starts(plant.spec)
        ]
        early = generator.random() < 0.6
        t = generator.uniform(0.0, model.transition if early else end)
        values = {
            p: generator.choice([float(low), float(high)])
            for p, (low, high) in zip(plant.parameters, plant.ranges, strict=True)
        }
        yield tuple(begin), t, values


CASES = {
    "periodic": {},
    "two frequencies": {"reference": "0.3*sin(t) + 0.2*cos(sqrt(2)*t)"},
    "decaying": {"reference": "sin(2*t)*(1 - exp(-t))"},
    "rational": {"reference": "1/(1 + t)"},
    "constant": {"reference": "0.25"},
    "uncertain gain": {"g1": "1 + a*x1**2"},
    "latched by a quantizer": {"more": "measurement: {noise: {x1: 0.02, x2: 0.01}}"},
}


@pytest.mark.parametrize("case", CASES)
def test_no_sample_leaves_the_bounds_of_the_center(plant_of, case):
    plant = plant_of(**CASES[case])
    found = nominal_center(plant, 1.5)
    center, slack = found.center, 1e-12
    largest_error = 0.0
    for begin, t, values in draws(plant, found.model):
        along = center_of(plant, found.model, begin, t)
        for i, (value, rate) in enumerate(along[:-1]):
            assert center.r_lower[i] - slack <= value <= center.r_upper[i] + slack
            assert abs(rate) <= center.rate[i] + slack
        assert abs(along[-1][0]) <= center.v + slack
        assert abs(along[-1][1]) <= center.v_rate + slack
        at = dict(zip(plant.states, (value for value, _ in along), strict=False))
        for i, channel in enumerate(plant.channels):
            true = evaluate(channel.f, {**at, **values}, FLOAT_FUNCTIONS)
            true += evaluate(channel.g, {**at, **values}, FLOAT_FUNCTIONS) * along[i + 1][0]
            model = evaluate(found.model.f[i], at, FLOAT_FUNCTIONS)
            model += evaluate(found.model.g[i], at, FLOAT_FUNCTIONS) * along[i + 1][0]
            assert abs(true - model) <= found.model_error[i] + slack
            largest_error = max(largest_error, abs(true - model))
    assert largest_error > 0.0


@pytest.mark.parametrize("transition", [0.5, 2.0, 5.0])
def test_the_bounds_are_tight_for_one_start(transition):
    plant = build_plant(load_spec(PLANTS / "nominal_motor_arm.yaml"))
    found = nominal_center(plant, transition)
    begin = tuple(float(s.lower) for s in starts(plant.spec))
    times = [transition * k / 2000 for k in range(2001)]
    times += [transition + 6.3 * k / 2000 for k in range(2001)]
    along = [center_of(plant, found.model, begin, t) for t in times]
    assert found.center.v <= 1.003 * max(abs(row[-1][0]) for row in along)
    assert found.center.v_rate <= 1.003 * max(abs(row[-1][1]) for row in along)
    for i in range(3):
        size = max(-found.center.r_lower[i], found.center.r_upper[i])
        assert size <= 1.003 * max(abs(row[i][0]) for row in along)


def test_the_residual_bounds_every_sample_of_d_i(plant_of):
    plant = plant_of(g1="1 + a*x1**2", d="0.05 + 0.1*x2**2", f2="a*x1*x2 + b + 0.1*Abs(x2)")
    found = nominal_center(plant, 1.5)
    residual = NominalResidual(
        plant,
        found,
        arithmetic=FloatArithmetic(),
        place=lambda _j, lower, upper, xi: (lower - xi, upper + xi),
        constant=float,
    )
    xi = (0.1, 0.3)
    bounds = [residual.disturbance(i, xi[: i + 1]) for i in range(2)]
    generator = random.Random(5)  # noqa: S311 -- reproducible, no secret
    reached = [0.0, 0.0]
    for begin, t, values in draws(plant, found.model):
        along = center_of(plant, found.model, begin, t)
        r = dict(zip(plant.states, (value for value, _ in along), strict=False))
        x = {s: v + generator.choice([-1, 1]) * w for (s, v), w in zip(r.items(), xi, strict=True)}
        for i, channel in enumerate(plant.channels):
            bound = evaluate(channel.disturbance, x, FLOAT_FUNCTIONS)
            true = evaluate(channel.f, {**x, **values}, FLOAT_FUNCTIONS)
            true += evaluate(channel.g, {**x, **values}, FLOAT_FUNCTIONS) * along[i + 1][0]
            residue = abs(true - along[i][1]) + bound
            assert residue <= bounds[i]
            reached[i] = max(reached[i], residue)
            assert residual.gain_lower(i, xi[: i + 1]) <= evaluate(
                channel.g, {**x, **values}, FLOAT_FUNCTIONS
            )
            assert residual.gain_upper(i, xi[: i + 1]) >= evaluate(
                channel.g, {**x, **values}, FLOAT_FUNCTIONS
            )
    assert all(bound < 2.5 * value for bound, value in zip(bounds, reached, strict=True))


def test_signs_may_cancel_between_f_and_g(plant_of):
    apart = plant_of(b="0.5", f1="-x1**2", g1="2 + x1")
    found = nominal_center(apart, 1.5)
    residual = NominalResidual(
        apart,
        found,
        arithmetic=FloatArithmetic(),
        place=lambda _j, lower, upper, xi: (lower - xi, upper + xi),
        constant=float,
    )
    terms = dict(residual.terms(0, (0.01,)))
    largest = max(-found.center.r_lower[0], found.center.r_upper[0]) + 0.01
    ahead = max(map(abs, found.ahead[0]))
    assert terms["deviation of x1"] <= (2 * largest + ahead) * 0.01
    assert MODEL_ERROR not in terms


@pytest.mark.parametrize(
    ("f", "left_out"),
    [
        ("a*x1*x2 + Abs(x1)*x2", ["x2*Abs(x1)"]),
        ("a*(x2 + Abs(x2))", ["a*Abs(x2)"]),
        ("x1 + Min(x1, x2)", ["Min(x1, x2)"]),
        ("x1 + x2**(1/3)", ["x2**(1/3)"]),
        ("a*x1", []),
    ],
)
def test_terms_without_the_regularity_are_left_out_and_counted_in_full(plant_of, f, left_out):
    plant = plant_of(f2=f'"{f}"')
    model = nominal_model(plant, 1.5)
    assert [str(term) for term in model.left_out[1]] == left_out
    assert not model.f[1].atoms(sp.Abs, sp.Min)
    found = nominal_center(plant, 1.5)
    residual = NominalResidual(
        plant,
        found,
        arithmetic=FloatArithmetic(),
        place=lambda _j, lower, upper, xi: (lower - xi, upper + xi),
        constant=float,
    )
    names = [name for name, _ in residual.terms(1, (0.1, 0.1))]
    assert (LEFT_OUT in names) == bool(left_out)
    assert DISTURBANCE not in names


def test_an_f_known_only_by_a_bound_stays_in_the_residual(tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(
        "name: plant\nstates: [x1]\ndynamics: {x1: {f_bound: 0.3 + x1**2, g_min: 1, g_bound: 3}}\n"
        "reference: sin(t)\ninitial: {x1: 0}\nperformance: {accuracy: 0.1, transition: 1}\n"
        "synthesis: {center: nominal}\n"
    )
    plant = build_plant(load_spec(path))
    found = nominal_center(plant, 1.0)
    assert found.model.f == (0,)
    assert found.model.g == (2,)
    residual = NominalResidual(
        plant,
        found,
        arithmetic=FloatArithmetic(),
        place=lambda _j, lower, upper, xi: (lower - xi, upper + xi),
        constant=float,
    )
    # |y_d'| = 1 is |2 v|, so g - 2 adds at most 1/2; the bound of f is taken at |x| <= 1.1.
    size = max(-found.center.r_lower[0], found.center.r_upper[0])
    expected = 0.3 + (size + 0.1) ** 2 + max(map(abs, found.ahead[0]))
    assert residual.disturbance(0, (0.1,)) == pytest.approx(expected, rel=1e-6)
    assert residual.gain_lower(0, (0.1,)) == 1.0
    assert residual.gain_upper(0, (0.1,)) == 3.0


def test_an_abs_in_g_is_followed_while_its_argument_keeps_its_sign():
    plant = build_plant(load_spec(PLANTS / "nominal_levitation.yaml"))
    found = nominal_center(plant, 0.25)
    assert found.model.g[2] == 20 * sp.sqrt(plant.states[2])
    assert found.authority[2][0] > 0.0


def test_an_abs_in_g_whose_argument_changes_sign_is_refused(plant_of):
    plant = plant_of(g1="2 + Abs(x1)")
    with pytest.raises(EnvelopeError, match=r"dynamics\.x1\.g has a kink where x1 is 0"):
        nominal_center(plant, 1.5)


def test_a_g_with_a_jump_is_refused(plant_of):
    with pytest.raises(EnvelopeError, match=r"Min\(1, x1\) \+ 2 has a kink, a jump"):
        nominal_model(plant_of(g1='"2 + Min(x1, 1)"'), 1.0)


def test_a_wider_start_has_wider_bounds_and_a_delay_an_early_feedforward(plant_of):
    narrow = nominal_center(plant_of(initial="{x1: 0.2, x2: 0}"), 1.5)
    wide = nominal_center(plant_of(more="sampling: {delay: 0.001}"), 1.5)
    assert narrow.center.v_start == 0.0
    assert 0.0 < wide.center.v_start <= wide.center.v
    assert wide.center.v >= narrow.center.v
    assert wide.center.r_upper[1] >= narrow.center.r_upper[1]


def test_a_reference_given_at_run_time_is_bounded_by_its_declared_derivatives(plant_of):
    known = nominal_center(plant_of(initial="{x1: 0, x2: 1}"), 1.5)
    runtime = plant_of(reference="{bounds: [1, 1, 1, 1]}", initial="{x1: 0, x2: 1, offset: 0.1}")
    supplied = nominal_center(runtime, 1.5)
    assert supplied.center.v >= known.center.v
    assert supplied.center.r_upper[0] >= 1.1
    unbounded = nominal_center(
        plant_of(reference="{bounds: [1, 1, 1, 1]}", initial="{x1: 0, x2: 1}"), 1.5
    )
    assert unbounded.center.r_upper[0] > supplied.center.r_upper[0]
