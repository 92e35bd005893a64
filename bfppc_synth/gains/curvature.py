"""Numbers that know only their log-log curvature: whether a program is a geometric one.

A quantity that is positive and convex in the logs of the unknowns stays so under sums, products,
powers, maxima, exp, sinh and cosh (docs/theory.md section 5). Evaluating the chain in these
numbers tells whether every constraint is `monomial >= convex`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Any

from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.majorants.arithmetic import Sign

if TYPE_CHECKING:
    from collections.abc import Callable

    import sympy as sp


class Curvature(IntEnum):
    """Of the magnitude, each contained in the next; OTHER is what nothing is known of."""

    ZERO = 0
    CONSTANT = 1
    MONOMIAL = 2
    CONVEX = 3
    OTHER = 4


@dataclass(frozen=True, slots=True)
class Curved:
    """A quantity by its curvature and its sign, the same for all values of the unknowns."""

    kind: Curvature
    sign: int = 1

    def __add__(self, other: Any) -> Curved:
        """Add: sums of one sign are convex."""
        b = curved(other)
        if Curvature.ZERO in (self.kind, b.kind):
            return b if self.kind is Curvature.ZERO else self
        if self.sign != b.sign or Curvature.OTHER in (self.kind, b.kind):
            return OTHER
        constants = self.kind is b.kind is Curvature.CONSTANT
        return Curved(Curvature.CONSTANT if constants else Curvature.CONVEX, self.sign)

    __radd__ = __add__

    def __mul__(self, other: Any) -> Curved:
        """Multiply: products have the larger curvature."""
        b = curved(other)
        if Curvature.ZERO in (self.kind, b.kind):
            return ZERO
        kind = max(self.kind, b.kind)
        return OTHER if kind is Curvature.OTHER else Curved(kind, self.sign * b.sign)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Curved:
        """Divide: only monomials may stand below."""
        b = curved(other)
        if b.kind not in (Curvature.CONSTANT, Curvature.MONOMIAL):
            return OTHER
        return self * Curved(b.kind, b.sign)

    def __rtruediv__(self, other: Any) -> Curved:
        """Divide a constant."""
        return curved(other) / self

    def __neg__(self) -> Curved:
        """Negate: the magnitude stays."""
        return Curved(self.kind, -self.sign)

    def __sub__(self, other: Any) -> Curved:
        """Subtract: add the negative."""
        return self + -curved(other)

    def __rsub__(self, other: Any) -> Curved:
        """Subtract: add the negative."""
        return curved(other) + -self

    def __pow__(self, exponent: int) -> Curved:
        """Raise to a power from 1 on."""
        return self if exponent % 2 else Curved(self.kind, 1)


ZERO, CONSTANT, OTHER = (Curved(k) for k in (Curvature.ZERO, Curvature.CONSTANT, Curvature.OTHER))
MONOMIAL = Curved(Curvature.MONOMIAL)


def curved(value: Any) -> Curved:
    """Take a number as a constant."""
    if isinstance(value, Curved):
        return value
    return ZERO if value == 0 else Curved(Curvature.CONSTANT, 1 if value > 0 else -1)


def _largest(a: Curved, b: Curved) -> Curved:
    """Of one sign: the larger of two magnitudes; of two, the positive one."""
    if Curvature.OTHER in (a.kind, b.kind):
        return OTHER
    above = [value for value in (a, b) if value.sign > 0 and value.kind is not Curvature.ZERO]
    if not above:
        # The smaller of two magnitudes is not convex, but of constants it is one.
        both = max(a.kind, b.kind) <= Curvature.CONSTANT
        if Curvature.ZERO in (a.kind, b.kind):
            return ZERO
        return Curved(Curvature.CONSTANT, -1) if both else OTHER
    if len(above) == 1:
        return above[0]
    constants = a.kind is b.kind is Curvature.CONSTANT
    return CONSTANT if constants else Curved(Curvature.CONVEX)


class CurvedNumbers:
    """Functions of the chain."""

    def number(self, value: float) -> Any:
        """Return a constant."""
        return curved(value)

    def tanh(self, value: Any) -> Any:
        """Return the hyperbolic tangent, which bends the other way."""
        return _of_constant(value)

    def sqrt(self, value: Any) -> Any:
        """Return the square root: a power."""
        return value if value.sign > 0 else OTHER

    def minimum(self, left: Any, right: Any) -> Any:
        """Return the smaller of two."""
        return -_largest(-left, -right)

    def maximum(self, left: Any, right: Any) -> Any:
        """Return the larger of two."""
        return _largest(left, right)

    def supremum(self, function: Callable[[Any], Any]) -> Any:
        """Return the largest of a function on [0, 1]: a maximum at constants, 0 among them."""
        return _largest(function(curved(1.0)), function(curved(0.5)))

    def record(self, symbol: str, index: int, value: Any) -> Any:
        """Name nothing: the value itself."""
        del symbol, index
        return value


def _of_constant(value: Curved) -> Curved:
    """Apply a function that only constants pass; it keeps the sign."""
    return value if value.kind <= Curvature.CONSTANT else OTHER


def _growing(value: Curved) -> Curved:
    """Apply an odd function whose series has no negative coefficient."""
    return value if value.kind <= Curvature.CONSTANT else Curved(Curvature.CONVEX, value.sign)


class CurvedArithmetic:
    """End-point arithmetic of the envelopes; ``asked`` once a constraint is not on constants."""

    def __init__(self) -> None:
        self.asked = False

    def number(self, value: sp.Expr) -> Curved:
        """Return a constant."""
        return curved(float(evaluate(value, {}, FLOAT_FUNCTIONS)))

    def add(self, a: Curved, b: Curved) -> Curved:
        """Return the sum."""
        return a + b

    def neg(self, a: Curved) -> Curved:
        """Return the negative."""
        return -a

    def mul(self, a: Curved, b: Curved) -> Curved:
        """Return the product."""
        return a * b

    def reciprocal(self, a: Curved) -> Curved:
        """Return the reciprocal."""
        return CONSTANT / a

    def power(self, a: Curved, exponent: int) -> Curved:
        """Return an integer power."""
        return a**exponent

    def root_power(self, a: Curved, p: int, q: int) -> Curved:
        """Return a^(p/q), a >= 0."""
        del p, q
        return a

    def minimum(self, a: Curved, b: Curved) -> Curved:
        """Return the smaller one."""
        return -_largest(-a, -b)

    def maximum(self, a: Curved, b: Curved) -> Curved:
        """Return the larger one."""
        return _largest(a, b)

    def exp(self, a: Curved) -> Curved:
        """Return e^a: convex where a is and grows; 1 for 0."""
        if a.kind <= Curvature.CONSTANT:
            return CONSTANT
        return Curved(Curvature.CONVEX) if a.sign > 0 and a.kind < Curvature.OTHER else OTHER

    def cosh(self, a: Curved) -> Curved:
        """Return the hyperbolic cosine."""
        if a.kind is Curvature.OTHER:
            return OTHER
        return CONSTANT if a.kind <= Curvature.CONSTANT else Curved(Curvature.CONVEX)

    def sinh(self, a: Curved) -> Curved:
        """Return the hyperbolic sine."""
        return OTHER if a.kind is Curvature.OTHER else _growing(a)

    def tanh(self, a: Curved) -> Curved:
        """Return the hyperbolic tangent."""
        return _of_constant(a)

    def atan(self, a: Curved) -> Curved:
        """Return the arc tangent."""
        return _of_constant(a)

    def asinh(self, a: Curved) -> Curved:
        """Return the inverse hyperbolic sine."""
        return _of_constant(a)

    def log(self, a: Curved) -> Curved:
        """Return the logarithm: no sign is known of it."""
        del a
        return OTHER

    def sin(self, a: Curved) -> Curved:
        """Return the sine: no sign is known of it."""
        del a
        return OTHER

    cos = tan = sin

    def contains_phase(
        self,
        lower: Curved,
        upper: Curved,
        offset: sp.Expr,
        period: sp.Expr,
        inside: Curved,
        outside: Curved,
    ) -> Curved:
        """Return what neither end can tell: which of the two it is may change."""
        del lower, upper, offset, period
        return inside if inside == outside and inside.kind is Curvature.ZERO else OTHER

    def sign_of(self, lower: Curved, upper: Curved) -> Sign:
        """Say what holds for all values of the unknowns."""
        if lower.kind is not Curvature.OTHER and (lower.sign > 0 or lower.kind is Curvature.ZERO):
            return Sign.NONNEGATIVE
        if upper.kind is not Curvature.OTHER and (upper.sign < 0 or upper.kind is Curvature.ZERO):
            return Sign.NONPOSITIVE
        known = Curvature.OTHER not in (lower.kind, upper.kind)
        return Sign.MIXED if known else Sign.UNKNOWN

    def side_of(self, lower: Curved, upper: Curved) -> Sign:
        """Say nothing: the reciprocal of what has no sign is no convex number."""
        del lower, upper
        return Sign.UNKNOWN

    def require_positive(self, value: Curved, subexpression: sp.Expr, reason: str) -> None:
        """Note a constraint that is none on constants."""
        del subexpression, reason
        self.asked = self.asked or value.kind is not Curvature.CONSTANT or value.sign < 0

    def require_nonnegative(self, value: Curved, subexpression: sp.Expr, reason: str) -> None:
        """Note a constraint that is none on constants."""
        if value.kind is not Curvature.ZERO:
            self.require_positive(value, subexpression, reason)
