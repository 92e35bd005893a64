"""Values of constant subexpressions: exact where rational, else to some fifty digits.

Only the parser uses this, to find 1/0, log(0) and the square root of -1 before sympy is
imported; every bound is computed again from the tree by whoever needs it. The functions
count on the ninety digits that ``precise()`` switches on.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Context, Decimal, localcontext
from fractions import Fraction
from math import isqrt
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

_CONTEXT: Final = Context(prec=90, Emax=99_999, Emin=-99_999)
_PI: Final = Decimal(
    "3.14159265358979323846264338327950288419716939937510"
    "58209749445923078164062862089986280348253421170679821480865132823"
)
_LARGEST: Final = Decimal("1e300")
_SMALLEST: Final = Decimal("1e-300")
_LARGEST_ANGLE: Final = Decimal("1e15")
_LARGEST_EXPONENT: Final = Decimal(690)
# Below this share of its operands a difference has lost too many digits to be told from 0.
_NOISE: Final = Decimal("1e-40")
_TINY: Final = Decimal("1e-25")
_SERIES_END: Final = Decimal("1e-95")
_LARGEST_BITS: Final = 8192


class ConstantError(ArithmeticError):
    """A constant that has no value, or none that binary64 could hold."""

    def __init__(self, message: str, fix: str) -> None:
        self.fix = fix
        super().__init__(message)


def _too_long() -> ConstantError:
    return ConstantError(
        f"a constant with more than {_LARGEST_BITS} bits", "round its numbers to 17 digits"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """A constant; ``exact`` is None where it is irrational or not known to be rational."""

    exact: Fraction | None
    near: Decimal

    @property
    def approximate(self) -> float:
        """Nearest binary64."""
        return float(self.near) if self.exact is None else float(self.exact)


def precise() -> AbstractContextManager[object]:
    """Switch to ninety digits; everything below runs inside."""
    return localcontext(_CONTEXT)


def rational(value: Fraction) -> Value:
    """Wrap an exact number, refusing what no binary64 reaches."""
    if max(value.numerator.bit_length(), value.denominator.bit_length()) > _LARGEST_BITS:
        raise _too_long()
    near = Decimal(value.numerator) / Decimal(value.denominator)
    _require_size(near)
    return Value(exact=value, near=near)


PI: Final = Value(exact=None, near=_PI)


def _irrational(near: Decimal) -> Value:
    _require_size(near)
    return Value(exact=None, near=near)


def _require_size(near: Decimal) -> None:
    if near and not _SMALLEST <= abs(near) <= _LARGEST:
        raise ConstantError(
            f"a constant of about {near:.0e} lies outside 1e-300 to 1e300", "choose other units"
        )


def add(left: Value, right: Value) -> Value:
    """Sum; a difference of irrationals that vanishes to forty digits counts as 0."""
    if left.exact is not None and right.exact is not None:
        return rational(left.exact + right.exact)
    near = left.near + right.near
    if abs(near) < _NOISE * max(abs(left.near), abs(right.near)):
        near = Decimal(0)
    return _irrational(near)


def negate(value: Value) -> Value:
    """Additive inverse."""
    exact = None if value.exact is None else -value.exact
    return Value(exact=exact, near=-value.near)


def multiply(left: Value, right: Value) -> Value:
    """Product."""
    if left.exact is not None and right.exact is not None:
        return rational(left.exact * right.exact)
    if 0 in {left.exact, right.exact}:
        return rational(Fraction(0))
    return _irrational(left.near * right.near)


def reciprocal(value: Value) -> Value:
    """1/value, refused where the value is 0 or cannot be told from 0."""
    if not value.near:
        raise ConstantError("division by zero", "keep the denominator away from 0")
    if value.exact is not None:
        return rational(1 / value.exact)
    return _irrational(1 / value.near)


def power(base: Value, exponent: Fraction) -> Value:
    """Rational power; odd roots of negative numbers as in docs/theory.md section 1."""
    if exponent < 0:
        return power(reciprocal(base), -exponent)
    if exponent.denominator == 1:
        return _integer_power(base, exponent.numerator)
    if base.near < 0:
        if exponent.denominator % 2 == 0:
            raise ConstantError(
                "an even root of a negative number", "write abs(...) if its size is meant"
            )
        root = power(negate(base), exponent)
        return negate(root) if exponent.numerator % 2 else root
    if base.exact is not None:
        above = _exact_root(base.exact.numerator, exponent.denominator)
        below = _exact_root(base.exact.denominator, exponent.denominator)
        if above is not None and below is not None:
            return rational(Fraction(above, below) ** exponent.numerator)
    if not base.near:
        return _irrational(Decimal(0))
    return _irrational(base.near ** (Decimal(exponent.numerator) / Decimal(exponent.denominator)))


def _integer_power(base: Value, exponent: int) -> Value:
    if base.exact is None:
        return _irrational(base.near**exponent)
    bits = max(base.exact.numerator.bit_length(), base.exact.denominator.bit_length())
    # The size is judged before the power is taken: 9**9**9 must not be waited for.
    if bits > 1 and (bits - 1) * exponent > _LARGEST_BITS:
        raise _too_long()
    return rational(base.exact**exponent)


def _exact_root(number: int, degree: int) -> int | None:
    """Integer root of a nonnegative integer, or None: sqrt(4) is 2 and not about 2."""
    if degree == 2 or not number:
        root = isqrt(number)
    else:
        root = int((Decimal(number) ** (1 / Decimal(degree))).to_integral_value())
    return root if root**degree == number else None


def _sine(x: Decimal) -> Decimal:
    if abs(x) > _LARGEST_ANGLE:
        raise ConstantError("an angle beyond 1e15", "reduce it by full turns")
    turns = (x / _PI).to_integral_value()
    rest = x - turns * _PI
    if turns and abs(rest) < _NOISE * abs(x):
        return Decimal(0)
    term = total = rest
    index = 1
    while abs(term) > abs(total) * _SERIES_END:
        term *= -rest * rest / ((index + 1) * (index + 2))
        total += term
        index += 2
    return -total if turns % 2 else total


def _cosine(x: Decimal) -> Decimal:
    return _sine(x + _PI / 2)


def _tangent(x: Decimal) -> Decimal:
    denominator = _cosine(x)
    if not denominator:
        raise ConstantError("tan at a pole", "keep the angle away from odd multiples of pi/2")
    return _sine(x) / denominator


def _arctangent(x: Decimal) -> Decimal:
    halvings = 0
    while abs(x) > Decimal("0.01"):
        x /= 1 + (1 + x * x).sqrt()
        halvings += 1
    power_of_x = total = x
    index = 1
    while abs(power_of_x) > abs(x) * _SERIES_END:
        power_of_x *= -x * x
        index += 2
        total += power_of_x / index
    return total * Decimal(2) ** halvings


def _exponential(x: Decimal) -> Decimal:
    if abs(x) > _LARGEST_EXPONENT:
        raise ConstantError("an exponential outside 1e-300 to 1e300", "choose other units")
    return x.exp()


def _hyperbolic_sine(x: Decimal) -> Decimal:
    if abs(x) < _TINY:
        return x
    grown = _exponential(x)
    return (grown - 1 / grown) / 2


def _hyperbolic_cosine(x: Decimal) -> Decimal:
    grown = _exponential(x)
    return (grown + 1 / grown) / 2


def _hyperbolic_tangent(x: Decimal) -> Decimal:
    if abs(x) > 300:
        return Decimal(1).copy_sign(x)
    return _hyperbolic_sine(x) / _hyperbolic_cosine(x)


def _hyperbolic_arcsine(x: Decimal) -> Decimal:
    size = abs(x)
    if size < _TINY:
        return x
    return (size + (1 + size * size).sqrt()).ln().copy_sign(x)


def _logarithm(x: Decimal) -> Decimal:
    if x <= 0:
        raise ConstantError(
            "log of a negative number" if x else "log of zero", "take the log of a positive number"
        )
    near = x.ln()
    return near if abs(near) > _NOISE else Decimal(0)


_AT_ZERO_IS_ZERO: Final = frozenset({"sin", "tan", "sinh", "tanh", "atan", "asinh"})
_AT_ZERO_IS_ONE: Final = frozenset({"cos", "cosh", "exp"})
_TRANSCENDENTAL: Final[dict[str, Callable[[Decimal], Decimal]]] = {
    "sin": _sine,
    "cos": _cosine,
    "tan": _tangent,
    "atan": _arctangent,
    "exp": _exponential,
    "sinh": _hyperbolic_sine,
    "cosh": _hyperbolic_cosine,
    "tanh": _hyperbolic_tangent,
    "asinh": _hyperbolic_arcsine,
    "log": _logarithm,
}


def call(function: str, arguments: tuple[Value, ...]) -> Value:
    """Value of a listed function (canonical name) at constant arguments."""
    first = arguments[0]
    if function == "abs":
        return negate(first) if first.near < 0 else first
    if function == "sign":
        return rational(Fraction((first.near > 0) - (first.near < 0)))
    if function == "min":
        return min(arguments, key=lambda value: value.near)
    if function == "max":
        return max(arguments, key=lambda value: value.near)
    if function == "sqrt":
        return power(first, Fraction(1, 2))
    if first.exact == 0 and function in _AT_ZERO_IS_ZERO:
        return first
    if first.exact == 0 and function in _AT_ZERO_IS_ONE:
        return rational(Fraction(1))
    if first.exact == 1 and function == "log":
        return rational(Fraction(0))
    return _irrational(_TRANSCENDENTAL[function](first.near))
