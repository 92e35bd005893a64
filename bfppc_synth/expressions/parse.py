"""Whitelist grammar: text -> model.expression, with the column of every mistake.

Precedence climbing over our own tokens builds our own tree: nothing of the text ever
reaches Python's compiler or sympy's parser, so nothing of it can be executed. ``^`` and
``**`` are the same sign here (Python's own ``^`` binds weaker than ``+``).
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Final, Literal

from bfppc_synth.expressions import constants
from bfppc_synth.expressions.builder import MOST_ARGUMENTS, Builder, Part
from bfppc_synth.expressions.lexer import ExpressionError, Token, TokenKind, read_number
from bfppc_synth.expressions.names import (
    ALIASES,
    BRANCHES,
    CONSTANTS,
    FUNCTIONS,
    KEYWORDS,
)
from bfppc_synth.model.expression import (
    Branches,
    Call,
    Comparison,
    Constant,
    Expression,
    Name,
    Node,
    Number,
    Operation,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

__all__ = ["ExpressionError", "constant_value", "parse_constant", "parse_expression"]


_RELATIONS: Final[dict[str, Literal["<", "<=", ">", ">="]]] = {
    "<": "<",
    "<=": "<=",
    ">": ">",
    ">=": ">=",
}


def parse_expression(
    text: str,
    *,
    names: Collection[str],
    elsewhere: Mapping[str, tuple[str, str]] | None = None,
) -> Expression:
    """Read an expression.

    Parameters
    ----------
    text : str
        Python-like mathematics (SPEC section 1).
    names : collection of str
        States, parameters and ``t`` that may occur; ``pi`` and ``E`` always may.
    elsewhere : mapping, optional
        Names that exist but may not occur here, to (what is wrong, fix).

    Raises
    ------
    ExpressionError
        At the first mistake, with its column.
    """
    part = _Parser(text, frozenset(names), elsewhere or {}).whole()
    return Expression(text=text, tree=part.node)


def parse_constant(text: str) -> Constant:
    """Read a number or a constant expression such as ``pi/60``.

    Raises
    ------
    ExpressionError
        At the first mistake, also when the text contains a name.
    """
    part = _Parser(text, frozenset(), {}).whole()
    if part.value is None:
        fix = "write a number, or numbers, pi and E combined, such as pi/60"
        raise ExpressionError("not a constant", column=1, length=len(text), fix=fix)
    return Constant(
        text=text, tree=part.node, exact=part.value.exact, approximate=part.value.approximate
    )


def constant_value(expression: Expression) -> Constant | None:
    """Return the expression as a constant, or None where it contains a name."""
    try:
        return parse_constant(expression.text)
    except ExpressionError:
        return None


class _Parser(Builder):
    """One pass over one text; the methods are the productions of the grammar."""

    _conditions = 0

    def whole(self) -> Part:
        """Read all of the text."""
        with constants.precise():
            part = self._sum()
        token = self.peek()
        if token.kind is not TokenKind.END:
            raise self.leftover(token)
        return part

    def _sum(self) -> Part:
        left = self._product()
        while self.at("+", "-"):
            sign = self.take().text
            right = self._product()
            left = self.binary("+" if sign == "+" else "-", left, right)
        return left

    def _product(self) -> Part:
        left = self._signed()
        while self.at("*", "/"):
            sign = self.take().text
            right = self._signed()
            left = self.binary("*" if sign == "*" else "/", left, right)
        return left

    def _signed(self) -> Part:
        if not self.at("+", "-"):
            return self._power()
        sign = self.take()
        self.descend()
        part = self._signed()
        self.ascend()
        if sign.text == "+":
            return part
        value = None if part.value is None else constants.negate(part.value)
        node = Operation(operator="neg", operands=(part.node,))
        return self.part(node, sign.start, part.end, part.degree, value)

    def _power(self) -> Part:
        base = self._atom()
        if not self.at("**", "^"):
            return base
        self.take()
        self.descend()
        exponent = self._signed()
        self.ascend()
        if base.node == Name(name="E"):
            return self.exponential(exponent, base.start, exponent.end)
        return self.raised(base, exponent)

    def _atom(self) -> Part:
        token = self.take()
        if token.kind is TokenKind.NUMBER:
            return self._number(token)
        if token.kind is TokenKind.NAME:
            return self._call(token) if self.at("(") else self._name(token)
        if token.text == "(":
            self.descend()
            inner = self._sum()
            closing = self.close(token)
            self.ascend()
            # The parentheses belong to the part, so that a caret underlines them too.
            return Part(
                node=inner.node,
                value=inner.value,
                degree=inner.degree,
                start=token.start,
                end=closing.end,
            )
        raise self.operand_missing(token)

    def _number(self, token: Token) -> Part:
        number = read_number(token)
        value = self.constant(token.start, token.end, lambda: constants.rational(number))
        return self.part(Number(value=number), token.start, token.end, Fraction(0), value)

    def _name(self, token: Token) -> Part:
        name = token.text
        if name in CONSTANTS:
            one = constants.rational(Fraction(1))
            value = constants.PI if name == "pi" else constants.call("exp", (one,))
            return self.part(Name(name=name), token.start, token.end, Fraction(0), value)
        if name in self.names:
            return self.part(Name(name=name), token.start, token.end, Fraction(1), None)
        if name in self.elsewhere:
            message, fix = self.elsewhere[name]
            raise self.error(token, message, fix)
        if name in FUNCTIONS or name in ALIASES or name == BRANCHES:
            raise self.error(token, f"`{name}` without arguments", f"write {name}(...)")
        if name in KEYWORDS:
            fix = "write Piecewise((value, x1 < 1), (other value, True)) if a choice is meant"
            raise self.error(token, f"`{name}` is no mathematics", fix)
        raise self.unknown(token, "name")

    def _call(self, token: Token) -> Part:
        function = ALIASES.get(token.text, token.text)
        if token.text in self.names or token.text in CONSTANTS:
            raise self.error(
                token, f"`{token.text}` is no function", f"write {token.text}*(...) for a product"
            )
        if function != BRANCHES and function not in FUNCTIONS:
            raise self.unknown(token, "function")
        self.descend()
        opening = self.take()
        if function == BRANCHES:
            part = self._branches(token, opening)
        else:
            part = self._function(token, opening, function)
        self.ascend()
        return part

    def _function(self, token: Token, opening: Token, function: str) -> Part:
        arguments: list[Part] = []
        while not self.at(")"):
            arguments.append(self._sum())
            if not self.at(","):
                break
            self.take()
        closing = self.close(opening)
        self.require_arity(token, closing, function, len(arguments))
        values = [part.value for part in arguments if part.value is not None]
        value = None
        if len(values) == len(arguments):
            operands = tuple(values)
            value = self.constant(
                token.start, closing.end, lambda: constants.call(function, operands)
            )
        node = Call(function=function, arguments=tuple(part.node for part in arguments))
        degree = max(part.degree for part in arguments)
        return self.part(node, token.start, closing.end, degree, value)

    def _branches(self, token: Token, opening: Token) -> Part:
        if self._conditions:
            raise self.error(
                token, "a Piecewise inside of a condition", "compare plain expressions"
            )
        form = "write Piecewise((value, x1 < 1), (other value, True))"
        branches: list[tuple[Node, Comparison | None]] = []
        degree = Fraction(0)
        while True:
            if not self.at("("):
                raise self.error(self.peek(), "a branch (value, condition) belongs here", form)
            inner = self.take()
            value = self._sum()
            if not self.at(","):
                raise self.error(self.peek(), "a comma and a condition belong here", form)
            self.take()
            condition = self._condition()
            self.close(inner)
            branches.append((value.node, condition))
            degree = max(degree, value.degree)
            if len(branches) > MOST_ARGUMENTS:
                fix = "nest one Piecewise in the last branch of another"
                raise self.error(inner, f"more than {MOST_ARGUMENTS} branches", fix)
            if condition is None or not self.at(","):
                break
            self.take()
        if self.at(",") and branches[-1][1] is None:
            fix = "remove what follows, or give the branch before it a comparison"
            raise self.error(self.peek(), "no branch is reached after the condition True", fix)
        closing = self.close(opening)
        if branches[-1][1] is not None:
            raise self.error_at(
                token.start,
                closing.end,
                "Piecewise has no value where every condition is false",
                "end with a branch (value, True)",
            )
        return self.part(Branches(branches=tuple(branches)), token.start, closing.end, degree, None)

    def _condition(self) -> Comparison | None:
        token = self.peek()
        if token.kind is TokenKind.NAME and token.text == "True":
            self.take()
            return None
        before = self._conditions
        self._conditions += 1
        left = self._sum()
        sign = self.peek()
        if sign.text not in _RELATIONS:
            raise self.error(
                sign, "a condition is one comparison by < <= > or >=, or True", "write x1 < 1"
            )
        self.take()
        right = self._sum()
        self._conditions = before
        if self.peek().text in _RELATIONS:
            raise self.error(
                self.peek(),
                "conditions are single comparisons",
                "nest one Piecewise in another",
            )
        return Comparison(relation=_RELATIONS[sign.text], left=left.node, right=right.node)
