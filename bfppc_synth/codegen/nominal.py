"""Center nominal as statements: r_1..r_n and v by unrolled Taylor arithmetic.

Three programs: the coefficients y_k of the reference at every step, what is latched at the first
accepted sample, and the center at every step. One control step runs no loop in any language.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.codegen.reference import statement_functions
from bfppc_synth.codegen.statements import StatementBuilder, named, needed
from bfppc_synth.expressions.evaluate import evaluate
from bfppc_synth.expressions.nominal import (
    center_series,
    fading_series,
    start_series,
    transition_weights,
)
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.model.law import CenterBlock, LatchBlock, Literal, Operator, Variable

if TYPE_CHECKING:
    import sympy as sp

    from bfppc_synth.model.law import Operand, Statement
    from bfppc_synth.model.nominal import NominalModel

_ELAPSED = Variable(name="elapsed")
_DURATION = Variable(name="T_s")
_ONE = Literal(value=1.0)


def nominal_center(model: NominalModel, reference: sp.Expr | None, time: sp.Symbol) -> CenterBlock:
    """Write r_1 = y_d + b, r_{i+1} = (dr_i - f^_i) / g^_i, v = r_{n+1} as statements.

    Parameters
    ----------
    model : NominalModel
        f^, g^ and T_s; the code reads T_s by its name.
    reference : sp.Expr | None
        y_d(t), compiled in; None where y_d_0..y_d_n are passed with every sample.
    time : sp.Symbol
        The symbol of the reference [s since the first sample].

    Returns
    -------
    CenterBlock
        With ``latch``; what is latched are the n weights b_0..b_{n-1} of the transition.

    Raises
    ------
    EnvelopeError
        If f^, g^ or the reference has a subexpression that cannot be differentiated.

    References
    ----------
    docs/theory.md section 4.
    """
    signals, y = _reference(model.order, reference, time)
    start, values = _start(model, y)
    latched = tuple(f"b_{j}" for j in range(model.order))
    statements, (*r, v) = _center(model, y, tuple(Variable(name=name) for name in latched))
    return CenterBlock(
        statements=statements,
        r=tuple(r),
        v=v,
        latched=latched,
        latch=LatchBlock(signals=signals, statements=start, values=values),
    )


def _reference(
    order: int, reference: sp.Expr | None, time: sp.Symbol
) -> tuple[tuple[Statement, ...], tuple[Operand, ...]]:
    """y_k = y_d^(k)/k!, k = 0..n: of the expression at ``elapsed``, or of what is passed."""
    builder = StatementBuilder("signal")
    series: tuple[Operand, ...]
    if reference is None:
        passed = (Variable(name=f"y_d_{k}") for k in range(order + 1))
        series = tuple(
            builder.emit(Operator.DIV, value, Literal(value=float(math.factorial(k))))
            for k, value in enumerate(passed)
        )
    else:
        base = statement_functions(builder)
        functions: TaylorFunctions[Operand] = TaylorFunctions(base, order + 1)
        series = evaluate(reference, {time: (_ELAPSED, _ONE)}, functions)
    return named(builder.statements, {f"y_{k}": value for k, value in enumerate(series)})


def _start(
    model: NominalModel, y: tuple[Operand, ...]
) -> tuple[tuple[Statement, ...], tuple[Operand, ...]]:
    """Latch b^(j)(0)/j! as weights: the measured start's own course minus the reference's."""
    builder = StatementBuilder("start")
    base = statement_functions(builder)
    start: tuple[Operand, ...] = tuple(Variable(name=f"x_{i}") for i in range(1, model.order + 1))
    course = start_series(model, base, start)
    functions: TaylorFunctions[Operand] = TaylorFunctions(base, model.order)
    values = transition_weights(base, functions.sub(course, y), _DURATION)
    return needed(builder.statements, values), values


def _center(
    model: NominalModel, y: tuple[Operand, ...], weights: tuple[Operand, ...]
) -> tuple[tuple[Statement, ...], tuple[Operand, ...]]:
    builder = StatementBuilder("center")
    base, length = statement_functions(builder), model.order + 1
    # From T_s on the share stays 1, where every coefficient of the transition is exactly 0.
    share = base.div(base.minimum(_DURATION, _ELAPSED), _DURATION)
    transition = fading_series(base, weights, share, _DURATION, length=length)
    r, v = center_series(model, base, y, transition, length=length)
    results = {f"r_{i}": series[0] for i, series in enumerate(r, start=1)}
    return named(builder.statements, results | {"v": v[0]})
