"""The suprema of the feedback shapes, against dense sampling."""

from __future__ import annotations

import itertools
import math

import pytest

from bfppc_synth.bounds.feedback import (
    coupled_rate,
    feedback,
    largest_slope,
    measurement_growth,
    steepness,
)
from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.model.shapes import Shape

NUMBERS = FloatNumbers()
SHAPES = [
    Shape(k=k, M=M, epsilon=0.4, c=c, N=N)
    for k, M, c, N in itertools.product((0.0, 2.0), (0.0, 0.7, 9.0), (0.0, 3.0), (3, 5))
    if k or M or c
]
# Squared, so that the steep part of a tanh near 0 is met often enough.
SAMPLES = [(j / 6000) ** 2 for j in range(6001)]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("p", [0.05, 1.3])
def test_largest_slope_is_the_supremum_of_the_derivative(shape, p):
    sampled = max(steepness(shape.generic, s * p, NUMBERS) for s in SAMPLES)
    assert largest_slope(shape.generic, p, NUMBERS) == pytest.approx(sampled, rel=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("p", "offset", "gain"), [(0.05, 4.0, 2.0), (1.3, 0.5, 7.0)])
def test_coupled_rate_is_the_supremum_at_one_and_the_same_point(shape, p, offset, gain):
    generic = shape.generic
    sampled = max(
        steepness(generic, s * p, NUMBERS) * (offset + gain * feedback(generic, s * p, NUMBERS))
        for s in SAMPLES
    )
    found = coupled_rate(generic, p, offset, gain, NUMBERS)
    assert found >= sampled * (1 - 1e-12)
    assert found == pytest.approx(sampled, rel=1e-6)


@pytest.mark.parametrize("shape", SHAPES)
def test_coupled_rate_is_at_most_the_simple_product(shape):
    p, offset, gain = 0.4, 3.0, 2.0
    simple = largest_slope(shape.generic, p, NUMBERS) * (
        offset + gain * feedback(shape.generic, p, NUMBERS)
    )
    assert coupled_rate(shape.generic, p, offset, gain, NUMBERS) <= simple * (1 + 1e-12)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("p", "eta"), [(0.05, 0.02), (1.3, 0.6), (0.3, 0.0)])
def test_measurement_growth_covers_every_sampled_difference(shape, p, eta):
    generic = shape.generic
    bound = measurement_growth(generic, p, eta, NUMBERS)
    worst = max(
        abs(feedback(generic, e + d, NUMBERS) - feedback(generic, e, NUMBERS))
        for e in (p * (2 * s - 1) for s in SAMPLES[::40])
        for d in (-eta, -eta / 3, eta / 2, eta)
    )
    assert worst <= bound * (1 + 1e-12) + 1e-15
    assert bound <= generic.k * eta + 2 * generic.M + generic.c * (p + eta) ** generic.N + 1e-15


def test_a_missing_term_is_left_out_and_not_evaluated():
    shape = Shape(k=2.0, M=0.0, epsilon=math.nan, c=0.0, N=3)
    assert feedback(shape.generic, 0.5, NUMBERS) == 1.0
