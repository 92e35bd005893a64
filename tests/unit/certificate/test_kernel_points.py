"""Exact special points, tight ranges and refused domains of the checker's arithmetic."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from bfppc_synth.certificate import checker

ONE = checker.ONE


def interval(lo: float | str, hi: float | str) -> checker.Interval:
    lower, upper = (checker.from_fraction(Fraction(end)) for end in (lo, hi))
    return lower[0], upper[1]


@pytest.mark.parametrize(
    ("name", "at", "value"),
    [
        ("sin", 0, 0),
        ("cos", 0, 1),
        ("tan", 0, 0),
        ("exp", 0, 1),
        ("log", 1, 0),
        ("sinh", 0, 0),
        ("cosh", 0, 1),
        ("tanh", 0, 0),
        ("atan", 0, 0),
        ("asinh", 0, 0),
        ("abs", -3, 3),
        ("sign", -3, -1),
        ("sign", 0, 0),
    ],
)
def test_special_points_are_exact(name: str, at: int, value: int) -> None:
    assert checker.FUNCTIONS[name]((at * ONE, at * ONE)) == (value * ONE, value * ONE)


def test_sine_up_to_a_half_turn_has_a_lower_end_of_exactly_zero() -> None:
    assert checker.sin(interval(0, "1.7")) == (0, ONE)
    assert checker.sin(interval(0, "3.14159"))[0] == 0
    assert checker.sin(interval(0, "3.1416"))[0] < 0


def test_sine_reaches_one_exactly_where_a_quarter_turn_is_inside() -> None:
    assert checker.sin(interval("1.5", "1.58"))[1] == ONE
    assert checker.sin(interval("1.5", "1.57"))[1] < ONE
    assert checker.sin(interval("-1.58", "-1.5"))[0] == -ONE
    assert checker.cos(interval("3", "3.2"))[0] == -ONE
    assert checker.cos(interval("6.2", "6.3"))[1] == ONE


@pytest.mark.parametrize("name", ["sin", "cos", "tanh"])
def test_bounded_functions_stay_within_one(name: str) -> None:
    for end in ("0.001", "1", "50", "1e13", "1e300"):
        lower, upper = checker.FUNCTIONS[name](interval(f"-{end}", end))
        assert -ONE <= lower <= upper <= ONE


def test_even_powers_are_not_negative_and_a_product_with_itself_is_one() -> None:
    x = checker.sym("x")
    square = checker.multiply([(x, 1), (x, 1)])
    assert square.text == checker.multiply([(x, 2)]).text
    assert checker.Tape(square, ("x",)).value((interval("-2", "1"),)) == (0, 4 * ONE)


@pytest.mark.parametrize("value", ["1e13", "1e-12", "123456.789e6", "-3e-10"])
def test_large_and_small_numbers_keep_their_digits(value: str) -> None:
    exact = Fraction(value)
    enclosure = checker.from_fraction(exact)
    assert enclosure[0] <= exact * ONE <= enclosure[1]
    root = checker.power(checker.absolute(enclosure), Fraction(1, 3))
    assert root[1] - root[0] <= max(root[1] >> 60, 2**60)


@pytest.mark.parametrize(
    ("name", "lo", "hi"),
    [
        ("log", 0, 1),
        ("log", -1, 1),
        ("tan", 1, 2),
        ("tan", -2, 5),
        ("root2", -1, 4),
        ("root4", "-1e-30", 1),
        ("exp", 3000, 3001),
    ],
)
def test_an_interval_outside_of_the_domain_is_refused(name: str, lo: str, hi: str) -> None:
    with pytest.raises(checker.UndecidedError):
        checker._call(name, (interval(lo, hi),))


@pytest.mark.parametrize(
    ("name", "lo", "hi"), [("log", "1e-30", 1), ("tan", -1, "1.57"), ("root2", 0, 4)]
)
def test_an_interval_up_to_the_edge_of_the_domain_is_not_refused(
    name: str, lo: str, hi: str
) -> None:
    assert checker._call(name, (interval(lo, hi),))


def test_division_by_an_interval_with_zero_is_refused() -> None:
    with pytest.raises(checker.UndecidedError):
        checker.div(checker.ONE_I, interval(-1, 1))
    with pytest.raises(checker.UndecidedError):
        checker.div(checker.ONE_I, interval(0, 1))
    assert checker.div(checker.ONE_I, interval(2, 4)) == (ONE // 4, ONE // 2)


def test_a_number_beyond_the_largest_is_refused() -> None:
    huge = (1 << 4200, 1 << 4200)
    with pytest.raises(checker.UndecidedError):
        checker.mul(huge, huge)


@pytest.mark.parametrize("value", ["0.1", "-0.1", "1e300", "123456789.123", "0", "1"])
def test_doubles_enclose_outward_and_as_narrowly_as_possible(value: str) -> None:
    exact = Fraction(value)
    enclosure = checker.from_fraction(exact)
    lower, upper = checker.to_doubles(enclosure)
    assert Fraction(lower) * ONE <= enclosure[0]
    assert Fraction(upper) * ONE >= enclosure[1]
    assert upper <= math.nextafter(math.nextafter(lower, math.inf), math.inf)


def test_what_no_double_holds_becomes_infinite() -> None:
    huge = ONE << 2000
    assert checker.to_doubles((-huge, huge)) == (-math.inf, math.inf)
    assert checker.to_doubles((huge, huge))[1] == math.inf
