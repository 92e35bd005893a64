"""How much of the funnel center nominal's transition leaves, over all times and starts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from bfppc_synth.bounds.dual_arrays import Dual, DualFunctions, constant, coordinate
from bfppc_synth.bounds.interval_arrays import Interval, IntervalFunctions, interval
from bfppc_synth.bounds.latch import offset_range, reference_expression, starts
from bfppc_synth.bounds.nominal.model import nominal_model
from bfppc_synth.bounds.rounding import above, below
from bfppc_synth.expressions.evaluate import evaluate
from bfppc_synth.expressions.nominal import start_series, transition_series
from bfppc_synth.expressions.resolution import upper_bound
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.model.spec import ReferenceKind

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bfppc_synth.model.plant import Plant

    Array = NDArray[np.float64]

_BASE = IntervalFunctions()
_ZERO = _BASE.number(sp.S.Zero)
_CELLS = 32
_MOST_BOXES = 20_000
_MOST_ROUNDS = 60
# A miss is stated to this share of the accuracy.
_GAP = 1e-4


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """funnel - |b| at its least: not below ``lower``, and ``reached`` at the time ``when`` [s]."""

    lower: float
    reached: float
    when: float


def transition_room(plant: Plant, transition: float, needed: float) -> Room:
    """Bound funnel(t) - |b(t)| over [0, T_s] and all starts that may be latched.

    Parameters
    ----------
    plant : Plant
        With a funnel.
    transition : float
        T_s [s].
    needed : float
        p_1 [unit of y]: what is known to leave more is not looked at closer.

    Returns
    -------
    Room
        Rounding included. Boxes of times and starts that may leave less are cut in two.

    Raises
    ------
    EnvelopeError
        If b or the funnel has no value or slope somewhere.

    References
    ----------
    docs/theory.md section 4, "A funnel may be asked for".
    """
    fading = _Fading(plant, transition)
    lower, upper = fading.boxes()
    best, when, closed = -math.inf, 0.0, -math.inf
    gap = _GAP * needed
    spent = 0
    for _ in range(_MOST_ROUNDS):
        bound, sample, point, score = fading.assess(lower, upper)
        spent += len(bound)
        top = int(np.argmax(sample))
        if sample[top] > best:
            best, when = float(sample[top]), float(point[top, 0]) * transition
        # With no coordinate worth cutting a bound is as good as it gets.
        live = (bound > max(-needed, best + gap)) & (score.max(axis=1) > 0.0)
        closed = max(closed, float(np.max(bound[~live], initial=-math.inf)))
        lower, upper, score = lower[live], upper[live], score[live]
        if not live.any():
            break
        if spent > _MOST_BOXES:
            closed = max(closed, float(np.max(bound[live])))
            break
        lower, upper = _halved(lower, upper, np.argmax(score, axis=1))
    else:
        closed = max(closed, float(np.max(fading.assess(lower, upper)[0])))
    return Room(lower=-max(closed, best), reached=-best, when=when)


def _halved(lower: Array, upper: Array, chosen: NDArray[np.int64]) -> tuple[Array, Array]:
    rows = np.arange(len(chosen))
    middle = lower[rows, chosen] + 0.5 * (upper[rows, chosen] - lower[rows, chosen])
    left, right = upper.copy(), lower.copy()
    left[rows, chosen] = right[rows, chosen] = middle
    return np.concatenate([lower, right]), np.concatenate([left, upper])


class _KinkedFunctions(DualFunctions):
    """Duals in which Min and Max have a slope: anything between both sides where they cross."""

    def minimum(self, a: Dual, b: Dual) -> Dual:
        """Return the smaller one."""
        first, second = a.value.upper <= b.value.lower, b.value.upper <= a.value.lower
        return Dual(_BASE.minimum(a.value, b.value), _either(a, b, first, second))

    def maximum(self, a: Dual, b: Dual) -> Dual:
        """Return the larger one."""
        first, second = a.value.lower >= b.value.upper, b.value.lower >= a.value.upper
        return Dual(_BASE.maximum(a.value, b.value), _either(a, b, first, second))


def _either(
    a: Dual, b: Dual, first: NDArray[np.bool_], second: NDArray[np.bool_]
) -> tuple[Interval | None, ...]:
    """Take the slopes of a where it is selected for certain, of b likewise, else their hull."""
    found: list[Interval | None] = []
    for u, v in zip(a.partials, b.partials, strict=True):
        left, right = _ZERO if u is None else u, _ZERO if v is None else v
        low = np.minimum(left.lower, right.lower)
        high = np.maximum(left.upper, right.upper)
        lower = np.where(first, left.lower, np.where(second, right.lower, low))
        upper = np.where(first, left.upper, np.where(second, right.upper, high))
        found.append(None if u is None and v is None else Interval(lower, upper))
    return tuple(found)


class _Fading:
    """|b| - funnel over boxes of s = t / T_s, the starts, and what a reference may begin with."""

    def __init__(self, plant: Plant, transition: float) -> None:
        if plant.funnel is None:
            raise LookupError("funnel")
        self._plant, self._funnel, self._transition = plant, plant.funnel, transition
        self._model = nominal_model(plant, transition)
        self._ranges = [interval(below(s.lower), above(s.upper)) for s in starts(plant.spec)]
        reference = plant.spec.reference
        self._runtime = reference.kind is ReferenceKind.RUNTIME
        if self._runtime:
            self._ranges.append(interval(*offset_range(plant)))
            for k, bound in enumerate(reference.bounds[1 : plant.order], start=1):
                size = above(upper_bound(bound) / math.factorial(k))
                self._ranges.append(interval(-size, size))
        self._wide = [j for j, a in enumerate(self._ranges) if float(a.lower) < float(a.upper)]

    def boxes(self) -> tuple[Array, Array]:
        """Return lower and upper ends (cells, coordinates) to begin with."""
        ends = np.linspace(0.0, 1.0, _CELLS + 1)
        ranges = [self._ranges[j] for j in self._wide]
        lower = [ends[:-1], *(np.full(_CELLS, float(a.lower)) for a in ranges)]
        upper = [ends[1:], *(np.full(_CELLS, float(a.upper)) for a in ranges)]
        return np.column_stack(lower), np.column_stack(upper)

    def assess(self, lower: Array, upper: Array) -> tuple[Array, Array, Array, Array]:
        """Bound each box from above, sample it where it may be largest, and weigh its sides.

        Where a slope has one sign the largest value is on that face, over the rest the mean
        value theorem bounds it (docs/theory.md section 6).
        """
        wide = self._excess([Interval(*ends) for ends in zip(lower.T, upper.T, strict=True)])
        point, score = lower + 0.5 * (upper - lower), np.zeros_like(lower)
        reach = np.zeros(len(lower))
        for j, slope in enumerate(wide.partials):
            if slope is None:
                continue
            down, up = (np.broadcast_to(end, reach.shape) for end in slope)
            width = upper[:, j] - lower[:, j]
            point[:, j] = np.where(down >= 0.0, upper[:, j], point[:, j])
            point[:, j] = np.where(up <= 0.0, lower[:, j], point[:, j])
            steep = np.where((down < 0.0) & (up > 0.0), np.maximum(-down, up), 0.0)
            # The middle is rounded: half a width and a little reaches both ends.
            reach = reach + steep * width * (0.5 + 1e-12)
            score[:, j] = steep * width
        at = self._excess([Interval(column, column) for column in point.T]).value
        near = (at.upper + reach) + 1e-15 * (np.abs(at.upper) + reach)
        shape = reach.shape
        bound = np.minimum(np.broadcast_to(wide.value.upper, shape), near)
        return bound, np.broadcast_to(at.lower, shape), point, score

    def _excess(self, box: list[Interval]) -> Dual:
        count, order = len(box), self._model.order
        functions = DualFunctions(count)
        s = coordinate(box[0], count, 0)
        given = [constant(a, count) for a in self._ranges]
        for place, j in enumerate(self._wide, start=1):
            given[j] = coordinate(box[place], count, place)
        started = start_series(self._model, functions, tuple(given[:order]))
        taylor = TaylorFunctions(functions, order)
        zero, one = functions.number(sp.S.Zero), functions.number(sp.S.One)
        if self._runtime:
            rest = taylor.sub(started, (zero, *given[order + 1 :]))
            departure = (given[order], *rest[1:])
        else:
            reference = evaluate(
                reference_expression(self._plant), {self._plant.time: (zero, one)}, taylor
            )
            departure = taylor.sub(started, reference)
        departure += (zero,) * (order - len(departure))
        duration = constant(interval(self._transition, self._transition), count)
        b = transition_series(functions, departure, s, duration, length=1)[0]
        time = {self._plant.time: functions.mul(duration, s)}
        funnel = evaluate(self._funnel, time, _KinkedFunctions(count))
        return functions.sub(functions.absolute(b), funnel)
