"""Cells of one span of times under branch and bound: bounded, collapsed, cut.

The natural enclosure of a cell is intersected with the mean value form around its middle; along
coordinates whose slope has one sign a cell is collapsed to the end that is worst.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bfppc_synth.bounds.interval_arrays import Array, Interval
from bfppc_synth.bounds.tight.fields import Field
from bfppc_synth.bounds.tight.ranges import product
from bfppc_synth.bounds.tight.residual import Center

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bfppc_synth.bounds.tight.center import CenterTable

_PASSES = 2
_KEPT = 32


class Objective(Protocol):
    """What is maximized: a function of center, errors, parameters and the side s."""

    def __call__(self, center: Center[Field], free: list[Field], side: Field) -> Field:
        """Return the value; ``free`` are the coordinates behind those of the center."""


class Pool:
    """Cells of one span that still count."""

    def __init__(self, table: CenterTable, box: tuple[Array, Array], objective: Objective) -> None:
        self._table, self._objective = table, objective
        self._axes = table.count
        self._scale = np.maximum(box[1] - box[0], 0.0)
        lower, upper = table.roots()
        count = lower.shape[1]
        free = [np.repeat(edge[:, None], count, axis=1) for edge in box]
        both = [np.vstack(pair) for pair in ((lower, free[0]), (upper, free[1]))]
        self.seen: list[tuple[Array, Array, Array, Array]] = []
        side = np.repeat([1.0, -1.0], count)
        self.lower, self.upper, self.side, self.bound, self._axis, self.best = self._judged(
            np.tile(both[0], 2), np.tile(both[1], 2), side
        )

    def cut(self, chosen: NDArray[np.int_]) -> None:
        """Replace the chosen cells by their halves."""
        columns, axis = np.arange(chosen.size), self._axis[chosen]
        lower, upper, side = self.lower[:, chosen], self.upper[:, chosen], self.side[chosen]
        middle = lower + 0.5 * (upper - lower)
        first, second = upper.copy(), lower.copy()
        first[axis, columns] = middle[axis, columns]
        second[axis, columns] = middle[axis, columns]
        found = self._judged(
            np.hstack((lower, second)), np.hstack((first, upper)), np.tile(side, 2)
        )
        # Halves are never worse than the whole.
        bound = np.minimum(found[3], np.tile(self.bound[chosen], 2))
        rest = np.ones(self.bound.size, dtype=bool)
        rest[chosen] = False
        self.lower = np.hstack((self.lower[:, rest], found[0]))
        self.upper = np.hstack((self.upper[:, rest], found[1]))
        self.side = np.concatenate((self.side[rest], found[2]))
        self.bound = np.concatenate((self.bound[rest], bound))
        self._axis = np.concatenate((self._axis[rest], found[4]))
        self.best = max(self.best, found[5])

    def open_cells(self, level: float) -> NDArray[np.int_]:
        """Cells above a level that can be cut, the highest first."""
        wide = np.any(self.upper > self.lower, axis=0) if self.lower.size else self.bound < 0.0
        candidates = np.flatnonzero((self.bound > level) & wide)
        return candidates[np.argsort(-self.bound[candidates], kind="stable")]

    def top(self, level: float) -> float:
        """Bound of the highest cell that can be cut; -inf where all are at or below a level."""
        chosen = self.open_cells(level)
        return float(self.bound[chosen[0]]) if chosen.size else -math.inf

    def _judged(
        self, lower: Array, upper: Array, side: Array
    ) -> tuple[Array, Array, Array, Array, NDArray[np.int_], float]:
        """Bound cells, after collapsing them; returns what the pool keeps of them."""
        bound = np.full(side.size, np.inf)
        best = -math.inf
        for turn in range(_PASSES):
            wide, thin, slope, rows = self._values(lower, upper, side)
            reach = 0.5 * (upper - lower)
            steep = np.maximum(np.abs(slope.lower), np.abs(slope.upper))
            with np.errstate(all="ignore"):
                smear = np.where(reach > 0.0, steep * reach, 0.0)
                centred = thin.upper + smear.sum(axis=0)
                bound = np.fmin(bound, np.fmin(wide.upper, centred))
            best = max(best, self._note(rows, lower, upper, side, thin, slope))
            if turn + 1 == _PASSES:
                break
            rising, falling = (slope.lower >= 0.0) & (reach > 0.0), (slope.upper <= 0.0)
            falling &= (reach > 0.0) & ~rising
            if not (rising.any() or falling.any()):
                break
            lower, upper = np.where(rising, upper, lower), np.where(falling, lower, upper)
        bound = np.where(np.isnan(bound), np.inf, bound)
        # A slope that is not bounded says nothing: the widest coordinate relative to its box.
        with np.errstate(all="ignore"):
            excess = np.where(reach > 0.0, (slope.upper - slope.lower) * reach, 0.0)
        finite = np.where(np.isfinite(excess), excess, 1e300)
        axis = (
            np.argmax(np.where(upper > lower, finite + 1e-300, -1.0), axis=0)
            if (lower.shape[0])
            else np.zeros(side.size, dtype=int)
        )
        return lower, upper, side, bound, axis, best

    def _values(
        self, lower: Array, upper: Array, side: Array
    ) -> tuple[Interval, Interval, Interval, Array]:
        count = lower.shape[1]
        rows = self._table.rows(lower[: self._axes], upper[: self._axes])
        middle = lower + 0.5 * (upper - lower)
        at = Field(Interval(side, side), None)
        quantities = rows.middle.lower.shape[0]
        empty = np.zeros((quantities + lower.shape[0] - self._axes, count))

        def own(j: int, low: Array, high: Array) -> Field:
            slope = empty.copy()
            slope[j] = 1.0
            return Field(Interval(low, high), Interval(slope, slope))

        with np.errstate(all="ignore"):
            over = [own(q, *ends) for q, ends in enumerate(zip(*rows.value, strict=True))]
            there = [Field(Interval(*ends), None) for ends in zip(*rows.middle, strict=True)]
            free = [
                own(quantities + j, *ends)
                for j, ends in enumerate(zip(lower[self._axes :], upper[self._axes :], strict=True))
            ]
            still = [Field(Interval(m, m), None) for m in middle[self._axes :]]
            found = self._objective(_center(over), free, at)
            center = self._objective(_center(there), still, at)
            slope = Interval(empty, empty) if found.slope is None else found.slope
            # By the chain rule: first what r and dr do, then how they move with time and start.
            along = product(
                Interval(slope.lower[:quantities, None], slope.upper[:quantities, None]),
                rows.slope,
            )
            whole = Interval(
                *(
                    np.vstack((part.sum(axis=0), own_part[quantities:]))
                    for part, own_part in zip(along, slope, strict=True)
                )
            )
        spread = (np.broadcast_to(end, (count,)) for end in found.value)
        narrow = (np.broadcast_to(end, (count,)) for end in center.value)
        middles = 0.5 * (rows.middle.lower + rows.middle.upper)
        return Interval(*spread), Interval(*narrow), whole, middles

    def _note(
        self,
        middles: Array,
        lower: Array,
        upper: Array,
        side: Array,
        thin: Interval,
        slope: Interval,
    ) -> float:
        """Remember the middles, and the corners that the slopes point to, as points."""
        at = lower + 0.5 * (upper - lower)
        free = at[self._axes :]
        self._keep(middles, free, side, thin.lower)
        with np.errstate(all="ignore"):
            lean = np.sign(np.nan_to_num(slope.lower + slope.upper))[self._axes :]
        corner = np.clip(
            free + lean * 0.5 * (upper - lower)[self._axes :],
            lower[self._axes :],
            upper[self._axes :],
        )
        fields = [Field(Interval(row, row), None) for row in middles]
        ends = [Field(Interval(row, row), None) for row in corner]
        with np.errstate(all="ignore"):
            found = self._objective(_center(fields), ends, Field(Interval(side, side), None))
        value = np.broadcast_to(found.value.lower, side.shape)
        self._keep(middles, corner, side, value)
        # The corner's center is a number near the middle's enclosure, not a rounded-up one.
        return float(np.nanmax(np.concatenate((thin.lower, value, [-np.inf]))))

    def _keep(self, center: Array, free: Array, side: Array, value: Array) -> None:
        known = np.flatnonzero(np.isfinite(value))
        if known.size:
            top = known[np.argsort(-value[known], kind="stable")[:_KEPT]]
            self.seen.append((center[:, top], free[:, top], side[top], value[top]))


def _center(quantities: list[Field]) -> Center[Field]:
    count = (len(quantities) - 1) // 2 + 1
    return Center(r=quantities[:count], rates=quantities[count:])
