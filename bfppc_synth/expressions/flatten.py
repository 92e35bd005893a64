"""Sympy expressions as straight-line steps: the one place that knows sympy's classes.

``evaluate`` runs the steps in a target's functions, the majorants run them on envelopes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import sympy as sp

from bfppc_synth.errors import EnvelopeError

if TYPE_CHECKING:
    from collections.abc import Callable

Relation = Literal["<", "<="]

# sympy's classes with one argument and one meaning; what is in no table here is refused.
_UNARY: dict[Any, str] = {
    sp.exp: "exp",
    sp.log: "log",
    sp.sin: "sin",
    sp.cos: "cos",
    sp.tan: "tan",
    sp.sinh: "sinh",
    sp.cosh: "cosh",
    sp.tanh: "tanh",
    sp.atan: "atan",
    sp.asinh: "asinh",
    sp.Abs: "absolute",
    sp.sign: "sign",
}
_RELATIONS: dict[Any, tuple[Relation, int, int]] = {
    sp.StrictLessThan: ("<", 0, 1),
    sp.LessThan: ("<=", 0, 1),
    sp.StrictGreaterThan: ("<", 1, 0),
    sp.GreaterThan: ("<=", 1, 0),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One operation on earlier steps.

    ``operator`` is a method of Functions, or ``symbol`` or ``number`` (``constants`` holds what
    they stand for). ``operands`` are positions of earlier steps, ``constants`` further
    arguments, which come first for ``select`` and last elsewhere; ``node`` is the
    subexpression, for messages.
    """

    operator: str
    operands: tuple[int, ...]
    constants: tuple[Any, ...]
    node: sp.Expr


