"""The reference expression as statements: sympy's tree in the law's few operators."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.codegen.statements import StatementBuilder
from bfppc_synth.errors import UsageError
from bfppc_synth.expressions.evaluate import evaluate
from bfppc_synth.model.law import Literal, Operator, ReferenceBlock, Variable

if TYPE_CHECKING:
    from bfppc_synth.expressions.evaluate import Functions
    from bfppc_synth.expressions.flatten import Relation
    from bfppc_synth.model.law import Operand

_ZERO = Literal(value=0.0)
#: Digits after which a constant is rounded to the nearest binary64.
_DIGITS = 40


def compile_reference(expression: sp.Expr, time: sp.Symbol) -> ReferenceBlock:
    """Write y_d(t) as a straight-line program.

    Parameters
    ----------
    expression : sp.Expr
        The reference; its only free symbol is ``time``.
    time : sp.Symbol
        Time since the first sample [s].

    Returns
    -------
    ReferenceBlock
        Statements in the variable ``t``; constants are the nearest binary64 numbers.

    Raises
    ------
    UsageError
        If the expression has another free symbol.
    EnvelopeError
        If a subexpression is no function of the plant file's mathematics.
    """
    strangers = sorted(symbol.name for symbol in expression.free_symbols - {time})
    if strangers:
        raise UsageError(
            f"reference: {', '.join(strangers)} stands in {expression}, but the controller "
            "computes the reference from t alone\n  fix: write the number itself"
        )
    builder = StatementBuilder("reference")
    value = evaluate(expression, {time: Variable(name="t")}, statement_functions(builder))
    return ReferenceBlock(statements=builder.statements, value=value)


def statement_functions(builder: StatementBuilder) -> Functions[Operand]:
    """Return the target that writes every operation as a statement of a builder."""
    return _StatementFunctions(builder)


class _StatementFunctions:
    """``Functions[Operand]`` of ``expressions.evaluate``: each operation becomes a statement."""

    def __init__(self, builder: StatementBuilder) -> None:
        self._emit = builder.emit
        self._power = builder.power

    def number(self, value: sp.Expr) -> Operand:
        if isinstance(value, sp.Rational):
            # Integer division rounds correctly; a detour over decimals would round twice.
            return Literal(value=int(value.p) / int(value.q))
        return Literal(value=float(sp.N(value, _DIGITS)))

    def add(self, a: Operand, b: Operand) -> Operand:
        return self._emit(Operator.ADD, a, b)

    def sub(self, a: Operand, b: Operand) -> Operand:
        return self._emit(Operator.SUB, a, b)

    def mul(self, a: Operand, b: Operand) -> Operand:
        return self._emit(Operator.MUL, a, b)

    def div(self, a: Operand, b: Operand) -> Operand:
        return self._emit(Operator.DIV, a, b)

    def neg(self, a: Operand) -> Operand:
        return self._emit(Operator.NEG, a)

    def power(self, a: Operand, exponent: int) -> Operand:
        return self._power(a, exponent)

    def sqrt(self, a: Operand) -> Operand:
        return self._emit(Operator.SQRT, a)

    def root_power(self, a: Operand, p: int, q: int) -> Operand:
        exponent = Literal(value=p / q)
        if q % 2 == 0:
            return self._emit(Operator.POW, a, exponent)
        # sgn(a) abs(a)^(p/q): C, Python and sympy each do something else with a negative base.
        root = self._emit(Operator.POW, self.absolute(a), exponent)
        if p % 2 == 0:
            return root
        return self._emit(Operator.SELECT_LESS, a, _ZERO, self.neg(root), root)

    def absolute(self, a: Operand) -> Operand:
        return self._emit(Operator.ABS, a)

    def sign(self, a: Operand) -> Operand:
        upper = self._emit(Operator.SELECT_LESS, _ZERO, a, Literal(value=1.0), _ZERO)
        return self._emit(Operator.SELECT_LESS, a, _ZERO, Literal(value=-1.0), upper)

    def exp(self, a: Operand) -> Operand:
        return self._emit(Operator.EXP, a)

    def log(self, a: Operand) -> Operand:
        return self._emit(Operator.LOG, a)

    def sin(self, a: Operand) -> Operand:
        return self._emit(Operator.SIN, a)

    def cos(self, a: Operand) -> Operand:
        return self._emit(Operator.COS, a)

    def tan(self, a: Operand) -> Operand:
        return self._emit(Operator.TAN, a)

    def sinh(self, a: Operand) -> Operand:
        return self._emit(Operator.SINH, a)

    def cosh(self, a: Operand) -> Operand:
        return self._emit(Operator.COSH, a)

    def tanh(self, a: Operand) -> Operand:
        return self._emit(Operator.TANH, a)

    def atan(self, a: Operand) -> Operand:
        return self._emit(Operator.ATAN, a)

    def asinh(self, a: Operand) -> Operand:
        return self._emit(Operator.ASINH, a)

    def minimum(self, a: Operand, b: Operand) -> Operand:
        return self._emit(Operator.SELECT_LESS, b, a, b, a)

    def maximum(self, a: Operand, b: Operand) -> Operand:
        return self._emit(Operator.SELECT_LESS, a, b, b, a)

    def select(
        self, relation: Relation, left: Operand, right: Operand, then: Operand, otherwise: Operand
    ) -> Operand:
        operator = Operator.SELECT_LESS if relation == "<" else Operator.SELECT_LESS_EQUAL
        return self._emit(operator, left, right, then, otherwise)
