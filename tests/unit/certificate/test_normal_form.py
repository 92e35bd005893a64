"""The checker's own expressions: parser, normal form, derivative."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from bfppc_synth.certificate import checker

NAMES = {name: checker.sym(name) for name in ("x", "y", "t")}


def parse(text: str) -> checker.Node:
    return checker.parse(text, NAMES)


def at(node: checker.Node, **values: float) -> float:
    names = sorted(values)
    box = tuple(checker.from_fraction(Fraction(values[name])) for name in names)
    lower, upper = checker.to_doubles(checker.Tape(node, names).value(box))
    assert upper - lower <= 1e-12 * max(1.0, abs(upper))
    return (lower + upper) / 2


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("x*x", "x**2"),
        ("x^2", "x**2"),
        ("x + x", "2*x"),
        ("2*(x + y)", "2*x + 2*y"),
        ("x - x", "0"),
        ("-x**2", "0 - x*x"),
        ("2**-1", "0.5"),
        ("2**3**2", "512"),
        ("sqrt(4)", "2"),
        ("exp(x)*exp(y)", "exp(x + y)"),
        ("exp(x)**2", "exp(2*x)"),
        ("E**x", "exp(x)"),
        ("sin(-x)", "-sin(x)"),
        ("cos(-x)", "cos(x)"),
        ("cos(y - x)", "cos(x - y)"),
        ("abs(-3*x)", "3*Abs(x)"),
        ("abs(x)**2", "x**2"),
        ("abs(x*y)", "abs(x)*abs(y)"),
        ("abs(x)*x**2", "abs(x)**3"),
        ("sign(x)*x", "abs(x)"),
        ("sign(x)*abs(x)", "x"),
        ("x**(1/3)*x**(2/3)", "x"),
        ("x*x**(1/3)", "x**(4/3)"),
        ("sqrt(x)**4", "x**2"),
        ("(x*y)**2", "x**2*y**2"),
        ("ln(x)", "log(x)"),
        ("min(x, y, x)", "Min(y, x)"),
        ("Max(1, 2, x)", "max(x, 2)"),
        ("1e3", "1000"),
        (".5e1", "5."),
    ],
)
def test_equal_expressions_have_equal_texts(text: str, same: str) -> None:
    assert parse(text).text == parse(same).text


@pytest.mark.parametrize(
    ("text", "other"),
    [
        # Two of these once had the same text, and their difference would have been 0.
        ("(x*y)**(1/3)", "x*y**(1/3)"),
        ("(2*x)**(1/3)", "2*x**(1/3)"),
        ("(2/3)**(1/3)", "2/3**(1/3)"),
        ("(x**2)**(1/3)", "x**(1/3)"),
        ("x*abs(x)", "x**2"),
        ("sqrt(x**2)", "x"),
        ("(-8)**(1/3)", "8**(1/3)"),
        ("sin(x)*y", "sin(x*y)"),
        ("Piecewise((x, x < y), (y, True))", "Piecewise((x, x <= y), (y, True))"),
        ("min(x, y)", "max(x, y)"),
    ],
)
def test_different_expressions_have_different_texts(text: str, other: str) -> None:
    assert parse(text).text != parse(other).text
    assert checker.minus(parse(text), parse(other)).text != "0"


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("x**(1/3)", -2.0),
        ("x**(2/3)", 4.0),
        ("x**(-1/3)", -0.5),
        ("x*abs(x)", -64.0),
        ("sign(x)*abs(x)**(4/3)", -16.0),
        ("Piecewise((1, x < -8), (2, x <= -8), (3, True))", 2.0),
        ("Max(x, 2) + Min(x, 2)", -6.0),
        ("atan(x) + asinh(x)", math.atan(-8) + math.asinh(-8)),
        ("cosh(x/4) + sinh(x/4)", math.exp(-2)),
        ("pi*E", math.pi * math.e),
        ("log(-x)/log(2)", 3.0),
    ],
)
def test_values_at_a_point(text: str, value: float) -> None:
    assert at(parse(text), x=-8.0) == pytest.approx(value, rel=1e-12)


def test_x_abs_x_has_the_range_of_one_increasing_power() -> None:
    tape = checker.Tape(parse("x*abs(x)"), ("x",))
    one = checker.ONE
    assert tape.value(((-one, 2 * one),)) == (-one, 4 * one)


@pytest.mark.parametrize(
    "text",
    [
        "sin(2*t + 1)*exp(-t/3)",
        "tanh(t)**3/(1 + t**2)",
        "sqrt(1 + t)*log(2 + t)",
        "atan(t) + asinh(t) + cosh(t) + sinh(t)",
        "tan(t/4)",
        "(1 + t)**(2/3)",
        "t*abs(t)",
    ],
)
def test_derivatives_agree_with_differences(text: str) -> None:
    node = parse(text)
    slope = checker.derivative(node, "t")
    for t in (0.25, 0.8, 1.7):
        h = 1e-5
        estimate = (at(node, t=t + h) - at(node, t=t - h)) / (2 * h)
        assert at(slope, t=t) == pytest.approx(estimate, rel=1e-6)


def test_the_slopes_of_a_kink_are_all_between_the_two_sides() -> None:
    slope = checker.derivative(parse("abs(t - 1)"), "t")
    tape = checker.Tape(slope, ("t",))
    one = checker.ONE
    assert tape.value(((0, 2 * one),)) == (-one, one)
    lower = checker.derivative(parse("min(2*t, t + 1)"), "t")
    assert checker.Tape(lower, ("t",)).value(((0, 2 * one),)) == (one, 2 * one)


@pytest.mark.parametrize("text", ["sign(t)", "Piecewise((0, t < 1), (1, True))"])
def test_what_may_jump_has_no_derivative(text: str) -> None:
    with pytest.raises(checker.UndecidedError):
        checker.derivative(parse(text), "t")


def test_a_common_power_of_what_is_nonnegative_is_divided_out() -> None:
    y = checker.sym("+y")
    node = checker.parse("y**2*exp(y) - y**3", {"y": y})
    assert checker.without_common_power(node).text == checker.parse("exp(y) - y", {"y": y}).text
    free = checker.parse("x**2*exp(x) - x**3", NAMES)
    assert checker.without_common_power(free).text == free.text
