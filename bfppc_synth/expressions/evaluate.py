"""Sympy expressions in any target's functions: floats, text, statements, CasADi.

The targets see ``+ - * /``, integer powers, roots and named functions, never a sympy class.
"""

from __future__ import annotations

import math
import operator
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol, TypeVar

import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.flatten import flatten

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.expressions.flatten import Relation

T = TypeVar("T")


class Functions(Protocol[T]):
    """What a target offers; every method is pure."""

    def number(self, value: sp.Expr) -> T:
        """Convert a Rational, a Float, pi or E."""

    def add(self, a: T, b: T) -> T:
        """Return a + b."""

    def sub(self, a: T, b: T) -> T:
        """Return a - b."""

    def mul(self, a: T, b: T) -> T:
        """Return a * b."""

    def div(self, a: T, b: T) -> T:
        """Return a / b."""

    def neg(self, a: T) -> T:
        """Return -a."""

    def power(self, a: T, exponent: int) -> T:
        """Return a**exponent for an integer exponent >= 2, as products."""

    def sqrt(self, a: T) -> T:
        """Return the square root of a >= 0."""

    def root_power(self, a: T, p: int, q: int) -> T:
        """Return a**(p/q), p >= 1 and q >= 3 in lowest terms.

        q odd: sgn(a) abs(a)**(p/q) for odd p, abs(a)**(p/q) for even p. q even: a >= 0.
        """

    def absolute(self, a: T) -> T:
        """Return abs(a)."""

    def sign(self, a: T) -> T:
        """Return -1, 0 or 1."""

    def exp(self, a: T) -> T:
        """Return e**a."""

    def log(self, a: T) -> T:
        """Return the natural logarithm of a > 0."""

    def sin(self, a: T) -> T:
        """Return the sine."""

    def cos(self, a: T) -> T:
        """Return the cosine."""

    def tan(self, a: T) -> T:
        """Return the tangent."""

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

    def minimum(self, a: T, b: T) -> T:
        """Return the smaller one."""

    def maximum(self, a: T, b: T) -> T:
        """Return the larger one."""

    def select(self, relation: Relation, left: T, right: T, then: T, otherwise: T) -> T:
        """Return ``then`` where ``left relation right``, else ``otherwise``."""


def evaluate(expression: sp.Expr, values: Mapping[sp.Symbol, T], functions: Functions[T]) -> T:
    """Evaluate an expression in a target's functions, each subexpression once.

    Parameters
    ----------
    expression : sp.Expr
        Real expression in the plant file's functions.
    values : Mapping[sp.Symbol, T]
        A value for every free symbol.
    functions : Functions[T]
        The target; ``FLOAT_FUNCTIONS`` for binary64.

    Returns
    -------
    T
        The value. Both branches of a Piecewise are computed, one is selected.

    Raises
    ------
    EnvelopeError
        If a subexpression has no rule, naming it.
    KeyError
        If a symbol has no value.

    References
    ----------
    docs/theory.md section 1 for the odd roots of negative numbers.
    """
    return _run(expression, values, functions)[-1]


def evaluate_float(expression: sp.Expr, values: Mapping[sp.Symbol, float]) -> float:
    """Evaluate in binary64 and refuse points where the expression has no value.

    Raises
    ------
    EnvelopeError
        As ``evaluate``; or at a pole, outside a domain, at infinity minus infinity, naming the
        subexpression where it happens.

    References
    ----------
    docs/theory.md section 1.
    """
    results = _run(expression, values, FLOAT_FUNCTIONS)
    if not math.isnan(results[-1]):
        return results[-1]
    steps = flatten(expression)
    # The last NaN may only have been passed on; the first one is where it arose.
    step = next(step for step, result in zip(steps, results, strict=True) if math.isnan(result))
    shown = ", ".join(f"{results[position]:.6g}" for position in step.operands)
    raise EnvelopeError(
        f"{step.node} has no value: {step.operator} of {shown or 'NaN'}",
        subexpression=str(step.node),
        fix="keep the states inside its domain",
    )


