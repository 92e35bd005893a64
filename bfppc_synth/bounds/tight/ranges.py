"""Interval arithmetic of numpy arrays without rounding, for the search of the tight bounds.

A cell without a value has NaN ends; comparisons with these are false.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from bfppc_synth.bounds.interval_arrays import Array, Interval

if TYPE_CHECKING:
    from collections.abc import Callable

Chosen: TypeAlias = NDArray[np.bool_]

_TURN = 2.0 * math.pi
_SLACK = 1e-9


def product(a: Interval, b: Interval) -> Interval:
    """Return a * b; shapes broadcast."""
    one, two = a.lower * b.lower, a.lower * b.upper
    three, four = a.upper * b.lower, a.upper * b.upper
    return Interval(
        np.minimum(np.minimum(one, two), np.minimum(three, four)),
        np.maximum(np.maximum(one, two), np.maximum(three, four)),
    )


def plus(a: Interval, b: Interval) -> Interval:
    """Return a + b."""
    return Interval(a.lower + b.lower, a.upper + b.upper)


def hull(a: Interval, b: Interval) -> Interval:
    """Return the hull of both."""
    return Interval(np.minimum(a.lower, b.lower), np.maximum(a.upper, b.upper))


def nearest_to_zero(a: Interval) -> Array:
    """Return the least magnitude."""
    return np.maximum(np.maximum(a.lower, -a.upper), 0.0)


def either(chosen: Chosen, a: Interval, b: Interval) -> Interval:
    """Take a where ``chosen``, b elsewhere."""
    return Interval(np.where(chosen, a.lower, b.lower), np.where(chosen, a.upper, b.upper))


def rising(a: Interval, function: Callable[[Array], Array]) -> Interval:
    """Return the range of a function that grows."""
    return Interval(function(a.lower), function(a.upper))


def folded(a: Interval, function: Callable[[Array], Array]) -> Interval:
    """Return the range of a function of |x| that grows with it."""
    return Interval(function(nearest_to_zero(a)), function(a.magnitude()))


def wave(a: Interval, function: Callable[[Array], Array], top: float) -> Interval:
    """Return the range of a sine or cosine whose upper peaks are at top + 2 k pi."""
    first, last = function(a.lower), function(a.upper)

    def reached(peak: float) -> Chosen:
        following = peak + _TURN * np.ceil((a.lower - _SLACK - peak) / _TURN)
        found: Chosen = following <= a.upper + _SLACK
        return found

    return Interval(
        np.where(reached(top + math.pi), -1.0, np.minimum(first, last)),
        np.where(reached(top), 1.0, np.maximum(first, last)),
    )


def side(a: Interval) -> Interval:
    """Return the range of the sign, all of [-1, 1] where 0 is among the values."""
    return Interval(np.where(a.lower > 0.0, 1.0, -1.0), np.where(a.upper < 0.0, -1.0, 1.0))
