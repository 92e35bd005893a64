"""How little a requirement must be relaxed: a bracket, then a secant in the log of its factor."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.reasons.requirement import Requirement

# The bracket's ratio at which it is narrow enough, and the evaluations that this may take.
_NARROW = math.log(1.015)
_EVALUATIONS = 9
# Aimed at: a little inside, so that the last point is one that holds.
_INSIDE = 0.004
# The least share of the bracket that a step leaves on either side.
_SAFE = 0.08


def least_relaxation(
    requirement: Requirement, miss: Callable[[float], float], given: float
) -> float | None:
    """Find the factor nearest to 1 with which nothing is missing any more.

    Parameters
    ----------
    requirement : Requirement
        Its factors and its extreme.
    miss : callable
        Of a factor: by how much (a log) the nearest design misses; infinity where it is not
        known, at most 0 where nothing is missing. It should fall as the factor leaves 1.
    given : float
        The miss of the factor 1.

    Returns
    -------
    float or None
        None where no factor that was tried suffices.
    """
    extreme = requirement.extreme
    if extreme is not None and miss(extreme) > 0.0:
        return None
    bad, bad_miss = 1.0, given
    for factor in requirement.factors:
        found = miss(factor)
        if found <= 0.0:
            return _narrowed(miss, (bad, bad_miss), (factor, found))
        bad, bad_miss = factor, found
    return extreme


def _narrowed(
    miss: Callable[[float], float], bad: tuple[float, float], good: tuple[float, float]
) -> float:
    """Narrow a bracket; the side that holds is returned."""
    low, high = math.log(bad[0]), math.log(good[0])
    low_miss, high_miss = bad[1], good[1]
    side = 0
    for _ in range(_EVALUATIONS):
        width = high - low
        if abs(width) <= _NARROW:
            break
        share = 0.5
        if math.isfinite(low_miss) and math.isfinite(high_miss) and low_miss > high_miss:
            share = (low_miss + _INSIDE) / (low_miss - high_miss)
            share = min(max(share, _SAFE), 1.0 - _SAFE)
        middle = low + share * width
        found = miss(math.exp(middle))
        # An end that stays twice counts half, or a secant would never move it.
        if found <= 0.0:
            high, high_miss = middle, found
            low_miss *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            low, low_miss = middle, found
            high_miss *= 0.5 if side < 0 else 1.0
            side = -1
    return math.exp(high)
