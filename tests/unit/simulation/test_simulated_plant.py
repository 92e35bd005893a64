"""The plant's right-hand sides as Python text."""

from __future__ import annotations

import math
import random

import pytest
import sympy as sp

from bfppc_synth.model.plant import Channel, Plant
from bfppc_synth.simulation.plant import compile_plant

X1, X2, T, A = sp.symbols("x1 x2 t a", real=True)
S = sp.Symbol("s", real=True)


def channel(state, **entries):
    bounds = ("f", "g", "f_bound", "g_bound", "g_min")
    return Channel(
        state=state,
        disturbance=sp.sympify(entries.pop("disturbance", 0)),
        **{name: entries.get(name) for name in bounds},
    )


def plant(*channels, ranges=(), reference=None):
    return Plant(
        spec=None,
        time=T,
        states=tuple(item.state for item in channels),
        parameters=(A,) if ranges else (),
        ranges=ranges,
        channels=channels,
        reference=reference,
        funnel=None,
    )


def force(expression, x):
    """Value of f(x1) as the simulation has it."""
    one = compile_plant(plant(channel(X1, f=expression, g=sp.Integer(1))))
    return one.model.coefficients(0.0, x, *one.nominal)[0]


SMOOTH = (
    X1 + X1 * sp.exp(-X1 / 2),
    X1**2 - sp.sin(X1) + 3,
    -X1 / (1 + X1**2) ** 2,
    X1**7 - sp.Rational(1, 3) * X1**4,
    sp.tanh(X1) + sp.atan(2 * X1) * sp.asinh(X1),
    sp.cosh(X1) - sp.sinh(2 * X1) * sp.tan(X1 / 10),
    sp.log(1 + X1**2) * sp.sqrt(2 + X1),
    sp.Abs(X1) * X1 + sp.sign(X1),
    sp.Min(X1, 1) + sp.Max(X1**2, X1),
    sp.Piecewise((X1**2, X1 < 0), (sp.sin(X1), X1 <= 1), (2 * X1, True)),
    sp.pi * X1 + sp.E,
)


@pytest.mark.parametrize("expression", SMOOTH, ids=str)
def test_the_text_computes_what_sympy_means(expression):
    for x in (-1.7, -0.3, 0.0, 0.6, 1.0, 1.9):
        expected = float(expression.subs(X1, sp.Rational(str(x))).evalf(30))
        assert force(expression, x) == pytest.approx(expected, rel=1e-13, abs=1e-14)


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        (X1 ** sp.Rational(1, 3), -2.0),
        (X1 ** sp.Rational(5, 3), -32.0),
        (sp.Abs(X1) ** sp.Rational(2, 3), 4.0),
        (1 / X1 ** sp.Rational(1, 3), -0.5),
    ],
)
def test_odd_roots_of_negative_numbers_keep_the_sign(expression, value):
    assert force(expression, -8.0) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("expression", [sp.sqrt(X1), sp.log(X1), X1 ** sp.Rational(3, 4), 1 / X1])
def test_a_branch_that_is_not_taken_needs_no_value(expression):
    guarded = sp.Piecewise((expression, X1 > 0), (X1, True))
    assert force(guarded, 4.0) == pytest.approx(float(expression.subs(X1, 4)))
    assert force(guarded, -4.0) == -4.0
    assert force(guarded, 0.0) == 0.0


def test_outside_a_domain_the_value_is_nan_and_never_complex():
    assert math.isnan(force(sp.sqrt(X1), -1.0))
    assert math.isnan(force(1 / X1, 0.0))


UNCERTAIN = plant(
    channel(X1, f=A * X1, f_bound=2 + X1**2, g=1 + X1**2, g_min=sp.Integer(1), disturbance=3),
    channel(X2, f_bound=sp.Abs(X1) + 1, g_min=sp.Integer(2), g_bound=4 + X2**2),
    ranges=((sp.Rational(1, 2), sp.Rational(3, 2)),),
    reference=sp.sin(2 * T),
)


