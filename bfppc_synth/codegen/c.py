"""Law -> C99: header, source, example and build files.

The certified constants stand in NAME.c in the form that ``codegen.python`` describes at its top.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.codegen.checks import CHECKS, beyond_limits
from bfppc_synth.codegen.portable import CALLS
from bfppc_synth.codegen.printing import INFIX, render
from bfppc_synth.codegen.provenance import banner, heading
from bfppc_synth.codegen.python import (
    describe_command,
    describe_signals,
    latched_offset,
    latched_signals,
    latched_values,
)
from bfppc_synth.codegen.switching import center_arguments
from bfppc_synth.model.law import Operator, Variable
from bfppc_synth.resources import template_environment

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.codegen.printing import Line
    from bfppc_synth.model.law import Law, NamedConstant, Provenance, Range, Statement

#: What render_c writes (path under the folder, with NAME for the plant's name): its template.
FILES = {
    "c/include/NAME.h": "c/controller.h.jinja",
    "c/src/NAME.c": "c/controller.c.jinja",
    "c/example/main.c": "c/main.c.jinja",
    "c/Makefile": "c/Makefile.jinja",
    "c/CMakeLists.txt": "c/CMakeLists.txt.jinja",
    "c/README.md": "c/README.md.jinja",
    **CHECKS,
}
_WIDTH = 100
_FUNCTIONS = {
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
    Operator.POW: "pow",
}


def render_c(law: Law, provenance: Provenance) -> dict[str, str]:
    """Print the controller as a C99 folder.

    Parameters
    ----------
    law : Law
        The controller.
    provenance : Provenance
        What the head of every file says.

    Returns
    -------
    dict[str, str]
        Path under the generated folder -> text; equal laws give equal bytes.

    Raises
    ------
    ResourceError
        If the installation has no templates.
    """
    context = _context(law, provenance)
    environment = template_environment()
    return {
        path.replace("NAME", law.name): environment.get_template(template).render(context)
        for path, template in FILES.items()
    }


def c_literal(law: Law) -> Callable[[float], str]:
    """Return what writes a number of the law in C."""
    return _CSyntax(law).literal


def _context(law: Law, provenance: Provenance) -> dict[str, object]:
    syntax = _CSyntax(law)
    center = render(law.center.statements, (*law.center.r, law.center.v), syntax)
    feedback = render(law.feedback, (Variable(name="u"),), syntax)
    reference = None
    if law.reference is not None:
        program = render(law.reference.statements, (law.reference.value,), syntax)
        read = (law.reference.value, *(o for s in law.reference.statements for o in s.operands))
        reference = {
            "lines": _declared(law, program.lines, indent=4),
            "value": program.results[0],
            "reads_time": Variable(name="t") in read,
        }
    return {
        "name": law.name,
        "heading": heading(law.name, law.title),
        "signals": describe_signals(law),
        "u_unit": describe_command(law),
        "banner": banner(provenance),
        "status": provenance.status,
        "order": law.order,
        "formula": law.formula,
        "real": law.arithmetic.real.value,
        "zero": syntax.literal(0.0),
        "portable": _portable(law, syntax),
        "certified": [_constant_line(constant, syntax) for constant in law.certified],
        "unread": [
            f"{law.name}_{constant.name}" for constant in law.certified if not constant.used
        ],
        "limits": [_constant_line(constant, syntax) for constant in law.limits],
        "derived": _declared(law, render(law.derived, (), syntax).lines, indent=12),
        "inputs": [_within(test, syntax) for test in law.inputs],
        "reference_tests": [_within(test, syntax) for test in law.reference_ranges],
        "derivatives": law.derivatives,
        "early": _time_tests(law),
        "time_limit": law.time_limit,
        "elapsed_limit": law.elapsed_limit,
        "reference": reference,
        "latch": _latch(law, syntax),
        "latched": latched_values(law, syntax),
        "start": [_within(test, syntax) for test in law.start],
        "center": _declared(law, center.lines, indent=12),
        "feedback": _judged(law, feedback.lines, syntax),
        "tube": [_within(test, syntax) for test in law.tube],
        "switching": _switching(law, syntax),
        **beyond_limits(law, syntax.literal),
        "example_x": ", ".join(syntax.literal(value) for value in _middle(law)),
        "u_max": repr(law.u_max),
        "accuracy": repr(law.accuracy),
        "transition": next((c.value for c in law.certified if c.name == "T_s"), None),
    }


def _latch(law: Law, syntax: _CSyntax) -> dict[str, object] | None:
    """Lay out what center nominal does before its center."""
    latch = law.center.latch
    if latch is None:
        return None
    signals = render(latch.signals, latched_signals(law), syntax)
    start = render(latch.statements, latch.values, syntax)
    return {
        "signals": _declared(law, signals.lines, indent=12),
        "start": _declared(law, start.lines, indent=16),
        "offset": latched_offset(law, syntax),
    }


def _portable(law: Law, syntax: _CSyntax) -> list[dict[str, object]]:
    """Lay out the functions that the file contains."""
    return [
        {
            "name": function.name,
            "summary": function.summary,
            "parameters": ", ".join(f"{law.name}_real {name}" for name in function.parameters),
            "lines": _declared(law, render(function.statements, (), syntax).lines, indent=4),
            "value": render((), (function.value,), syntax).results[0],
        }
        for function in law.functions
    ]


def _switching(law: Law, syntax: _CSyntax) -> dict[str, object] | None:
    """Lay out the stages as functions of states and center; the state counts them from 0."""
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
                "lines": _declared(law, program.lines, indent=4),
                "stays": [_within(test, syntax) for test in stage.stays],
                "expected": [_within(test, syntax) for test in stage.expected],
            }
        )
    return {
        "anchors": list(range(1, law.switching.anchors + 1)),
        "numbers": list(numbers),
        "read": ", ".join(read),
        "results": ", ".join(f"&e_{i}" for i in numbers),
        "parameters": [f"{law.name}_real {name}" for name in read],
        "center_lines": _declared(law, center.lines, indent=4),
        "center_parameters": [f"{law.name}_real {name}" for name, _ in passed],
        "center_arguments": ", ".join(value for _, value in passed),
        "center_results": ", ".join(f"&r_{i}" for i in numbers),
        "stages": stages,
    }


def _judged(law: Law, lines: tuple[Line, ...], syntax: _CSyntax) -> list[str]:
    """Declare results, and test each error where it is known: none is kept over a call of tanh."""
    tests = {test.variable: _within(test, syntax) for test in law.tube}
    # Center nominal divides: a command held back because v has no value is not OK.
    declared = [] if law.center.latch is None else ["bool inside = (isfinite(v) != 0);"]
    left = "inside = inside &&" if declared else "bool inside ="
    for line in lines:
        declared += _declared(law, (line,), indent=12)
        if line.target in tests:
            declared.append(f"{left} {tests[line.target]};")
            left = "inside = inside &&"
    return declared


def _middle(law: Law) -> tuple[float, ...]:
    """Middle of the box of first samples."""
    limits = {constant.name: float(constant.value) for constant in law.limits}
    return tuple(
        0.5 * (limits[f"start_lower_{i}"] + limits[f"start_upper_{i}"])
        for i in range(1, law.order + 1)
    )


def _constant_line(constant: NamedConstant, syntax: _CSyntax) -> str:
    name, value = syntax.name, syntax.literal(float(constant.value))
    return f"static const {name}_real {name}_{constant.name} = {value};"


def _declared(law: Law, lines: tuple[Line, ...], *, indent: int) -> list[str]:
    """Write results as declarations; a long one goes on in the next line."""
    declared: list[str] = []
    for line in lines:
        left = f"const {law.name}_real {line.target} ="
        whole = f"{left} {line.text};"
        wide = indent + len(whole) > _WIDTH
        declared += [left, f"    {line.text};"] if wide else [whole]
    return declared


def _time_tests(law: Law) -> list[str]:
    """List what makes a sample BAD_TIME; any one does."""
    name = law.name
    tests = [f"(started && !((s->t_last <= t) && (elapsed <= {name}_elapsed_limit)))"]
    if law.time_limit is not None:
        tests.append(f"!((t > -{name}_time_limit) && (t < {name}_time_limit))")
    return tests


def _within(test: Range, syntax: _CSyntax) -> str:
    upper = syntax.variable(test.upper)
    lower = f"-{upper}" if test.lower is None else syntax.variable(test.lower)
    return f"{syntax.name}_in_range({syntax.variable(test.variable)}, {lower}, {upper})"


class _CSyntax:
    """C expressions; constants of the file carry the prefix, locals do not."""

    def __init__(self, law: Law) -> None:
        self.name = law.name
        self._arithmetic = law.arithmetic
        self._constants = {constant.name for constant in (*law.certified, *law.limits)}

    def literal(self, value: float) -> str:
        suffix = "F" if self._arithmetic.single else ""
        return self._arithmetic.literal(self._arithmetic.nearest(value)) + suffix

    def rounded(self, text: str) -> str:
        # The type of the operands says what is rounded to.
        return text

    def variable(self, name: str) -> str:
        # u is the caller's pointer.
        local = "command" if name == "u" else name
        return f"{self.name}_{name}" if name in self._constants else local

    def infix(self, statement: Statement) -> str | None:
        return INFIX.get(statement.operator)

    def call(self, statement: Statement, arguments: tuple[str, ...]) -> str:
        operator = statement.operator
        if self._arithmetic.portable and operator in CALLS:
            name, more = CALLS[operator]
            passed = ", ".join((*arguments, *map(self.literal, more)))
            return f"{self.name}_{name}({passed})"
        suffix = "f" if self._arithmetic.single else ""
        return f"{_FUNCTIONS[operator]}{suffix}({', '.join(arguments)})"

    def select(self, condition: str, then: str, otherwise: str) -> str:
        return f"({condition}) ? {then} : {otherwise}"
