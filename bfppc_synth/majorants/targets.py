"""Two number types for the envelopes: binary64 for search and checks, sympy for reading."""

from __future__ import annotations

import math
from functools import lru_cache

import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import FloatFunctions, evaluate_float, power_by_products
from bfppc_synth.majorants.arithmetic import Sign

# Beyond this argument binary64 no longer knows the phase well enough to leave a peak out.
_LARGEST_PHASE = 1e8


@lru_cache(maxsize=1024)
def _float(constant: sp.Expr) -> float:
    return evaluate_float(constant, {})


class FloatArithmetic:
    """Binary64, rounded to nearest: an estimate to within rounding, never a proof.

    Infinity stands for a number too large for binary64. No operation returns NaN: where one
    would (infinity minus infinity, a NaN among the operands), EnvelopeError is raised.
    """

    number = staticmethod(_float)
    exp = staticmethod(FloatFunctions.exp)
    sinh = staticmethod(FloatFunctions.sinh)
    cosh = staticmethod(FloatFunctions.cosh)
    log = staticmethod(math.log)
    tan = staticmethod(math.tan)
    tanh = staticmethod(math.tanh)
    atan = staticmethod(math.atan)
    asinh = staticmethod(math.asinh)

    def add(self, a: float, b: float) -> float:
        """Refuse infinity minus infinity."""
        total = a + b
        if math.isnan(total):
            raise _overflow(a, "+", b)
        return total

    def neg(self, a: float) -> float:
        """Change the sign."""
        return -a

    def mul(self, a: float, b: float) -> float:
        """Let 0 win over infinity."""
        product = a * b
        if not math.isnan(product):
            return product
        if math.isnan(a) or math.isnan(b):
            raise _overflow(a, "*", b)
        return 0.0

    def reciprocal(self, a: float) -> float:
        """Divide 1 by a."""
        return 1.0 / a

    def power(self, a: float, exponent: int) -> float:
        """Multiply by repeated squaring, which is monotone after rounding too."""
        return power_by_products(a, exponent)

    def root_power(self, a: float, p: int, q: int) -> float:
        """Take the root first: square and cube roots are nearly correctly rounded."""
        if q == 2:
            return power_by_products(math.sqrt(a), p)
        if q == 3:
            return power_by_products(math.cbrt(a), p)
        return float(a ** (p / q))

    def minimum(self, a: float, b: float) -> float:
        """Refuse NaN, which comparisons would lose."""
        if a <= b:
            return a
        if b < a:
            return b
        raise _overflow(a, "min", b)

    def maximum(self, a: float, b: float) -> float:
        """Refuse NaN, which comparisons would lose."""
        if a >= b:
            return a
        if b > a:
            return b
        raise _overflow(a, "max", b)

    def sin(self, a: float) -> float:
        """Return 0 at infinity, where ``contains_phase`` drops it."""
        return math.sin(a) if math.isfinite(a) else 0.0

    def cos(self, a: float) -> float:
        """Return 0 at infinity, where ``contains_phase`` drops it."""
        return math.cos(a) if math.isfinite(a) else 0.0

    def contains_phase(
        self,
        lower: float,
        upper: float,
        offset: sp.Expr,
        period: sp.Expr,
        inside: float,
        outside: float,
    ) -> float:
        """Count periods from the offset; say inside where the phase is not known."""
        if math.isnan(lower) or math.isnan(upper):
            raise _overflow(lower, "to", upper)
        start, step = _float(offset), _float(period)
        # Written so that an infinite end counts as inside.
        if not (upper - lower < step and lower > -_LARGEST_PHASE and upper < _LARGEST_PHASE):
            return inside
        first = start + step * math.ceil((lower - start) / step)
        return inside if first <= upper else outside

    def sign_of(self, lower: float, upper: float) -> Sign:
        """Compare with 0; a float always knows."""
        if lower > 0.0:
            return Sign.POSITIVE
        if upper < 0.0:
            return Sign.NEGATIVE
        if lower == 0.0:
            return Sign.ZERO if upper == 0.0 else Sign.NONNEGATIVE
        return Sign.NONPOSITIVE if upper == 0.0 else Sign.MIXED

    def side_of(self, lower: float, upper: float) -> Sign:
        """Return what ``sign_of`` returns."""
        return self.sign_of(lower, upper)

    def require_positive(self, value: float, subexpression: sp.Expr, reason: str) -> None:
        """Raise unless value > 0."""
        if not value > 0.0:
            raise _outside(value, subexpression, reason, "must be above 0")

    def require_nonnegative(self, value: float, subexpression: sp.Expr, reason: str) -> None:
        """Raise unless value >= 0."""
        if not value >= 0.0:
            raise _outside(value, subexpression, reason, "must not be below 0")


