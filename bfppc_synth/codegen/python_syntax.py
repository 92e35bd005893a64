"""How Python writes the operations of a law."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.codegen.portable import CALLS, every_statement
from bfppc_synth.codegen.printing import INFIX
from bfppc_synth.codegen.switching import center_arguments
from bfppc_synth.codegen.totality import latched_ranges, raising
from bfppc_synth.model.law import Operator, Variable

if TYPE_CHECKING:
    from bfppc_synth.model.law import Law, Statement

#: Names of the math module, as the template imports them.
_FUNCTIONS = {
    Operator.SQRT: "sqrt",
    Operator.EXP: "exp",
    Operator.LOG: "log",
    Operator.SIN: "sin",
    Operator.COS: "cos",
    Operator.TAN: "tan",
    Operator.TANH: "tanh",
    Operator.SINH: "sinh",
    Operator.COSH: "cosh",
    Operator.ATAN: "atan",
    Operator.ASINH: "asinh",
    Operator.POW: "power",
}
#: math.pow under a name that is no builtin.
IMPORTED = {"power": "pow as power"}


class PythonSyntax:
    """Python expressions; remembers what has to be imported or defined for them."""

    def __init__(self, law: Law) -> None:
        elapsed = (0.0, law.elapsed_limit)
        names = (name for name, _ in center_arguments(law))
        known = {name: elapsed for name in names if name.startswith(("elapsed", "since"))}
        if law.center.latch is not None:
            known = latched_ranges(law)
            latch = law.center.latch
            self._raising = raising(
                (*latch.signals, *latch.statements, *law.center.statements), known
            )
        else:
            self._raising = raising(law.center.statements, known)
        if law.reference is not None:
            self._raising |= raising(law.reference.statements, {"t": elapsed})
        self._arithmetic = law.arithmetic
        if law.arithmetic.single:
            # What is not 0 in binary64 may be it in binary32.
            self._raising |= _dividing(law)
        self.functions: set[str] = set()
        self.helpers: set[str] = set()

    def literal(self, value: float) -> str:
        """Write a constant of the code; a number of binary32 is one of binary64 too."""
        return repr(self._arithmetic.nearest(value))

    def variable(self, name: str) -> str:
        """Write a name of the law."""
        return name

    def rounded(self, text: str) -> str:
        """Round the result of an operation to binary32: Python has no such numbers."""
        return f"single({text})" if self._arithmetic.single else text

    def infix(self, statement: Statement) -> str | None:
        """Return the sign between two operands; None where a helper answers as C does."""
        if statement.operator is Operator.DIV and statement.target in self._raising:
            return None
        return INFIX.get(statement.operator)

    def call(self, statement: Statement, arguments: tuple[str, ...]) -> str:
        """Write a function."""
        operator = statement.operator
        if operator is Operator.ABS:
            return f"abs({arguments[0]})"
        if self._arithmetic.portable and operator in CALLS:
            name, more = CALLS[operator]
            return f"portable_{name}({', '.join((*arguments, *map(repr, more)))})"
        name = "divide" if operator is Operator.DIV else _FUNCTIONS[operator]
        if statement.target in self._raising:
            self.helpers.add(name)
            name = f"ieee_{name}"
        else:
            self.functions.add(name)
        return self.rounded(f"{name}({', '.join(arguments)})")

    def select(self, condition: str, then: str, otherwise: str) -> str:
        """Write a conditional expression."""
        return f"{then} if {condition} else {otherwise}"


def _dividing(law: Law) -> frozenset[str]:
    """Divisions by anything but a constant."""
    constants = {constant.name for constant in law.certified if constant.value}
    return frozenset(
        s.target
        for s in every_statement(law)
        if s.operator is Operator.DIV
        and isinstance(s.operands[1], Variable)
        and s.operands[1].name not in constants
    )
