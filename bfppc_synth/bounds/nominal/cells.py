"""Cells of time that cover [0, infinity), with the reference's Taylor series over each.

docs/theory.md sections 4 and 6: the transition is cut into cells of s = t / T_s; what follows
is one period of a periodic reference, or pieces of time up to where all that fades is small,
and phases from there on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import sympy as sp

from bfppc_synth.bounds.derivative import NOT_ENCLOSED_FIX, derivative
from bfppc_synth.bounds.interval_arrays import Interval, interval
from bfppc_synth.bounds.natural import natural
from bfppc_synth.bounds.phases import Phases
from bfppc_synth.bounds.tail import Tail
from bfppc_synth.errors import EnvelopeError

if TYPE_CHECKING:
    from numpy.typing import NDArray

CELLS = 192
# Cells of a whole grid of phases, by the number of classes of frequencies.
_GRID = {1: 192, 2: 48, 3: 16}
# Beyond this share of the signal, what still fades is worth another piece of time.
_FADED = 1e-6
_MOST_CELLS = 24_000
_LOOSE = 1e-9

Bounds: TypeAlias = tuple[float, float]


class Span(Enum):
    """What the time of a batch of cells is to the transition."""

    TRANSITION = auto()  # s = t / T_s in [0, 1]
    AFTER = auto()  # b = 0: the start no longer matters


@dataclass(frozen=True, slots=True, kw_only=True)
class Cells:
    """A batch of cells: the expression that the reference is on them, and its coordinates.

    ``symbols`` are the coordinates that ``reference`` reads, ``speed`` their rates in t (1 for
    t itself, the frequency for a phase), ``ranges`` their cells. ``rest`` bounds, derivative
    by derivative, what has faded and is left out of ``reference``.
    """

    reference: sp.Expr
    symbols: tuple[sp.Symbol, ...]
    speeds: tuple[sp.Expr, ...]
    ranges: tuple[Interval, ...]
    rest: tuple[Bounds, ...] = ()
    span: Span = Span.AFTER


def split(lower: float, upper: float, count: int) -> Interval:
    """Cut [lower, upper] into cells that share their ends."""
    ends = np.linspace(lower, upper, count + 1)
    # linspace may end a unit in the last place short.
    ends[0], ends[-1] = lower, upper
    return interval(ends[:-1], ends[1:])


def transition_cells(reference: sp.Expr, time: sp.Symbol, share: float, count: int) -> Cells:
    """Cut the first ``share`` of the transition into cells of s = t / T_s."""
    return Cells(
        reference=reference,
        symbols=(time,),
        speeds=(sp.S.One,),
        ranges=(split(0.0, share, count),),
        span=Span.TRANSITION,
    )


def halved(cells: Cells, chosen: NDArray[np.bool_] | None) -> Cells:
    """Halve the chosen cells (all, where None) along every coordinate."""
    parts = [
        box if chosen is None else Interval(box.lower[chosen], box.upper[chosen])
        for box in cells.ranges
    ]
    choices: list[list[Interval]] = [[]]
    for box in parts:
        middle = box.lower + 0.5 * (box.upper - box.lower)
        sides = (Interval(box.lower, middle), Interval(middle, box.upper))
        choices = [[*choice, side] for choice in choices for side in sides]
    ranges = tuple(
        Interval(
            np.concatenate([choice[j].lower for choice in choices]),
            np.concatenate([choice[j].upper for choice in choices]),
        )
        for j in range(len(parts))
    )
    return replace(cells, ranges=ranges)


def later_cells(
    reference: sp.Expr, time: sp.Symbol, start: float, orders: int
) -> tuple[Cells, ...]:
    """Cover [start, infinity).

    Parameters
    ----------
    reference : sympy.Expr
        y_d(t).
    time : sympy.Symbol
        t [s].
    start : float
        T_s [s].
    orders : int
        Number of derivatives wanted, the value included.

    Returns
    -------
    tuple[Cells, ...]
        Pieces of time, then phases.

    Raises
    ------
    EnvelopeError
        If the reference has too many incommensurate frequencies, or does not settle.

    References
    ----------
    docs/theory.md section 2, "All suprema over t are rigorous".
    """
    if time not in reference.free_symbols:
        return (Cells(reference=reference, symbols=(), speeds=(), ranges=()),)
    tail = Tail(reference, time, {})
    phases = Phases(reference, time)
    if tail.is_periodic:
        return (_phased(reference, time, phases),)
    limit = _limit(tail, phases, reference)
    fading = sp.expand(reference - limit.xreplace(dict(phases.originals)))
    tails = _derivatives(fading, time, orders)
    wholes = _derivatives(reference, time, orders)
    period = _shortest(phases)
    pieces: list[Cells] = []
    spent, end = 0, start
    while True:
        rest = _beside(wholes, end) or _rest(tails, end)
        if rest is not None and (_is_faded(rest, limit, phases) or spent > _MOST_CELLS):
            break
        if spent > 4 * _MOST_CELLS:
            raise _unsettled(reference, end)
        following = 2.0 * max(end, 1.0)
        count = max(CELLS // 2, math.ceil(CELLS // 2 * (following - end) / period))
        pieces.append(
            Cells(
                reference=reference,
                symbols=(time,),
                speeds=(sp.S.One,),
                ranges=(split(end, following, count),),
            )
        )
        spent, end = spent + count, following
    # The limit is periodic, or constant: its phases stand for all times from here on.
    last = _phased(limit.xreplace(dict(phases.originals)), time, phases)
    return (
        *pieces,
        replace(last, rest=rest),
    )


def _limit(tail: Tail, phases: Phases, reference: sp.Expr) -> sp.Expr:
    """Put what every fading or saturating part of a signal settles on in its place."""
    found = tail.form
    for symbol, (lower, upper) in tail.limit_box().items():
        if symbol in phases.ranges:
            continue
        if lower != upper:
            raise _unsettled(reference, math.inf)
        found = found.xreplace({symbol: sp.Rational(lower)})
    return found


def _phased(expression: sp.Expr, time: sp.Symbol, phases: Phases) -> Cells:
    """Cover all times by the phases of the classes of frequencies."""
    symbols = tuple(sorted(phases.ranges, key=str))
    if time not in expression.free_symbols:
        return Cells(reference=expression, symbols=(), speeds=(), ranges=())
    if not symbols:
        raise _unsettled(expression, math.inf)
    speeds = tuple(sp.diff(phases.originals[symbol], time) for symbol in symbols)
    written = Tail(expression, time, {}).form
    if written.free_symbols - set(symbols):
        raise _unsettled(expression, math.inf)
    axes = [
        split(*phases.ranges[symbol], _GRID[len(symbols)] * _harmonic(written, symbol))
        for symbol in symbols
    ]
    lower = np.meshgrid(*(axis.lower for axis in axes), indexing="ij")
    upper = np.meshgrid(*(axis.upper for axis in axes), indexing="ij")
    ranges = tuple(interval(a.ravel(), b.ravel()) for a, b in zip(lower, upper, strict=True))
    return Cells(reference=written, symbols=symbols, speeds=speeds, ranges=ranges)


def _harmonic(written: sp.Expr, phase: sp.Symbol) -> int:
    """How many times the fastest wave goes round while a phase does so once (16 at most)."""
    slopes = [sp.diff(wave.args[0], phase) for wave in written.atoms(sp.sin, sp.cos)]
    # A wave of a wave has no one frequency; its inner one is among the others.
    turns = [abs(float(slope)) for slope in slopes if slope.is_number]
    return math.ceil(min(16.0, max(turns, default=1.0)))


def _shortest(phases: Phases) -> float:
    """Period of the slowest class: cells resolve its harmonics less finely."""
    periods = []
    for original in phases.originals.values():
        speed = sp.diff(original, *original.free_symbols)
        periods.append(2.0 * math.pi / abs(float(speed)))
    return min(periods, default=math.inf)


def _derivatives(signal: sp.Expr, time: sp.Symbol, orders: int) -> list[Tail]:
    rates = [signal]
    while len(rates) < orders:
        rates.append(derivative(rates[-1], time))
    return [Tail(rate, time, {}) for rate in rates]


def _beside(tails: list[Tail], start: float) -> tuple[Bounds, ...] | None:
    """Bound what a signal and its derivatives differ from their limits for all t >= start.

    By the mean value theorem in what fades or saturates: sin(t) atan(t) differs from its limit
    by what atan does, and not by the whole wave. None where that says nothing.
    """
    found = []
    for tail in tails:
        box, limit = tail.box(max(start, 1e-9)), tail.limit_box()
        if box is None:
            return None
        reach = 0.0
        ends = {symbol: (*edge, *limit[symbol]) for symbol, edge in box.items()}
        hull = {symbol: (min(four), max(four)) for symbol, four in ends.items()}
        try:
            for symbol in sorted(tail.narrow & box.keys(), key=str):
                slope = derivative(tail.form, symbol)
                used = {name: hull[name] for name in slope.free_symbols}
                steep = max(map(abs, natural(slope, used)))
                reach += steep * (hull[symbol][1] - hull[symbol][0])
        except EnvelopeError:
            return None
        if not math.isfinite(reach):
            return None
        reach *= 1.0 + _LOOSE
        found.append((-reach, reach))
    return tuple(found)


def _rest(tails: list[Tail], start: float) -> tuple[Bounds, ...] | None:
    """Bound each derivative of what fades for all t >= start; None where it is too early."""
    found = []
    for tail in tails:
        box = tail.box(max(start, 1e-9))
        if box is None:
            return None
        try:
            lower, upper = natural(tail.form, box)
        except EnvelopeError:
            return None
        if not (math.isfinite(lower) and math.isfinite(upper)):
            return None
        wide = _LOOSE * max(abs(lower), abs(upper))
        found.append((lower - wide, upper + wide))
    return tuple(found)


def _is_faded(rest: tuple[Bounds, ...], limit: sp.Expr, phases: Phases) -> bool:
    base = {symbol: edge for symbol, edge in phases.ranges.items() if symbol in limit.free_symbols}
    lower, upper = natural(limit, base)
    scale = max(abs(lower), abs(upper), 1e-3)
    return all(max(-low, up) <= _FADED * scale for low, up in rest)


def _unsettled(reference: sp.Expr, end: float) -> EnvelopeError:
    return EnvelopeError(
        f"the reference {reference} does not settle on a periodic signal within {end:.0e} s",
        subexpression=str(reference),
        fix=NOT_ENCLOSED_FIX,
    )
