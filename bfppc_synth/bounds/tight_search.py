"""Best-first branch and bound for the tight bounds: suprema, and the points that come close.

docs/theory.md section 9. The natural enclosure of a cell is intersected with the mean value
form around its middle; along coordinates whose slope has one sign a cell is collapsed to the
end that is worst.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bfppc_synth.bounds.interval_arrays import Array, Interval
from bfppc_synth.bounds.tight_fields import Field, product
from bfppc_synth.bounds.tight_residual import Center

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bfppc_synth.bounds.tight_center import CenterTable

# What rounding may amount to, relative to the terms of a residual.
_ROUNDING = 1e-9
_LEAST_BATCH, _MOST_BATCH = 16, 128
_PASSES = 2
_WAITING = 0.2
# Points this much below the largest are no worst points.
_POOR = 0.3
_APART = 0.2


class Objective(Protocol):
    """What is maximized: a function of center, errors, parameters and the side s."""

    def __call__(self, center: Center[Field], free: list[Field], side: Field) -> Field:
        """Return the value; ``free`` are the coordinates behind those of the center."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Peak:
    """A point that comes close to a supremum.

    ``r`` are r_1..r_n and v, ``rates`` dr_1..dr_n there; ``free`` the errors and parameters in
    the order of the search; ``side`` is s.
    """

    value: float
    side: float
    r: tuple[float, ...]
    rates: tuple[float, ...]
    free: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Extremum:
    """sup in [lower, upper]; ``cuts`` cells were cut for that."""

    lower: float
    upper: float
    peaks: tuple[Peak, ...]
    cuts: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How far a supremum is searched: relative gap, and cells that may be cut."""

    gap: float = 1e-3
    cuts: int = 300
    peaks: int = 6


class _Pool:
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
            top = known[np.argsort(-value[known], kind="stable")[:32]]
            self.seen.append((center[:, top], free[:, top], side[top], value[top]))


def _center(quantities: list[Field]) -> Center[Field]:
    count = (len(quantities) - 1) // 2 + 1
    return Center(r=quantities[:count], rates=quantities[count:])


def maximize(
    tables: tuple[CenterTable, ...],
    box: tuple[Array, Array],
    objective: Objective,
    *,
    offset: float,
    effort: Effort,
) -> Extremum:
    """Bound a supremum over all spans, both sides and a box of free coordinates.

    Parameters
    ----------
    tables : tuple[CenterTable, ...]
        The center, span by span.
    box : tuple
        Lower and upper ends of errors and parameters, shape (coordinates,).
    objective : Objective
        What is maximized.
    offset : float
        What stands beside the supremum: the gap is relative to the sum of both.
    effort : Effort
        When to stop.

    Returns
    -------
    Extremum
        ``upper`` holds, up to what the checker finds of it; ``lower`` is the value of a point.

    References
    ----------
    docs/theory.md section 9.
    """
    pools = [_Pool(table, box, objective) for table in tables]
    lower = max(pool.best for pool in pools)
    cuts = 0
    while cuts < effort.cuts:
        level = lower + effort.gap * max(abs(lower), offset)
        tops = [pool.top(level) for pool in pools]
        highest = max(tops)
        if highest == -math.inf:
            break
        for pool, top in zip(pools, tops, strict=True):
            # Spans whose highest cell is well below another's wait.
            if top < highest - _WAITING * (highest - lower) or cuts >= effort.cuts:
                continue
            chosen = pool.open_cells(level)
            batch = max(_LEAST_BATCH, min(_MOST_BATCH, chosen.size // 2))
            chosen = chosen[: min(batch, effort.cuts - cuts)]
            pool.cut(chosen)
            cuts += chosen.size
            lower = max(lower, pool.best)
    closed = max(float(np.max(pool.bound)) for pool in pools)
    upper = closed + _ROUNDING * (abs(closed) + offset)
    return Extremum(
        lower=lower, upper=max(upper, lower), peaks=_peaks(pools, box, lower, effort), cuts=cuts
    )


def _peaks(
    pools: list[_Pool], box: tuple[Array, Array], best: float, effort: Effort
) -> tuple[Peak, ...]:
    """Choose the highest points, each some way apart from those that are higher."""
    entries: list[tuple[float, Array, Array, float]] = []
    for pool in pools:
        for centers, frees, sides, values in pool.seen:
            entries += [
                (float(values[j]), centers[:, j], frees[:, j], float(sides[j]))
                for j in range(values.size)
                if values[j] >= best - _POOR * abs(best)
            ]
    entries.sort(key=lambda entry: -entry[0])
    width = np.where(box[1] > box[0], box[1] - box[0], 1.0)
    scale = None
    found: list[Peak] = []
    kept: list[tuple[Array, float]] = []
    for value, center, free, side in entries:
        if len(found) == effort.peaks:
            break
        scale = np.abs(center) + 1e-9 if scale is None else scale
        place = np.concatenate((free / width, 0.5 * center / scale))
        if any(s == side and np.max(np.abs(place - p)) < _APART for p, s in kept):
            continue
        kept.append((place, side))
        order = (center.size - 1) // 2
        found.append(
            Peak(
                value=value,
                side=side,
                r=tuple(map(float, center[: order + 1])),
                rates=tuple(map(float, center[order + 1 :])),
                free=tuple(map(float, free)),
            )
        )
    return tuple(found)