def test_nominal_is_midpoints_no_disturbance_and_middle_gain():
    dynamics = compile_plant(UNCERTAIN)
    values = dynamics.model.coefficients(0.5, 2.0, 3.0, *dynamics.nominal)
    # f known only by its bound is f_bound sin(t + i), g between its bounds in the middle.
    assert values == pytest.approx((2.0, 5.0, 3.0 * math.sin(2.5), 7.5), rel=1e-15)
    assert dynamics.reference(0.25) == math.sin(0.5)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        # a; shares of the disturbance; of f_bound; places of g
        ((0.5, 1, 0, 1, -1, 0, 0), (6 + 3, 1.0, -3.0, 2.0)),
        ((0.5, -1, 0, -1, 1, 1, 1), (-6 - 3, 5.0, 3.0, 13.0)),
        ((0.5, 0, 0, 0, 0, 0.5, 0.5), (0.0, 3.0, 0.0, 7.5)),
    ],
)
def test_within_the_declared_bounds_anything_can_be_chosen(arguments, expected):
    dynamics = compile_plant(UNCERTAIN)
    assert dynamics.bounds.coefficients(0.5, 2.0, 3.0, *arguments) == pytest.approx(expected)


def test_the_model_follows_f_and_g_where_the_file_gives_them():
    dynamics = compile_plant(UNCERTAIN)
    values = dynamics.model.coefficients(0.0, 2.0, 3.0, 1.5, -1, 0, 1, 1, 0, 1)
    assert values[:2] == pytest.approx((1.5 * 2 - 3, 5.0))


def test_a_plant_without_declared_bounds_has_no_second_truth():
    exact = plant(channel(X1, f=X1, g=sp.Integer(1)))
    assert compile_plant(exact).bounds is None
    assert compile_plant(exact).reference is None
    assert compile_plant(UNCERTAIN).bounds is not None


def test_the_steps_are_of_fourth_order():
    oscillator = compile_plant(
        plant(channel(X1, f=sp.Integer(0), g=sp.Integer(1)), channel(X2, f=-X1, g=sp.Integer(1)))
    )

    def error(steps):
        x = (1.0, 0.0)
        for k in range(steps):
            x = oscillator.model.advance(k / steps, 1.0 / steps, *x, 0.0, *oscillator.nominal)
        return math.hypot(x[0] - math.cos(1.0), x[1] + math.sin(1.0))

    assert 14.0 < error(10) / error(20) < 18.0
    assert error(20) < 1e-7


def test_the_steps_know_the_time_of_their_stages():
    driven = compile_plant(plant(channel(X1, f_bound=sp.Integer(1), g=sp.Integer(1))))
    (x,) = driven.model.advance(0.3, 0.1, 0.0, 0.0, *driven.nominal)
    assert x == pytest.approx(math.cos(1.3) - math.cos(1.4), abs=1e-8)


def test_random_points_of_the_papers_second_plant():
    generator = random.Random(1)  # noqa: S311 -- reproducible, no secret
    first, second = X1 + X1 * sp.exp(-A * X1), X1 * sp.sin(X2) + X1 * X2**2
    dynamics = compile_plant(
        plant(
            channel(X1, f=first, g=1 + sp.sin(X1**2)),
            channel(X2, f=second, g=3 + sp.cos(X1)),
            ranges=((sp.Rational(2, 5), sp.Rational(3, 5)),),
        )
    )
    for _ in range(200):
        x, y = generator.uniform(-3, 3), generator.uniform(-9, 9)
        values = dynamics.model.coefficients(0.0, x, y, *dynamics.nominal)
        expected = (
            x + x * math.exp(-0.5 * x),
            1 + math.sin(x * x),
            x * math.sin(y) + x * y * y,
            3 + math.cos(x),
        )
        assert values == pytest.approx(expected, rel=1e-14)
