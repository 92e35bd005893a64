"""Straight-line programs as lines of text, the same way for every language."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from bfppc_synth.codegen.statements import block_of, is_part
from bfppc_synth.model.law import Literal, Operator, Variable

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from bfppc_synth.model.law import Operand, Statement

#: A part longer than this gets a line of its own.
_LONGEST_PART = 50
#: The operators that every language writes between its operands.
INFIX = {Operator.ADD: "+", Operator.SUB: "-", Operator.MUL: "*", Operator.DIV: "/"}
_RELATIONS = {Operator.SELECT_LESS: "<", Operator.SELECT_LESS_EQUAL: "<="}


class Syntax(Protocol):
    """How a language writes what is not infix arithmetic."""

    def literal(self, value: float) -> str:
        """Write a binary64 constant so that it reads back to the same bits."""

    def variable(self, name: str) -> str:
        """Write a name of the law."""

    def rounded(self, text: str) -> str:
        """Write the result of an infix operation, rounded where the language would not."""

    def infix(self, statement: Statement) -> str | None:
        """Return the sign between two operands; None where a function is called."""

    def call(self, statement: Statement, arguments: tuple[str, ...]) -> str:
        """Write a function of one or two arguments."""

    def select(self, condition: str, then: str, otherwise: str) -> str:
        """Write a conditional expression, without outer parentheses."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """``target = text``."""

    target: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class _Text:
    """An expression; ``atomic`` ones need no parentheses as operands."""

    text: str
    atomic: bool

    @property
    def operand(self) -> str:
        return self.text if self.atomic else f"({self.text})"


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """Assignments and the expressions of the results."""

    lines: tuple[Line, ...]
    results: tuple[str, ...]


def render(statements: Iterable[Statement], results: Iterable[Operand], syntax: Syntax) -> Program:
    """Write statements as assignments, parts that are used once inside their user.

    Nesting changes no operation and no order, as every operand is parenthesized.

    Parameters
    ----------
    statements : Iterable[Statement]
        A straight-line program.
    results : Iterable[Operand]
        What is read from it afterwards.
    syntax : Syntax
        The language.

    Returns
    -------
    Program
        Lines in order, and the results as expressions.
    """
    program = tuple(statements)
    wanted = tuple(results)
    uses = Counter(
        operand.name
        for operands in (*(statement.operands for statement in program), wanted)
        for operand in operands
        if isinstance(operand, Variable)
    )
    lines: list[Line] = []
    known: dict[str, _Text] = {}
    for statement in program:
        text, target = _expression(statement, known, syntax), statement.target
        if is_part(target) and uses[target] == 1 and len(text.text) <= _LONGEST_PART:
            known[target] = text
            continue
        if is_part(target):
            # Parts are numbered again, as most of them are gone.
            name = f"{block_of(target)}_{len(lines) + 1}"
            known[target] = _Text(text=syntax.variable(name), atomic=True)
        else:
            name = target
        lines.append(Line(target=syntax.variable(name), text=text.text))
    texts = tuple(_operand(operand, known, syntax).text for operand in wanted)
    return Program(lines=tuple(lines), results=texts)


def _operand(operand: Operand, known: Mapping[str, _Text], syntax: Syntax) -> _Text:
    if isinstance(operand, Literal):
        text = syntax.literal(operand.value)
        return _Text(text=text, atomic=not text.startswith("-"))
    return known.get(operand.name) or _Text(text=syntax.variable(operand.name), atomic=True)


def _expression(statement: Statement, known: Mapping[str, _Text], syntax: Syntax) -> _Text:
    operands = [_operand(operand, known, syntax) for operand in statement.operands]
    operator = statement.operator
    sign = syntax.infix(statement)
    if sign is not None:
        left, right = operands
        plain = f"{left.operand} {sign} {right.operand}"
        text = syntax.rounded(plain)
        return _Text(text=text, atomic=text != plain)
    if operator is Operator.NEG:
        return _Text(text=f"-{operands[0].operand}", atomic=False)
    if operator in _RELATIONS:
        left, right, then, otherwise = operands
        condition = f"{left.operand} {_RELATIONS[operator]} {right.operand}"
        text = syntax.select(condition, then.operand, otherwise.operand)
        return _Text(text=text, atomic=False)
    text = syntax.call(statement, tuple(operand.text for operand in operands))
    return _Text(text=text, atomic=True)
