"""A candidate before the checker: its certificate, its rounding; or in floats only.

The checker is loaded when there is something to prove: a mistake in a file is answered before.
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.gains.methods.theorem3 import stage_demands
from bfppc_synth.gains.period import largest_period
from bfppc_synth.model.certificate import Certificate, Inequality, Verdict
from bfppc_synth.model.spec import Form

if TYPE_CHECKING:
    from bfppc_synth.gains.evaluation import Evaluation
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.bounds import ChainBounds
    from bfppc_synth.model.shapes import Shape
    from bfppc_synth.model.spec import PlantSpec


def errors_of(
    problem: DesignProblem, shapes: tuple[Shape, ...], half_widths: tuple[float, ...]
) -> tuple[float, ...]:
    """Ask the checker what the law of a candidate loses by rounding; () where it cannot tell."""
    from bfppc_synth.certificate.entries import rounding_errors

    return rounding_errors(
        _document(problem.plant.spec),
        shapes,
        half_widths,
        stages=() if problem.staging is None else problem.staging.stages,
        transition=None if problem.nominal is None else problem.nominal.model.transition,
        arithmetic=problem.arithmetic,
        chosen=problem.plant.spec.chosen,
    )


def proved(problem: DesignProblem, found: Evaluation) -> Certificate:
    """Write the certificate of a candidate and judge it."""
    from bfppc_synth.certificate.produce import judge, produce_certificate, tool_name

    document = _document(problem.plant.spec)
    produced = produce_certificate(
        document,
        found.shapes,
        found.half_widths,
        tool=tool_name(),
        stages=() if problem.staging is None else problem.staging.stages,
        transition=None if problem.nominal is None else problem.nominal.model.transition,
        tight=found.tight,
        arithmetic=problem.arithmetic,
        chosen=problem.plant.spec.chosen,
    )
    return judge(document, produced)


def certified_period(problem: DesignProblem, found: Evaluation, certificate: Certificate) -> float:
    """Return a lower bound on the largest period [s] that these gains keep; 0 for none.

    Where nothing is certified it is what floats say.
    """
    spec = problem.plant.spec
    estimate = largest_period(problem, found.shapes, found.half_widths, found.tight)
    if certificate.verdict is not Verdict.CERTIFIED or estimate == 0.0:
        return estimate
    from bfppc_synth.certificate.period import proved_period

    design = json.loads(certificate.document)["design"]
    own = spec.sampling.period.approximate
    return max(own, proved_period(_document(spec), design, max(own, estimate)))


def _document(spec: PlantSpec) -> dict[str, object]:
    from bfppc_synth.spec.canonical import plant_json

    document: dict[str, object] = json.loads(plant_json(spec))
    return document


def judged_in_floats(problem: DesignProblem, found: Evaluation) -> Certificate:
    """List every inequality as evaluated in floats, where nothing or all of it can be certified."""
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


def promised(
    bounds: ChainBounds[float], states: tuple[str, ...], certificate: Certificate
) -> ChainBounds[float]:
    """Return the bounds with U and X_i as proved: the upper ends of the certificate.

    What the search computed in floats may be less, by a part in a thousand with center nominal.
    """
    if certificate.verdict is not Verdict.CERTIFIED or not certificate.document:
        return bounds
    enclosures = json.loads(certificate.document).get("enclosures", {})

    def upper(key: str, value: float) -> float:
        pair = enclosures.get(key)
        return value if pair is None else max(value, float.fromhex(pair[1]))

    sizes = zip(states, bounds.X, strict=True)
    return replace(
        bounds,
        U=upper("U", bounds.U),
        X=tuple(upper(f"X[{state}]", size) for state, size in sizes),
    )
