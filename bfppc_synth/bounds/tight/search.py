"""Best-first branch and bound for the tight bounds: suprema, and the points that come close.

docs/theory.md section 9.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.bounds.tight.pool import Objective, Pool

if TYPE_CHECKING:
    from bfppc_synth.bounds.interval_arrays import Array
    from bfppc_synth.bounds.tight.center import CenterTable

# What rounding may amount to, relative to the terms of a residual.
_ROUNDING = 1e-9
# What stands for the size of a coordinate that is 0: no unit makes it that small.
_NOWHERE = 1e-200
_LEAST_BATCH, _MOST_BATCH = 16, 128
_WAITING = 0.2
# Points this much below the largest are no worst points.
_POOR = 0.3
_APART = 0.12


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
    peaks: int = 12


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
    pools = [Pool(table, box, objective) for table in tables]
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
    pools: list[Pool], box: tuple[Array, Array], best: float, effort: Effort
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
        scale = np.maximum(np.abs(center), _NOWHERE) if scale is None else scale
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
