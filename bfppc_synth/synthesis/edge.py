"""A monotone question on one number: how far it goes, and where it is worth the most.

Positions are logs in the direction that is wanted: larger is better and harder.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

#: Bracket that ends the search [log], and where designs end without a limit: nobody wants to be
#: that near to where nothing holds.
RESOLVED = 4e-4
COARSE = 4e-3
_STEP = math.log(2.0)
_LONGEST_STEP = math.log(64.0)
_MOST = 60
# What a position may be away from the cheapest [log].
_WORTH = 0.008
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Edge:
    """The last position that was seen to hold; ``bound`` if the limit ends it, not a breakdown."""

    position: float
    bound: bool


def furthest(excess: Callable[[float], float], start: float, *, end: float = math.inf) -> Edge:
    """Find how far an excess stays at or below 0.

    Parameters
    ----------
    excess : Callable[[float], float]
        Nondecreasing; at or below 0 where the position holds, infinite where nothing is known.
    start : float
        A position that holds.
    end : float
        Not searched beyond.

    Returns
    -------
    Edge
        Within ``RESOLVED`` of the first position that does not hold (``COARSE`` where nothing is
        known of it); ``end`` where all hold.
    """
    low, at_low = start, excess(start)
    step = _STEP
    high, at_high = low, at_low
    for _ in range(_MOST):
        high = min(low + step, end)
        if high <= low:
            return Edge(position=low, bound=True)
        at_high = excess(high)
        if at_high > 0.0:
            break
        slope = (at_high - at_low) / (high - low)
        low, at_low = high, at_high
        # Where the excess grows evenly it says itself how far there is to go.
        ahead = -at_low / slope if slope > 0.0 and math.isfinite(at_low) else 2.0 * step
        step = min(max(1.1 * ahead, _STEP / 8), 2.0 * step, _LONGEST_STEP)
    else:
        return Edge(position=low, bound=False)
    return _between(excess, low, at_low, high, at_high)


def _between(
    excess: Callable[[float], float], low: float, at_low: float, high: float, at_high: float
) -> Edge:
    """Close a bracket by false position, kept off its ends; by halves where an end is infinite."""
    halve = False
    while high - low > (RESOLVED if math.isfinite(at_high) else COARSE):
        width = high - low
        middle = low + 0.5 * width
        if not halve and math.isfinite(at_low) and math.isfinite(at_high):
            guess = low - at_low * width / (at_high - at_low)
            # Just beyond the guess on the shorter side: the other end then moves for good.
            near = 0.5 * RESOLVED if guess - low < high - guess else -0.5 * RESOLVED
            margin = 0.45 * min(RESOLVED, width)
            middle = min(max(guess + near, low + margin), high - margin)
        found = excess(middle)
        if found > 0.0:
            high, at_high = middle, found
        else:
            low, at_low = middle, found
        halve = high - low > 0.5 * width
    return Edge(position=low, bound=math.isfinite(at_high))


def cheapest(
    cost: Callable[[float], float], start: float, *, end: float = math.inf, first: float = _STEP
) -> float:
    """Find the least value of a unimodal cost, from a position where it is finite.

    Parameters
    ----------
    cost : Callable[[float], float]
        Infinite where the position does not hold.
    start : float
        A position that holds.
    end : float
        Not searched beyond.
    first : float
        The first step to either side.

    Returns
    -------
    float
        The best position seen, within a percent of the least one.
    """
    seen = {start: cost(start)}

    def value(position: float) -> float:
        if position not in seen:
            seen[position] = cost(position)
        return seen[position]

    middle = start
    for direction in (1.0, -1.0):
        step = first
        for _ in range(_MOST):
            ahead = min(middle + direction * step, end)
            if ahead == middle or value(ahead) >= value(middle):
                break
            middle, step = ahead, min(2.0 * step, _LONGEST_STEP)
        if middle != start:
            break
    known = sorted(seen)
    place = known.index(middle)
    low = known[place - 1] if place > 0 else middle - first
    high = known[place + 1] if place + 1 < len(known) else min(middle + first, end)
    while high - low > _WORTH:
        left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
        if value(left) <= value(right):
            high = right
        else:
            low = left
    return min(seen, key=lambda position: (seen[position], position))
