"""Interval arrays that carry partial derivatives: what the mean value form needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeVar

import sympy as sp

from bfppc_synth.bounds.interval_arrays import Interval, IntervalFunctions, intersected
from bfppc_synth.errors import EnvelopeError

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.expressions.flatten import Relation

T = TypeVar("T")
_BASE = IntervalFunctions()


class Dual(NamedTuple):
    """A value and its partial derivatives by the coordinates of a cell; None is 0."""

    value: Interval
    partials: tuple[Interval | None, ...]


def mean_value(wide: Dual, thin: Dual, reach: tuple[Interval, ...]) -> Interval:
    """Enclose a function over cells by its value in their middle and its partials over them.

    Parameters
    ----------
    wide : Dual
        Value and partials over the cells.
    thin : Dual
        The value at the middle of each cell.
    reach : tuple[Interval, ...]
        Range of every coordinate minus its middle.

    Returns
    -------
    Interval
        The intersection of both enclosures.

    References
    ----------
    docs/theory.md section 6; the excess shrinks with the square of a cell's width.
    """
    total = thin.value
    for partial, distance in zip(wide.partials, reach, strict=True):
        if partial is not None:
            total = _BASE.add(total, _BASE.mul(partial, distance))
    return intersected(wide.value, total)


def constant(value: Interval, count: int) -> Dual:
    """Return a number that depends on none of ``count`` coordinates."""
    return Dual(value, (None,) * count)


def coordinate(value: Interval, count: int, index: int) -> Dual:
    """Return one of ``count`` coordinates itself."""
    one = _BASE.number(sp.S.One)
    return Dual(value, tuple(one if j == index else None for j in range(count)))


class DualFunctions:
    """``expressions.evaluate.Functions`` of duals in ``count`` coordinates."""

    def __init__(self, count: int) -> None:
        self._count = count

    def number(self, value: sp.Expr) -> Dual:
        """Return a constant."""
        return constant(_BASE.number(value), self._count)

    def add(self, a: Dual, b: Dual) -> Dual:
        """Return a + b."""
        partials = tuple(
            v if u is None else u if v is None else _BASE.add(u, v)
            for u, v in zip(a.partials, b.partials, strict=True)
        )
        return Dual(_BASE.add(a.value, b.value), partials)

    def sub(self, a: Dual, b: Dual) -> Dual:
        """Return a - b."""
        partials = tuple(
            (None if v is None else _BASE.neg(v))
            if u is None
            else u
            if v is None
            else _BASE.sub(u, v)
            for u, v in zip(a.partials, b.partials, strict=True)
        )
        return Dual(_BASE.sub(a.value, b.value), partials)

    def neg(self, a: Dual) -> Dual:
        """Return -a."""
        partials = tuple(None if u is None else _BASE.neg(u) for u in a.partials)
        return Dual(_BASE.neg(a.value), partials)

    def mul(self, a: Dual, b: Dual) -> Dual:
        """Return a * b."""
        partials = []
        for u, v in zip(a.partials, b.partials, strict=True):
            left = None if u is None else _BASE.mul(u, b.value)
            right = None if v is None else _BASE.mul(v, a.value)
            joint = left if right is None else right
            if left is not None and right is not None:
                joint = _BASE.add(left, right)
            partials.append(joint)
        return Dual(_BASE.mul(a.value, b.value), tuple(partials))

    def div(self, a: Dual, b: Dual) -> Dual:
        """Return a / b; its partials are (a' - (a / b) b') / b."""
        value = _BASE.div(a.value, b.value)
        partials = []
        for u, v in zip(a.partials, b.partials, strict=True):
            rest = u
            if v is not None:
                carried = _BASE.mul(value, v)
                rest = _BASE.neg(carried) if u is None else _BASE.sub(u, carried)
            partials.append(None if rest is None else _BASE.div(rest, b.value))
        return Dual(value, tuple(partials))

    def power(self, a: Dual, exponent: int) -> Dual:
        """Return a**exponent."""
        lower = _BASE.power(a.value, exponent - 1) if exponent > 1 else _BASE.number(sp.S.One)
        slope = _BASE.mul(_BASE.number(sp.Integer(exponent)), lower)
        return self._chained(a, _BASE.power(a.value, exponent), lambda: slope)

    def sqrt(self, a: Dual) -> Dual:
        """Return the square root."""
        value = _BASE.sqrt(a.value)
        return self._chained(a, value, lambda: _BASE.div(_BASE.number(sp.S.Half), value))

    def root_power(self, a: Dual, p: int, q: int) -> Dual:
        """Return a**(p/q) of an a > 0."""
        value = _BASE.root_power(a.value, p, q)

        def slope() -> Interval:
            return _BASE.mul(_BASE.number(sp.Rational(p, q)), _BASE.div(value, a.value))

        return self._chained(a, value, slope)

    def exp(self, a: Dual) -> Dual:
        """Return e**a."""
        value = _BASE.exp(a.value)
        return self._chained(a, value, lambda: value)

    def log(self, a: Dual) -> Dual:
        """Return the natural logarithm."""
        one = _BASE.number(sp.S.One)
        return self._chained(a, _BASE.log(a.value), lambda: _BASE.div(one, a.value))

    def sin(self, a: Dual) -> Dual:
        """Return the sine."""
        return self._chained(a, _BASE.sin(a.value), lambda: _BASE.cos(a.value))

    def cos(self, a: Dual) -> Dual:
        """Return the cosine."""
        return self._chained(a, _BASE.cos(a.value), lambda: _BASE.neg(_BASE.sin(a.value)))

    def tan(self, a: Dual) -> Dual:
        """Return the tangent."""
        value = _BASE.tan(a.value)
        return self._chained(a, value, lambda: _BASE.add(_ONE, _BASE.power(value, 2)))

    def sinh(self, a: Dual) -> Dual:
        """Return the hyperbolic sine."""
        return self._chained(a, _BASE.sinh(a.value), lambda: _BASE.cosh(a.value))

    def cosh(self, a: Dual) -> Dual:
        """Return the hyperbolic cosine."""
        return self._chained(a, _BASE.cosh(a.value), lambda: _BASE.sinh(a.value))

    def tanh(self, a: Dual) -> Dual:
        """Return the hyperbolic tangent."""
        value = _BASE.tanh(a.value)
        return self._chained(a, value, lambda: _BASE.sub(_ONE, _BASE.power(value, 2)))

    def atan(self, a: Dual) -> Dual:
        """Return the arc tangent."""

        def slope() -> Interval:
            return _BASE.div(_ONE, _BASE.add(_ONE, _BASE.power(a.value, 2)))

        return self._chained(a, _BASE.atan(a.value), slope)

    def asinh(self, a: Dual) -> Dual:
        """Return the inverse hyperbolic sine."""

        def slope() -> Interval:
            return _BASE.div(_ONE, _BASE.sqrt(_BASE.add(_ONE, _BASE.power(a.value, 2))))

        return self._chained(a, _BASE.asinh(a.value), slope)

    def absolute(self, a: Dual) -> Dual:
        """Return the absolute value; at the kink its slope is anything between both sides."""
        return self._chained(a, _BASE.absolute(a.value), lambda: _BASE.sign(a.value))

    def sign(self, a: Dual) -> Dual:
        """Refuse a sign, which jumps."""
        raise _jump(a)

    def minimum(self, a: Dual, b: Dual) -> Dual:
        """Refuse a minimum: nothing along the center has one."""
        raise _jump(a, b)

    def maximum(self, a: Dual, b: Dual) -> Dual:
        """Refuse a maximum: nothing along the center has one."""
        raise _jump(a, b)

    def select(
        self, relation: Relation, left: Dual, right: Dual, then: Dual, otherwise: Dual
    ) -> Dual:
        """Refuse branches: nothing along the center has them."""
        del relation
        raise _jump(left, right, then, otherwise)

    def _chained(self, a: Dual, value: Interval, slope: Callable[[], Interval]) -> Dual:
        if all(partial is None for partial in a.partials):
            return Dual(value, a.partials)
        rate = slope()
        return Dual(value, tuple(None if u is None else _BASE.mul(rate, u) for u in a.partials))


_ONE = _BASE.number(sp.S.One)


def _jump(*operands: Dual) -> EnvelopeError:
    del operands
    return EnvelopeError("it has no derivative along the center", subexpression="")
