"""Intervals in numpy arrays, rounded outward: one entry per cell of a search.

Every operation widens its result by one unit in the last place of each end, a library function
by 2**-50 of its value, which is several units. The proof is the separate checker's; this is
what makes the search agree with it.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.expressions.flatten import Relation

Array: TypeAlias = NDArray[np.float64]

# What a library function may be off by, relative to its value.
_LOOSE = 2.0**-50
# One to two units in the last place of a normal number; _TINY stands for the others.
_UNIT = 2.0**-52
_TINY = 1e-300
# Beyond this argument a phase is not looked at: every sine lies in [-1, 1].
_LARGEST_PHASE = 1e6
_PHASE_SLACK = 1e-9


class Interval(NamedTuple):
    """Lower and upper ends, arrays of equal or broadcastable shape."""

    lower: Array
    upper: Array

    def magnitude(self) -> Array:
        """Largest absolute value of each entry."""
        return np.maximum(np.abs(self.lower), np.abs(self.upper))


def interval(lower: Array | float, upper: Array | float) -> Interval:
    """Return the interval between two given ends."""
    return Interval(np.asarray(lower, dtype=float), np.asarray(upper, dtype=float))


def intersected(a: Interval, b: Interval) -> Interval:
    """Return what two enclosures of the same numbers have in common."""
    return Interval(np.maximum(a.lower, b.lower), np.minimum(a.upper, b.upper))


def _outward(lower: Array, upper: Array) -> Interval:
    # At least one unit in the last place, so the rounding of this very step is covered too;
    # nextafter says the same and takes ten times as long.
    return Interval(
        lower - (np.abs(lower) * _UNIT + _TINY), upper + (np.abs(upper) * _UNIT + _TINY)
    )


def _loose(lower: Array, upper: Array) -> Interval:
    return Interval(
        lower - (np.abs(lower) * _LOOSE + _TINY), upper + (np.abs(upper) * _LOOSE + _TINY)
    )


def _wave(a: Interval, wave: Callable[[Array], Array], top: float) -> Interval:
    """Range of a sine or cosine whose upper peaks are at top + 2 k pi."""
    first, last = wave(a.lower), wave(a.upper)
    found = _loose(np.minimum(first, last), np.maximum(first, last))
    turn = 2.0 * math.pi
    large = (a.upper - a.lower >= turn) | (
        np.maximum(np.abs(a.lower), np.abs(a.upper)) > _LARGEST_PHASE
    )

    def reached(peak: float) -> NDArray[np.bool_]:
        # A peak counts as inside when it lies this little outside: the safe side.
        next_peak = peak + turn * np.ceil((a.lower - _PHASE_SLACK - peak) / turn)
        result: NDArray[np.bool_] = large | (next_peak <= a.upper + _PHASE_SLACK)
        return result

    lower = np.where(reached(top + math.pi), -1.0, np.maximum(found.lower, -1.0))
    return Interval(lower, np.where(reached(top), 1.0, np.minimum(found.upper, 1.0)))


@lru_cache(maxsize=1024)
def _number(value: sp.Expr) -> Interval:
    near = float(evaluate(value, {}, FLOAT_FUNCTIONS))
    at = np.array(near)
    # A Rational that binary64 holds is itself; anything else lies within a few units.
    exact = isinstance(value, sp.Rational) and sp.Rational(near) == value
    return Interval(at, at) if exact else _loose(at, at)


class IntervalFunctions:
    """``expressions.evaluate.Functions`` of interval arrays."""

    def number(self, value: sp.Expr) -> Interval:
        """Enclose a constant."""
        return _number(value)

    def add(self, a: Interval, b: Interval) -> Interval:
        """Return a + b."""
        return _outward(a.lower + b.lower, a.upper + b.upper)

    def sub(self, a: Interval, b: Interval) -> Interval:
        """Return a - b."""
        return _outward(a.lower - b.upper, a.upper - b.lower)

    def neg(self, a: Interval) -> Interval:
        """Return -a."""
        return Interval(-a.upper, -a.lower)

    def mul(self, a: Interval, b: Interval) -> Interval:
        """Return a * b."""
        corners = (a.lower * b.lower, a.lower * b.upper, a.upper * b.lower, a.upper * b.upper)
        lower = np.minimum(np.minimum(corners[0], corners[1]), np.minimum(corners[2], corners[3]))
        upper = np.maximum(np.maximum(corners[0], corners[1]), np.maximum(corners[2], corners[3]))
        return _outward(lower, upper)

    def div(self, a: Interval, b: Interval) -> Interval:
        """Return a / b, where b has no 0."""
        if np.any((b.lower <= 0.0) & (b.upper >= 0.0)):
            raise _no_value("a denominator may be 0 along the center")
        return self.mul(a, _outward(1.0 / b.upper, 1.0 / b.lower))

    def power(self, a: Interval, exponent: int) -> Interval:
        """Return a**exponent for an integer exponent >= 1."""
        if exponent == 1:
            return a
        if exponent % 2:
            lower, upper = a
            return _loose(lower**exponent, upper**exponent)
        least = np.maximum(np.maximum(a.lower, -a.upper), 0.0)
        found = _loose(least**exponent, a.magnitude() ** exponent)
        return Interval(np.maximum(found.lower, 0.0), found.upper)

    def sqrt(self, a: Interval) -> Interval:
        """Return the square root."""
        self._positive(a, "what stands under a root")
        return _loose(np.sqrt(a.lower), np.sqrt(a.upper))

    def root_power(self, a: Interval, p: int, q: int) -> Interval:
        """Return a**(p/q) of an a > 0."""
        self._positive(a, "what stands under a root")
        return _loose(a.lower ** (p / q), a.upper ** (p / q))

    def exp(self, a: Interval) -> Interval:
        """Return e**a."""
        return _loose(np.exp(a.lower), np.exp(a.upper))

    def log(self, a: Interval) -> Interval:
        """Return the natural logarithm."""
        self._positive(a, "the argument of a logarithm")
        return _loose(np.log(a.lower), np.log(a.upper))

    def sin(self, a: Interval) -> Interval:
        """Return the sine."""
        return _wave(a, np.sin, 0.5 * math.pi)

    def cos(self, a: Interval) -> Interval:
        """Return the cosine."""
        return _wave(a, np.cos, 0.0)

    def tan(self, a: Interval) -> Interval:
        """Return the tangent inside one branch."""
        if np.any(a.upper - a.lower >= math.pi):
            raise _no_value("a tangent may reach its pole along the center")
        cosine = self.cos(a)
        if np.any((cosine.lower <= 0.0) & (cosine.upper >= 0.0)):
            raise _no_value("a tangent may reach its pole along the center")
        return _loose(np.tan(a.lower), np.tan(a.upper))

    def sinh(self, a: Interval) -> Interval:
        """Return the hyperbolic sine."""
        return _loose(np.sinh(a.lower), np.sinh(a.upper))

    def cosh(self, a: Interval) -> Interval:
        """Return the hyperbolic cosine."""
        least = np.maximum(np.maximum(a.lower, -a.upper), 0.0)
        return _loose(np.cosh(least), np.cosh(a.magnitude()))

    def tanh(self, a: Interval) -> Interval:
        """Return the hyperbolic tangent."""
        return _loose(np.tanh(a.lower), np.tanh(a.upper))

    def atan(self, a: Interval) -> Interval:
        """Return the arc tangent."""
        return _loose(np.arctan(a.lower), np.arctan(a.upper))

    def asinh(self, a: Interval) -> Interval:
        """Return the inverse hyperbolic sine."""
        return _loose(np.arcsinh(a.lower), np.arcsinh(a.upper))

    def absolute(self, a: Interval) -> Interval:
        """Return the absolute value."""
        least = np.maximum(np.maximum(a.lower, -a.upper), 0.0)
        return Interval(least, a.magnitude())

    def sign(self, a: Interval) -> Interval:
        """Return the sign, [-1, 1] where it is not known."""
        lower = np.where(a.lower > 0.0, 1.0, np.where(a.lower == 0.0, 0.0, -1.0))
        return Interval(lower, np.where(a.upper < 0.0, -1.0, np.where(a.upper == 0.0, 0.0, 1.0)))

    def minimum(self, a: Interval, b: Interval) -> Interval:
        """Return the smaller one."""
        return Interval(np.minimum(a.lower, b.lower), np.minimum(a.upper, b.upper))

    def maximum(self, a: Interval, b: Interval) -> Interval:
        """Return the larger one."""
        return Interval(np.maximum(a.lower, b.lower), np.maximum(a.upper, b.upper))

    def select(
        self,
        relation: Relation,
        left: Interval,
        right: Interval,
        then: Interval,
        otherwise: Interval,
    ) -> Interval:
        """Return the hull of both branches."""
        del relation, left, right
        lower = np.minimum(then.lower, otherwise.lower)
        return Interval(lower, np.maximum(then.upper, otherwise.upper))

    def _positive(self, a: Interval, what: str) -> None:
        if np.any(a.lower <= 0.0):
            raise _no_value(f"{what} may be 0 or below along the center")


def _no_value(what: str) -> EnvelopeError:
    return EnvelopeError(
        what,
        subexpression="",
        fix="narrow initial or the reference, choose another transition, or center performance",
    )
