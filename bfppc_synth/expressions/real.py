"""sympy's operations on real numbers, kept real.

sympy reads an odd root of a negative number as a complex number, and on its way to a normal
form merges ``(x**(2/3))**(1/2)`` into ``x**(1/3)``, which for real x must be
``Abs(x)**(1/3)``. Every power is therefore built by ``real_power``, which keeps two promises:
a power with even numerator and odd denominator has a base known to be nonnegative, and no
negative number stands under a root.
"""

from __future__ import annotations

import sympy as sp


def real_abs(argument: sp.Expr) -> sp.Expr:
    """Return abs(x) without a detour through complex numbers."""
    # sympy takes sqrt(x) for complex where x < 0 and would rewrite its absolute value in
    # arguments and real parts; here a root is real wherever it is defined.
    return sp.Abs(argument, evaluate=argument.is_extended_real is True)


def real_sign(argument: sp.Expr) -> sp.Expr:
    """Return sign(x) without a detour through complex numbers."""
    return sp.sign(argument, evaluate=argument.is_extended_real is True)


def real_tan(argument: sp.Expr) -> sp.Expr:
    """Return tan(x), never cot."""
    # sympy writes tan(x + pi/2) as -cot(x); no rule is wanted for a function nobody typed.
    return sp.tan(argument).replace(sp.cot, lambda x: sp.cos(x) / sp.sin(x))


def real_power(base: sp.Expr, exponent: sp.Rational) -> sp.Expr:
    """Return base**exponent; an odd root keeps the sign, an even numerator loses it."""
    if exponent.q == 1 or exponent.q % 2 == 0:
        return protected(sp.Pow(base, exponent))
    coefficient, _ = base.as_coeff_Mul()
    sign = 1
    if coefficient.is_negative:
        base = -base
        sign = 1 if exponent.p % 2 == 0 else -1
    if exponent.p % 2 == 0:
        base = real_abs(base)
    return sign * protected(sp.Pow(base, exponent))


def protected(expression: sp.Expr) -> sp.Expr:
    """Keep both promises for the factors that the last operation may have merged."""
    factors = sp.Mul.make_args(expression)
    kept = tuple(_protected_factor(factor) for factor in factors)
    return expression if kept == factors else sp.Mul(*kept)


def _protected_factor(factor: sp.Expr) -> sp.Expr:
    if not isinstance(factor, sp.Pow) or not factor.exp.is_Rational:
        return factor
    base, exponent = factor.base, factor.exp
    if exponent.q == 1 or exponent.q % 2 == 0 or base.is_nonnegative:
        return factor
    if exponent.p % 2 == 0:
        return sp.Pow(real_abs(base), exponent)
    if base.is_number and base.is_negative:
        return -sp.Pow(-base, exponent)
    return factor
