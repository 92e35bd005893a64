"""What the numbers and functions of the generated code ask of a plant file and of a problem."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bfppc_synth.errors import NoDesignError, UsageError
from bfppc_synth.expressions.evaluate import evaluate
from bfppc_synth.gains.methods.theorem3 import retimed
from bfppc_synth.model.arithmetic import Arithmetic, Mathematics, Real
from bfppc_synth.model.law import Variable
from bfppc_synth.model.spec import BoundsKind, Form, Method

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.gains.problem import DesignProblem, FixedGains
    from bfppc_synth.model.law import Statement
    from bfppc_synth.model.nominal import NominalModel
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.shapes import Shape
    from bfppc_synth.model.spec import PlantSpec


def require_arithmetic(spec: PlantSpec, arithmetic: Arithmetic) -> None:
    """Refuse binary32 where nothing says what its rounding may cost.

    Raises
    ------
    UsageError
        A method that neglects rounding, a form that is never certified, or a simulation that is
        longer than the clock can tell.
    """
    if not arithmetic.single:
        return
    synthesis = spec.synthesis
    if synthesis.method in (Method.THEOREM1, Method.THEOREM2):
        raise UsageError(
            f"--real float: method {synthesis.method} neglects the rounding of the controller,"
            " which binary32 does not allow\n  fix: use `method: unified`, or --real double"
        )
    if synthesis.form is Form.PRINTED:
        raise UsageError(
            "--real float: form printed is never certified, so nothing says that binary32 is"
            " enough\n  fix: use `form: sound`, or --real double"
        )
    if synthesis.bounds is BoundsKind.TIGHT:
        raise UsageError(
            "--real float: bounds tight leave no room for the rounding of binary32\n"
            "  fix: use `bounds: termwise`, or --real double"
        )
    from bfppc_synth.codegen.limits import elapsed_limit, nearest

    longest = elapsed_limit(nearest(spec.sampling.period), arithmetic)
    if spec.simulation.horizon >= longest:
        raise UsageError(
            f"--real float: simulation.horizon {spec.simulation.horizon:g} s is not below"
            f" {longest:g} s, after which one unit in the last place of t is more than a sixteenth"
            " of the sample period\n  fix: a shorter horizon, or --real double"
        )


def require_functions(plant: Plant, model: NominalModel | None, arithmetic: Arithmetic) -> None:
    """Refuse a function without a portable form before anything is searched.

    Raises
    ------
    UsageError
        Naming the function and the place.
    """
    if not arithmetic.portable:
        return
    # sympy is needed for expressions only, and is loaded by then.
    from bfppc_synth.codegen.nominal import nominal_center
    from bfppc_synth.codegen.portable import require_portable
    from bfppc_synth.codegen.reference import compile_reference, statement_functions
    from bfppc_synth.codegen.statements import StatementBuilder

    blocks: list[tuple[str, tuple[Statement, ...]]] = []
    if plant.reference is not None:
        program = compile_reference(plant.reference, plant.time)
        blocks.append(("reference", program.statements))
    if model is not None:
        states = {symbol: Variable(name=symbol.name) for symbol in model.states}
        for kind, expressions in (("f", model.f), ("g", model.g)):
            for state, expression in zip(plant.spec.states, expressions, strict=True):
                builder = StatementBuilder("part")
                evaluate(expression, states, statement_functions(builder))
                blocks.append((f"dynamics.{state}.{kind}", builder.statements))
        center = nominal_center(model, plant.reference, plant.time)
        latch = () if center.latch is None else (*center.latch.signals, *center.latch.statements)
        blocks.append(("the nominal center's derivatives", (*latch, *center.statements)))
    require_portable(blocks)


def in_arithmetic(problem: DesignProblem, arithmetic: Arithmetic) -> DesignProblem:
    """Round what the plant file fixes to the numbers of the code; accuracy is rounded down."""
    if not arithmetic.single:
        return replace(problem, arithmetic=arithmetic)
    changed = replace(
        problem,
        arithmetic=arithmetic,
        accuracy=arithmetic.below(problem.accuracy),
        half_widths=tuple(
            None if p is None else arithmetic.nearest(p) for p in problem.half_widths
        ),
        gains=tuple(_fixed(gains, arithmetic) for gains in problem.gains),
    )
    staging = changed.staging
    if staging is None:
        return changed
    inputs = tuple(
        replace(
            stage,
            gains=tuple(rounded_shape(shape, arithmetic) for shape in stage.gains),
            half_widths=tuple(map(arithmetic.nearest, stage.half_widths)),
        )
        for stage in staging.inputs
    )
    return with_rounding(replace(changed, staging=replace(staging, inputs=inputs)), ())


def _fixed(gains: FixedGains, arithmetic: Arithmetic) -> FixedGains:
    k, M, epsilon, c = (
        None if value is None else arithmetic.nearest(value)
        for value in (gains.k, gains.M, gains.epsilon, gains.c)
    )
    return replace(gains, k=k, M=M, epsilon=epsilon, c=c)


def rounded_shape(shape: Shape, arithmetic: Arithmetic) -> Shape:
    """Round the gains of one step to the numbers of the code."""
    k, M, epsilon, c = map(arithmetic.nearest, (shape.k, shape.M, shape.epsilon, shape.c))
    return replace(shape, k=k, M=M, epsilon=epsilon, c=c)


def with_rounding(problem: DesignProblem, errors: tuple[float, ...]) -> DesignProblem:
    """Count rounding as measurement errors and as an actuator error (docs/theory.md section 6).

    Parameters
    ----------
    problem : DesignProblem
        Under the conditions of the plant file.
    errors : tuple[float, ...]
        Of every measured error, then of u [units of the states, of u]; none for no rounding.

    Returns
    -------
    DesignProblem
        Under worse conditions.

    Raises
    ------
    NoDesignError
        If a free stage has no tube then.
    """
    given = problem.conditions
    *measured, command = errors or (0.0,) * (problem.order + 1)
    conditions = replace(
        given,
        delta=tuple(a + b for a, b in zip(given.delta, measured, strict=True)),
        actuator_error=given.actuator_error + command,
    )
    changed = retimed(problem, conditions)
    if changed is None:
        raise NoDesignError(refusal(problem, errors, "a free stage has no tube any more"))
    return changed


def refusal(problem: DesignProblem, errors: tuple[float, ...], what: str) -> str:
    """Say that binary32 is not admissible: what it rounds, and what that breaks."""
    spec = problem.plant.spec
    names = [f"e of {state}" for state in spec.states] + ["u"]
    lost = ", ".join(f"{name} {e:.3g}" for name, e in zip(names, errors, strict=False))
    rounding = f" rounds {lost}" if lost else ""
    return (
        f"--real float is not admissible for {spec.path}: binary32{rounding}; {what}\n"
        "  fix: --real double, a larger accuracy, or a weaker law (objective slope)"
    )


def coded_transition(problem: DesignProblem) -> float | None:
    """Return T_s as binary32 has it, where that is another number than the search's."""
    if problem.nominal is None:
        return None
    given = problem.nominal.model.transition
    coded = problem.arithmetic.nearest(given)
    return None if coded == given else coded


def read_arithmetic(document: Mapping[str, Any]) -> Arithmetic:
    """Read what a folder's code computes with from its report.

    Raises
    ------
    KeyError, ValueError
        If the report names another type or library.
    """
    given = document.get("arithmetic", {})
    real, mathematics = given.get("real", "double"), given.get("math", "libm")
    return Arithmetic(real=Real(real), mathematics=Mathematics(mathematics))
