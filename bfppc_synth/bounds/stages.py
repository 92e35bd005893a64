"""The free stages of Theorem 3: what their errors stay below, and what the next center gains.

docs/theory.md section 8. A free stage proves nothing; it is watched at the samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING

from bfppc_synth.bounds.chain import ChainRules, chain_input, evaluate_chain
from bfppc_synth.bounds.feedback import feedback
from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.bounds.residual import float_residual
from bfppc_synth.bounds.rounding import above
from bfppc_synth.errors import EnvelopeError, ShapeError
from bfppc_synth.model.stages import Handover, Stage

if TYPE_CHECKING:
    from bfppc_synth.model.bounds import (
        CenterBounds,
        ChainBounds,
        Conditions,
        Majorants,
        SignalBounds,
    )
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.shapes import Shape

# p^ is rounded up by this share and more, until the inequality holds with room for a proof.
_ROOMS = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
_ITERATIONS = 400
_SETTLED = 1e-12
# An error that has grown by this factor between two samples is not held by anything.
_DIVERGED = 1e6
_NUMBERS = FloatNumbers()


@dataclass(frozen=True, slots=True, kw_only=True)
class StageInput:
    """What one free stage is made of: phi_{i,m} and p_{i,m}, i = 1..n."""

    gains: tuple[Shape, ...]
    half_widths: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What all stages share: the plant, its bounds, the first center, the timing."""

    plant: Plant
    majorants: Majorants
    signals: SignalBounds
    center: CenterBounds
    conditions: Conditions
    handover: Handover


def free_stages(
    inputs: tuple[StageInput, ...], around: Surroundings
) -> tuple[tuple[Stage, ...], int | None]:
    """Widen the tube of every free stage, the first one first.

    Parameters
    ----------
    inputs : tuple[StageInput, ...]
        Stages 1..K-1 as the file fixes them.
    around : Surroundings
        Plant, bounds, center and timing.

    Returns
    -------
    tuple
        The stages, and the 0-based number of the first one that has no widened tube (None if
        all have one): between two samples its errors may grow without a bound.

    Raises
    ------
    ShapeError
        If a stage has not one gain and one half-width per state.

    References
    ----------
    docs/theory.md section 8.
    """
    stages: list[Stage] = []
    for number, given in enumerate(inputs):
        if not len(given.gains) == len(given.half_widths) == around.plant.order:
            raise ShapeError(f"stage {number + 1} needs one gain and one p per state")
        stage = _widen(given, center_after(tuple(stages), around), around)
        if stage is None:
            return tuple(stages), number
        stages.append(stage)
    return tuple(stages), None


def center_after(stages: tuple[Stage, ...], around: Surroundings) -> CenterBounds:
    """Bound the center of the law that follows these stages.

    Parameters
    ----------
    stages : tuple[Stage, ...]
        Every stage that was left before, in order; none gives the first center.
    around : Surroundings
        ``handover`` says whether the center changes at a switch.

    Returns
    -------
    CenterBounds
        Reanchored: r_1 = y_d + rho_1 a + sum of rhobar r_1^(l), r_i = rhobar r_i^(m); with
        containment the first center. ``earlier`` is the largest command so far.

    References
    ----------
    docs/theory.md section 8, "reanchor".
    """
    first = around.center
    if not stages:
        return first
    earlier = max(stage.peak for stage in stages)
    if around.handover is Handover.CONTAINMENT:
        return replace(first, earlier=earlier)
    last, rates = stages[-1], around.signals.rho_rate
    shift = sum((Fraction(stage.anchor_limit) for stage in stages), Fraction(0))
    latched = [
        above(Fraction(X) + Fraction(delta))
        for X, delta in zip(last.bounds.X, around.conditions.delta, strict=True)
    ][1:]
    return replace(
        first,
        r_lower=(-above(shift - Fraction(first.r_lower[0])), *(-edge for edge in latched)),
        r_upper=(above(Fraction(first.r_upper[0]) + shift), *latched),
        rate=(
            above(Fraction(first.rate[0]) + Fraction(rates[0]) * shift),
            *(above(Fraction(r) * Fraction(x)) for r, x in zip(rates[1:], latched, strict=True)),
        ),
        feed=(*latched, 0.0),
        earlier=earlier,
    )


def sample_time(conditions: Conditions) -> float:
    """Largest time between two samples h [s], from h + tau and tau, rounded up."""
    if conditions.delay == 0.0:
        return conditions.hold
    return max(0.0, conditions.hold - conditions.delay) + 2.0 * math.ulp(conditions.hold)


def _widen(given: StageInput, center: CenterBounds, around: Surroundings) -> Stage | None:
    """Find p^_{i,m} >= p_{i,m} + eta_{i,m} + h V_{i,m}, all constants evaluated at p^_m itself."""
    residual = float_residual(around.plant, around.majorants, center)
    shapes = tuple(shape.generic for shape in given.gains)
    period = sample_time(around.conditions)

    def judged(widened: tuple[float, ...]) -> tuple[Stage, tuple[float, ...]]:
        start = chain_input(shapes, widened, center, around.conditions, _NUMBERS)
        bounds = evaluate_chain(start, residual, _NUMBERS, ChainRules())
        peak = _peak(given)
        speed = _speed(bounds, widened, max(peak, center.earlier), around.conditions)
        stage = Stage(
            gains=given.gains,
            omega=given.half_widths,
            widened=widened,
            bounds=bounds,
            center=center,
            speed=speed,
            peak=peak,
        )
        return stage, needed_widths(stage, period)

    try:
        widened = given.half_widths
        for _ in range(_ITERATIONS):
            _, needed = judged(widened)
            if not all(n <= _DIVERGED * p for n, p in zip(needed, given.half_widths, strict=True)):
                return None
            if all(n <= w * (1.0 + _SETTLED) for n, w in zip(needed, widened, strict=True)):
                break
            widened = tuple(map(max, needed, widened))
        for room in _ROOMS:
            wider = tuple(_rounded_up(w * (1.0 + room)) for w in widened)
            stage, needed = judged(wider)
            if all(n <= w * (1.0 - room / 4.0) for n, w in zip(needed, wider, strict=True)):
                return stage
    except (EnvelopeError, OverflowError, ZeroDivisionError):
        return None
    return None


def needed_widths(stage: Stage, period: float) -> tuple[float, ...]:
    """p_{i,m} + eta_{i,m} + h V_{i,m}: what p^_{i,m} must be above."""
    return tuple(
        p + eta + period * rate
        for p, eta, rate in zip(stage.omega, stage.bounds.eta, stage.speed, strict=True)
    )


def _peak(given: StageInput) -> float:
    """U_m: the monitor guarantees |ê_{n,m}| <= p_{n,m} whenever law m is applied."""
    # One part in 1e12 covers the rounding of the law's own arithmetic here.
    return feedback(given.gains[-1].generic, given.half_widths[-1], _NUMBERS) * (1.0 + 1e-12)


def _speed(
    bounds: ChainBounds[float], widened: tuple[float, ...], force: float, conditions: Conditions
) -> tuple[float, ...]:
    """V_{i,m} = E_i for i < n; V_{n,m} counts every command that may still be in force."""
    last = len(widened) - 1
    rates = [
        bounds.D[i] + bounds.G[i] * (widened[i + 1] + bounds.s[i] + bounds.A[i])
        for i in range(last)
    ]
    return (*rates, bounds.D[last] + bounds.G[last] * (force + conditions.actuator_error))


def _rounded_up(value: float) -> float:
    """Round up to seven digits: a number that a certificate is easily read with."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 6)
    return float(f"{math.ceil(value / unit) * unit:.6e}")
