"""Sums, products and quotients of truncated Taylor series over any target's functions.

A series is the tuple (x, x', x''/2!, ..) of normalized coefficients at one t; a shorter tuple
has zeros above, so that a constant is a series of length 1 and costs no operation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, TypeAlias, TypeVar

import sympy as sp

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bfppc_synth.expressions.evaluate import Functions

T = TypeVar("T")
Series: TypeAlias = tuple[T, ...]


class SeriesArithmetic(Generic[T]):
    """The four operations and integer powers, cut off after ``length`` coefficients.

    Parameters
    ----------
    base : Functions[T]
        The target that the coefficients are numbers of.
    length : int
        Number of coefficients kept, at least 1.

    References
    ----------
    docs/theory.md section 4.
    """

    def __init__(self, base: Functions[T], length: int) -> None:
        self._base = base
        self._length = length

    def number(self, value: sp.Expr) -> Series[T]:
        """Return a constant."""
        return (self._base.number(value),)

    def add(self, a: Series[T], b: Series[T]) -> Series[T]:
        """Return a + b."""
        a, b = self._cut(a), self._cut(b)
        common = tuple(map(self._base.add, a, b))
        return (*common, *a[len(b) :], *b[len(a) :])

    def sub(self, a: Series[T], b: Series[T]) -> Series[T]:
        """Return a - b."""
        a, b = self._cut(a), self._cut(b)
        common = tuple(map(self._base.sub, a, b))
        return (*common, *a[len(b) :], *map(self._base.neg, b[len(a) :]))

    def neg(self, a: Series[T]) -> Series[T]:
        """Return -a."""
        return tuple(map(self._base.neg, self._cut(a)))

    def mul(self, a: Series[T], b: Series[T]) -> Series[T]:
        """Return the product of Cauchy."""
        a, b = self._cut(a), self._cut(b)
        count = min(self._length, len(a) + len(b) - 1)
        return tuple(self._convolved(a, b, k) for k in range(count))

    def div(self, a: Series[T], b: Series[T]) -> Series[T]:
        """Return a / b: a = q b read for the coefficients of q."""
        a, b = self._cut(a), self._cut(b)
        div = self._base.div
        if len(b) == 1:
            return tuple(div(value, b[0]) for value in a)
        found: list[T] = []
        for k in range(self._length):
            carried = self._sum(
                self._base.mul(b[j], found[k - j]) for j in range(1, min(k, len(b) - 1) + 1)
            )
            found.append(div(self._less(a, k, carried), b[0]))
        return tuple(found)

    def power(self, a: Series[T], exponent: int) -> Series[T]:
        """Return a**exponent by repeated squaring; the value itself is the target's power."""
        a = self._cut(a)
        value = self._base.power(a[0], exponent)
        if len(a) == 1 or self._length == 1:
            return (value,)
        result: Series[T] | None = None
        square, left = a, exponent
        while True:
            if left % 2:
                result = square if result is None else self.mul(result, square)
            left //= 2
            if left == 0:
                return (value, *result[1:]) if result is not None else (value,)
            square = self._square(square)

    def derivative(self, a: Series[T]) -> Series[T]:
        """Return a', one coefficient shorter; (0,) for a constant."""
        if len(a) == 1:
            return self.number(sp.S.Zero)
        return self._cut(tuple(self._times(k, a[k]) for k in range(1, len(a))))

    def _cut(self, a: Series[T]) -> Series[T]:
        return a[: self._length]

    def _times(self, count: int, value: T) -> T:
        return value if count == 1 else self._base.mul(self._base.number(sp.Integer(count)), value)

    def _over(self, value: T, count: int) -> T:
        return value if count == 1 else self._base.div(value, self._base.number(sp.Integer(count)))

    def _sum(self, terms: Iterable[T]) -> T | None:
        total: T | None = None
        for term in terms:
            total = term if total is None else self._base.add(total, term)
        return total

    def _some(self, total: T | None) -> T:
        return self._base.number(sp.S.Zero) if total is None else total

    def _less(self, a: Series[T], k: int, carried: T | None) -> T:
        """a_k minus what the lower coefficients carry."""
        if carried is None:
            return a[k] if k < len(a) else self._base.number(sp.S.Zero)
        return self._base.sub(a[k], carried) if k < len(a) else self._base.neg(carried)

    def _convolved(self, a: Series[T], b: Series[T], k: int) -> T:
        first, last = max(0, k - len(b) + 1), min(k, len(a) - 1)
        return self._some(self._sum(self._base.mul(a[j], b[k - j]) for j in range(first, last + 1)))

    def _symmetric(self, a: list[T] | Series[T], k: int, first: int) -> T | None:
        """Sum of a_j a_(k-j) for j from ``first`` to k - first, equal products once."""
        base = self._base
        low = max(first, k - len(a) + 1)
        pairs = [base.mul(a[j], a[k - j]) for j in range(low, (k + 1) // 2)]
        total = self._sum(pairs)
        if total is not None:
            total = base.add(total, total)
        if k % 2 == 0 and low <= k // 2:
            middle = base.power(a[k // 2], 2)
            total = middle if total is None else base.add(total, middle)
        return total

    def _square(self, a: Series[T]) -> Series[T]:
        count = min(self._length, 2 * len(a) - 1)
        return tuple(self._some(self._symmetric(a, k, 0)) for k in range(count))
