"""A law without memory of its own: functions of time, states, reference and what was latched.

Solvers and optimizers may ask for the same instant twice, or go back; an object that counts
samples cannot answer them. Screening and the held command belong to that object, and stay there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.codegen.portable import CALLS
from bfppc_synth.codegen.printing import INFIX, render
from bfppc_synth.codegen.provenance import banner, heading
from bfppc_synth.codegen.python import (
    assigned,
    constant_line,
    describe_command,
    describe_signals,
    latched_signals,
    latched_values,
    unpacking,
)
from bfppc_synth.codegen.switching import center_arguments
from bfppc_synth.errors import UsageError
from bfppc_synth.model.law import Operator, Variable
from bfppc_synth.resources import template_environment

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.codegen.printing import Syntax
    from bfppc_synth.model.law import Law, Provenance, Range, Statement

_CASADI = {
    Operator.ABS: "fabs",
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


class CasadiSyntax:
    """Expressions of CasADi's Python interface, which is imported as ``ca``; binary64 only."""

    def __init__(self, law: Law) -> None:
        self._portable = law.arithmetic.portable

    def literal(self, value: float) -> str:
        """Write a binary64 constant."""
        return repr(value)

    def variable(self, name: str) -> str:
        """Write a name of the law."""
        return name

    def rounded(self, text: str) -> str:
        """Nothing to do: CasADi computes in binary64."""
        return text

    def infix(self, statement: Statement) -> str | None:
        """Return the sign between two operands."""
        return INFIX.get(statement.operator)

    def call(self, statement: Statement, arguments: tuple[str, ...]) -> str:
        """Write a function."""
        operator = statement.operator
        if self._portable and operator in CALLS:
            name, more = CALLS[operator]
            return f"portable_{name}({', '.join((*arguments, *map(repr, more)))})"
        return f"ca.{_CASADI[operator]}({', '.join(arguments)})"

    def select(self, condition: str, then: str, otherwise: str) -> str:
        """Write a conditional expression."""
        return f"ca.if_else({condition}, {then}, {otherwise})"


def render_casadi(law: Law, provenance: Provenance) -> str:
    """Print the law as a Python file that builds CasADi Functions.

    Parameters
    ----------
    law : Law
        Any center, any method; binary64.
    provenance : Provenance
        What the head of the file says.

    Returns
    -------
    str
        Functions NAME_start (what the first sample latches) and NAME (the command).

    Raises
    ------
    UsageError
        If the law computes in binary32, which CasADi does not have.
    """
    if law.arithmetic.single:
        raise UsageError(
            f"--to casadi: {law.name} computes in binary32, and CasADi has binary64 only: its"
            " commands would be others; fix: export a design of --real double"
        )
    return render_script("casadi", law, provenance, pure_context(law, CasadiSyntax(law)))


def render_script(
    which: str, law: Law, provenance: Provenance, context: Mapping[str, object]
) -> str:
    """Fill one of templates/interop/*.py.jinja, with what all of them say at their top."""
    return (
        template_environment()
        .get_template(f"interop/{which}.py.jinja")
        .render(
            {
                **context,
                "name": law.name,
                "heading": heading(law.name, law.title),
                "banner": banner(provenance),
                "signals_text": describe_signals(law),
                "u_unit": describe_command(law),
            }
        )
    )


def pure_context(law: Law, syntax: Syntax) -> dict[str, object]:
    """Lay out what templates/interop/law.py.jinja prints.

    Parameters
    ----------
    law : Law
        Any center, any method.
    syntax : Syntax
        Python's or CasADi's.

    Returns
    -------
    dict[str, object]
        Constants, functions, what the first sample latches, and the law on it.
    """
    center = render(law.center.statements, (*law.center.r, law.center.v), syntax)
    feedback = render(law.feedback, (Variable(name="u"),), syntax)
    reference, latch = None, law.center.latch
    if law.reference is not None:
        program = render(law.reference.statements, (law.reference.value,), syntax)
        lines = assigned(program.lines, indent=4)
        reference = {"lines": lines, "value": program.results[0]}
    signals = () if latch is None else render(latch.signals, latched_signals(law), syntax).lines
    begin = () if latch is None else render(latch.statements, latch.values, syntax).lines
    switching = _switching(law, syntax)
    return {
        "order": law.order,
        "states": unpacking(law),
        "derivatives": law.derivatives,
        "formula": law.formula,
        "certified": [constant_line(constant, syntax) for constant in law.certified],
        "portable": [
            {
                "name": function.name,
                "summary": function.summary,
                "parameters": ", ".join(function.parameters),
                "lines": assigned(render(function.statements, (), syntax).lines, indent=4),
                "value": render((), (function.value,), syntax).results[0],
            }
            for function in law.functions
        ],
        "reference": reference,
        "reads_reference": latch is None,
        "signals": assigned(signals, indent=4),
        "begin": assigned(begin, indent=4),
        "offset": syntax.rounded("x_1 - y_d"),
        "latched": latched_values(law, syntax),
        "center": assigned(center.lines, indent=4),
        "feedback": assigned(feedback.lines, indent=4),
        "switching": switching,
        "memory": memory_of(law),
        "rounds": law.arithmetic.single,
        "entries": [f"x_{i}" for i in range(1, law.order + 1)],
    }


def memory_of(law: Law) -> tuple[str, ...]:
    """Name what the law remembers: what is latched, and with stages what a switch changes."""
    if law.center.latch is not None:
        return law.center.latched
    if law.switching is None:
        return ("offset", *law.center.latched)
    numbers = range(1, law.switching.anchors + 1)
    renewed = ("renewed",) if law.switching.anchors and law.center.latched else ()
    anchors = (f"anchor_{number}" for number in numbers)
    times = (f"switched_{number}" for number in numbers)
    return ("stage", "offset", *law.center.latched, *renewed, *anchors, *times)


def _switching(law: Law, syntax: Syntax) -> dict[str, object] | None:
    if law.switching is None:
        return None
    center = render(law.center.statements, law.center.r, syntax)
    passed = center_arguments(law)
    numbers = range(1, law.order + 1)
    read = [f"x_{i}" for i in numbers] + [f"r_{i}" for i in numbers]
    stages = []
    for number, stage in enumerate(law.switching.stages, start=1):
        program = render(stage.feedback, (Variable(name="u"),), syntax)
        stages.append(
            {
                "number": number,
                "lines": assigned(program.lines, indent=4),
                "stays": [side for test in stage.stays for side in _sides(test)],
            }
        )
    arguments = (syntax.rounded(value) if " - " in value else value for _, value in passed)
    return {
        "anchors": law.switching.anchors,
        "read": ", ".join(read),
        "results": ", ".join((*(f"e_{i}" for i in numbers), "u")),
        "center": assigned(center.lines, indent=4),
        "center_results": ", ".join(read[law.order :]),
        "center_parameters": ", ".join(name for name, _ in passed),
        "center_arguments": ", ".join(arguments),
        "stages": stages,
        "starts": law.center.latched,
    }


def _sides(test: Range) -> tuple[str, str]:
    """Compare twice: no object of an optimizer is true or false, so none can be chained."""
    lower = f"-{test.upper}" if test.lower is None else test.lower
    return f"{lower} <= {test.variable}", f"{test.variable} <= {test.upper}"
