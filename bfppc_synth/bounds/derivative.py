"""Derivatives of absolutely continuous expressions, kinks included (docs/theory.md section 2)."""

from __future__ import annotations

import sympy as sp

from bfppc_synth.errors import EnvelopeError

NOT_ENCLOSED_FIX = "give {value, bound, rate}"


def derivative(expression: sp.Expr, variable: sp.Symbol) -> sp.Expr:
    """Differentiate with respect to one variable, almost everywhere.

    sympy's own ``diff`` asks whether arguments are real and leaves Heaviside and DiracDelta
    behind; here a kink is a ``sign``, whose envelope is the hull of the branches' derivatives.

    Parameters
    ----------
    expression : sympy.Expr
        Built from the functions of docs/theory.md section 1; odd roots of negative numbers
        mean sgn(x) abs(x)**(p/q), for which the power rule holds as it stands.
    variable : sympy.Symbol
        What to differentiate by.

    Returns
    -------
    sympy.Expr
        Equal to the derivative outside a set of measure zero.

    Raises
    ------
    EnvelopeError
        If a part may jump (sign, Piecewise): its derivative would not carry its changes.

    References
    ----------
    docs/theory.md section 2, "All suprema over t are rigorous".
    """
    if variable not in expression.free_symbols:
        return sp.S.Zero
    if expression == variable:
        return sp.S.One
    if isinstance(expression, sp.Add):
        return sp.Add(*(derivative(term, variable) for term in expression.args))
    if isinstance(expression, sp.Mul):
        return _product(expression, variable)
    if isinstance(expression, sp.Pow):
        base, exponent = expression.args
        if variable in exponent.free_symbols:
            raise _refusal(expression, "has a varying exponent")
        return exponent * base ** (exponent - 1) * derivative(base, variable)
    if isinstance(expression, sp.sign | sp.Piecewise):
        raise _refusal(expression, "may jump, and a jump has no bounded rate")
    if isinstance(expression, sp.Abs):
        (inner,) = expression.args
        return sp.sign(inner) * derivative(inner, variable)
    if isinstance(expression, sp.Max | sp.Min):
        return _extremum(expression, variable)
    if isinstance(expression, sp.Function) and len(expression.args) == 1:
        (inner,) = expression.args
        return expression.fdiff(1) * derivative(inner, variable)
    raise _refusal(expression, "has no derivative rule")


def _product(expression: sp.Mul, variable: sp.Symbol) -> sp.Expr:
    factors = expression.args
    terms = []
    for index, factor in enumerate(factors):
        rate = derivative(factor, variable)
        if rate != 0:
            terms.append(sp.Mul(rate, *factors[:index], *factors[index + 1 :]))
    return sp.Add(*terms)


def _extremum(expression: sp.Expr, variable: sp.Symbol) -> sp.Expr:
    # max(a, b) = (a + b + |a - b|)/2: the sign of a - b selects the branch, and where that is
    # undecided the two branches' derivatives are its end points.
    side = sp.S.One if isinstance(expression, sp.Max) else sp.S.NegativeOne
    first, *rest = expression.args
    other = rest[0] if len(rest) == 1 else expression.func(*rest)
    rate, other_rate = (derivative(part, variable) for part in (first, other))
    choice = side * sp.sign(first - other)
    return (rate + other_rate) / 2 + choice * (rate - other_rate) / 2


def _refusal(expression: sp.Expr, what: str) -> EnvelopeError:
    return EnvelopeError(
        f"{expression} {what}", subexpression=str(expression), fix=NOT_ENCLOSED_FIX
    )
