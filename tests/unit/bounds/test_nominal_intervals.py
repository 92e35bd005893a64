"""Interval arrays and their partial derivatives contain what they must."""

import math

import numpy as np
import pytest
import sympy as sp

from bfppc_synth.bounds.dual_arrays import DualFunctions, constant, coordinate, mean_value
from bfppc_synth.bounds.interval_arrays import Interval, IntervalFunctions, interval
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate

X = sp.Symbol("x", real=True)
Y = sp.Symbol("y", real=True)
EXPRESSIONS = [
    X + Y,
    X - 3 * Y,
    X * Y,
    X / (2 + Y**2),
    X**2,
    X**3 * Y,
    (X * Y) ** 4,
    sp.sqrt(3 + X),
    (3 + X) ** sp.Rational(3, 4),
    sp.exp(X * Y),
    sp.log(3 + Y),
    sp.sin(3 * X),
    sp.cos(X - 4 * Y),
    sp.tan(X / 2),
    sp.sinh(X),
    sp.cosh(X * Y),
    sp.tanh(2 * X),
    sp.atan(Y * 3),
    sp.asinh(X),
    sp.Abs(X) * Y,
    sp.sin(X) * sp.exp(-Y) - X * Y**2,
]


def boxes(count: int = 60) -> tuple[Interval, Interval]:
    generator = np.random.default_rng(7)
    lower = generator.uniform(-1.5, 1.0, (2, count))
    upper = lower + generator.uniform(0.0, 0.5, (2, count))
    return interval(lower[0], upper[0]), interval(lower[1], upper[1])


def samples(box: Interval, count: int = 7):
    return [box.lower + share * (box.upper - box.lower) for share in np.linspace(0.0, 1.0, count)]


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_a_range_contains_every_sample(expression):
    x, y = boxes()
    found = evaluate(expression, {X: x, Y: y}, IntervalFunctions())
    lower, upper = np.broadcast_arrays(found.lower, found.upper)
    for first in samples(x):
        for second in samples(y):
            for k, (a, b) in enumerate(zip(first, second, strict=True)):
                value = evaluate(expression, {X: float(a), Y: float(b)}, FLOAT_FUNCTIONS)
                assert lower[k] <= value <= upper[k]


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_the_mean_value_form_contains_every_sample(expression):
    box = boxes(30)
    middle = [interval((b.lower + b.upper) / 2, (b.lower + b.upper) / 2) for b in box]
    base = IntervalFunctions()
    reach = tuple(base.sub(b, at) for b, at in zip(box, middle, strict=True))
    wide = {s: coordinate(b, 2, j) for j, (s, b) in enumerate(zip((X, Y), box, strict=True))}
    thin = {s: constant(b, 0) for s, b in zip((X, Y), middle, strict=True)}
    found = mean_value(
        evaluate(expression, wide, DualFunctions(2)),
        evaluate(expression, thin, DualFunctions(0)),
        reach,
    )
    natural = evaluate(expression, {X: box[0], Y: box[1]}, base)
    assert np.all(found.lower >= natural.lower)
    assert np.all(found.upper <= natural.upper)
    for first in samples(box[0], 5):
        for second in samples(box[1], 5):
            for k, (a, b) in enumerate(zip(first, second, strict=True)):
                value = evaluate(expression, {X: float(a), Y: float(b)}, FLOAT_FUNCTIONS)
                assert found.lower[k] <= value <= found.upper[k]


@pytest.mark.parametrize("expression", EXPRESSIONS[:-3], ids=str)
def test_partials_contain_the_slope(expression):
    x, y = boxes(30)
    found = evaluate(expression, {X: coordinate(x, 2, 0), Y: coordinate(y, 2, 1)}, DualFunctions(2))
    for partial, symbol in zip(found.partials, (X, Y), strict=True):
        slope = sp.diff(expression, symbol)
        if partial is None:
            assert slope == 0
            continue
        at = {X: x.lower, Y: y.upper}
        values = sp.lambdify((X, Y), slope, "numpy")(at[X], at[Y])
        slack = 1e-12 * (1.0 + np.abs(values))
        assert np.all(partial.lower <= values + slack)
        assert np.all(values <= partial.upper + slack)


def test_the_excess_of_the_mean_value_form_shrinks_with_the_square_of_the_width():
    excess = []
    base = IntervalFunctions()
    for width in (0.1, 0.01):
        box = interval(0.5, 0.5 + width)
        at = interval(0.5 + width / 2, 0.5 + width / 2)
        expression = X * (1 - X)
        found = mean_value(
            evaluate(expression, {X: coordinate(box, 1, 0)}, DualFunctions(1)),
            evaluate(expression, {X: constant(at, 0)}, DualFunctions(0)),
            (base.sub(box, at),),
        )
        excess.append(float(found.upper) - 0.25)
    assert 0.0 <= excess[1] < excess[0] / 50


@pytest.mark.parametrize(
    ("lower", "upper", "expected"),
    [
        (0.0, 1.0, (0.0, math.sin(1.0))),
        (1.0, 2.0, (math.sin(1.0), 1.0)),
        (4.0, 5.0, (-1.0, math.sin(4.0))),
        (-8.0, 8.0, (-1.0, 1.0)),
        (1e9, 1e9, (-1.0, 1.0)),
    ],
)
def test_a_sine_has_its_exact_range(lower, upper, expected):
    found = IntervalFunctions().sin(interval(lower, upper))
    assert (float(found.lower), float(found.upper)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("value", [sp.Rational(1, 2), sp.Rational(1, 10), sp.pi, sp.E / 3])
def test_a_constant_is_enclosed(value):
    found = IntervalFunctions().number(value)
    exact = sp.Rational(0.5)
    if value == exact:
        assert float(found.lower) == float(found.upper) == 0.5
        return
    assert sp.Rational(float(found.lower)) < value < sp.Rational(float(found.upper))


@pytest.mark.parametrize("expression", [1 / X, sp.log(X), sp.sqrt(X), sp.tan(2 * X)], ids=str)
def test_a_pole_and_an_end_of_a_domain_are_refused(expression):
    with pytest.raises(EnvelopeError):
        evaluate(expression, {X: interval(-1.0, 1.0)}, IntervalFunctions())
