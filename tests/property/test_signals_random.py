"""Random signals: no sample of the signal or of its rate lies outside the bounds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from bfppc_synth.bounds.derivative import derivative
from bfppc_synth.bounds.signal_range import range_from
from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate

if TYPE_CHECKING:
    from collections.abc import Callable

TIME = sp.Symbol("t", real=True)
SAMPLES = [0.0137 * index for index in range(600)] + [0.31 * index for index in range(27, 600)]

tenths = st.integers(-30, 30).filter(bool).map(lambda value: sp.Rational(value, 10))
positive = st.integers(1, 30).map(lambda value: sp.Rational(value, 10))
frequencies = st.one_of(
    positive,
    positive.map(lambda value: sp.sqrt(2) * value),
    st.integers(1, 6).map(lambda value: sp.pi * value / 3),
)
waves = st.builds(
    lambda wave, frequency, shift: wave(frequency * TIME + shift),
    st.sampled_from([sp.sin, sp.cos]),
    frequencies,
    tenths,
)
fading = st.one_of(
    st.builds(lambda rate, power: sp.exp(-rate * TIME**power), positive, st.sampled_from([1, 2])),
    st.builds(lambda rate, power: TIME**power * sp.exp(-rate * TIME), positive, st.integers(1, 3)),
    st.builds(lambda width, at: 1 / (1 + width * (TIME - at) ** 2), positive, tenths),
)
saturating = st.one_of(
    st.builds(lambda rate, at: sp.tanh(rate * (TIME - at)), tenths, tenths),
    st.builds(lambda rate: sp.atan(rate * TIME**2 - TIME), positive),
    st.builds(lambda zero, pole: (TIME + zero) / (TIME + pole), tenths, positive),
)
kinked = st.one_of(
    waves.map(sp.Abs),
    st.builds(sp.Min, st.builds(lambda rate: rate * TIME, positive), tenths),
    st.builds(sp.Max, waves, tenths),
)
parts = st.one_of(waves, waves, fading, saturating, kinked)
terms = st.builds(
    lambda factor, factors: factor * sp.Mul(*factors),
    tenths,
    st.lists(parts, min_size=1, max_size=2),
)
signals = st.lists(terms, min_size=1, max_size=2).map(lambda found: sp.Add(*found))


def outside(expression: sp.Expr, bounds: tuple[float, float]) -> list[float]:
    """Sampled times at which the expression leaves its bounds."""
    rounding = 1e-12 * max(map(abs, bounds))
    lower, upper = bounds[0] - rounding, bounds[1] + rounding
    value: Callable[[float], float] = lambda t: evaluate(  # noqa: E731
        expression, {TIME: t}, FLOAT_FUNCTIONS
    )
    return [t for t in SAMPLES if not lower <= value(t) <= upper]


@settings(max_examples=25)
@given(signals)
def test_no_sample_of_a_random_signal_is_outside_its_range(signal: sp.Expr) -> None:
    assert outside(signal, range_from(signal, TIME, 0.0, {})) == []


@settings(max_examples=15)
@given(signals)
def test_no_sample_of_its_rate_is_outside_the_range_of_the_rate(signal: sp.Expr) -> None:
    rate = derivative(signal, TIME)

    assert outside(rate, range_from(rate, TIME, 0.0, {})) == []


@settings(max_examples=30)
@given(frequencies, tenths, tenths, tenths)
def test_a_sum_of_sine_and_cosine_has_its_amplitude(
    frequency: sp.Expr, sine: sp.Expr, cosine: sp.Expr, level: sp.Expr
) -> None:
    signal = level + sine * sp.sin(frequency * TIME) + cosine * sp.cos(frequency * TIME)
    amplitude = math.hypot(float(sine), float(cosine))
    lower, upper = range_from(signal, TIME, 0.0, {})

    assert (lower, upper) == pytest.approx(
        (float(level) - amplitude, float(level) + amplitude), abs=1e-8 * (amplitude + 3.0)
    )
    assert lower <= float(level) - amplitude
    assert upper >= float(level) + amplitude


@settings(max_examples=30)
@given(positive, positive, st.integers(1, 4))
def test_a_fading_power_has_its_peak(rate: sp.Expr, factor: sp.Expr, power: int) -> None:
    signal = factor * TIME**power * sp.exp(-rate * TIME)
    peak = float(factor) * (power / (float(rate) * math.e)) ** power
    upper = range_from(signal, TIME, 0.0, {})[1]

    assert peak * (1.0 - 1e-14) <= upper <= peak * (1.0 + 1e-6)


@settings(max_examples=30)
@given(positive, frequencies, tenths)
def test_a_wave_that_starts_gently_has_the_wave_as_its_limit(
    rate: sp.Expr, frequency: sp.Expr, shift: sp.Expr
) -> None:
    signal = (1 - sp.exp(-rate * TIME)) * sp.sin(frequency * TIME + shift)
    lower, upper = range_from(signal, TIME, 0.0, {})

    assert -1.0 - 1e-6 <= lower <= -1.0
    assert 1.0 <= upper <= 1.0 + 1e-6
