"""Every quantizer keeps the delta_0 that the certificate assumes (docs/theory.md section 3)."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bfppc_synth.simulation.quantizers import (
    DeadZoneUniform,
    Exact,
    HysteresisUniform,
    LogarithmicUniform,
    Uniform,
)

MAKERS = {
    "exact": Exact,
    "uniform": lambda: Uniform(0.1),
    "uniform with a fine step": lambda: Uniform(1e-5),
    "no dead zone": lambda: DeadZoneUniform(0.1, 0.0),
    "small dead zone": lambda: DeadZoneUniform(0.1, 0.02),
    "large dead zone": lambda: DeadZoneUniform(0.1, 0.2),
    "small hysteresis": lambda: HysteresisUniform(0.1, 0.01),
    "largest hysteresis": lambda: HysteresisUniform(0.1, 0.05),
    "logarithmic, log cells dominate": lambda: LogarithmicUniform(0.02, 0.1, 0.8, 0.1),
    "logarithmic, uniform cells dominate": lambda: LogarithmicUniform(0.02, 0.1, 0.4, 0.1),
    "logarithmic, minimum dominates": lambda: LogarithmicUniform(0.1, 0.01, 0.5, 0.02),
    "logarithmic, coarse": lambda: LogarithmicUniform(0.01, 0.5, 0.8, 0.1),
}
POINTS = st.floats(min_value=-50.0, max_value=50.0)


def keeps_its_bound(quantizer, x):
    # Rounding of x and of the level, the quantizer being a real-valued map in the theory.
    return abs(quantizer(x) - x) <= quantizer.resolution + 1e-14 * (1.0 + abs(x))


@pytest.mark.parametrize("name", MAKERS)
@given(walk=st.lists(POINTS, min_size=1, max_size=30))
def test_every_measurement_of_a_run_is_within_the_resolution(name, walk):
    quantizer = MAKERS[name]()
    assert all(keeps_its_bound(quantizer, x) for x in walk)


@pytest.mark.parametrize("name", MAKERS)
def test_a_slow_sweep_is_within_the_resolution_and_nearly_reaches_it(name):
    quantizer = MAKERS[name]()
    points = [math.sin(k / 4000.0) for k in range(40000)]
    errors = [abs(quantizer(x) - x) for x in points]
    assert all(e <= quantizer.resolution * (1.0 + 1e-12) for e in errors)
    # Log cells lie where their edges fall, so their own bound is only nearly met.
    assert max(errors) >= 0.85 * quantizer.resolution


@given(first=POINTS, start=POINTS)
def test_hysteresis_keeps_the_bound_on_its_first_sample_whatever_came_before(first, start):
    quantizer = HysteresisUniform(0.1, 0.05)
    quantizer(start)
    quantizer.reset()
    fresh = HysteresisUniform(0.1, 0.05)
    value = quantizer(first)
    assert value == fresh(first)
    assert abs(value - first) <= 0.1 * (1.0 + 1e-12)


@given(x=POINTS, width=st.floats(min_value=0.0, max_value=0.999))
def test_hysteresis_does_not_move_inside_its_cell(x, width):
    quantizer = HysteresisUniform(0.1, 0.05)
    level = quantizer(x)
    for nearby in (level - 0.1 * width, level + 0.1 * width, level):
        assert quantizer(nearby) == level


@pytest.mark.parametrize("name", [name for name in MAKERS if "hysteresis" not in name])
@given(x=POINTS, y=POINTS)
def test_quantizers_without_memory_are_monotone_functions(name, x, y):
    quantizer = MAKERS[name]()
    low, high = sorted((x, y))
    first, second = quantizer(low), quantizer(high)
    assert first <= second
    assert quantizer(low) == first