class SympyArithmetic:
    """Sympy expressions in magnitudes z >= 0: the formulas that a report shows.

    Signs come from sympy's assumptions and from nesting: an upper end is nondecreasing in
    every z, so where it is >= 0 at z = 0 it is >= 0 everywhere, and a lower end likewise.
    What is undecided stays sound: a wave reaches its peak, a maximum is written as Max.
    ``constraints`` are what must be positive (or not negative) for the formula to hold.
    """

    def __init__(self) -> None:
        self.constraints: list[sp.Expr] = []

    exp = staticmethod(sp.exp)
    log = staticmethod(sp.log)
    sin = staticmethod(sp.sin)
    cos = staticmethod(sp.cos)
    tan = staticmethod(sp.tan)
    sinh = staticmethod(sp.sinh)
    cosh = staticmethod(sp.cosh)
    tanh = staticmethod(sp.tanh)
    atan = staticmethod(sp.atan)
    asinh = staticmethod(sp.asinh)

    def number(self, value: sp.Expr) -> sp.Expr:
        """Keep constants exact."""
        return value

    def add(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        """Return a + b."""
        return a + b

    def neg(self, a: sp.Expr) -> sp.Expr:
        """Distribute the sign over a sum."""
        return -a

    def mul(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        """Keep the sign outside, so that -(1 + z) times -z is z (1 + z)."""
        minus_a, minus_b = a.could_extract_minus_sign(), b.could_extract_minus_sign()
        product = (-a if minus_a else a) * (-b if minus_b else b)
        return product if minus_a == minus_b else -product

    def reciprocal(self, a: sp.Expr) -> sp.Expr:
        """Return 1 / a."""
        return 1 / a

    def power(self, a: sp.Expr, exponent: int) -> sp.Expr:
        """Return a**exponent."""
        return a**exponent

    def root_power(self, a: sp.Expr, p: int, q: int) -> sp.Expr:
        """Return a**(p/q) of an a >= 0."""
        return a ** sp.Rational(p, q)

    def minimum(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        """Write every minimum by Max, so that equal ones cancel."""
        return -self.maximum(-a, -b)

    def maximum(self, a: sp.Expr, b: sp.Expr) -> sp.Expr:
        """Drop what is never the largest, take common factors out of what remains."""
        kept: list[sp.Expr] = []
        for candidate in (*sp.Max.make_args(a), *sp.Max.make_args(b)):
            if any(self._at_least(other, candidate) for other in kept):
                continue
            kept = [other for other in kept if not self._at_least(candidate, other)]
            kept.append(candidate)
        return kept[0] if len(kept) == 1 else _written_maximum(kept)

    def _at_least(self, a: sp.Expr, b: sp.Expr) -> bool:
        """Say whether a >= b is known, given that the constraints hold."""
        if a == b:
            return True
        # A minimum is written -Max(-c, -d): it is at most each of c and d.
        if isinstance(-b, sp.Max):
            return any(self._at_least(a, -c) for c in (-b).args)
        if isinstance(-a, sp.Max):
            return all(self._at_least(-c, b) for c in (-a).args)
        positive = {value: sp.Dummy(positive=True) for value in self.constraints}
        return bool(sp.expand((a - b).xreplace(positive)).is_nonnegative)

    def contains_phase(
        self,
        lower: sp.Expr,
        upper: sp.Expr,
        offset: sp.Expr,
        period: sp.Expr,
        inside: sp.Expr,
        outside: sp.Expr,
    ) -> sp.Expr:
        """Decide constant intervals exactly; a symbolic one is taken to reach the phase."""
        if lower.free_symbols or upper.free_symbols:
            return inside
        first = offset + period * sp.ceiling((lower - offset) / period)
        return outside if (first - upper).is_positive else inside

    def sign_of(self, lower: sp.Expr, upper: sp.Expr) -> Sign:
        """Ask the assumptions, then the smallest box."""
        if lower.is_zero and upper.is_zero:
            return Sign.ZERO
        if lower.is_nonnegative:
            return Sign.POSITIVE if lower.is_positive else Sign.NONNEGATIVE
        if upper.is_nonpositive:
            return Sign.NEGATIVE if upper.is_negative else Sign.NONPOSITIVE
        least, largest = _at_zero(lower), _at_zero(upper)
        return Sign.MIXED if least.is_nonpositive and largest.is_nonnegative else Sign.UNKNOWN

    def side_of(self, lower: sp.Expr, upper: sp.Expr) -> Sign:
        """Look at z = 0, where the box is smallest."""
        if _at_zero(lower).is_positive:
            return Sign.POSITIVE
        return Sign.NEGATIVE if _at_zero(upper).is_negative else Sign.UNKNOWN

    def require_positive(self, value: sp.Expr, subexpression: sp.Expr, reason: str) -> None:
        """Raise where it is certainly not, note it where that depends on z."""
        if value.is_nonpositive:
            raise _outside(value, subexpression, reason, "must be above 0")
        if not value.is_positive:
            self.constraints.append(value)

    def require_nonnegative(self, value: sp.Expr, subexpression: sp.Expr, reason: str) -> None:
        """Raise where it is certainly not, note it where that depends on z."""
        if value.is_negative:
            raise _outside(value, subexpression, reason, "must not be below 0")
        if not value.is_nonnegative:
            self.constraints.append(value)


def _at_zero(end: sp.Expr) -> sp.Expr:
    return end.subs(dict.fromkeys(end.free_symbols, sp.S.Zero))


def _written_maximum(candidates: list[sp.Expr]) -> sp.Expr:
    """Write Max, with the nonnegative factors that all candidates share in front of it."""
    parts = [set(sp.Mul.make_args(sp.factor_terms(candidate))) for candidate in candidates]
    shared = [part for part in set.intersection(*parts) if part.is_nonnegative]
    front = sp.Mul(*sorted(shared, key=sp.default_sort_key))
    inner = [sp.Mul(*(part - set(shared))) for part in parts]
    return front * sp.Max(*sorted(inner, key=sp.default_sort_key), evaluate=False)


def _overflow(a: float, operation: str, b: float) -> EnvelopeError:
    return EnvelopeError(
        f"the bounds overflow binary64: {a} {operation} {b} is no number",
        subexpression="",
        fix="choose a smaller range, or other units",
    )


def _outside(value: object, subexpression: sp.Expr, reason: str, want: str) -> EnvelopeError:
    return EnvelopeError(
        f"{subexpression} {reason} is {value}, and {want}",
        subexpression=str(subexpression),
        fix="narrow the range of what it is a function of, or declare a bound instead",
    )
