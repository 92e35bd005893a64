"""The widened tubes of free stages and the center after a handover (docs/theory.md section 8)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bfppc_synth.bounds.signals import bound_signals, conditions, performance_center
from bfppc_synth.bounds.stages import (
    StageInput,
    Surroundings,
    center_after,
    free_stages,
    needed_widths,
    sample_time,
)
from bfppc_synth.errors import ShapeError
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.majorants.derive import derive_majorants
from bfppc_synth.model.bounds import Conditions
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.stages import Handover
from bfppc_synth.spec.load import load_spec

PLANT = Path(__file__).parents[2] / "plants" / "switching.yaml"
PRINTED = StageInput(
    gains=(
        Shape(k=2.0, M=6.0, epsilon=0.5, c=0.1, N=3),
        Shape(k=1.0, M=0.1, epsilon=0.5, c=2.0, N=3),
    ),
    half_widths=(0.04, 1.0),
)


@pytest.fixture(scope="module")
def around() -> Surroundings:
    plant = build_plant(load_spec(PLANT))
    signals = bound_signals(plant)
    return Surroundings(
        plant=plant,
        majorants=derive_majorants(plant),
        signals=signals,
        center=performance_center(plant, signals),
        conditions=conditions(plant.spec),
        handover=Handover.REANCHOR,
    )


def timed(around: Surroundings, *, hold: float, delay: float = 0.0, delta=(0.0, 0.0)):
    given = Conditions(delta=delta, hold=hold, delay=delay, actuator_error=0.0)
    return replace(around, conditions=given)


def only(around: Surroundings):
    (stage,), broken = free_stages((PRINTED,), around)
    assert broken is None
    return stage


def test_exact_continuous_measurement_widens_nothing_but_a_hair(around):
    stage = only(around)
    for wide, p in zip(stage.widened, PRINTED.half_widths, strict=True):
        assert p < wide < p * (1.0 + 2e-6)
    assert stage.peak == pytest.approx(3.01973753, rel=1e-8)


@pytest.mark.parametrize("delta", [(0.0, 0.0), (0.002, 0.01)])
@pytest.mark.parametrize("hold", [1e-5, 1e-4])
def test_a_widened_tube_contains_what_happens_between_two_samples(around, hold, delta):
    timing = timed(around, hold=hold, delta=delta)
    stage = only(timing)
    needed = needed_widths(stage, sample_time(timing.conditions))
    for wide, need, p in zip(stage.widened, needed, PRINTED.half_widths, strict=True):
        assert p < need < wide < need * 1.001


def test_the_speeds_are_taken_on_the_widened_tube_and_not_on_the_narrow_one(around):
    slow, fast = only(around), only(timed(around, hold=1e-4))
    assert all(a < b for a, b in zip(slow.speed, fast.speed, strict=True))


def test_a_period_without_a_fixed_point_is_refused_and_a_shorter_one_is_not(around):
    assert free_stages((PRINTED,), timed(around, hold=0.1))[1] == 0
    assert free_stages((PRINTED, PRINTED), timed(around, hold=1e-4))[1] is None


def test_a_pole_inside_a_widened_tube_is_refused(around):
    wide = replace(PRINTED, half_widths=(5.0, 1e200))
    assert free_stages((wide,), around)[1] == 0


def test_the_handover_moves_the_center_by_all_measured_errors(around):
    timing = timed(around, hold=1e-4, delta=(0.001, 0.02))
    stages, _ = free_stages((PRINTED, PRINTED), timing)
    first, second = stages
    shift = first.anchor_limit + second.anchor_limit
    center = center_after(stages, timing)
    assert center.r_upper[0] == pytest.approx(around.center.r_upper[0] + shift, rel=1e-12)
    assert center.r_lower[0] == pytest.approx(around.center.r_lower[0] - shift, rel=1e-12)
    assert center.rate[0] == pytest.approx(around.center.rate[0] + 0.5 * shift, rel=1e-12)
    latched = second.bounds.X[1] + 0.02
    assert center.r_upper[1] == -center.r_lower[1] == pytest.approx(latched, rel=1e-12)
    assert center.feed == (center.r_upper[1], 0.0)
    assert center.earlier == max(first.peak, second.peak)


def test_an_intermediate_stage_has_the_center_of_the_handovers_before_it(around):
    (first, second), _ = free_stages((PRINTED, PRINTED), around)
    assert first.center == around.center
    assert second.center == center_after((first,), around)
    assert second.bounds.X[1] > first.bounds.X[1]


def test_containment_keeps_the_first_center(around):
    timing = replace(around, handover=Handover.CONTAINMENT)
    stages, _ = free_stages((PRINTED, PRINTED), timing)
    center = center_after(stages, timing)
    assert replace(center, earlier=0.0) == around.center
    assert stages[0].widened == stages[1].widened


def test_the_time_between_samples_leaves_the_delay_out(around):
    assert sample_time(timed(around, hold=3e-4).conditions) == 3e-4
    both = timed(around, hold=3e-4, delay=2e-4).conditions
    assert 1e-4 <= sample_time(both) < 1.0001e-4


def test_a_stage_with_a_gain_too_few_is_refused(around):
    with pytest.raises(ShapeError, match="stage 1 needs one gain"):
        free_stages((replace(PRINTED, gains=PRINTED.gains[:1]),), around)
