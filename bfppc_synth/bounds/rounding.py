"""Rationals rounded outward to binary64."""

from __future__ import annotations

import math
from fractions import Fraction


def above(value: Fraction) -> float:
    """Smallest binary64 that is not below a rational."""
    near = float(value)
    return near if Fraction(near) >= value else math.nextafter(near, math.inf)


def below(value: Fraction) -> float:
    """Largest binary64 that is not above a rational."""
    # Adding 0.0 turns -0.0 into 0.0, which reports would print with its sign.
    return -above(-value) + 0.0
