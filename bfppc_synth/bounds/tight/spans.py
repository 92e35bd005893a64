"""The times and starts of a center as spans: joint coordinates wherever they are known."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from bfppc_synth.bounds.dual_arrays import Dual, DualFunctions, constant
from bfppc_synth.bounds.interval_arrays import Interval, IntervalFunctions, interval
from bfppc_synth.bounds.latch import reference_expression, starts
from bfppc_synth.bounds.nominal.cells import Cells, later_cells, transition_cells
from bfppc_synth.bounds.nominal.cells import Span as Period
from bfppc_synth.bounds.nominal.following import Follower
from bfppc_synth.bounds.performance import rho_end, rho_floor
from bfppc_synth.bounds.rounding import above, below
from bfppc_synth.bounds.tight.center import Span
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import evaluate
from bfppc_synth.expressions.resolution import lower_bound, upper_bound
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.model.spec import ReferenceKind, RhoKind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.bounds import CenterBounds, SignalBounds
    from bfppc_synth.model.nominal import NominalModel
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.spec import RhoSpec

_BASE = IntervalFunctions()
_TIME_PIECES = 16
_PHASE_PIECES = {1: 16, 2: 8, 3: 4}
# exp(-12) of a start is left over when the tail of (53) begins.
_FADED = 12.0
# More than this of a reference beside what it settles on: its bounds alone are as good.
_LEFT = 1e-2


def nominal_spans(plant: Plant, model: NominalModel) -> tuple[Span, ...]:
    """Cover t >= 0 and all latched starts of center nominal.

    Raises
    ------
    EnvelopeError
        If the reference does not settle on something periodic.

    References
    ----------
    docs/theory.md sections 4 and 9.
    """
    follower = Follower(plant, model)
    batches = [transition_cells(follower.reference, plant.time, 1.0, 1)]
    if follower.runtime:
        batches.append(Cells(reference=sp.S.Zero, symbols=(), speeds=(), ranges=()))
    else:
        batches += later_cells(follower.reference, plant.time, model.transition, model.order + 2)
    found = []
    for cells in batches:
        begun = follower.coordinates(cells)
        axes = [*_axes(cells), *(_edges(box) for box in begun)]

        def series(at: list[Dual], cells: Cells = cells) -> list[Dual]:
            everything = follower.series(cells, at)
            none = constant(_BASE.number(sp.S.Zero), len(at))
            rates = [part[1] if len(part) > 1 else none for part in everything[:-1]]
            return [*(part[0] for part in everything), *rates]

        pieces = (*_pieces(cells), *(1 for _ in begun))
        found.append(Span(evaluate=series, axes=tuple(axes), pieces=pieces))
    return tuple(found)


def performance_spans(
    plant: Plant, signals: SignalBounds, center: CenterBounds
) -> tuple[Span, ...]:
    """Cover t >= 0 and all starts of center performance.

    y_d(t) and rho(t) belong to one t wherever y_d is an expression that settles; elsewhere
    r_1 and dr_1 range over their boxes.

    References
    ----------
    docs/theory.md sections 2 and 9.
    """
    center_of = _Performance(plant, signals, center)
    if plant.spec.reference.kind is ReferenceKind.EXPRESSION:
        try:
            return center_of.followed()
        except EnvelopeError:
            # A kink, or a signal that never settles: its bounds are known all the same.
            pass
    return center_of.boxed()


class _Performance:
    """r_1 = y_d + rho_1 a, r_i = rho_i x_i(0) in duals."""

    def __init__(self, plant: Plant, signals: SignalBounds, center: CenterBounds) -> None:
        self._plant, self._center = plant, center
        self._rhos = plant.spec.performance.rho
        begin = [interval(below(s.lower), above(s.upper)) for s in starts(plant.spec)]
        # The first one is the offset a, in place of x_1(0).
        self._starts = [interval(signals.offset_lower, signals.offset_upper), *begin[1:]]
        self._wide = [j for j, s in enumerate(self._starts) if float(s.lower) < float(s.upper)]
        self._end = max(_end(rho) for rho in self._rhos)

    def followed(self) -> tuple[Span, ...]:
        reference, time = reference_expression(self._plant), self._plant.time
        first = Cells(
            reference=reference,
            symbols=(time,),
            speeds=(sp.S.One,),
            ranges=(interval(np.array([0.0]), np.array([self._end])),),
            span=Period.TRANSITION,
        )
        # What is rounded up by a few units in the last place is taken back.
        batches = (first, *later_cells(reference, time, self._end * (1.0 - 1e-15), 2))
        if any(max(-low, high) > _LEFT for low, high in batches[-1].rest[:2]):
            raise EnvelopeError(
                "too much of the reference is left when it settles", subexpression=""
            )
        spans = []
        for cells in batches:
            wide = self._kept(cells.span)

            def follow(
                at: list[Dual], cells: Cells = cells, wide: Sequence[int] = tuple(wide)
            ) -> list[Dual]:
                known = len(cells.symbols)
                count = len(at)
                functions = DualFunctions(count)
                values = {
                    symbol: (value, functions.number(speed))
                    for symbol, value, speed in zip(
                        cells.symbols, at[:known], cells.speeds, strict=True
                    )
                }
                taylor = TaylorFunctions(functions, 2)
                signal = evaluate(cells.reference, values, taylor)
                rest = tuple(constant(interval(*ends), count) for ends in cells.rest[:2])
                signal = taylor.add(signal, rest) if rest else signal
                none = functions.number(sp.S.Zero)
                rate = signal[1] if len(signal) > 1 else none
                now = at[0] if cells.span is Period.TRANSITION else None
                return self._joined((signal[0], rate), now, self._begin(wide, at[known:]), count)

            axes = [*_axes(cells), *(_edges(self._starts[j]) for j in wide)]
            pieces = (*_pieces(cells), *(1 for _ in wide))
            spans.append(Span(evaluate=follow, axes=tuple(axes), pieces=pieces))
            # A reference that TaylorFunctions refuse is refused here, not in the search.
            middles = [
                constant(interval(*(np.array([0.5 * sum(e)]),) * 2), len(axes)) for e in axes
            ]
            follow(middles)
        return tuple(spans)

    def boxed(self) -> tuple[Span, ...]:
        center = self._center
        box = ((center.r_lower[0], center.r_upper[0]), (-center.rate[0], center.rate[0]))
        spans = []
        for period in (Period.TRANSITION, Period.AFTER):
            wide = [j for j in self._kept(period) if j > 0]
            early = period is Period.TRANSITION and len(self._rhos) > 1

            def follow(at: list[Dual], wide: Sequence[int] = tuple(wide)) -> list[Dual]:
                begin = self._begin(wide, at[2 : 2 + len(wide)])
                # The time stands last, where there is one.
                now = at[-1] if len(at) > 2 + len(wide) else None
                found = self._joined(None, now, begin, len(at))
                found[0], found[self._plant.order + 1] = at[0], at[1]
                return found

            axes = [*box, *(_edges(self._starts[j]) for j in wide)]
            if early:
                axes.append((0.0, self._end))
            pieces = (*(1 for _ in range(2 + len(wide))), *([_TIME_PIECES] if early else []))
            spans.append(Span(evaluate=follow, axes=tuple(axes), pieces=pieces))
        return tuple(spans)

    def _kept(self, period: Period) -> list[int]:
        """List the starts that still matter: all, or those whose rho has a floor."""
        if period is Period.TRANSITION:
            return self._wide
        return [j for j in self._wide if self._rhos[j].kind is RhoKind.EXPONENTIAL]

    def _begin(self, wide: Sequence[int], at: Sequence[Dual]) -> dict[int, Dual]:
        return dict(zip(wide, at, strict=True))

    def _joined(
        self,
        signal: tuple[Dual, Dual] | None,
        now: Dual | None,
        begin: dict[int, Dual],
        count: int,
    ) -> list[Dual]:
        """r_1..r_n, v = 0, dr_1..dr_n; ``now`` None is late: what is left of rho ranges."""
        at = DualFunctions(count)
        none = at.number(sp.S.Zero)
        values, rates = [], []
        for j, rho in enumerate(self._rhos):
            start = begin.get(j, constant(self._starts[j], count))
            size, speed = _faded(rho, now, self._end, count)
            values.append(at.mul(size, start))
            rates.append(at.mul(speed, start))
        if signal is not None:
            values[0] = at.add(values[0], signal[0])
            rates[0] = at.add(rates[0], signal[1])
        return [*values, none, *rates]


def _end(rho: RhoSpec) -> float:
    if rho.kind is RhoKind.COSINE:
        return rho_end(rho)
    return _FADED / float(lower_bound(rho.rate))


def _faded(rho: RhoSpec, now: Dual | None, end: float, count: int) -> tuple[Dual, Dual]:
    """Rho and drho at ``now``, or for all t >= end."""
    none = np.zeros(1)
    if rho.kind is RhoKind.EXPONENTIAL:
        floor, rate = rho_floor(rho), upper_bound(rho.rate)
        if now is None:
            left = float(1 - floor) * math.exp(-float(lower_bound(rho.rate)) * end) * 1.001
            size = interval(below(floor), above(floor) + left)
            speed = interval(-left * above(rate), 0.0)
            return constant(size, count), constant(speed, count)
        at = DualFunctions(count)
        fall = at.exp(at.mul(at.number(-sp.Rational(rate.numerator, rate.denominator)), now))
        share = 1 - floor
        left_over = at.mul(at.number(sp.Rational(share.numerator, share.denominator)), fall)
        least = at.number(sp.Rational(floor.numerator, floor.denominator))
        slow = at.number(-sp.Rational(rate.numerator, rate.denominator))
        return at.add(least, left_over), at.mul(slow, left_over)
    zero = constant(Interval(none, none), count)
    if now is None:
        return zero, zero
    t_s, last = float(upper_bound(rho.t_s)), rho_end(rho)
    lower, upper = (np.minimum(edge, last) / t_s for edge in now.value)
    phase = Interval(lower, upper)
    half = 0.5 / t_s
    wave, turn = _BASE.sin(phase), _BASE.cos(phase)
    late, over = now.value.lower >= last, now.value.upper >= last
    size = Interval(np.where(over, 0.0, 0.5 + 0.5 * np.cos(upper)), 0.5 + 0.5 * np.cos(lower))
    speed = Interval(
        -half * np.maximum(wave.upper, 0.0),
        np.where(late | over, 0.0, -half * np.maximum(wave.lower, 0.0)),
    )
    speed = Interval(np.where(late, 0.0, speed.lower), speed.upper)
    bend = half / t_s
    bending = Interval(-bend * turn.upper, -bend * turn.lower)
    bending = Interval(
        np.where(late, 0.0, np.where(over, np.minimum(bending.lower, 0.0), bending.lower)),
        np.where(late, 0.0, np.where(over, np.maximum(bending.upper, 0.0), bending.upper)),
    )
    return (
        Dual(size, tuple(None if u is None else _BASE.mul(speed, u) for u in now.partials)),
        Dual(speed, tuple(None if u is None else _BASE.mul(bending, u) for u in now.partials)),
    )


def _edges(box: Interval) -> tuple[float, float]:
    return float(np.min(box.lower)), float(np.max(box.upper))


def _axes(cells: Cells) -> tuple[tuple[float, float], ...]:
    return tuple(_edges(box) for box in cells.ranges)


def _pieces(cells: Cells) -> tuple[int, ...]:
    """How finely the axes of a batch are cut before the search starts."""
    if cells.span is Period.TRANSITION:
        return (_TIME_PIECES,)
    if len(cells.symbols) == 1:
        return (min(64, max(_TIME_PIECES, cells.ranges[0].lower.size // 12)),)
    return tuple(_PHASE_PIECES[len(cells.symbols)] for _ in cells.symbols)
