"""From a plant file's records to the design problem: plant, majorants, bounds, center."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.bounds.admission import admit, misplaced_term, refused_reference
from bfppc_synth.bounds.funnel import require_funnel
from bfppc_synth.bounds.representable import require_representable
from bfppc_synth.bounds.signals import (
    bound_signals,
    conditions,
    performance_center,
    printed_center,
)
from bfppc_synth.errors import EnvelopeError, UsageError
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.gains.methods.theorem2 import Theorem2, Theorem2Printed
from bfppc_synth.gains.methods.theorem3 import staged
from bfppc_synth.gains.methods.unified import Unified
from bfppc_synth.gains.objective import weights_of
from bfppc_synth.gains.problem import DesignProblem, fixed_gains
from bfppc_synth.majorants.derive import derive_majorants
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.spec import CenterKind, Form, Method
from bfppc_synth.synthesis.arithmetic import coded_transition, in_arithmetic, require_functions
from bfppc_synth.synthesis.nominal import around_performance, nominal_if_any
from bfppc_synth.synthesis.theorem1 import prepare_theorem1

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.gains.methods.demands import Theorem
    from bfppc_synth.gains.theorem1.problem import Theorem1Problem
    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.bounds import SignalBounds
    from bfppc_synth.model.spec import PlantSpec

# Relative room of the rounded inequalities; widened where the checker finds it too thin.
MARGINS = (2e-4, 2e-3, 2e-2)


def _silent(message: str) -> None:
    del message


def prepare(
    spec: PlantSpec,
    progress: Callable[[str], None] = _silent,
    *,
    transition: float | None = None,
    arithmetic: Arithmetic = DEFAULT,
) -> tuple[DesignProblem, SignalBounds]:
    """Build the plant, its majorants and signal bounds, and the problem to solve."""
    if spec.synthesis.center is CenterKind.NOMINAL:
        found = _prepared_nominal(spec, progress, transition, arithmetic)
        if found is not None:
            return found
        spec = around_performance(spec)
    progress("bounding the plant")
    plant = build_plant(spec)
    require_representable(plant)
    try:
        signals = bound_signals(plant)
        printed = spec.synthesis.form is Form.PRINTED
        center = (printed_center if printed else performance_center)(plant, signals)
    except EnvelopeError as error:
        raise refused_reference(plant, error) from error
    try:
        majorants = derive_majorants(plant)
    except EnvelopeError as error:
        raise misplaced_term(plant, error) from error
    admit(plant, majorants, center)
    require_funnel(plant)
    accuracy = spec.performance.accuracy
    if accuracy is None:
        raise UsageError("performance.accuracy is required in this version")
    problem = DesignProblem(
        plant=plant,
        majorants=majorants,
        center=center,
        conditions=conditions(spec),
        theorem=_theorem(spec),
        accuracy=accuracy.approximate,
        half_widths=tuple(None if p is None else p.approximate for p in spec.synthesis.p),
        gains=tuple(fixed_gains(gains) for gains in spec.synthesis.gains),
        weights=weights_of(spec),
        limit=None if spec.actuator.limit is None else spec.actuator.limit.approximate,
        margin=MARGINS[0],
    )
    if spec.synthesis.method is Method.THEOREM3:
        problem = staged(problem, signals, spec.synthesis)
    require_functions(plant, None, arithmetic)
    return in_arithmetic(problem, arithmetic), signals


def _prepared_nominal(
    spec: PlantSpec,
    progress: Callable[[str], None],
    transition: float | None,
    arithmetic: Arithmetic,
) -> tuple[DesignProblem, SignalBounds] | None:
    """Prepare center nominal, with T_s as the code has it; None where it was not asked for."""
    weights, margin = weights_of(spec), MARGINS[0]
    found = nominal_if_any(spec, weights, margin, progress, transition=transition)
    if found is None:
        return None
    coded = coded_transition(in_arithmetic(found[0], arithmetic))
    if coded is not None:
        found = nominal_if_any(spec, weights, margin, progress, transition=coded)
        if found is None:
            return None
    problem = in_arithmetic(found[0], arithmetic)
    model = None if problem.nominal is None else problem.nominal.model
    require_functions(problem.plant, model, arithmetic)
    return problem, found[1]


def problem_of_theorem1(spec: PlantSpec) -> Theorem1Problem:
    """Build the problem of theorem1, its mistakes at their places."""
    try:
        return prepare_theorem1(spec, weights_of(spec), MARGINS[0])
    except EnvelopeError as error:
        raise misplaced_term(build_plant(spec), error) from error


def _theorem(spec: PlantSpec) -> Theorem:
    if spec.synthesis.form is Form.PRINTED:
        return Theorem2Printed()
    return Theorem2() if spec.synthesis.method is Method.THEOREM2 else Unified()
