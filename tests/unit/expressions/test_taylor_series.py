"""Taylor arithmetic agrees with sympy's own series, and costs no more than it must."""

import math

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.expressions.taylor import TaylorFunctions

X = sp.Symbol("x", real=True)
Y = sp.Symbol("y", real=True)
H = sp.Symbol("h")
LENGTH = 5
ARGUMENT = (0.75, -0.25, 0.5, 0.125, -0.0625)
OTHER = (1.5, 0.5, -0.25)

SMOOTH = [
    sp.exp(X),
    sp.log(X),
    sp.sin(X),
    sp.cos(X),
    sp.tan(X),
    sp.sinh(X),
    sp.cosh(X),
    sp.tanh(X),
    sp.atan(X),
    sp.asinh(X),
    sp.sqrt(X),
    X ** sp.Rational(3, 4),
    X ** sp.Rational(-5, 2),
    X**2,
    X**7,
    X**-3,
    X / Y,
    (X**2 + sp.sin(Y)) / (1 + X * Y),
    2 - X * Y + sp.Rational(1, 3) * Y**2,
]


def polynomial(series: tuple[float, ...]) -> sp.Expr:
    return sum(sp.Rational(value) * H**k for k, value in enumerate(series))


def expected(expression: sp.Expr, series: dict[sp.Symbol, tuple[float, ...]]) -> list[float]:
    along = expression.subs({symbol: polynomial(value) for symbol, value in series.items()})
    found = []
    for order in range(LENGTH):
        found.append(float(along.subs(H, 0)) / math.factorial(order))
        along = sp.diff(along, H)
    return found


@pytest.mark.parametrize("expression", SMOOTH, ids=str)
def test_every_coefficient_is_sympys(expression):
    series = {X: ARGUMENT, Y: OTHER}
    found = evaluate(expression, series, TaylorFunctions(FLOAT_FUNCTIONS, LENGTH))
    assert found == pytest.approx(expected(expression, series), rel=1e-12, abs=1e-12)


@st.composite
def expressions(draw, depth=3):
    if depth == 0:
        return draw(st.sampled_from([X, Y, sp.Rational(1, 2), sp.Integer(3)]))
    left, right = draw(expressions(depth=depth - 1)), draw(expressions(depth=depth - 1))
    return draw(
        st.sampled_from(
            [
                left + right,
                left - right,
                left * right,
                left / (2 + right**2),
                sp.sin(left),
                sp.cos(left),
                sp.tanh(left),
                sp.atan(left),
                sp.exp(-(left**2)),
                sp.sqrt(1 + left**2),
            ]
        )
    )


@given(expression=expressions())
def test_random_expressions_have_sympys_coefficients(expression):
    series = {X: ARGUMENT, Y: OTHER}
    found = evaluate(expression, series, TaylorFunctions(FLOAT_FUNCTIONS, 4))
    full = [*found, *[0.0] * 4][:4]
    # Compared by a central difference of the truth: sympy's fourth derivative takes seconds.
    exact = sp.lambdify(H, expression.subs({s: polynomial(v) for s, v in series.items()}), "math")
    step = 1e-3
    values = [exact(k * step) for k in range(-2, 3)]
    slope = (values[0] - 8 * values[1] + 8 * values[3] - values[4]) / (12 * step)
    bend = (-values[0] + 16 * values[1] - 30 * values[2] + 16 * values[3] - values[4]) / (
        24 * step**2
    )
    scale = 1.0 + max(map(abs, full))
    assert full[0] == pytest.approx(values[2], rel=1e-12, abs=1e-12)
    assert full[1] == pytest.approx(slope, abs=1e-6 * scale)
    assert full[2] == pytest.approx(bend, abs=1e-5 * scale)


@pytest.mark.parametrize("length", [1, 2, 3, 4])
def test_a_shorter_series_is_the_beginning_of_a_longer_one(length):
    series = {X: ARGUMENT, Y: OTHER}
    for expression in SMOOTH:
        long = evaluate(expression, series, TaylorFunctions(FLOAT_FUNCTIONS, LENGTH))
        short = evaluate(expression, series, TaylorFunctions(FLOAT_FUNCTIONS, length))
        assert short == long[:length]


def test_a_constant_stays_one_number():
    functions = TaylorFunctions(FLOAT_FUNCTIONS, LENGTH)
    assert evaluate(sp.sin(X) * sp.exp(X) + X**3, {X: (0.5,)}, functions) == pytest.approx(
        (math.sin(0.5) * math.exp(0.5) + 0.125,)
    )


@pytest.mark.parametrize(
    "expression",
    [
        sp.Abs(X),
        sp.sign(X),
        sp.Min(X, 1),
        sp.Max(X, Y),
        sp.Piecewise((X, X < 1), (Y, True)),
        X ** sp.Rational(1, 3),
    ],
    ids=str,
)
def test_what_has_no_series_is_refused(expression):
    functions = TaylorFunctions(FLOAT_FUNCTIONS, 2)
    with pytest.raises(EnvelopeError, match="has no Taylor series"):
        evaluate(expression, {X: ARGUMENT, Y: OTHER}, functions)


def test_the_derivative_of_a_series_is_that_of_its_polynomial():
    functions = TaylorFunctions(FLOAT_FUNCTIONS, LENGTH)
    assert functions.derivative(ARGUMENT) == (-0.25, 1.0, 0.375, -0.25)
    assert functions.derivative((3.0,)) == (0.0,)
