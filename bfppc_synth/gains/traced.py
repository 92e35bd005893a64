"""End points of envelopes as CasADi expressions that know their signs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.majorants.arithmetic import Sign

if TYPE_CHECKING:
    from collections.abc import Callable

    import sympy as sp


@dataclass(frozen=True, slots=True)
class Traced:
    """An end point as CasADi expression, with its value at the smallest box.

    ``sign`` is +1 or -1 where the end point has that sign (or is 0) on every box.
    """

    sx: Any
    near: float
    sign: int


# Below this a value counts as 0, of which no share can be taken.
_TINY = 1e-100


class TracedArithmetic:
    """End-point arithmetic of the envelopes; collects what must stay positive.

    ``functions`` is the CasADi module, handed in by its one importer.
    """

    def __init__(self, functions: Any) -> None:
        self._ca = functions
        self.positive: list[Any] = []

    def number(self, value: sp.Expr) -> Traced:
        """Return a constant."""
        return self.constant(float(evaluate(value, {}, FLOAT_FUNCTIONS)))

    def constant(self, value: float) -> Traced:
        """Return a float constant; 0 counts as nonnegative."""
        return Traced(self._ca.SX(value), value, 1 if value >= 0.0 else -1)

    def add(self, a: Traced, b: Traced) -> Traced:
        """Return the sum."""
        return Traced(a.sx + b.sx, a.near + b.near, a.sign if a.sign == b.sign else 0)

    def neg(self, a: Traced) -> Traced:
        """Return the negative."""
        return Traced(-a.sx, -a.near, -a.sign)

    def mul(self, a: Traced, b: Traced) -> Traced:
        """Return the product."""
        near = 0.0 if 0.0 in (a.near, b.near) else a.near * b.near
        return Traced(a.sx * b.sx, near, a.sign * b.sign)

    def reciprocal(self, a: Traced) -> Traced:
        """Return the reciprocal."""
        return Traced(1 / a.sx, 1.0 / a.near if a.near else math.inf, a.sign)

    def power(self, a: Traced, exponent: int) -> Traced:
        """Return an integer power."""
        sign = 1 if exponent % 2 == 0 else a.sign
        return Traced(a.sx**exponent, _safe(lambda: a.near**exponent), sign)

    def root_power(self, a: Traced, p: int, q: int) -> Traced:
        """Return a^(p/q), a >= 0; the tiny offset keeps the derivative at 0 finite."""
        near = max(a.near, 0.0) ** (p / q)
        return Traced((self._ca.fmax(a.sx, 0.0) + 1e-30) ** (p / q), near, 1)

    def minimum(self, a: Traced, b: Traced) -> Traced:
        """Return the smaller one."""
        sign = -1 if -1 in (a.sign, b.sign) else min(a.sign, b.sign)
        return Traced(self._ca.fmin(a.sx, b.sx), min(a.near, b.near), sign)

    def maximum(self, a: Traced, b: Traced) -> Traced:
        """Return the larger one."""
        return Traced(self._ca.fmax(a.sx, b.sx), max(a.near, b.near), max(a.sign, b.sign))

    def exp(self, a: Traced) -> Traced:
        """Return e^a."""
        return Traced(self._ca.exp(a.sx), _safe(lambda: math.exp(a.near)), 1)

    def log(self, a: Traced) -> Traced:
        """Return the natural logarithm."""
        return Traced(self._ca.log(a.sx), _safe(lambda: math.log(a.near)), 0)

    def sin(self, a: Traced) -> Traced:
        """Return the sine."""
        return Traced(self._ca.sin(a.sx), _safe(lambda: math.sin(a.near)), 0)

    def cos(self, a: Traced) -> Traced:
        """Return the cosine."""
        return Traced(self._ca.cos(a.sx), _safe(lambda: math.cos(a.near)), 0)

    def tan(self, a: Traced) -> Traced:
        """Return the tangent."""
        return Traced(self._ca.tan(a.sx), _safe(lambda: math.tan(a.near)), 0)

    def sinh(self, a: Traced) -> Traced:
        """Return the hyperbolic sine."""
        return Traced(self._ca.sinh(a.sx), _safe(lambda: math.sinh(a.near)), a.sign)

    def cosh(self, a: Traced) -> Traced:
        """Return the hyperbolic cosine."""
        return Traced(self._ca.cosh(a.sx), _safe(lambda: math.cosh(a.near)), 1)

    def tanh(self, a: Traced) -> Traced:
        """Return the hyperbolic tangent."""
        return Traced(self._ca.tanh(a.sx), math.tanh(a.near), a.sign)

    def atan(self, a: Traced) -> Traced:
        """Return the arc tangent."""
        return Traced(self._ca.atan(a.sx), math.atan(a.near), a.sign)

    def asinh(self, a: Traced) -> Traced:
        """Return the inverse hyperbolic sine."""
        return Traced(self._ca.asinh(a.sx), math.asinh(a.near), a.sign)

    def contains_phase(
        self,
        lower: Traced,
        upper: Traced,
        offset: sp.Expr,
        period: sp.Expr,
        inside: Traced,
        outside: Traced,
    ) -> Traced:
        """Choose ``inside`` if offset + k period lies in [lower, upper] for an integer k."""
        start = float(evaluate(offset, {}, FLOAT_FUNCTIONS))
        cycle = float(evaluate(period, {}, FLOAT_FUNCTIONS))
        nearest = self._ca.ceil((lower.sx - start) / cycle) * cycle + start
        sx = self._ca.if_else(nearest <= upper.sx, inside.sx, outside.sx)
        sign = inside.sign if inside.sign == outside.sign else 0
        return Traced(sx, inside.near, sign)

    def sign_of(self, lower: Traced, upper: Traced) -> Sign:
        """Say what holds on every box; a mixed sign persists as boxes grow."""
        if lower.sign > 0:
            return Sign.NONNEGATIVE
        if upper.sign < 0:
            return Sign.NONPOSITIVE
        return Sign.MIXED if lower.near <= 0.0 <= upper.near else Sign.UNKNOWN

    def side_of(self, lower: Traced, upper: Traced) -> Sign:
        """Say on which side of 0 the smallest box lies."""
        if lower.near > 0.0:
            return Sign.POSITIVE
        return Sign.NEGATIVE if upper.near < 0.0 else Sign.UNKNOWN

    def require_positive(self, value: Traced, subexpression: sp.Expr, reason: str) -> None:
        """Collect value > 0 as a constraint."""
        del subexpression, reason
        self.keep_positive(value)

    def keep_positive(self, value: Traced) -> None:
        """Collect value > 0, in shares of what it is at the smallest box: units do not matter."""
        own = abs(value.near)
        self.positive.append(value.sx / own if _TINY < own < math.inf else value.sx)

    def require_nonnegative(self, value: Traced, subexpression: sp.Expr, reason: str) -> None:
        """Collect value > 0 as a constraint (a hair stricter)."""
        self.require_positive(value, subexpression, reason)


def _safe(compute: Callable[[], float]) -> float:
    """Value at the smallest box; infinite where there is none, as it only guides signs."""
    try:
        return compute()
    except (OverflowError, ValueError, ZeroDivisionError):
        return math.inf
