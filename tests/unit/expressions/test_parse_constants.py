import math
from fractions import Fraction

import pytest

from bfppc_synth.expressions.parse import constant_value, parse_constant, parse_expression

MEANINGS = {
    "pi/60": math.pi / 60,
    "E": math.e,
    "E**2": math.exp(2),
    "sin(1)": math.sin(1),
    "sin(-7)": math.sin(-7),
    "sin(1e-200)": 1e-200,
    "cos(2)": math.cos(2),
    "cos(100)": math.cos(100),
    "tan(1)": math.tan(1),
    "atan(5)": math.atan(5),
    "atan(-0.003)": math.atan(-0.003),
    "exp(-3)": math.exp(-3),
    "log(7)": math.log(7),
    "sinh(1/3)": math.sinh(1 / 3),
    "sinh(1e-30)": 1e-30,
    "cosh(2)": math.cosh(2),
    "tanh(0.5)": math.tanh(0.5),
    "tanh(1e5)": 1.0,
    "tanh(-1e5)": -1.0,
    "asinh(-2)": math.asinh(-2),
    "asinh(1e-30)": 1e-30,
    "2**0.3": 2**0.3,
    "pi**2": math.pi**2,
    "pi**-1": 1 / math.pi,
    "2*pi - 1": 2 * math.pi - 1,
    "-pi": -math.pi,
    "abs(-pi)": math.pi,
    "max(pi, 3)": math.pi,
    "min(pi, 4, 5)": math.pi,
    "pi - 355/113": float(Fraction(-355, 113) + Fraction("3.141592653589793238462643383279503")),
}


@pytest.mark.parametrize(("text", "value"), MEANINGS.items())
def test_an_irrational_constant_is_known_to_the_last_places(text, value):
    constant = parse_constant(text)
    assert constant.approximate == pytest.approx(value, rel=4e-16, abs=0)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.1 + 0.2", Fraction(3, 10)),
        ("-1e-3", Fraction(-1, 1000)),
        ("4**0.5", Fraction(2)),
        ("sqrt(9/16)", Fraction(3, 4)),
        ("(-8)**(1/3)", Fraction(-2)),
        ("(-8)**(2/3)", Fraction(4)),
        ("(-8)**(-1/3)", Fraction(-1, 2)),
        ("27**(2/3)", Fraction(9)),
        ("0**(1/3)", Fraction(0)),
        ("exp(0)", Fraction(1)),
        ("sin(0) + cos(0)", Fraction(1)),
        ("log(1)", Fraction(0)),
        ("sign(-pi)", Fraction(-1)),
        ("0*pi", Fraction(0)),
        ("abs(-3)", Fraction(3)),
        ("min(2, 1/3)", Fraction(1, 3)),
    ],
)
def test_a_rational_constant_is_exact(text, value):
    assert parse_constant(text).exact == value


@pytest.mark.parametrize("text", ["pi/60", "sqrt(2)", "2**(1/3)", "exp(1)", "sin(1)"])
def test_an_irrational_constant_has_no_exact_value(text):
    assert parse_constant(text).exact is None


@pytest.mark.parametrize(
    "text", ["sin(pi)", "pi - pi", "4*atan(1) - pi", "cos(pi/2)", "sin(1)**2 + cos(1)**2 - 1"]
)
def test_what_cannot_be_told_from_zero_counts_as_zero(text):
    assert parse_constant(text).approximate == 0.0


def test_an_expression_is_a_constant_only_without_names():
    assert constant_value(parse_expression("pi*2", names=("x1",))) is not None
    assert constant_value(parse_expression("pi*x1", names=("x1",))) is None
