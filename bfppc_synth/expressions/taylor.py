"""The plant language on truncated Taylor series in t (docs/theory.md section 4)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn, TypeVar

import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.series import Series, SeriesArithmetic

if TYPE_CHECKING:
    from bfppc_synth.expressions.flatten import Relation

T = TypeVar("T")

__all__ = ["Series", "TaylorFunctions"]


class TaylorFunctions(SeriesArithmetic[T]):
    """``expressions.evaluate.Functions`` of series, cut off after ``length`` coefficients.

    Every coefficient is computed by the same operations in the same order whatever the
    length: code and bounds of different lengths agree where both have a coefficient.

    Parameters
    ----------
    base : Functions[T]
        The target that the coefficients are numbers of.
    length : int
        Number of coefficients kept, at least 1.

    References
    ----------
    docs/theory.md section 4; the recurrences follow from y' = F'(x) x', coefficient by
    coefficient.
    """

    def sqrt(self, a: Series[T]) -> Series[T]:
        """Return the root of a > 0: a = r r."""
        a = self._cut(a)
        base = self._base
        found = [base.sqrt(a[0])]
        if len(a) == 1:
            return tuple(found)
        twice = base.add(found[0], found[0]) if self._length > 1 else found[0]
        for k in range(1, self._length):
            inner = self._symmetric(found, k, 1)
            found.append(base.div(self._less(a, k, inner), twice))
        return tuple(found)

    def root_power(self, a: Series[T], p: int, q: int) -> Series[T]:
        """Return a**(p/q) for even q, a > 0: a w' = (p/q) a' w."""
        if q % 2:
            self._refuse("an odd root")
        a = self._cut(a)
        base = self._base
        found = [base.root_power(a[0], p, q)]
        if len(a) == 1:
            return tuple(found)
        for k in range(1, self._length):
            total = self._sum(
                base.mul(base.mul(base.number(sp.Rational(p * j, q) - (k - j)), a[j]), found[k - j])
                for j in range(1, min(k, len(a) - 1) + 1)
            )
            found.append(base.div(self._some(total), base.mul(base.number(sp.Integer(k)), a[0])))
        return tuple(found)

    def exp(self, a: Series[T]) -> Series[T]:
        """Return e**a: y' = y a'."""
        a = self._cut(a)
        found = [self._base.exp(a[0])]
        for k in self._orders(a):
            found.append(self._integral(a, found, k))
        return tuple(found)

    def log(self, a: Series[T]) -> Series[T]:
        """Return the natural logarithm of a > 0: a y' = a'."""
        a = self._cut(a)
        base = self._base
        found = [base.log(a[0])]
        for k in self._orders(a):
            found.append(self._quotient(a, a, found, k))
        return tuple(found)

    def sin(self, a: Series[T]) -> Series[T]:
        """Return the sine: y' = cos(a) a'."""
        a = self._cut(a)
        other = self._base.cos(a[0]) if self._orders(a) else None
        return self._coupled(a, self._base.sin(a[0]), other, (1, -1))

    def cos(self, a: Series[T]) -> Series[T]:
        """Return the cosine: y' = -sin(a) a'."""
        a = self._cut(a)
        other = self._base.sin(a[0]) if self._orders(a) else None
        return self._coupled(a, self._base.cos(a[0]), other, (-1, 1))

    def tan(self, a: Series[T]) -> Series[T]:
        """Return the tangent: y' = (1 + y**2) a'."""
        a = self._cut(a)
        return self._bent(a, self._base.tan(a[0]), 1)

    def tanh(self, a: Series[T]) -> Series[T]:
        """Return the hyperbolic tangent: y' = (1 - y**2) a'."""
        a = self._cut(a)
        return self._bent(a, self._base.tanh(a[0]), -1)

    def sinh(self, a: Series[T]) -> Series[T]:
        """Return the hyperbolic sine: y' = cosh(a) a'."""
        a = self._cut(a)
        other = self._base.cosh(a[0]) if self._orders(a) else None
        return self._coupled(a, self._base.sinh(a[0]), other, (1, 1))

    def cosh(self, a: Series[T]) -> Series[T]:
        """Return the hyperbolic cosine: y' = sinh(a) a'."""
        a = self._cut(a)
        other = self._base.sinh(a[0]) if self._orders(a) else None
        return self._coupled(a, self._base.cosh(a[0]), other, (1, 1))

    def atan(self, a: Series[T]) -> Series[T]:
        """Return the arc tangent: (1 + a**2) y' = a'."""
        a = self._cut(a)
        found = [self._base.atan(a[0])]
        below = self.add(self.number(sp.S.One), self.power(a, 2)) if len(a) > 1 else a
        for k in self._orders(a):
            found.append(self._quotient(a, below, found, k))
        return tuple(found)

    def asinh(self, a: Series[T]) -> Series[T]:
        """Return the inverse hyperbolic sine: sqrt(1 + a**2) y' = a'."""
        a = self._cut(a)
        found = [self._base.asinh(a[0])]
        below = a
        if len(a) > 1:
            below = self.sqrt(self.add(self.number(sp.S.One), self.power(a, 2)))
        for k in self._orders(a):
            found.append(self._quotient(a, below, found, k))
        return tuple(found)

    def absolute(self, a: Series[T]) -> Series[T]:
        """Refuse the absolute value, which has a kink."""
        del a
        self._refuse("an absolute value")

    def sign(self, a: Series[T]) -> Series[T]:
        """Refuse the sign, which jumps."""
        del a
        self._refuse("a sign")

    def minimum(self, a: Series[T], b: Series[T]) -> Series[T]:
        """Refuse the minimum, which has a kink."""
        del a, b
        self._refuse("a minimum")

    def maximum(self, a: Series[T], b: Series[T]) -> Series[T]:
        """Refuse the maximum, which has a kink."""
        del a, b
        self._refuse("a maximum")

    def select(
        self,
        relation: Relation,
        left: Series[T],
        right: Series[T],
        then: Series[T],
        otherwise: Series[T],
    ) -> Series[T]:
        """Refuse branches, which may jump."""
        del relation, left, right, then, otherwise
        self._refuse("a Piecewise")

    def _orders(self, a: Series[T]) -> range:
        """Orders 1, 2, .. of a result that is constant where its argument is."""
        return range(1, self._length if len(a) > 1 else 1)

    def _integral(self, a: Series[T], factor: list[T], k: int) -> T:
        """Coefficient k of the integral of factor a'."""
        total = self._sum(
            self._base.mul(self._times(j, a[j]), factor[k - j])
            for j in range(1, min(k, len(a) - 1) + 1)
            if k - j < len(factor)
        )
        return self._over(self._some(total), k)

    def _quotient(self, a: Series[T], below: Series[T], found: list[T], k: int) -> T:
        """Coefficient k of the y with below y' = a'."""
        base = self._base
        carried = self._sum(
            base.mul(self._times(j, found[j]), below[k - j])
            for j in range(max(1, k - len(below) + 1), k)
        )
        if carried is not None:
            carried = self._over(carried, k)
        return base.div(self._less(a, k, carried), below[0])

    def _coupled(self, a: Series[T], y: T, z: T | None, signs: tuple[int, int]) -> Series[T]:
        """Return y with y' = signs[0] z a', z' = signs[1] y a', with as little of z as needed."""
        found, other = [y], [] if z is None else [z]
        for k in self._orders(a):
            found.append(self._signed(signs[0], self._integral(a, other, k)))
            if k + 1 < self._length:
                other.append(self._signed(signs[1], self._integral(a, found, k)))
        return tuple(found)

    def _signed(self, sign: int, value: T) -> T:
        return value if sign > 0 else self._base.neg(value)

    def _bent(self, a: Series[T], value: T, sign: int) -> Series[T]:
        """Return y with y' = (1 + sign y**2) a'."""
        join = self._base.add if sign > 0 else self._base.sub
        found, slopes = [value], list[T]()
        for k in self._orders(a):
            square = self._some(self._symmetric(found, k - 1, 0))
            if k == 1:
                slopes.append(join(self._base.number(sp.S.One), square))
            else:
                slopes.append(self._signed(sign, square))
            found.append(self._integral(a, slopes, k))
        return tuple(found)

    def _refuse(self, what: str) -> NoReturn:
        raise EnvelopeError(
            f"{what} has no Taylor series", subexpression=what, fix="leave it out of f^ and g^"
        )
