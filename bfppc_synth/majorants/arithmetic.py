"""What a number type must offer so that the envelope rules can be written once.

``T`` is one end point: a float, a sympy expression, a CasADi expression with its value at the
smallest box. The rules (``rules.py``) call nothing but these methods.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Protocol, TypeVar

if TYPE_CHECKING:
    import sympy as sp

T = TypeVar("T")


class Sign(Enum):
    """What is known about every number in [lower, upper].

    A sign other than UNKNOWN must hold for every box at which the result is used: a product
    formula chosen by the sign at one box is not nested (docs/theory.md section 1, traps). MIXED
    persists as boxes grow, so a symbolic target may read it off the smallest box.
    """

    ZERO = "lower = upper = 0"
    POSITIVE = "lower > 0"
    NONNEGATIVE = "lower >= 0"
    NEGATIVE = "upper < 0"
    NONPOSITIVE = "upper <= 0"
    MIXED = "lower <= 0 <= upper"
    UNKNOWN = "nothing is known"


class Arithmetic(Protocol[T]):
    """Scalar operations on end points of envelopes.

    None of them needs to round outward: a rigorous target does, the search does not. An
    operation whose result does not exist as a number raises EnvelopeError; overflow upward is
    infinity.
    """

    def number(self, value: sp.Expr) -> T:
        """Convert a constant; the rules pass Rationals, Floats, pi and E only."""

    def add(self, a: T, b: T) -> T:
        """Return a + b."""

    def neg(self, a: T) -> T:
        """Return -a."""

    def mul(self, a: T, b: T) -> T:
        """Return a * b; 0 times infinity is 0, as infinity stands for a large finite number."""

    def reciprocal(self, a: T) -> T:
        """Return 1 / a; the rules have required its sign before."""

    def power(self, a: T, exponent: int) -> T:
        """Return a**exponent for an integer exponent >= 1 and an a of any sign."""

    def root_power(self, a: T, p: int, q: int) -> T:
        """Return a**(p/q) for a >= 0, p >= 1, q >= 2 in lowest terms; q = 2, p = 1 is sqrt."""

    def minimum(self, a: T, b: T) -> T:
        """Return the smaller one."""

    def maximum(self, a: T, b: T) -> T:
        """Return the larger one."""

    def exp(self, a: T) -> T:
        """Return e**a."""

    def log(self, a: T) -> T:
        """Return the natural logarithm; a > 0 has been required."""

    def sin(self, a: T) -> T:
        """Return the sine; dropped by ``contains_phase`` where a is infinite."""

    def cos(self, a: T) -> T:
        """Return the cosine; dropped by ``contains_phase`` where a is infinite."""

    def tan(self, a: T) -> T:
        """Return the tangent; the branch has been required."""

    def sinh(self, a: T) -> T:
        """Return the hyperbolic sine."""

    def cosh(self, a: T) -> T:
        """Return the hyperbolic cosine."""

    def tanh(self, a: T) -> T:
        """Return the hyperbolic tangent."""

    def atan(self, a: T) -> T:
        """Return the arc tangent."""

    def asinh(self, a: T) -> T:
        """Return the inverse hyperbolic sine."""

    def contains_phase(
        self, lower: T, upper: T, offset: sp.Expr, period: sp.Expr, inside: T, outside: T
    ) -> T:
        """Return ``inside`` if offset + k period lies in [lower, upper] for an integer k.

        ``outside`` is returned otherwise. ``inside`` is always the safe answer: a target that
        cannot tell returns it. offset and period are constants (multiples of pi).
        """

    def sign_of(self, lower: T, upper: T) -> Sign:
        """Say what is known about the sign of everything in [lower, upper]."""

    def side_of(self, lower: T, upper: T) -> Sign:
        """Say on which side of 0 [lower, upper] must lie for its reciprocal to exist.

        Asked where ``sign_of`` is UNKNOWN only: POSITIVE or NEGATIVE as the smallest box has it
        (``require_positive`` on the end nearest 0 follows), UNKNOWN if neither.
        """

    def require_positive(self, value: T, subexpression: sp.Expr, reason: str) -> None:
        """Want value > 0: floats raise EnvelopeError, symbolic targets collect a constraint."""

    def require_nonnegative(self, value: T, subexpression: sp.Expr, reason: str) -> None:
        """Want value >= 0, as ``require_positive``."""
