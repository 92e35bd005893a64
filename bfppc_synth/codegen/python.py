"""Law -> controller.py, standard library only.

The certified numbers stand between the lines ``# CERTIFIED CONSTANTS BEGIN`` and
``# CERTIFIED CONSTANTS END`` (in C the same words in ``/* */``), one a line, in the order k_1, M_1,
epsilon_1, c_1, N_1, p_1, k_2, ..., p_n, (T_s with center nominal,) U_MAX, and nothing else
stands there:

    controller.py   k_1 = 0.5
    NAME.c          static const NAME_real NAME_k_1 = 0.5;

Numbers are the shortest decimals that read back to the certified bits. Every number keeps its
line, also where no operation reads it (N_i, and the gains of a term that is left out).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.codegen.printing import render
from bfppc_synth.codegen.provenance import banner, heading, plain
from bfppc_synth.codegen.python_syntax import IMPORTED, PythonSyntax
from bfppc_synth.codegen.statements import is_part
from bfppc_synth.codegen.switching import center_arguments
from bfppc_synth.model.law import Variable
from bfppc_synth.resources import template_environment

if TYPE_CHECKING:
    from bfppc_synth.codegen.printing import Line, Syntax
    from bfppc_synth.model.law import Law, NamedConstant, Provenance, Range

_WIDTH = 100


def render_controller(law: Law, provenance: Provenance) -> str:
    """Print the controller as one Python module.

    Parameters
    ----------
    law : Law
        The controller.
    provenance : Provenance
        What the head of the file says.

    Returns
    -------
    str
        Text of controller.py; equal laws give equal bytes.

    Raises
    ------
    ResourceError
        If the installation has no templates.
    """
    syntax = PythonSyntax(law)
    center = render(law.center.statements, (*law.center.r, law.center.v), syntax)
    feedback = render(law.feedback, (Variable(name="u"),), syntax)
    derived = render(law.derived, (), syntax)
    reference = None
    if law.reference is not None:
        program = render(law.reference.statements, (law.reference.value,), syntax)
        lines = assigned(program.lines, indent=4)
        reference = {"lines": lines, "value": program.results[0]}
    # Rounding of a law in binary32 is written out: Python has no such numbers.
    rounds = law.arithmetic.single
    template = template_environment().get_template("python/controller.py.jinja")
    return template.render(
        heading=heading(law.name, law.title),
        signals=describe_signals(law),
        u_unit=describe_command(law),
        banner=banner(provenance),
        formula=law.formula,
        rounds=rounds,
        entry=_entry(law) if rounds else [],
        elapsed=syntax.rounded("t - self._t_0"),
        offset=syntax.rounded("x_1 - y_d"),
        portable=_portable(law, syntax),
        real_limit=repr(law.arithmetic.largest),
        certified=[constant_line(constant, syntax) for constant in law.certified],
        limits=[constant_line(constant, syntax) for constant in law.limits],
        derived=[f"{line.target} = {line.text}" for line in derived.lines],
        order=law.order,
        states=unpacking(law),
        inputs=[_within(test) for test in law.inputs],
        reference_tests=[_within(test) for test in law.reference_ranges],
        derivatives=law.derivatives,
        time_test=None if law.time_limit is None else "-time_limit < t < time_limit",
        reference=reference,
        latch=_latch(law, syntax),
        latched=latched_values(law, syntax),
        start=[_within(test) for test in law.start],
        center=assigned(center.lines, indent=8),
        feedback=assigned(feedback.lines, indent=8),
        tube=[*(_within(test) for test in law.tube), *_followed(law)],
        switching=_switching(law, syntax),
        # Printing the statements above has collected what they call.
        functions=[IMPORTED.get(name, name) for name in sorted(syntax.functions)],
        helpers=sorted(syntax.helpers),
        needs_math=rounds or bool(syntax.helpers),
        accuracy=repr(law.accuracy),
        period=repr(law.period),
    )


def _latch(law: Law, syntax: PythonSyntax) -> dict[str, object] | None:
    """Lay out what center nominal does before its center."""
    latch = law.center.latch
    if latch is None:
        return None
    signals = render(latch.signals, latched_signals(law), syntax)
    start = render(latch.statements, latch.values, syntax)
    return {
        "signals": assigned(signals.lines, indent=8),
        "start": assigned(start.lines, indent=12),
        "offset": latched_offset(law, syntax),
    }


def constant_line(constant: NamedConstant, syntax: Syntax) -> str:
    """Write a constant of the law on a line of its own."""
    value = constant.value
    return f"{constant.name} = {value if isinstance(value, int) else syntax.literal(value)}"


def _entry(law: Law) -> list[str]:
    """Round what is passed in, as a caller of the C controller does."""
    return [f"{name} = single({name})" for name in ("t", *(f"x_{i + 1}" for i in range(law.order)))]


def _portable(law: Law, syntax: PythonSyntax) -> list[dict[str, object]]:
    """Lay out the functions that the file contains."""
    return [
        {
            "name": function.name,
            "summary": function.summary,
            "parameters": ", ".join(f"{name}: float" for name in function.parameters),
            "lines": assigned(render(function.statements, (), syntax).lines, indent=4),
            "value": render((), (function.value,), syntax).results[0],
        }
        for function in law.functions
    ]


def latched_signals(law: Law) -> tuple[Variable, ...]:
    """List what the later programs read of the first one: it must keep its name."""
    latch = law.center.latch
    signals = () if latch is None else latch.signals
    return tuple(Variable(name=s.target) for s in signals if not is_part(s.target))


def latched_offset(law: Law, syntax: Syntax) -> str | None:
    """Return x_1(0) - y_d(0) where center nominal has to screen it."""
    if not any(test.variable == "offset" for test in law.start):
        return None
    return syntax.rounded(f"x_1 - {law.reference_ranges[0].variable}")


def latched_values(law: Law, syntax: Syntax) -> list[dict[str, str]]:
    """Pair what the first accepted sample latches with its value."""
    latch = law.center.latch
    if latch is None:
        return [{"name": name, "state": f"x_{name[6:]}"} for name in law.center.latched]
    values = render(latch.statements, latch.values, syntax).results
    pairs = zip(law.center.latched, values, strict=True)
    return [{"name": name, "state": value} for name, value in pairs]


def _switching(law: Law, syntax: PythonSyntax) -> dict[str, object] | None:
    """Lay out the stages: functions of states and center, what keeps each, what follows it."""
    if law.switching is None:
        return None
    numbers = range(1, law.order + 1)
    errors = [f"e_{i}" for i in numbers]
    read = [f"x_{i}" for i in numbers] + [f"r_{i}" for i in numbers]
    center = render(law.center.statements, law.center.r, syntax)
    passed = center_arguments(law)
    stages = []
    for number, stage in enumerate(law.switching.stages, start=1):
        program = render(stage.feedback, (Variable(name="u"),), syntax)
        stages.append(
            {
                "number": number,
                "lines": assigned(program.lines, indent=4),
                "stays": [_within(test) for test in stage.stays],
                "expected": [_within(test) for test in stage.expected],
            }
        )
    return {
        "anchors": list(range(1, law.switching.anchors + 1)),
        "results": ", ".join((*errors, "u")),
        "result_type": _floats(law.order + 1),
        "read": ", ".join(read),
        "parameters": ", ".join(f"{name}: float" for name in read),
        "center_lines": assigned(center.lines, indent=4),
        "center_results": ", ".join(read[law.order :]),
        "center_type": "float" if law.order == 1 else f"tuple[{_floats(law.order)}]",
        "center_parameters": [f"{name}: float" for name, _ in passed],
        "center_arguments": ", ".join(
            syntax.rounded(value) if " - " in value else value for _, value in passed
        ),
        "stages": stages,
    }


def _floats(count: int) -> str:
    return ", ".join(["float"] * count)


def describe_signals(law: Law) -> tuple[str, ...]:
    """Say which entry of x is which state, with its unit where the plant file gives one."""
    units = dict(law.units)
    return tuple(
        f"x[{i}] = {state} [{plain(units[state])}]" if state in units else f"x[{i}] = {state}"
        for i, state in enumerate(law.states)
    )


def describe_command(law: Law) -> str:
    """Return the unit of u as `` [V]``; empty where the plant file gives none."""
    unit = dict(law.units).get("u")
    return "" if unit is None else f" [{plain(unit)}]"


def unpacking(law: Law) -> str:
    """Return the left side of the assignment that takes x apart."""
    names = [f"x_{i}" for i in range(1, law.order + 1)]
    return f"({names[0]},)" if law.order == 1 else ", ".join(names)


def assigned(lines: tuple[Line, ...], *, indent: int) -> list[str]:
    """Write results as assignments; a long one goes on in the next line."""
    assigned: list[str] = []
    for line in lines:
        whole = f"{line.target} = {line.text}"
        wide = indent + len(whole) > _WIDTH
        assigned += [f"{line.target} = (", f"    {line.text}", ")"] if wide else [whole]
    return assigned


def _followed(law: Law) -> list[str]:
    """Center nominal divides: a command held back because v has no value is not OK."""
    return [] if law.center.latch is None else ["-real_limit <= v <= real_limit"]


def _within(test: Range) -> str:
    lower = f"-{test.upper}" if test.lower is None else test.lower
    return f"{lower} <= {test.variable} <= {test.upper}"