class Flattener:
    """Write one expression as steps, equal subexpressions once.

    ``product``, ``power`` and ``cotangent`` are what another reading of the same expression
    overrides (``majorants.envelope``).
    """

    def __init__(self) -> None:
        self.steps: list[Step] = []
        self._positions: dict[sp.Expr, int] = {}
        self._emitted: dict[tuple[object, ...], int] = {}

    def emit(
        self, operator: str, node: sp.Expr, *operands: int, constants: tuple[Any, ...] = ()
    ) -> int:
        """Append a step, or find the equal earlier one; return its position."""
        key = (operator, operands, constants)
        if key not in self._emitted:
            self._emitted[key] = len(self.steps)
            self.steps.append(
                Step(operator=operator, operands=operands, constants=constants, node=node)
            )
        return self._emitted[key]

    def visit(self, node: sp.Expr) -> int:
        """Return the position of a node's value."""
        if node not in self._positions:
            # The type, not isinstance: sympy counts Pow(E, x) as an exp whose argument is E.
            write = self._writers.get(type(node), Flattener._leaf)
            self._positions[node] = write(self, node)
        return self._positions[node]

    def _leaf(self, node: sp.Expr) -> int:
        if isinstance(node, sp.Symbol):
            return self.emit("symbol", node, constants=(node,))
        if node.is_finite and (isinstance(node, (sp.Rational, sp.Float)) or node in (sp.pi, sp.E)):
            return self.emit("number", node, constants=(node,))
        raise no_rule(node)

    def _unary(self, node: sp.Expr) -> int:
        return self.emit(_UNARY[type(node)], node, self.visit(node.args[0]))

    def _extremum(self, node: sp.Expr) -> int:
        operator = "minimum" if type(node) is sp.Min else "maximum"
        operands = [self.visit(a) for a in sorted(node.args, key=sp.default_sort_key)]
        return self._chain(operator, node, operands)

    def _branches(self, node: sp.Expr) -> int:
        *cases, (last, condition) = node.args
        if condition != sp.true:
            raise EnvelopeError(
                f"{node} has no value where none of its conditions holds",
                subexpression=str(node),
                fix="end the Piecewise with (value, True)",
            )
        result = self.visit(last)
        for value, test in reversed(cases):
            if type(test) not in _RELATIONS:
                raise no_rule(test)
            relation, left, right = _RELATIONS[type(test)]
            sides = (self.visit(test.args[left]), self.visit(test.args[right]))
            operands = (*sides, self.visit(value), result)
            result = self.emit("select", node, *operands, constants=(relation,))
        return result

    def _sum(self, node: sp.Expr) -> int:
        # What is added comes first, so that -x + y reads y - x and costs one operation.
        terms = [(t.as_coeff_Mul()[0].is_negative, t) for t in node.as_ordered_terms()]
        plus = [self.visit(term) for minus, term in terms if not minus]
        minus = [self.visit(-term) for minus, term in terms if minus]
        total = self._chain("add", node, plus) if plus else self.emit("neg", node, minus.pop(0))
        return self._chain("sub", node, [total, *minus])

    def _product(self, node: sp.Expr) -> int:
        return self.product(node)

    def product(self, node: sp.Expr) -> int:
        """Write a product as numerator / denominator."""
        coefficient, rest = node.as_coeff_Mul(rational=True)
        if coefficient.is_negative:
            return self.emit("neg", node, self.visit(-coefficient * rest))
        over: list[int] = []
        under: list[int] = []
        # x/10 is rounded once, 0.1 * x twice; other fractions become one literal.
        if coefficient.p == 1 and coefficient.q != 1:
            under.append(self.visit(sp.Integer(coefficient.q)))
        elif coefficient != 1:
            over.append(self.visit(coefficient))
        for factor in sorted(sp.Mul.make_args(rest), key=sp.default_sort_key):
            base, exponent = split_power(factor)
            if exponent.is_negative:
                under.append(self.power(factor, base, -exponent))
            else:
                over.append(self.visit(factor))
        return self._quotient(node, over, under)

    def _quotient(self, node: sp.Expr, over: list[int], under: list[int]) -> int:
        numerator = self._chain("mul", node, over) if over else self.visit(sp.S.One)
        if not under:
            return numerator
        return self.emit("div", node, numerator, self._chain("mul", node, under))

    def _chain(self, operator: str, node: sp.Expr, positions: list[int]) -> int:
        total = positions[0]
        for position in positions[1:]:
            total = self.emit(operator, node, total, position)
        return total

    def _power(self, node: sp.Expr) -> int:
        base, exponent = node.args
        if exponent.is_Rational:
            return self.power(node, base, exponent)
        if base == sp.E:
            return self.emit("exp", node, self.visit(exponent))
        if base.is_number and base.is_positive:
            # The grammar has no such power, but sympy may make one of exp(log(2)*x).
            return self.emit("exp", node, self.visit(exponent * sp.log(base)))
        raise no_rule(node)

    def power(self, node: sp.Expr, base: sp.Expr, exponent: sp.Rational) -> int:
        """Write base**exponent for a rational exponent other than 0."""
        if exponent.is_negative:
            return self._quotient(node, [], [self.power(node, base, -exponent)])
        p, q = int(exponent.p), int(exponent.q)
        operand = self.visit(base)
        if q == 2:
            operand, q = self.emit("sqrt", node, operand), 1
        if q == 1:
            return operand if p == 1 else self.emit("power", node, operand, constants=(p,))
        return self.emit("root_power", node, operand, constants=(p, q))

    def _cotangent(self, node: sp.Expr) -> int:
        # sympy itself turns tan(x + pi/2) into -cot(x).
        return self.cotangent(node, self.visit(node.args[0]))

    def cotangent(self, node: sp.Expr, argument: int) -> int:
        """Write cot as cos / sin."""
        cosine = self.emit("cos", node, argument)
        return self.emit("div", node, cosine, self.emit("sin", node, argument))

    _writers: ClassVar[dict[Any, Callable[[Flattener, sp.Expr], int]]] = {
        **dict.fromkeys(_UNARY, _unary),
        sp.cot: _cotangent,
        sp.Min: _extremum,
        sp.Max: _extremum,
        sp.Piecewise: _branches,
        sp.Add: _sum,
        sp.Mul: _product,
        sp.Pow: _power,
    }


def split_power(factor: sp.Expr) -> tuple[sp.Expr, sp.Rational]:
    """Split a factor into base and rational exponent; exp and irrational powers stay whole."""
    if type(factor) is sp.Pow and factor.exp.is_Rational:
        return factor.base, factor.exp
    return factor, sp.S.One


def no_rule(node: sp.Expr) -> EnvelopeError:
    """Build the refusal of a subexpression that no table has."""
    return EnvelopeError(
        f"{node} has no rule: it is neither a finite real number nor a listed function",
        subexpression=str(node),
        fix="write it with the functions of docs/theory.md section 1",
    )


@lru_cache(maxsize=1024)
def flatten(expression: sp.Expr) -> tuple[Step, ...]:
    """Write an expression as steps, the last of which is its value.

    Raises
    ------
    EnvelopeError
        If a subexpression has no rule, naming it.
    """
    flattener = Flattener()
    last = flattener.visit(expression)
    return tuple(flattener.steps[: last + 1])
