"""Bounds on the reference, the performance functions and the center that they make.

docs/theory.md section 2, the row `performance` of the table, and section 3, "Anchoring".
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.bounds.derivative import NOT_ENCLOSED_FIX, derivative
from bfppc_synth.bounds.latch import (
    offset_range,
    reference_expression,
    resolutions,
    starts,
    value_at_zero,
)
from bfppc_synth.bounds.performance import rho_end, rho_expression, rho_floor, rho_rate
from bfppc_synth.bounds.rounding import above, below
from bfppc_synth.bounds.signal_range import range_from, range_on
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.resolution import upper_bound
from bfppc_synth.model.bounds import CenterBounds, Conditions, SignalBounds
from bfppc_synth.model.spec import Anchor, ReferenceKind

if TYPE_CHECKING:
    from bfppc_synth.bounds.latch import Start
    from bfppc_synth.bounds.natural import Range
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.spec import PlantSpec

_OFFSET = sp.Symbol("a", real=True)


def conditions(spec: PlantSpec) -> Conditions:
    """Collect what measurement, computer and actuator do to the law.

    Parameters
    ----------
    spec : PlantSpec
        The plant file.

    Returns
    -------
    Conditions
        delta_{0,i} [unit of x_i], doubled for the exact anchor; h + tau and tau [s]; delta_u
        [unit of u]. All rounded up.

    References
    ----------
    docs/theory.md section 3.
    """
    # The exact anchor's error is measured against rho x(0), not rho q(x(0)): 1 + rho_M = 2.
    factor = 2 if spec.synthesis.anchor is Anchor.EXACT else 1
    delay = upper_bound(spec.sampling.delay)
    return Conditions(
        delta=tuple(above(factor * delta) for delta in resolutions(spec)),
        hold=above(upper_bound(spec.sampling.period) + delay),
        delay=above(delay),
        actuator_error=above(upper_bound(spec.actuator.error)),
    )


def bound_signals(plant: Plant) -> SignalBounds:
    """Bound the reference and the performance functions over all t >= 0.

    Parameters
    ----------
    plant : Plant
        Its reference is an expression, an expression with declared bounds, or supplied at
        run time.

    Returns
    -------
    SignalBounds
        Y_0 [unit of y], Y_1 [unit of y per s], the offset a = x_1(0) - y_d(0) of the anchor,
        inf rho_i and sup |drho_i| [1/s].

    Raises
    ------
    EnvelopeError
        If the reference is unbounded, may jump, or is of a kind that cannot be enclosed.

    References
    ----------
    docs/theory.md sections 2 and 3; SPEC section 1, "References enclosed rigorously".
    """
    spec = plant.spec
    if spec.reference.kind is ReferenceKind.EXPRESSION:
        value, rate = _reference_ranges(reference_expression(plant), plant.time)
        bounds = _size(value), _size(rate)
    else:
        bounds = (
            above(upper_bound(spec.reference.bounds[0])),
            above(upper_bound(spec.reference.bounds[1])),
        )
    offset = offset_range(plant)
    rhos = spec.performance.rho
    return SignalBounds(
        Y_0=bounds[0],
        Y_1=bounds[1],
        a_0=max(abs(offset[0]), abs(offset[1])),
        offset_lower=offset[0],
        offset_upper=offset[1],
        rho_floor=tuple(below(rho_floor(rho)) for rho in rhos),
        rho_rate=tuple(above(rho_rate(rho)) for rho in rhos),
    )


def performance_center(plant: Plant, signals: SignalBounds) -> CenterBounds:
    """Bound the center r_1 = y_d + rho_1 a, r_i = rho_i x_i(0), v = 0.

    |r_1| and |dr_1| are taken of the sum, at one and the same t: Example 2 has 1.2808 and
    1.0308 instead of 1.5 and 1.5.

    Parameters
    ----------
    plant : Plant
        The plant.
    signals : SignalBounds
        From ``bound_signals``.

    Returns
    -------
    CenterBounds
        Range of r_i [unit of x_i] and bounds on |dr_i| [unit of x_i per s], for all t and all
        declared starts; feed is s_2..s_{n+1}.

    Raises
    ------
    EnvelopeError
        As ``bound_signals``.

    References
    ----------
    docs/theory.md section 2.
    """
    if plant.spec.reference.kind is ReferenceKind.EXPRESSION:
        value, rate = _joint_ranges(plant, signals)
        first, first_rate = value, _size(rate)
    else:
        size = above(Fraction(signals.Y_0) + Fraction(signals.a_0))
        first = (0.0 - size, size)
        first_rate = above(
            Fraction(signals.Y_1) + Fraction(signals.rho_rate[0]) * Fraction(signals.a_0)
        )
    rhos = plant.spec.performance.rho
    others = starts(plant.spec)[1:]
    ranges = [_faded(start, rho_floor(rho)) for start, rho in zip(others, rhos[1:], strict=True)]
    rates = [rho_rate(rho) * start.size for start, rho in zip(others, rhos[1:], strict=True)]
    return _center([first, *ranges], [first_rate, *map(above, rates)])


def printed_center(plant: Plant, signals: SignalBounds) -> CenterBounds:
    """Bound the center as the paper prints it: Y_0 + rho_M a_0 and Y_1 + rho_{M,0} a_0.

    Parameters
    ----------
    plant, signals
        As for ``performance_center``.

    Returns
    -------
    CenterBounds
        Ranges symmetric about 0; a declared ``rate_bound`` is rho_{M,0}.

    References
    ----------
    docs/theory.md section 2, "Printed"; the paper's (58), (61)-(62).
    """
    sizes, rates = [], []
    for index, (rho, start) in enumerate(
        zip(plant.spec.performance.rho, starts(plant.spec), strict=True)
    ):
        slope = rho_rate(rho) if rho.rate_bound is None else upper_bound(rho.rate_bound)
        start_size = Fraction(signals.a_0) if index == 0 else start.size
        reference = (signals.Y_0, signals.Y_1) if index == 0 else (0.0, 0.0)
        sizes.append(above(Fraction(reference[0]) + start_size))
        rates.append(above(Fraction(reference[1]) + slope * start_size))
    return _center([(0.0 - size, size) for size in sizes], rates)


def _center(ranges: list[Range], rates: list[float]) -> CenterBounds:
    return CenterBounds(
        r_lower=tuple(lower for lower, _ in ranges),
        r_upper=tuple(upper for _, upper in ranges),
        rate=tuple(rates),
        feed=(*(_size(edge) for edge in ranges[1:]), 0.0),
        v=0.0,
        v_rate=0.0,
        v_start=0.0,
    )


def _size(edge: Range) -> float:
    return max(abs(edge[0]), abs(edge[1]))


def _faded(start: Start, floor: Fraction) -> Range:
    """Range of rho x(0), rho in [floor, 1]: a start above 0 never fades below 0."""
    return (
        below(min(start.lower, floor * start.lower)),
        above(max(start.upper, floor * start.upper)),
    )


@lru_cache(maxsize=16)
def _reference_ranges(reference: sp.Expr, time: sp.Symbol) -> tuple[Range, Range]:
    """Range of y_d and of dy_d over all t >= 0."""
    try:
        # First the derivative: it refuses what may jump.
        slope = derivative(reference, time)
        return range_from(reference, time, 0.0, {}), range_from(slope, time, 0.0, {})
    except EnvelopeError as error:
        raise _not_enclosed(reference, error) from error


def _not_enclosed(reference: sp.Expr, error: EnvelopeError) -> EnvelopeError:
    return EnvelopeError(
        f"the reference {reference} cannot be enclosed over all t >= 0: {error}",
        subexpression=error.subexpression,
        fix=NOT_ENCLOSED_FIX,
    )


def _joint_ranges(plant: Plant, signals: SignalBounds) -> tuple[Range, Range]:
    """Range of r_1 = y_d + rho_1 a and of dr_1, over all t and all a."""
    reference, time = reference_expression(plant), plant.time
    rho = plant.spec.performance.rho[0]
    offset = signals.offset_lower, signals.offset_upper
    value, rate = _reference_ranges(reference, time)
    if offset == (0.0, 0.0):
        return value, rate
    if time not in reference.free_symbols:
        return _around_constant(plant, signals)
    joint = reference + _OFFSET * rho_expression(rho, time)
    slope = derivative(joint, time)
    end = rho_end(rho)
    try:
        if math.isinf(end):
            every = {_OFFSET: offset}
            return range_from(joint, time, 0.0, every), range_from(slope, time, 0.0, every)
        return _fading_range(joint, reference, time, end, offset), _fading_range(
            slope, derivative(reference, time), time, end, offset
        )
    except EnvelopeError as error:
        raise _not_enclosed(reference, error) from error


def _fading_range(
    joint: sp.Expr, reference: sp.Expr, time: sp.Symbol, end: float, offset: Range
) -> Range:
    """Range of a signal that is ``joint`` up to the end of (52), and ``reference`` from there."""
    # ``end`` is rounded up by a few units in the last place, which this takes back.
    after = range_from(reference, time, end * (1.0 - 1e-15), {})
    return range_on(joint, time, (0.0, end), {_OFFSET: offset}, after)


def _around_constant(plant: Plant, signals: SignalBounds) -> tuple[Range, Range]:
    """Exact ranges for a constant reference: c + rho a, drho a."""
    lower, upper = value_at_zero(reference_expression(plant), plant.time)
    floor = rho_floor(plant.spec.performance.rho[0])
    down, up = Fraction(signals.offset_lower), Fraction(signals.offset_upper)
    speed = above(rho_rate(plant.spec.performance.rho[0]) * Fraction(signals.a_0))
    value = below(lower + min(down, floor * down)), above(upper + max(up, floor * up))
    return value, (0.0 - speed, speed)
