"""From a plant file's records to a judged design: majorants, bounds, search, certificate."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bfppc_synth.bounds.funnel import require_signals
from bfppc_synth.bounds.signals import (
    conditions,
)
from bfppc_synth.errors import UsageError
from bfppc_synth.gains.diagnose import no_design
from bfppc_synth.gains.evaluation import Evaluation, Judge
from bfppc_synth.gains.optimality import optimality_of
from bfppc_synth.gains.problem import DesignProblem, is_free
from bfppc_synth.gains.search import search
from bfppc_synth.gains.terms import explained, nominal_split
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.certificate import Certificate, Verdict
from bfppc_synth.model.design import Design
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.spec import BoundsKind, CenterKind, Form, Method
from bfppc_synth.spec.objective import sought
from bfppc_synth.spec.resolve import read_chosen, require_same, resolved
from bfppc_synth.synthesis.arithmetic import read_arithmetic, require_arithmetic
from bfppc_synth.synthesis.nominal import around_performance
from bfppc_synth.synthesis.prepare import MARGINS, prepare, problem_of_theorem1
from bfppc_synth.synthesis.proof import certified_period, judged_in_floats, promised, proved
from bfppc_synth.synthesis.rounding import (
    found_with_room,
    rounded_evaluation,
    with_own_rounding,
)
from bfppc_synth.synthesis.theorem1 import (
    read_proof,
    restore_theorem1,
    synthesize_theorem1,
)

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.bounds import SignalBounds
    from bfppc_synth.model.chosen import Chosen
    from bfppc_synth.model.spec import PlantSpec


def _silent(message: str) -> None:
    del message


def synthesize(
    spec: PlantSpec,
    *,
    progress: Callable[[str], None] = _silent,
    arithmetic: Arithmetic = DEFAULT,
) -> Design:
    """Find gains, prove them, and return the design; writes nothing.

    Parameters
    ----------
    spec : PlantSpec
        A checked plant file.
    progress : callable
        Receives one sentence per stage.
    arithmetic : Arithmetic
        What the generated code computes with.

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
    UsageError
        The arithmetic is not one that the plant file's method or functions allow.
    """
    objective = sought(spec.synthesis)
    if objective is not None and spec.chosen is None:
        from bfppc_synth.synthesis.inverse import solve_inverse

        def solve(asked: PlantSpec, transition: float | None) -> Design:
            return _synthesized(asked, progress, arithmetic, transition)

        return solve_inverse(spec, objective, solve, progress, arithmetic)
    return _synthesized(spec, progress, arithmetic, None)


def _synthesized(
    spec: PlantSpec,
    progress: Callable[[str], None],
    arithmetic: Arithmetic,
    transition: float | None,
) -> Design:
    """Find gains for requirements that are all given; T_s too where it has been chosen."""
    require_arithmetic(spec, arithmetic)
    if spec.synthesis.method is Method.THEOREM1:
        return synthesize_theorem1(problem_of_theorem1(spec), MARGINS, progress, arithmetic)
    problem, signals = prepare(spec, progress, transition=transition, arithmetic=arithmetic)
    if arithmetic.single:
        found, certificate = found_with_room(problem, lambda room: _searched(room, progress))
        problem = with_own_rounding(problem, found.shapes, found.half_widths)
        own = Judge(problem).evaluate(found.shapes, found.half_widths, found.alternative)
        return _design(problem, signals, own or found, certificate)
    if spec.synthesis.bounds is BoundsKind.TIGHT:
        from bfppc_synth.synthesis.tight import synthesize_tight

        tightened = synthesize_tight(problem, signals, MARGINS, progress)
        design = _design(tightened.problem, signals, tightened.evaluation, tightened.certificate)
        return replace(design, termwise=tightened.termwise)
    candidate, judged = _searched(problem, progress)
    if candidate is None or judged is None:
        raise no_design(problem, free=is_free(problem))
    return _design(problem, signals, candidate, judged)


def _searched(
    problem: DesignProblem, progress: Callable[[str], None]
) -> tuple[Evaluation | None, Certificate | None]:
    """Search with more and more room until the checker is content."""
    free = is_free(problem)
    found: Evaluation | None = None
    certificate: Certificate | None = None
    printed = problem.plant.spec.synthesis.form is Form.PRINTED
    # A fixed step of the paper may hold with equality.
    for margin in (MARGINS[0], 0.0) if printed else MARGINS:
        problem = replace(problem, margin=margin)
        found = search(problem, progress)
        if found is None:
            if printed and margin > 0.0:
                continue
            break
        if printed:
            certificate = judged_in_floats(problem, found)
            break
        progress("proving")
        found = rounded_evaluation(problem, found)
        certificate = proved(problem, found)
        require_signals(problem.plant, certificate.failures)
        thin = certificate.verdict is not Verdict.CERTIFIED and free
        if not thin or any(not entry.holds for entry in certificate.assumption_checks):
            break
        progress("a margin was too thin: rounding again")
    return found, certificate


def restore(folder: Path) -> Design:
    """Read a generated folder back into a design; nothing is searched.

    Raises
    ------
    UsageError
        If the folder lacks plant.yaml or report.json.
    """
    from bfppc_synth.spec.load import load_spec
    from bfppc_synth.synthesis.tight import restored_tight

    try:
        document: dict[str, Any] = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        arithmetic = read_arithmetic(document)
        chosen = read_chosen(document)
        if read_proof(folder):
            # What is proved decides, not what a report says of it.
            proved_for = json.loads(read_proof(folder))["design"].get("chosen")
            require_same(chosen, proved_for)
        if document["method"] == Method.THEOREM1:
            problem_1 = problem_of_theorem1(_as_chosen(load_spec(folder / "plant.yaml"), chosen))
            return replace(restore_theorem1(problem_1, document, folder), arithmetic=arithmetic)
        shapes = tuple(
            Shape(k=g["k"], M=g["M"], epsilon=g["epsilon"], c=g["c"], N=g["N"])
            for g in document["gains"]
        )
        widths = tuple(float(p) for p in document["omega"]["p"])
        verdict = Verdict(document["status"])
        proof = read_proof(folder)
        tight, termwise = restored_tight(document)
        period = float(document["sampling"]["largest_certified_period"] or 0.0)
        center, transition = document["center"], document["performance"].get("transition")
    except FileNotFoundError as error:
        raise UsageError(
            f"{folder}: not a generated folder (no report.json); fix: name a folder that"
            " bfppc-synth wrote"
        ) from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise UsageError(
            f"{folder}: not a generated folder ({type(error).__name__}: {error}); fix: name a"
            " folder that bfppc-synth wrote"
        ) from error
    spec = _as_chosen(load_spec(folder / "plant.yaml"), chosen)
    if center == CenterKind.PERFORMANCE:
        spec = around_performance(spec)
    problem, signals = prepare(spec, transition=transition, arithmetic=arithmetic)
    problem = with_own_rounding(problem, shapes, widths)
    found = Judge(problem).best(shapes, widths, tight)
    if found is None or len(shapes) != spec.order:
        raise UsageError(f"{folder}: the gains of report.json do not fit plant.yaml")
    certificate = replace(judged_in_floats(problem, found), verdict=verdict, document=proof)
    design = _design(problem, signals, found, certificate, period)
    return replace(design, termwise=termwise)


def _as_chosen(spec: PlantSpec, chosen: Chosen | None) -> PlantSpec:
    if (None if chosen is None else chosen.objective) is not sought(spec.synthesis):
        raise UsageError(
            f"{spec.path}: report.json is about another objective\n  fix: run synth again"
        )
    return spec if chosen is None else resolved(spec, chosen)


def _design(
    problem: DesignProblem,
    signals: SignalBounds,
    found: Evaluation,
    certificate: Certificate,
    period: float | None = None,
) -> Design:
    spec = problem.plant.spec
    if period is None:
        sampled = spec.synthesis.method in (Method.UNIFIED, Method.THEOREM3)
        sound = spec.synthesis.form is Form.SOUND
        period = certified_period(problem, found, certificate) if sampled and sound else 0.0
    entries = []
    for entry in certificate.inequalities:
        stem, _, state = entry.id.rstrip("]").partition("[")
        if stem in ("U1", "U2", "U2'", "T2") and state in spec.states:
            step = spec.states.index(state)
            entries.append(replace(entry, binding_terms=explained(problem, found, step)))
        else:
            entries.append(entry)
    bounds = promised(found.bounds, spec.states, certificate)
    split = nominal_split(problem, found)
    if split is not None:
        split = replace(split, feedforward=bounds.U - split.tube - split.actuator_error)
    return Design(
        spec=spec,
        plant=problem.plant,
        majorants=problem.majorants,
        signals=signals,
        center=problem.center,
        conditions=conditions(spec),
        gains=found.shapes,
        omega=found.half_widths,
        bounds=bounds,
        certificate=replace(certificate, inequalities=tuple(entries)),
        largest_certified_period=period,
        stages=() if problem.staging is None else problem.staging.stages,
        nominal=None if problem.nominal is None else problem.nominal.model,
        nominal_split=split,
        tight=found.tight,
        arithmetic=problem.arithmetic,
        optimality=optimality_of(problem, found),
    )
