"""Bounds on reference, performance functions and center, from the plant file."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

import pytest

from bfppc_synth.bounds.signals import (
    bound_signals,
    conditions,
    performance_center,
    printed_center,
)
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.spec.load import load_spec

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bfppc_synth.model.plant import Plant

MakePlant = "Callable[..., Plant]"


@pytest.fixture
def make_plant(tmp_path: Path) -> Callable[..., Plant]:
    """Build a plant from the lines that matter to its signals."""

    def make(*lines: str, initial: str = "{x1: 0, x2: 0}", rho: str = "") -> Plant:
        performance = f"{{accuracy: 0.3, rho: {rho}}}" if rho else "{accuracy: 0.3}"
        text = "\n".join(
            (
                "name: demo",
                "states: [x1, x2]",
                "dynamics: {x1: {f: x1**2}, x2: {f: x1*x2}}",
                f"initial: {initial}",
                f"performance: {performance}",
                *lines,
            )
        )
        path = tmp_path / "demo.yaml"
        path.write_text(text + "\n", encoding="utf-8")
        return build_plant(load_spec(path))

    return make


def test_example_2_takes_reference_and_offset_at_the_same_time(make_plant: MakePlant) -> None:
    plant = make_plant("reference: sin(t)", initial="{x1: 0.5, x2: 0}")
    signals = bound_signals(plant)
    center = performance_center(plant, signals)

    # sin t + (1 + cos t)/4 and its derivative both have amplitude sqrt(1 + 1/16).
    amplitude = math.sqrt(17.0) / 4.0
    assert amplitude + 0.25 <= center.r_upper[0] <= 1.2808
    assert amplitude <= center.rate[0] <= 1.0308
    assert center.r_upper[0] == pytest.approx(amplitude + 0.25, rel=1e-8)
    assert center.rate[0] == pytest.approx(amplitude, rel=1e-8)
    # Once rho has ended, the reference alone goes down to -1.
    assert center.r_lower[0] == pytest.approx(-1.0, abs=1e-9)
    assert center.r_lower[0] <= -1.0


def test_example_1_has_exact_bounds(make_plant: MakePlant) -> None:
    plant = make_plant(initial="{x1: 1, x2: 0}")
    signals = bound_signals(plant)
    center = performance_center(plant, signals)

    assert (signals.Y_0, signals.Y_1, signals.a_0) == (0.0, 0.0, 1.0)
    assert (signals.offset_lower, signals.offset_upper) == (1.0, 1.0)
    assert (center.r_lower, center.r_upper) == ((0.0, 0.0), (1.0, 0.0))
    assert center.rate == (0.5, 0.0)
    assert (center.feed, center.v, center.v_rate, center.v_start) == ((0.0, 0.0), 0.0, 0.0, 0.0)


def test_the_printed_form_adds_the_bounds_of_both(make_plant: MakePlant) -> None:
    plant = make_plant(
        "reference: sin(t)",
        initial="{x1: 0.5, x2: 0.2}",
        rho="{kind: cosine, t_s: 1, rate_bound: 1}",
    )
    signals = bound_signals(plant)
    printed = printed_center(plant, signals)

    assert printed.r_upper[0] == pytest.approx(1.5, rel=1e-10)
    assert printed.r_lower[0] == -printed.r_upper[0]
    assert printed.rate == pytest.approx((1.5, 0.2), rel=1e-10)
    # The sound form keeps the true rate 1/(2 t_s), whatever is declared.
    assert signals.rho_rate == (0.5, 0.5)
    assert performance_center(plant, signals).rate[1] == 0.1


def test_a_supremum_that_is_only_approached_is_found(make_plant: MakePlant) -> None:
    plant = make_plant("reference: (pi/2)*sin(t)*(1 - exp(-0.1*t**2))")
    signals = bound_signals(plant)

    assert Fraction(math.pi) / 2 <= Fraction(signals.Y_0)
    assert pytest.approx(math.pi / 2.0, rel=1e-8) == signals.Y_0
    assert pytest.approx(math.pi / 2.0, rel=1e-8) == signals.Y_1


def test_a_narrow_spike_is_not_missed(make_plant: MakePlant) -> None:
    plant = make_plant("reference: sin(t) + 1/(1 + 1e8*(t - 7.3)**2)")
    signals = bound_signals(plant)
    peak = 1.0 + math.sin(7.3)
    slope = 1e4 * 3.0 * math.sqrt(3.0) / 8.0 + math.cos(7.3)

    assert peak <= signals.Y_0 <= peak + 1e-4
    assert slope - 1e-3 <= signals.Y_1 <= slope + 1e-3


def test_a_peak_after_the_end_of_rho_counts(make_plant: MakePlant) -> None:
    plant = make_plant(
        "reference: 3*exp(-(t - 9)**2)",
        initial="{x1: 0.1, x2: 0}",
        rho="{kind: cosine, t_s: 1}",
    )
    center = performance_center(plant, bound_signals(plant))

    assert center.r_upper[0] == pytest.approx(3.0, rel=1e-8)
    assert center.rate[0] == pytest.approx(3.0 * math.sqrt(2.0 / math.e), rel=1e-8)


def test_an_exponential_rho_leaves_its_floor(make_plant: MakePlant) -> None:
    plant = make_plant(
        initial="{x1: [-3, -2], x2: [-2, -1]}", rho="{kind: exponential, rate: 2, floor: 0.25}"
    )
    signals = bound_signals(plant)
    center = performance_center(plant, signals)

    assert signals.rho_floor == (0.25, 0.25)
    assert signals.rho_rate == (1.5, 1.5)
    assert (center.r_lower, center.r_upper) == ((-3.0, -2.0), (-0.5, -0.25))
    assert center.rate == (4.5, 3.0)
    assert center.feed == (2.0, 0.0)


def test_an_exponential_rho_is_taken_jointly_too(make_plant: MakePlant) -> None:
    plant = make_plant(
        "reference: 1 - exp(-t)",
        initial="{x1: [1.5, 2], x2: 0}",
        rho="{kind: exponential, rate: 1}",
    )
    center = performance_center(plant, bound_signals(plant))

    # 1 + (a - 1) exp(-t), a in [1.5, 2]: it falls from 2 to 1.
    assert center.r_upper[0] == pytest.approx(2.0, rel=1e-8)
    assert center.r_lower[0] == pytest.approx(1.0, rel=1e-8)
    assert center.rate[0] == pytest.approx(1.0, rel=1e-8)


def test_the_latched_anchor_widens_the_starts_and_the_exact_one_the_errors(
    make_plant: MakePlant,
) -> None:
    measured = "measurement: {quantizer: {kind: uniform, step: 0.2}, noise: 0.025}"
    latched = make_plant(measured, initial="{x1: 1, x2: 0}")
    exact = make_plant(measured, "synthesis: {anchor: exact}", initial="{x1: 1, x2: 0}")

    assert conditions(latched.spec).delta == (0.125, 0.125)
    assert conditions(exact.spec).delta == (0.25, 0.25)
    wide, narrow = bound_signals(latched), bound_signals(exact)
    assert (wide.offset_lower, wide.offset_upper, wide.a_0) == (0.875, 1.125, 1.125)
    assert (narrow.offset_lower, narrow.offset_upper, narrow.a_0) == (1.0, 1.0, 1.0)
    assert performance_center(latched, wide).feed == (0.125, 0.0)
    assert performance_center(exact, narrow).feed == (0.0, 0.0)


def test_times_are_rounded_up(make_plant: MakePlant) -> None:
    plant = make_plant("sampling: {period: 0.1, delay: 0.2}", "actuator: {error: 0.3}")
    found = conditions(plant.spec)

    # binary64 0.1 is above 1/10, 0.3 is below 3/10: the next one is taken.
    assert Fraction(found.hold) >= Fraction(3, 10) > Fraction(math.nextafter(found.hold, 0.0))
    assert Fraction(found.delay) >= Fraction(1, 5)
    assert Fraction(found.actuator_error) >= Fraction(3, 10)


def test_a_continuous_exact_loop_has_no_conditions(make_plant: MakePlant) -> None:
    found = conditions(make_plant().spec)

    assert (found.delta, found.hold, found.delay, found.actuator_error) == (
        (0.0, 0.0),
        0.0,
        0.0,
        0.0,
    )


def test_declared_bounds_replace_the_enclosure(make_plant: MakePlant) -> None:
    plant = make_plant(
        "reference: {value: sin(t**2), bound: 1, rate: 8}", initial="{x1: 0.5, x2: 0}"
    )
    signals = bound_signals(plant)
    center = performance_center(plant, signals)

    assert (signals.Y_0, signals.Y_1, signals.a_0) == (1.0, 8.0, 0.5)
    assert (center.r_lower[0], center.r_upper[0], center.rate[0]) == (-1.5, 1.5, 8.25)


@pytest.mark.parametrize(
    ("offset", "expected"), [("", (-1.75, 2.25)), (", offset: 0.25", (-0.375, 0.375))]
)
def test_a_run_time_reference_may_start_anywhere_unless_offset_bounds_it(
    make_plant: MakePlant, offset: str, expected: tuple[float, float]
) -> None:
    plant = make_plant(
        "reference: {bounds: [1.5, 2]}",
        "measurement: {noise: 0.125}",
        initial=f"{{x1: [-0.125, 0.625], x2: 0{offset}}}",
    )
    signals = bound_signals(plant)

    assert (signals.offset_lower, signals.offset_upper) == expected
    assert signals.a_0 == max(map(abs, expected))
    assert performance_center(plant, signals).rate[0] == 2.0 + signals.a_0 / 2.0


def test_an_irrational_start_of_the_reference_is_enclosed(make_plant: MakePlant) -> None:
    plant = make_plant("reference: cos(t + 1)", initial="{x1: 0, x2: 0}")
    signals = bound_signals(plant)

    assert signals.offset_lower <= -math.cos(1.0) <= signals.offset_upper
    assert signals.offset_upper - signals.offset_lower < 1e-15


def test_a_start_on_the_reference_leaves_the_reference_alone(make_plant: MakePlant) -> None:
    plant = make_plant("reference: 2*sin(3*t)")
    signals = bound_signals(plant)
    center = performance_center(plant, signals)

    assert signals.a_0 == 0.0
    assert center.r_upper[0] == pytest.approx(2.0, rel=1e-9)
    assert center.rate[0] == pytest.approx(6.0, rel=1e-9)


def test_a_reference_that_cannot_be_enclosed_says_what_to_declare(make_plant: MakePlant) -> None:
    with pytest.raises(EnvelopeError, match="the reference 1/t cannot be enclosed") as caught:
        bound_signals(make_plant("reference: 1/(t - 0)"))

    assert caught.value.fix == "give {value, bound, rate}"
    assert caught.value.subexpression == "1/t"
