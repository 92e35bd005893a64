"""Suprema over all t against their analytic values, and what has none."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from bfppc_synth.bounds.derivative import derivative
from bfppc_synth.bounds.signal_range import range_from, range_on
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.parse import parse_expression
from bfppc_synth.expressions.symbolic import to_sympy

TIME = sp.Symbol("t", real=True)


def signal(text: str) -> sp.Expr:
    return to_sympy(parse_expression(text, names=["t"]).tree, {"t": TIME})


def tightly(found: tuple[float, float], lower: float, upper: float) -> bool:
    """Whether a range contains [lower, upper] and is within 1e-6 of it."""
    slack = 1e-6 * max(abs(lower), abs(upper))
    ulp = 4.0 * math.ulp(max(abs(lower), abs(upper)))
    return lower - slack <= found[0] <= lower + ulp and upper - ulp <= found[1] <= upper + slack


VALUES = [
    ("sin(t)", -1.0, 1.0),
    ("1.5*cos(2*t/3)", -1.5, 1.5),
    # One class of frequencies: exact over the common period.
    ("sin(t) + cos(2*t)", -2.0, 1.125),
    ("sin(t)*sin(3*t)", -1.0, 9.0 / 16.0),
    ("2*sin(pi*t) + sin(2*pi*t)", -1.5 * math.sqrt(3.0), 1.5 * math.sqrt(3.0)),
    # Different classes: dense in the torus, so the suprema add.
    ("sin(t) + sin(sqrt(2)*t)", -2.0, 2.0),
    ("sin(t) + sin(sqrt(2)*t) + cos(sqrt(3)*t)", -3.0, 3.0),
    # More classes than phases: each sine is then in [-1, 1].
    ("sin(t) + sin(sqrt(2)*t) + sin(sqrt(3)*t) + sin(sqrt(5)*t)", -4.0, 4.0),
    ("exp(-t)", 0.0, 1.0),
    ("t*exp(-t)", 0.0, 1.0 / math.e),
    ("t**3*exp(-2*t**2)", 0.0, 0.75**1.5 * math.exp(-1.5)),
    ("exp(-t**(3/2))", 0.0, 1.0),
    ("3 - 2*exp(-t)", 1.0, 3.0),
    (
        "1 - exp(-t)*cos(10*t)",
        0.0,
        1.0 + math.exp((math.atan(0.1) - math.pi) / 10.0) * math.cos(math.atan(0.1)),
    ),
    ("tanh(t - 2)", math.tanh(-2.0), 1.0),
    ("atan(t)", 0.0, math.pi / 2.0),
    ("1/(1 + exp(-t))", 0.5, 1.0),
    ("1/(1 + exp(t))", 0.0, 0.5),
    ("1/cosh(t)", 0.0, 1.0),
    ("t/(1 + t)", 0.0, 1.0),
    ("t/(1 + t**2)", 0.0, 0.5),
    ("t/sqrt(1 + t**2)", 0.0, 1.0),
    ("(t**2 + 1)/(t**2 + 2*t + 2)", (3.0 - math.sqrt(5.0)) / 2.0, 1.0),
    ("t - t**2/(1 + t)", 0.0, 1.0),
    ("sin(t + exp(-t))", -1.0, 1.0),
    ("sin(t**2)", -1.0, 1.0),
    ("tan(sin(t))", -math.tan(1.0), math.tan(1.0)),
    ("1/(2 - sin(t) - cos(t))", 1.0 / (2.0 + math.sqrt(2.0)), 1.0 / (2.0 - math.sqrt(2.0))),
    ("Abs(sin(t))", 0.0, 1.0),
    ("Abs(t - 5)/(1 + t)", 0.0, 5.0),
    ("Max(sin(t), cos(t))", -math.sqrt(0.5), 1.0),
    ("Min(t, 1)", 0.0, 1.0),
    ("Max(1 - t, 0)", 0.0, 1.0),
    ("5", 5.0, 5.0),
]


@pytest.mark.parametrize(("text", "lower", "upper"), VALUES)
def test_the_range_over_all_times_is_tight(text: str, lower: float, upper: float) -> None:
    found = range_from(signal(text), TIME, 0.0, {})

    assert tightly(found, lower, upper)


RATES = [
    ("sin(t)", -1.0, 1.0),
    ("Abs(sin(t))", -1.0, 1.0),
    ("Min(t, 1)", 0.0, 1.0),
    ("Max(1 - t, 0)", -1.0, 0.0),
    ("Max(sin(t), 1/2)", -math.sqrt(0.75), math.sqrt(0.75)),
    ("Abs(t - 5)/(1 + t)", -6.0, 1.0 / 6.0),
    # log(1 + t) has no bound, and its rate has.
    ("log(1 + t)", 0.0, 1.0),
    ("sin(100*t)*exp(-t)", -96.9266251, 100.0),
]


@pytest.mark.parametrize(("text", "lower", "upper"), RATES)
def test_the_rate_takes_the_hull_of_both_sides_of_a_kink(
    text: str, lower: float, upper: float
) -> None:
    found = range_from(derivative(signal(text), TIME), TIME, 0.0, {})

    assert found == pytest.approx((lower, upper), rel=2e-8, abs=1e-8)


@pytest.mark.parametrize(
    "center", ["7.3", "123.456", "3/7", "0"], ids=["7.3", "123.456", "3/7", "0"]
)
def test_a_spike_of_width_1e_minus_6_is_found_wherever_it_stands(center: str) -> None:
    spike = signal(f"sin(t)/2 + 1/(1 + 1e12*(t - {center})**2)")
    at = float(sp.sympify(sp.Rational(center)))
    peak = 1.0 + math.sin(at) / 2.0
    lower, upper = range_from(spike, TIME, 0.0, {})

    assert peak <= upper <= peak + 1e-6
    assert lower == pytest.approx(-0.5, abs=1e-6)


def test_the_first_and_the_last_instant_belong_to_a_span() -> None:
    found = range_on(signal("t**2"), TIME, (1.0, 3.0), {})

    assert tightly(found, 1.0, 9.0)


def test_what_happened_before_the_start_does_not_count() -> None:
    found = range_from(signal("exp(-t)"), TIME, 2.0, {})

    assert tightly(found, 0.0, math.exp(-2.0))


def test_other_symbols_take_every_value_of_their_range() -> None:
    offset = sp.Symbol("a", real=True)
    found = range_from(sp.sin(TIME) + offset * sp.exp(-TIME), TIME, 0.0, {offset: (-1.0, 2.0)})
    times = [step / 1e4 for step in range(100_000)]

    peak = max(math.sin(t) + 2.0 * math.exp(-t) for t in times)
    valley = min(math.sin(t) - math.exp(-t) for t in times)
    assert found == pytest.approx((valley, peak), rel=1e-7)


UNBOUNDED = [
    ("t", "1/(1 + t)"),
    ("t**2", "t**2*exp(-t)"),
    ("exp(t)", "exp(-t)"),
    ("sqrt(t)", "sqrt(t)*exp(-t)"),
    ("log(1 + t)", "log(2 + sin(t))"),
    ("t*sin(t)", "t*sin(t)/(1 + t)"),
    ("Max(t, 1)", "Min(t, 1)"),
    ("sinh(t)", "sinh(sin(t))"),
    ("asinh(t)", "tanh(t)"),
]


@pytest.mark.parametrize(("text", "neighbour"), UNBOUNDED)
def test_what_grows_is_refused_and_its_bounded_neighbour_is_not(text: str, neighbour: str) -> None:
    with pytest.raises(EnvelopeError, match=r"bounded|no limit") as caught:
        range_from(signal(text), TIME, 0.0, {})
    assert caught.value.fix == "give {value, bound, rate}"

    assert all(map(math.isfinite, range_from(signal(neighbour), TIME, 0.0, {})))


POLES = [
    ("1/(t - 5)", "1/(t + 5)"),
    ("1/(t - 1e5)**2", "1/(t + 1e5)**2"),
    ("1/sin(t)", "1/(1.01 + sin(t))"),
    ("sin(t)/t", "sin(t)/(t + 1)"),
    ("log(sin(t))", "log(1.01 + sin(t))"),
    ("sqrt(sin(t))", "sqrt(1 + sin(t))"),
    ("tan(2*sin(t))", "tan(1.5*sin(t))"),
    ("(2*t - 2)/(t**2 - 1)", "(2*t + 2)/(t**2 + 1)"),
    # 0/0 at an instant that the sampling may meet.
    ("sin(t)*(t**2 - 1)/(t - 1)/(t + 2)", "sin(t)*(t**2 - 1)/(t + 1)/(t + 2)"),
]


@pytest.mark.parametrize(("text", "neighbour"), POLES)
def test_a_domain_error_is_refused_and_its_neighbour_is_not(text: str, neighbour: str) -> None:
    with pytest.raises(EnvelopeError):
        range_from(signal(text), TIME, 0.0, {})

    assert all(map(math.isfinite, range_from(signal(neighbour), TIME, 0.0, {})))


@pytest.mark.parametrize(
    "text", ["sign(sin(t))", "Piecewise((0, t < 1), (1, True))", "exp(-sign(t - 1))"]
)
def test_what_may_jump_has_no_derivative(text: str) -> None:
    with pytest.raises(EnvelopeError, match="jump"):
        derivative(signal(text), TIME)


@pytest.mark.parametrize(
    "text",
    [
        "Abs(t - 1)*t**3",
        "Max(t, 2*t - 1, 3 - t)",
        "Min(sin(t), t/2)",
        "(t - 2)**(1/3)",
        "Abs(t - 2)**(2/3)",
        "exp(sin(t))/(2 + cosh(t)) + asinh(t)*atan(3*t) + log(1 + t**2) + tan(t/9)",
    ],
)
@pytest.mark.parametrize("at", [0.3, 0.9, 1.4, 2.7, 5.1])
def test_the_derivative_is_the_slope_of_the_graph(text: str, at: float) -> None:
    step = 1e-6
    expression = signal(text)
    ends = [range_on(expression, TIME, (t, t), {})[0] for t in (at - step, at + step)]
    slope = range_on(derivative(expression, TIME), TIME, (at, at), {})[0]

    assert slope == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=1e-5, abs=1e-5)
