"""Enclosures over many cells at once, with slopes by every coordinate, for the tight bounds.

Plain binary64, not rounded outward: what is found here is a claim, widened by more than any
rounding, and the separate checker proves it with its own arithmetic (docs/theory.md section 6).
A cell where a subexpression has no value gets NaN there, which later counts as unbounded.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bfppc_synth.bounds.interval_arrays import Array, Interval
from bfppc_synth.bounds.tight.ranges import (
    Chosen,
    either,
    folded,
    hull,
    nearest_to_zero,
    plus,
    product,
    rising,
    side,
    wave,
)
from bfppc_synth.expressions.evaluate import nearest_float

if TYPE_CHECKING:
    from collections.abc import Callable

    import sympy as sp

    from bfppc_synth.expressions.flatten import Relation


class Field(NamedTuple):
    """Values over ``m`` cells, and slopes (one row per coordinate) or None for a constant."""

    value: Interval
    slope: Interval | None


class FieldFunctions:
    """``expressions.evaluate.Functions`` of fields."""

    def number(self, value: sp.Expr) -> Field:
        """Return a constant."""
        at = np.array(nearest_float(value))
        return Field(Interval(at, at), None)

    def add(self, a: Field, b: Field) -> Field:
        """Return a + b."""
        slope = a.slope if b.slope is None else b.slope
        if a.slope is not None and b.slope is not None:
            slope = plus(a.slope, b.slope)
        return Field(plus(a.value, b.value), slope)

    def sub(self, a: Field, b: Field) -> Field:
        """Return a - b."""
        return self.add(a, self.neg(b))

    def neg(self, a: Field) -> Field:
        """Return -a."""
        slope = None if a.slope is None else Interval(-a.slope.upper, -a.slope.lower)
        return Field(Interval(-a.value.upper, -a.value.lower), slope)

    def mul(self, a: Field, b: Field) -> Field:
        """Return a * b."""
        left = None if a.slope is None else product(a.slope, b.value)
        right = None if b.slope is None else product(b.slope, a.value)
        slope = left if right is None else right
        if left is not None and right is not None:
            slope = plus(left, right)
        return Field(product(a.value, b.value), slope)

    def div(self, a: Field, b: Field) -> Field:
        """Return a / b; NaN where b may be 0."""
        held = (b.value.lower <= 0.0) & (b.value.upper >= 0.0)
        below = Interval(
            np.where(held, np.nan, 1.0 / b.value.upper), np.where(held, np.nan, 1.0 / b.value.lower)
        )
        value = product(a.value, below)
        slope = a.slope
        if b.slope is not None:
            carried = product(b.slope, value)
            away = Interval(-carried.upper, -carried.lower)
            slope = away if slope is None else plus(slope, away)
        return Field(value, None if slope is None else product(slope, below))

    def power(self, a: Field, exponent: int) -> Field:
        """Return a**exponent for an integer exponent >= 2."""

        def raised(power: int) -> Interval:
            grows = rising if power % 2 else folded
            return grows(a.value, lambda x: x**power)

        rate = raised(exponent - 1)
        slope = Interval(exponent * rate.lower, exponent * rate.upper)
        return _chained(a, raised(exponent), lambda: slope)

    def sqrt(self, a: Field) -> Field:
        """Return the root; its slope is not bounded at 0."""
        value = rising(a.value, np.sqrt)
        return _chained(a, value, lambda: Interval(0.5 / value.upper, 0.5 / value.lower))

    def root_power(self, a: Field, p: int, q: int) -> Field:
        """Return a**(p/q), odd roots of negative numbers as docs/theory.md section 1 has them."""
        share = p / q

        def odd(x: Array) -> Array:
            return np.sign(x) * np.abs(x) ** share

        def even(x: Array) -> Array:
            return x**share

        if q % 2 == 0:
            value = rising(a.value, even)
        elif p % 2:
            value = rising(a.value, odd)
        else:
            value = folded(a.value, even)

        def slope() -> Interval:
            near, far = nearest_to_zero(a.value), a.value.magnitude()
            ends = share * near ** (share - 1.0), share * far ** (share - 1.0)
            size = Interval(np.minimum(*ends), np.maximum(*ends))
            if p % 2:
                return size
            # An even numerator falls on the left of 0.
            return product(size, side(a.value))

        return _chained(a, value, slope)

    def exp(self, a: Field) -> Field:
        """Return e**a."""
        value = rising(a.value, np.exp)
        return _chained(a, value, lambda: value)

    def log(self, a: Field) -> Field:
        """Return the natural logarithm."""
        value = rising(a.value, np.log)
        return _chained(a, value, lambda: Interval(1.0 / a.value.upper, 1.0 / a.value.lower))

    def sin(self, a: Field) -> Field:
        """Return the sine."""
        value = wave(a.value, np.sin, 0.5 * math.pi)
        return _chained(a, value, lambda: wave(a.value, np.cos, 0.0))

    def cos(self, a: Field) -> Field:
        """Return the cosine."""
        value = wave(a.value, np.cos, 0.0)
        return _chained(a, value, lambda: wave(a.value, lambda x: -np.sin(x), -0.5 * math.pi))

    def tan(self, a: Field) -> Field:
        """Return the tangent inside one branch, NaN elsewhere."""
        cosine = wave(a.value, np.cos, 0.0)
        pole = (cosine.lower <= 0.0) & (cosine.upper >= 0.0)
        held = rising(a.value, np.tan)
        value = Interval(np.where(pole, np.nan, held.lower), np.where(pole, np.nan, held.upper))
        square = folded(value, np.square)
        return _chained(a, value, lambda: Interval(1.0 + square.lower, 1.0 + square.upper))

    def sinh(self, a: Field) -> Field:
        """Return the hyperbolic sine."""
        return _chained(a, rising(a.value, np.sinh), lambda: folded(a.value, np.cosh))

    def cosh(self, a: Field) -> Field:
        """Return the hyperbolic cosine."""
        return _chained(a, folded(a.value, np.cosh), lambda: rising(a.value, np.sinh))

    def tanh(self, a: Field) -> Field:
        """Return the hyperbolic tangent."""
        value = rising(a.value, np.tanh)

        def slope() -> Interval:
            square = folded(value, np.square)
            return Interval(1.0 - square.upper, 1.0 - square.lower)

        return _chained(a, value, slope)

    def atan(self, a: Field) -> Field:
        """Return the arc tangent."""
        square = folded(a.value, np.square)
        rate = Interval(1.0 / (1.0 + square.upper), 1.0 / (1.0 + square.lower))
        return _chained(a, rising(a.value, np.arctan), lambda: rate)

    def asinh(self, a: Field) -> Field:
        """Return the inverse hyperbolic sine."""
        square = folded(a.value, np.square)
        rate = Interval((1.0 + square.upper) ** -0.5, (1.0 + square.lower) ** -0.5)
        return _chained(a, rising(a.value, np.arcsinh), lambda: rate)

    def absolute(self, a: Field) -> Field:
        """Return |a|; at the kink its slope is anything between both sides."""
        lower, upper = a.value
        # Up to the kink itself it is one of its two branches.
        falls = (upper <= 0.0) & (lower < 0.0)
        slope = Interval(np.where(lower >= 0.0, 1.0, -1.0), np.where(falls, -1.0, 1.0))
        return _chained(a, folded(a.value, np.abs), lambda: slope)

    def sign(self, a: Field) -> Field:
        """Return the sign; across its jump the slope is not bounded."""
        value = side(a.value)
        still = (a.value.lower > 0.0) | (a.value.upper < 0.0)
        steep = np.where(still, 0.0, np.inf)
        return _chained(a, value, lambda: Interval(-steep, steep))

    def minimum(self, a: Field, b: Field) -> Field:
        """Return the smaller one."""
        return self.neg(self.maximum(self.neg(a), self.neg(b)))

    def maximum(self, a: Field, b: Field) -> Field:
        """Return the larger one; where either may be it, the slope is either's."""
        value = Interval(
            np.maximum(a.value.lower, b.value.lower), np.maximum(a.value.upper, b.value.upper)
        )
        return Field(value, self._chosen(a, b, a.value.lower >= b.value.upper, b, a))

    def select(
        self, relation: Relation, left: Field, right: Field, then: Field, otherwise: Field
    ) -> Field:
        """Return the hull of both branches where neither is sure; no slope there: it may jump."""
        del relation
        yes = left.value.upper < right.value.lower
        no = left.value.lower > right.value.upper
        value = either(
            yes, then.value, either(no, otherwise.value, hull(then.value, otherwise.value))
        )
        slope = self._chosen(then, otherwise, yes, left, right)
        if slope is None:
            return Field(value, None)
        open_cells = ~(yes | no)
        return Field(
            value,
            Interval(
                np.where(open_cells, -np.inf, slope.lower),
                np.where(open_cells, np.inf, slope.upper),
            ),
        )

    def _chosen(
        self, a: Field, b: Field, first: Chosen, left: Field, right: Field
    ) -> Interval | None:
        """Slope of a where ``first``, of b where left > right surely, of either elsewhere."""
        if a.slope is None and b.slope is None:
            return None
        zero = np.zeros(1)
        one = Interval(zero, zero) if a.slope is None else a.slope
        two = Interval(zero, zero) if b.slope is None else b.slope
        second = left.value.lower > right.value.upper
        return either(first, one, either(second, two, hull(one, two)))


def _chained(a: Field, value: Interval, slope: Callable[[], Interval]) -> Field:
    return Field(value, None if a.slope is None else product(slope(), a.slope))