def _run(expression: sp.Expr, values: Mapping[sp.Symbol, T], functions: Functions[T]) -> list[T]:
    results: list[T] = []
    for step in flatten(expression):
        if step.operator == "symbol":
            results.append(values[step.constants[0]])
            continue
        operands = [results[position] for position in step.operands]
        leading = step.operator == "select"
        arguments = (*step.constants, *operands) if leading else (*operands, *step.constants)
        results.append(getattr(functions, step.operator)(*arguments))
    return results


@lru_cache(maxsize=1024)
def nearest_float(value: sp.Expr) -> float:
    """Return the binary64 nearest to a Rational, a Float, pi or E."""
    if isinstance(value, sp.Rational):
        return int(value.p) / int(value.q)
    return float(value)


def power_by_products(a: float, exponent: int) -> float:
    """Return a**exponent, exponent >= 1, by repeated squaring: monotone in abs(a)."""
    result, square = 1.0, a
    while exponent > 1:
        if exponent % 2:
            result *= square
        square *= square
        exponent //= 2
    return result * square


class FloatFunctions:
    """Binary64 by the math module: overflow is infinity, no value is NaN.

    NaN and not an exception, because the branch of a Piecewise that is not taken may well
    have no value.
    """

    number = staticmethod(nearest_float)
    add = staticmethod(operator.add)
    sub = staticmethod(operator.sub)
    mul = staticmethod(operator.mul)
    neg = staticmethod(operator.neg)
    power = staticmethod(power_by_products)
    absolute = staticmethod(math.fabs)
    tanh = staticmethod(math.tanh)
    atan = staticmethod(math.atan)
    asinh = staticmethod(math.asinh)

    def div(self, a: float, b: float) -> float:
        """Divide; NaN at a pole."""
        return a / b if b else math.nan

    def sqrt(self, a: float) -> float:
        """Take the square root; NaN below 0."""
        return math.sqrt(a) if a >= 0.0 else math.nan

    def root_power(self, a: float, p: int, q: int) -> float:
        """Keep the sign for odd p and q (docs/theory.md section 1)."""
        if a < 0.0 and q % 2 == 0:
            return math.nan
        magnitude = float(math.fabs(a) ** (p / q))
        return -magnitude if a < 0.0 and p % 2 else magnitude

    def sign(self, a: float) -> float:
        """Return -1, 0 or 1; NaN of NaN."""
        return math.copysign(1.0, a) if abs(a) > 0.0 else a

    @staticmethod
    def exp(a: float) -> float:
        """Overflow to infinity."""
        try:
            return math.exp(a)
        except OverflowError:
            return math.inf

    def log(self, a: float) -> float:
        """Take the logarithm; NaN at 0 and below."""
        return math.log(a) if a > 0.0 else math.nan

    def sin(self, a: float) -> float:
        """Take the sine; NaN at infinity."""
        return math.sin(a) if math.isfinite(a) else math.nan

    def cos(self, a: float) -> float:
        """Take the cosine; NaN at infinity."""
        return math.cos(a) if math.isfinite(a) else math.nan

    def tan(self, a: float) -> float:
        """Take the tangent; NaN at infinity."""
        return math.tan(a) if math.isfinite(a) else math.nan

    @staticmethod
    def sinh(a: float) -> float:
        """Overflow to infinity, with the sign of a."""
        try:
            return math.sinh(a)
        except OverflowError:
            return math.copysign(math.inf, a)

    @staticmethod
    def cosh(a: float) -> float:
        """Overflow to infinity."""
        try:
            return math.cosh(a)
        except OverflowError:
            return math.inf

    def minimum(self, a: float, b: float) -> float:
        """Pass NaN on from either side."""
        return a if a < b or math.isnan(a) else b

    def maximum(self, a: float, b: float) -> float:
        """Pass NaN on from either side."""
        return a if a > b or math.isnan(a) else b

    def select(
        self, relation: Relation, left: float, right: float, then: float, otherwise: float
    ) -> float:
        """Take one of two values that were both computed."""
        return then if (left < right if relation == "<" else left <= right) else otherwise


FLOAT_FUNCTIONS: Functions[float] = FloatFunctions()
