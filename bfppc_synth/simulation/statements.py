"""Python statements as a target of ``expressions.evaluate``."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import sympy as sp


class Statements:
    """Collects ``name = operation`` lines; equal operations are written once.

    Names are what the methods take and return. Powers become products, and odd roots of
    negative numbers mean sgn(x) abs(x)**(p/q), as docs/theory.md section 1 wants everywhere.
    Outside a domain the value is NaN and no exception, because the branch of a Piecewise that
    is not taken may well have no value.
    """

    def __init__(self, prefix: str = "v") -> None:
        self.lines: list[str] = []
        self._prefix = prefix
        self._known: dict[str, str] = {}

    def _name(self, operation: str) -> str:
        if operation not in self._known:
            name = f"{self._prefix}{len(self._known)}"
            self._known[operation] = name
            self.lines.append(f"{name} = {operation}")
        return self._known[operation]

    def number_text(self, value: float) -> str:
        """Write a binary64 number; the parentheses keep ``(-2.0) * x`` readable to Python."""
        return repr(value) if value >= 0.0 else f"({value!r})"

    def number(self, value: sp.Expr) -> str:
        """Write a constant as the nearest binary64 number."""
        if value.is_Rational:
            return self.number_text(float(Fraction(int(value.p), int(value.q))))
        return self.number_text(float(value))

    def add(self, a: str, b: str) -> str:
        """Write a + b."""
        return self._name(f"{a} + {b}")

    def sub(self, a: str, b: str) -> str:
        """Write a - b."""
        return self._name(f"{a} - {b}")

    def mul(self, a: str, b: str) -> str:
        """Write a * b."""
        return self._name(f"{a} * {b}")

    def div(self, a: str, b: str) -> str:
        """Write a / b; the test for a pole is spared where b is a number."""
        if b[0].isdigit():
            return self._name(f"{a} / {b}")
        return self._name(f"{a} / {b} if {b} else nan")

    def neg(self, a: str) -> str:
        """Write -a."""
        return self._name(f"-{a}")

    def power(self, a: str, exponent: int) -> str:
        """Write a**exponent, exponent >= 1, as products."""
        if exponent == 1:
            return a
        root = self.power(a, exponent // 2)
        square = self.mul(root, root)
        return self.mul(square, a) if exponent % 2 else square

    def sqrt(self, a: str) -> str:
        """Write the square root."""
        return self._name(f"sqrt({a}) if {a} >= 0.0 else nan")

    def root_power(self, a: str, p: int, q: int) -> str:
        """Write a**(p/q)."""
        if q % 2 == 0:
            return self._name(f"pow({a}, {p / q!r}) if {a} >= 0.0 else nan")
        size = self._name(f"pow(abs({a}), {p / q!r})")
        return self._name(f"copysign({size}, {a})") if p % 2 else size

    def absolute(self, a: str) -> str:
        """Write abs(a)."""
        return self._name(f"abs({a})")

    def sign(self, a: str) -> str:
        """Write -1, 0 or 1."""
        return self._name(f"1.0 if {a} > 0.0 else -1.0 if {a} < 0.0 else 0.0")

    def exp(self, a: str) -> str:
        """Write e**a."""
        return self._name(f"exp({a})")

    def log(self, a: str) -> str:
        """Write the natural logarithm."""
        return self._name(f"log({a}) if {a} > 0.0 else nan")

    def sin(self, a: str) -> str:
        """Write the sine."""
        return self._name(f"sin({a})")

    def cos(self, a: str) -> str:
        """Write the cosine."""
        return self._name(f"cos({a})")

    def tan(self, a: str) -> str:
        """Write the tangent."""
        return self._name(f"tan({a})")

    def sinh(self, a: str) -> str:
        """Write the hyperbolic sine."""
        return self._name(f"sinh({a})")

    def cosh(self, a: str) -> str:
        """Write the hyperbolic cosine."""
        return self._name(f"cosh({a})")

    def tanh(self, a: str) -> str:
        """Write the hyperbolic tangent."""
        return self._name(f"tanh({a})")

    def atan(self, a: str) -> str:
        """Write the arc tangent."""
        return self._name(f"atan({a})")

    def asinh(self, a: str) -> str:
        """Write the inverse hyperbolic sine."""
        return self._name(f"asinh({a})")

    def minimum(self, a: str, b: str) -> str:
        """Write the smaller one."""
        return self._name(f"{a} if {a} < {b} else {b}")

    def maximum(self, a: str, b: str) -> str:
        """Write the larger one."""
        return self._name(f"{a} if {a} > {b} else {b}")

    def select(
        self, relation: Literal["<", "<="], left: str, right: str, then: str, otherwise: str
    ) -> str:
        """Write ``then`` where the relation holds, else ``otherwise``."""
        return self._name(f"{then} if {left} {relation} {right} else {otherwise}")
