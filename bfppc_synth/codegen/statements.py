"""Building straight-line programs: every result has a name and is assigned once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.model.law import Literal, Operator, Statement, Variable

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from bfppc_synth.model.law import Operand

#: Results with this prefix may be written inside the expression that uses them.
PART = "part_"


def is_part(name: str) -> bool:
    """Whether a result was named by the builder and not by the theory."""
    return name.startswith(PART)


def block_of(part: str) -> str:
    """Name of the program that a part belongs to."""
    return part.removeprefix(PART).rpartition("_")[0]


class StatementBuilder:
    """Collects statements; an operation that was already computed is not computed again.

    ``block`` keeps the names of several programs apart that are printed into one function.
    """

    def __init__(self, block: str) -> None:
        self._block = block
        self._statements: list[Statement] = []
        self._known: dict[tuple[Operator, tuple[Operand, ...]], Variable] = {}

    @property
    def statements(self) -> tuple[Statement, ...]:
        """Everything emitted so far, in order."""
        return tuple(self._statements)

    def emit(self, operator: Operator, *operands: Operand) -> Operand:
        """Compute an intermediate result."""
        folded = _fold(operator, operands)
        if folded is not None:
            return folded
        known = self._known.get((operator, operands))
        if known is not None:
            return known
        target = Variable(name=f"{PART}{self._block}_{len(self._known) + 1}")
        self._known[operator, operands] = target
        self._append(target.name, operator, operands)
        return target

    def name(self, target: str, operator: Operator, *operands: Operand) -> Variable:
        """Compute a result that carries a name of the theory."""
        self._append(target, operator, operands)
        return Variable(name=target)

    def power(self, base: Operand, exponent: int) -> Operand:
        """Compute base**exponent, exponent >= 1, as products by repeated squaring.

        A library pow rounds differently from one machine to the next; products do not.
        """
        result: Operand | None = None
        square = base
        while True:
            if exponent % 2 == 1:
                result = square if result is None else self.emit(Operator.MUL, result, square)
            exponent //= 2
            if exponent == 0:
                return square if result is None else result
            square = self.emit(Operator.MUL, square, square)

    def _append(self, target: str, operator: Operator, operands: tuple[Operand, ...]) -> None:
        self._statements.append(Statement(target=target, operator=operator, operands=operands))


def needed(statements: Iterable[Statement], results: Iterable[Operand]) -> tuple[Statement, ...]:
    """Leave out every statement that no result needs."""
    wanted = {operand.name for operand in results if isinstance(operand, Variable)}
    kept: list[Statement] = []
    for statement in reversed(tuple(statements)):
        if statement.target in wanted:
            wanted |= {o.name for o in statement.operands if isinstance(o, Variable)}
            kept.append(statement)
    return tuple(reversed(kept))


def named(
    statements: Iterable[Statement], results: Mapping[str, Operand]
) -> tuple[tuple[Statement, ...], tuple[Operand, ...]]:
    """Give results names of the theory, and leave out what no result needs.

    Parameters
    ----------
    statements : Iterable[Statement]
        A straight-line program.
    results : Mapping[str, Operand]
        Name -> what it names. A constant, an input, and a part that has a name already stay
        what they are.

    Returns
    -------
    tuple
        The statements, in order, and what stands for each result now.
    """
    names: dict[str, str] = {}
    for name, operand in results.items():
        if isinstance(operand, Variable) and is_part(operand.name):
            names.setdefault(operand.name, name)

    def renamed(operand: Operand) -> Operand:
        if isinstance(operand, Literal):
            return operand
        return Variable(name=names.get(operand.name, operand.name))

    program = (
        Statement(
            target=names.get(statement.target, statement.target),
            operator=statement.operator,
            operands=tuple(map(renamed, statement.operands)),
        )
        for statement in needed(statements, results.values())
    )
    return tuple(program), tuple(map(renamed, results.values()))


def _fold(operator: Operator, operands: tuple[Operand, ...]) -> Operand | None:
    """Drop operations that change no bit: 1 x, x / 1, x + 0, and those on two constants.

    + - * are the same here and in the generated code; functions are left to its libm.
    """
    match operator, operands:
        case Operator.NEG, (Literal(value=value),):
            return Literal(value=-value)
        case Operator.ADD, (Literal(value=left), Literal(value=right)):
            return Literal(value=left + right)
        case Operator.SUB, (Literal(value=left), Literal(value=right)):
            return Literal(value=left - right)
        case Operator.MUL, (Literal(value=left), Literal(value=right)):
            return Literal(value=left * right)
        case Operator.MUL, (Literal(value=1.0), other):
            return other
        case ((Operator.MUL | Operator.DIV), (other, Literal(value=1.0))):
            return other
        case Operator.ADD, (Literal(value=0.0), other):
            return other
        case ((Operator.ADD | Operator.SUB), (other, Literal(value=0.0))):
            return other
    return None
