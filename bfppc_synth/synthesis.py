"""From a plant file's records to a judged design: majorants, bounds, search, certificate."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bfppc_synth.bounds.admission import (
    admit,
    misplaced_term,
    refused_reference,
    require_reference,
)
from bfppc_synth.bounds.signals import (
    bound_signals,
    conditions,
    performance_center,
    printed_center,
)
from bfppc_synth.errors import EnvelopeError, UsageError
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.gains.diagnose import no_design
from bfppc_synth.gains.evaluation import Evaluation, Judge
from bfppc_synth.gains.methods.theorem2 import Theorem2, Theorem2Printed
from bfppc_synth.gains.methods.theorem3 import stage_demands, staged
from bfppc_synth.gains.methods.unified import Unified
from bfppc_synth.gains.period import largest_period
from bfppc_synth.gains.problem import DesignProblem, Weights, fixed_gains, is_free
from bfppc_synth.gains.search import search
from bfppc_synth.gains.terms import explained, nominal_split
from bfppc_synth.majorants.derive import derive_majorants
from bfppc_synth.model.certificate import Certificate, Inequality, Verdict
from bfppc_synth.model.design import Design
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.spec import BoundsKind, CenterKind, Form, Method, Objective
from bfppc_synth.proving import proved
from bfppc_synth.synthesis_nominal import prepare_nominal
from bfppc_synth.synthesis_theorem1 import (
    prepare_theorem1,
    read_proof,
    restore_theorem1,
    synthesize_theorem1,
)
from bfppc_synth.synthesis_tight import restored_tight, synthesize_tight

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bfppc_synth.gains.methods.demands import Theorem
    from bfppc_synth.gains.theorem1.problem import Theorem1Problem
    from bfppc_synth.model.bounds import SignalBounds
    from bfppc_synth.model.spec import PlantSpec

# Relative room of the rounded inequalities; widened where the checker finds it too thin.
MARGINS = (2e-4, 2e-3, 2e-2)
# What an objective adds of the other quantity: 1 % of U buys orders of magnitude of slope.
SIDE_WEIGHT = 0.01
LEADING = {
    Objective.PEAK_INPUT: Weights(peak_input=1.0, slope=SIDE_WEIGHT),
    Objective.SLOPE: Weights(peak_input=SIDE_WEIGHT, slope=1.0),
    Objective.BALANCED: Weights(peak_input=1.0, slope=1.0),
}


def _silent(message: str) -> None:
    del message


def synthesize(spec: PlantSpec, *, progress: Callable[[str], None] = _silent) -> Design:
    """Find gains, prove them, and return the design; writes nothing.

    Parameters
    ----------
    spec : PlantSpec
        A checked plant file.
    progress : callable
        Receives one sentence per stage.

    Returns
    -------
    Design
        With its certificate, whatever it says: ``design.certificate.require()`` raises.

    Raises
    ------
    PlantFileError
        A bound breaks down on the smallest box, or the reference cannot be enclosed.
    NoDesignError
        Something is free and nothing was found, or the actuator limit is exceeded.
    """
    if spec.synthesis.method is Method.THEOREM1:
        return synthesize_theorem1(_of_theorem1(spec), MARGINS, progress)
    problem, signals = prepare(spec, progress)
    free = is_free(problem)
    if spec.synthesis.bounds is BoundsKind.TIGHT:
        tightened = synthesize_tight(problem, signals, MARGINS, progress)
        design = _design(tightened.problem, signals, tightened.evaluation, tightened.certificate)
        return replace(design, termwise=tightened.termwise)
    found: Evaluation | None = None
    certificate: Certificate | None = None
    printed = spec.synthesis.form is Form.PRINTED
    # A fixed step of the paper may hold with equality.
    for margin in (MARGINS[0], 0.0) if printed else MARGINS:
        problem = replace(problem, margin=margin)
        found = search(problem, progress)
        if found is None:
            if printed and margin > 0.0:
                continue
            break
        if printed:
            certificate = _judged_in_floats(problem, found)
            break
        progress("proving")
        certificate = proved(problem, found)
        require_reference(problem.plant, certificate.failures)
        thin = certificate.verdict is not Verdict.CERTIFIED and free
        if not thin or any(not entry.holds for entry in certificate.assumption_checks):
            break
        progress("a margin was too thin: rounding again")
    if found is None or certificate is None:
        raise no_design(problem, free=free)
    return _design(problem, signals, found, certificate)


def prepare(
    spec: PlantSpec,
    progress: Callable[[str], None] = _silent,
    *,
    transition: float | None = None,
) -> tuple[DesignProblem, SignalBounds]:
    """Build the plant, its majorants and signal bounds, and the problem to solve."""
    if spec.synthesis.center is CenterKind.NOMINAL:
        return prepare_nominal(spec, _weights(spec), MARGINS[0], progress, transition=transition)
    progress("bounding the plant")
    plant = build_plant(spec)
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
        weights=_weights(spec),
        limit=None if spec.actuator.limit is None else spec.actuator.limit.approximate,
        margin=MARGINS[0],
    )
    if spec.synthesis.method is Method.THEOREM3:
        problem = staged(problem, signals, spec.synthesis)
    return problem, signals


def restore(folder: Path) -> Design:
    """Read a generated folder back into a design; nothing is searched.

    Raises
    ------
    UsageError
        If the folder lacks plant.yaml or report.json.
    """
    from bfppc_synth.spec.load import load_spec

    try:
        document: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        if document["method"] == Method.THEOREM1:
            problem_1 = _of_theorem1(load_spec(folder / "plant.yaml"))
            return restore_theorem1(problem_1, document, folder)
        shapes = tuple(
            Shape(k=g["k"], M=g["M"], epsilon=g["epsilon"], c=g["c"], N=g["N"])
            for g in document["gains"]
        )
        widths = tuple(float(p) for p in document["omega"]["p"])
        verdict = Verdict(document["status"])
        proof = read_proof(folder)
        tight, termwise = restored_tight(document)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UsageError(
            f"{folder}: not a generated folder ({type(error).__name__}: {error}); fix: name a"
            " folder that bfppc-synth wrote"
        ) from error
    spec = load_spec(folder / "plant.yaml")
    problem, signals = prepare(spec, transition=document["performance"].get("transition"))
    found = Judge(problem).best(shapes, widths, tight)
    if found is None or len(shapes) != spec.order:
        raise UsageError(f"{folder}: the gains of report.json do not fit plant.yaml")
    certificate = replace(_judged_in_floats(problem, found), verdict=verdict, document=proof)
    return replace(_design(problem, signals, found, certificate), termwise=termwise)


def _of_theorem1(spec: PlantSpec) -> Theorem1Problem:
    try:
        return prepare_theorem1(spec, _weights(spec), MARGINS[0])
    except EnvelopeError as error:
        raise misplaced_term(build_plant(spec), error) from error


def _theorem(spec: PlantSpec) -> Theorem:
    if spec.synthesis.form is Form.PRINTED:
        return Theorem2Printed()
    return Theorem2() if spec.synthesis.method is Method.THEOREM2 else Unified()


def _weights(spec: PlantSpec) -> Weights:
    objective = spec.synthesis.objective
    if len(objective) == 1:
        return LEADING[objective[0][0]]
    given = dict(objective)
    both = given.get(Objective.BALANCED, 0.0)
    peak = given.get(Objective.PEAK_INPUT, 0.0) + both
    slope = given.get(Objective.SLOPE, 0.0) + both
    least = SIDE_WEIGHT * max(peak, slope)
    return Weights(peak_input=max(peak, least), slope=max(slope, least))


def _judged_in_floats(problem: DesignProblem, found: Evaluation) -> Certificate:
    """Every inequality as evaluated in floats, where nothing can be certified or all of it is."""
    printed = problem.plant.spec.synthesis.form is Form.PRINTED
    names = problem.plant.spec.states
    inequalities = tuple(
        Inequality(
            id=f"{demand.name}[{names[demand.step]}]",
            equation=demand.equation,
            lhs=(demand.lhs, demand.lhs),
            rhs=(demand.rhs, demand.rhs),
            holds=demand.lhs >= demand.rhs,
        )
        for demand in (*stage_demands(problem), *found.demands)
    )
    failed = (entry for entry in inequalities if not entry.holds)
    failures = (
        *(("the printed form of the paper is never certified",) if printed else ()),
        *(f"{e.id} {e.equation}: {e.lhs[0]:.6g} is not above {e.rhs[0]:.6g}" for e in failed),
    )
    verdict = Verdict.PRINTED if printed else Verdict.UNDECIDED
    return Certificate(
        verdict=verdict, inequalities=inequalities, assumptions=(), failures=failures
    )


def _design(
    problem: DesignProblem, signals: SignalBounds, found: Evaluation, certificate: Certificate
) -> Design:
    spec = problem.plant.spec
    entries = []
    for entry in certificate.inequalities:
        stem, _, state = entry.id.rstrip("]").partition("[")
        if stem in ("U1", "U2", "U2'", "T2") and state in spec.states:
            step = spec.states.index(state)
            entries.append(replace(entry, binding_terms=explained(problem, found, step)))
        else:
            entries.append(entry)
    sampled = spec.synthesis.method in (Method.UNIFIED, Method.THEOREM3)
    periodic = sampled and spec.synthesis.form is Form.SOUND
    return Design(
        spec=spec,
        plant=problem.plant,
        majorants=problem.majorants,
        signals=signals,
        center=problem.center,
        conditions=problem.conditions,
        gains=found.shapes,
        omega=found.half_widths,
        bounds=found.bounds,
        certificate=replace(certificate, inequalities=tuple(entries)),
        largest_certified_period=(
            largest_period(problem, found.shapes, found.half_widths, found.tight)
            if periodic
            else 0.0
        ),
        stages=() if problem.staging is None else problem.staging.stages,
        nominal=None if problem.nominal is None else problem.nominal.model,
        nominal_split=nominal_split(problem, found),
        tight=found.tight,
    )
