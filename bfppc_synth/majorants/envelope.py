"""Monotone envelopes: an interval (lower, upper) that contains an expression and is nested.

docs/theory.md section 1. The rules are in ``rules.py``, the number types in ``targets.py``.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeVar

import sympy as sp

from bfppc_synth.expressions.flatten import Flattener, split_power
from bfppc_synth.majorants.arithmetic import Arithmetic, Sign
from bfppc_synth.majorants.rules import RULES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

T = TypeVar("T")

__all__ = ["Arithmetic", "Sign", "compile_envelope", "envelope", "magnitude"]

# (rule, positions of the operands, further arguments, subexpression)
_Program = tuple[tuple["Callable[..., Any] | None", tuple[int, ...], tuple[Any, ...], Any], ...]


class EnvelopeFlattener(Flattener):
    """Read products and powers as the envelope rules have them.

    Division is a reciprocal before any power, which keeps the sign that decides a pole; a
    number factor scales; x abs(x) and sgn(x) abs(x)^r are one increasing power of x.
    """

    def product(self, node: sp.Expr) -> int:
        """Write a product: rational coefficient, then the factors in a fixed order."""
        coefficient, rest = node.as_coeff_Mul(rational=True)
        negative, factors = _gather(sp.Mul.make_args(rest))
        positions = self._signed_powers(node, factors)
        positions += [
            self.power(base**exponent, base, exponent) for base, exponent in factors.items()
        ]
        total = positions[0]
        for position in positions[1:]:
            total = self.emit("mul", node, total, position)
        if abs(coefficient) != 1:
            total = self.emit("scale", node, total, constants=(abs(coefficient),))
        return self.emit("neg", node, total) if coefficient.is_negative != negative else total

    def power(self, node: sp.Expr, base: sp.Expr, exponent: sp.Rational) -> int:
        """Write base**exponent for a rational exponent other than 0."""
        operand = self.visit(base)
        if exponent.is_negative:
            operand = self.emit("reciprocal", node, operand)
        return self._positive_power(node, operand, abs(exponent))

    def cotangent(self, node: sp.Expr, argument: int) -> int:
        """Keep cot in one piece: its quotient would lose the sign."""
        return self.emit("cotangent", node, argument)

    def _positive_power(self, node: sp.Expr, operand: int, exponent: sp.Rational) -> int:
        p, q = int(exponent.p), int(exponent.q)
        if (p, q) == (1, 1):
            return operand
        if q % 2 == 0:
            return self.emit("even_root", node, operand, constants=(p, q))
        if p % 2 == 0:
            return self.emit("magnitude_power", node, operand, constants=(p, q))
        if q == 1:
            return self.emit("odd_power", node, operand, constants=(p,))
        return self.emit("signed_power", node, operand, constants=(p, q))

    def _signed_powers(self, node: sp.Expr, factors: dict[sp.Expr, sp.Rational]) -> list[int]:
        """Take the groups sgn(a)^i abs(a)^r a^m out of the factors and write each as one."""
        positions = []
        bases = {factor.args[0] for factor in factors if type(factor) in (sp.Abs, sp.sign)}
        for base in sorted(bases, key=sp.default_sort_key):
            # Of a base that is a sign itself, base and sign(base) are the same factor.
            kinds = dict.fromkeys((sp.Abs(base), base, sp.sign(base)))
            group = [factor for factor in kinds if _joins(factor, base, factors)]
            total = sum((factors[f] for f in group if f != sp.sign(base)), sp.S.Zero)
            if len(group) < 2 or total == 0:
                continue
            odd = sum(int(factors[f].p) for f in group if f != sp.Abs(base)) % 2 == 1
            for factor in group:
                del factors[factor]
            operator = "signed_power" if odd else "magnitude_power"
            constants = (int(total.p), int(total.q))
            positions.append(self.emit(operator, node, self.visit(base), constants=constants))
        return positions


def _gather(factors: tuple[sp.Expr, ...]) -> tuple[bool, dict[sp.Expr, sp.Rational]]:
    """Write factors as {base: exponent} and whether their product is to be negated.

    Equal factors become one power, also those that sympy keeps apart: (x - y) (y - x).
    """
    negative = False
    exponents: dict[sp.Expr, sp.Rational] = {}
    for factor in sorted(factors, key=sp.default_sort_key):
        base, exponent = split_power(factor)
        flipped = base.is_Add and exponent.is_Integer and base.could_extract_minus_sign()
        base = -base if flipped else base
        # Poles and the domains of even roots must survive: no cancelling, no sqrt(x) sqrt(x).
        even_root = exponent.q % 2 == 0 and type(base) is not sp.Abs
        if even_root or exponents.get(base, sp.S.Zero) * exponent < 0:
            base, exponent, flipped = factor, sp.S.One, False
        negative ^= flipped and exponent.p % 2 == 1
        exponents[base] = exponents.get(base, sp.S.Zero) + exponent
    return negative, exponents


def _joins(factor: sp.Expr, base: sp.Expr, factors: dict[sp.Expr, sp.Rational]) -> bool:
    """Say whether a factor of abs(base), base, sign(base) may become part of one power.

    A negative exponent stays outside, so that its pole is seen; so does an even root of the
    base itself, whose domain is smaller.
    """
    exponent = factors.get(factor, sp.S.NegativeOne)
    if exponent.is_negative:
        return False
    if factor == sp.Abs(base):
        return True
    return bool(exponent.is_Integer if factor == sp.sign(base) else exponent.q % 2 == 1)


@lru_cache(maxsize=1024)
def _program(expression: sp.Expr) -> _Program:
    flattener = EnvelopeFlattener()
    last = flattener.visit(expression)
    return tuple(
        (RULES.get(step.operator), step.operands, step.constants, step.node)
        for step in flattener.steps[: last + 1]
    )


def compile_envelope(
    expression: sp.Expr,
) -> Callable[[Mapping[sp.Symbol, tuple[T, T]], Arithmetic[T]], tuple[T, T]]:
    """Find the rules of an expression once; the result is called with (base, arithmetic).

    Raises
    ------
    EnvelopeError
        If a subexpression has no rule, naming it.

    References
    ----------
    docs/theory.md section 1.
    """
    program = _program(expression)

    def run(base: Mapping[sp.Symbol, tuple[T, T]], arithmetic: Arithmetic[T]) -> tuple[T, T]:
        return _run(program, base, arithmetic)

    return run


def envelope(
    expression: sp.Expr, base: Mapping[sp.Symbol, tuple[T, T]], arithmetic: Arithmetic[T]
) -> tuple[T, T]:
    """Enclose an expression over a box; a larger box gives a larger interval.

    Parameters
    ----------
    expression : sp.Expr
        Real expression in the plant file's functions.
    base : Mapping[sp.Symbol, tuple[T, T]]
        (lower, upper) of every free symbol: states over the reachable box, parameters over
        their ranges [units of the symbols].
    arithmetic : Arithmetic[T]
        What the end points are made of.

    Returns
    -------
    tuple[T, T]
        (lower, upper) [unit of the expression]; for floats, up to rounding to nearest.

    Raises
    ------
    EnvelopeError
        If a subexpression has no rule or reaches beyond its domain, naming it.
    KeyError
        If a symbol has no interval.

    References
    ----------
    docs/theory.md section 1; the paper's Definition 1 and Remark 1.
    """
    return _run(_program(expression), base, arithmetic)


def _run(
    program: _Program, base: Mapping[sp.Symbol, tuple[T, T]], arithmetic: Arithmetic[T]
) -> tuple[T, T]:
    results: list[tuple[T, T]] = []
    for rule, operands, constants, node in program:
        if rule is not None:
            results.append(rule(arithmetic, node, *[results[i] for i in operands], *constants))
        elif isinstance(node, sp.Symbol):
            results.append(base[node])
        else:
            value = arithmetic.number(node)
            results.append((value, value))
    return results[-1]


def magnitude(pair: tuple[T, T], arithmetic: Arithmetic[T]) -> T:
    """Return max(upper, -lower): the majorant of what the pair encloses."""
    return arithmetic.maximum(pair[1], arithmetic.neg(pair[0]))
