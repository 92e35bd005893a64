"""What each requirement of a feasible design costs: the same program, asked for 10 % less."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.errors import BfppcError, EnvelopeError
from bfppc_synth.expressions.evaluate import evaluate_float
from bfppc_synth.gains.evaluation import Judge
from bfppc_synth.gains.problem import is_free
from bfppc_synth.gains.search import continued
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.sensitivity import Sensitivity
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.spec import BoundsKind, Method, Objective
from bfppc_synth.reasons.requirements import requirements_of
from bfppc_synth.reasons.wishes import plain
from bfppc_synth.spec.edits import changed
from bfppc_synth.synthesis.prepare import prepare

if TYPE_CHECKING:
    from bfppc_synth.gains.evaluation import Evaluation
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.design import Design
    from bfppc_synth.reasons.requirement import Requirement

EASED = 1.1
#: Relative changes are told to this much; the solver knows them no better.
_DIGITS = 4
INVERSE = frozenset({Objective.ACCURACY, Objective.PERIOD, Objective.RESOLUTION})


def with_sensitivities(design: Design) -> Design:
    """Estimate for each requirement what asking 10 % less of it would buy.

    Parameters
    ----------
    design : Design
        A certified design; others, and those by tight bounds or theorem1, are returned as they
        are.

    Returns
    -------
    Design
        With ``sensitivities``, the one that buys most of the peak input first.

    References
    ----------
    docs/theory.md section 5: what the multipliers say, here by solving again from the design.
    """
    spec = design.spec
    if (
        design.certificate.verdict is not Verdict.CERTIFIED
        or spec.synthesis.method is Method.THEOREM1
        or spec.synthesis.bounds is BoundsKind.TIGHT
        or any(word in INVERSE for word, _ in spec.synthesis.objective)
    ):
        return design
    transition = None if design.nominal is None else design.nominal.transition
    try:
        problem, _ = prepare(spec, transition=transition, arithmetic=design.arithmetic)
    except BfppcError:
        return design
    # Rounding in binary32 is the design's own: the estimate is made without it.
    shapes = tuple(gain for gain in design.gains if isinstance(gain, Shape))
    known = Judge(problem).best(shapes, design.omega) if is_free(problem) else None
    base = None if known is None else continued(problem, known)
    if known is None or base is None:
        return design
    found = []
    for requirement in _distinct(design):
        eased = _eased(problem, requirement, transition)
        other = None if eased is None else continued(eased, known)
        if other is None or other.shortfall > 0.0:
            continue
        # The design at hand does for less, too: where the solver ends dearer, nothing is bought.
        found.append(_sensitivity(requirement, base, min(base, other, key=_cost)))
    found.sort(key=lambda one: (one.peak_input, one.slope, one.path))
    return replace(design, sensitivities=tuple(found))


def _cost(found: Evaluation) -> float:
    return found.cost


def _distinct(design: Design) -> tuple[Requirement, ...]:
    """List the requirements, the first of each path."""
    spec, plant = design.spec, design.plant
    start = 0.0
    if plant.reference is not None:
        try:
            start = evaluate_float(plant.reference, {plant.time: 0.0})
        except EnvelopeError:
            start = 0.0
    limit = plain(spec, "actuator.limit", "larger")
    listed = [*(() if limit is None else (limit,)), *requirements_of(spec, start)]
    first = {requirement.path: requirement for requirement in reversed(listed)}
    return tuple(reversed(first.values()))


def _factor(requirement: Requirement) -> float:
    return EASED if requirement.factors[0] > 1.0 else 1.0 / EASED


def _eased(
    problem: DesignProblem, requirement: Requirement, transition: float | None
) -> DesignProblem | None:
    spec = problem.plant.spec
    try:
        other = changed(spec, requirement.change(_factor(requirement)))
        given = other.performance.transition is not None
        return prepare(
            other, transition=None if given else transition, arithmetic=problem.arithmetic
        )[0]
    except (BfppcError, ArithmeticError, ValueError):
        return None


def _sensitivity(requirement: Requirement, base: Evaluation, other: Evaluation) -> Sensitivity:
    return Sensitivity(
        path=requirement.path,
        given=requirement.given,
        eased=requirement.written(_factor(requirement)),
        peak_input=_relative(other.bounds.U, base.bounds.U),
        slope=_relative(other.bounds.slope, base.bounds.slope),
    )


def _relative(value: float, base: float) -> float:
    # A change of exactly 0 is 0.0, never -0.0.
    return round(value / base - 1.0, _DIGITS) + 0.0 if base > 0.0 else 0.0
