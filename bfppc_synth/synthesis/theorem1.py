"""Theorem 1's road from a plant file's records to a judged design."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bfppc_synth.bounds.admission import admit
from bfppc_synth.bounds.funnel import require_funnel, require_signals
from bfppc_synth.bounds.signals import bound_signals, conditions
from bfppc_synth.errors import NotCertifiedError, UsageError
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.gains.diagnose import Diagnosis, NoGainsError
from bfppc_synth.gains.problem import Weights
from bfppc_synth.gains.theorem1.judge import Theorem1Judge
from bfppc_synth.gains.theorem1.search import search_theorem1
from bfppc_synth.gains.theorem1.setup import theorem1_problem
from bfppc_synth.majorants.derive import derive_majorants
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.certificate import Certificate, Inequality, Strictness, Verdict
from bfppc_synth.model.design import Design
from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.model.spec import Form
from bfppc_synth.model.theorem1 import Theorem1Bounds
from bfppc_synth.synthesis.arithmetic import require_functions

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from bfppc_synth.errors import BfppcError
    from bfppc_synth.gains.theorem1.judge import Theorem1Evaluation
    from bfppc_synth.gains.theorem1.problem import Theorem1Problem
    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.spec import PlantSpec

NEVER_CERTIFIED = "the printed form of the paper is never certified"


def prepare_theorem1(spec: PlantSpec, weights: Weights, margin: float) -> Theorem1Problem:
    """Build the plant, its majorants, and the problem to solve.

    Raises
    ------
    PlantFileError
        A bound breaks down on the smallest box that any design has.
    EnvelopeError
        A subexpression has no rule.
    """
    plant = build_plant(spec)
    majorants = derive_majorants(plant)
    problem = theorem1_problem(plant, majorants, weights, margin)
    admit(plant, majorants, problem.center)
    require_funnel(plant)
    return problem


def synthesize_theorem1(
    problem: Theorem1Problem,
    margins: tuple[float, ...],
    progress: Callable[[str], None],
    arithmetic: Arithmetic = DEFAULT,
) -> Design:
    """Find gains, prove them, and return the design; writes nothing.

    Parameters
    ----------
    problem : Theorem1Problem
        What is fixed, free and wanted.
    margins : tuple[float, ...]
        Relative room that the rounded inequalities keep: the next one is tried where the
        checker finds one too thin.
    progress : callable
        Receives one sentence per stage.
    arithmetic : Arithmetic
        What the generated code computes with.

    Raises
    ------
    NoGainsError
        Something is free and nothing was found, or the actuator limit is exceeded.
    """
    require_functions(problem.plant, None, arithmetic)
    for margin in margins:
        problem = replace(problem, margin=margin)
        found = search_theorem1(problem, progress)
        if found is None:
            raise _no_design(problem, progress)
        if problem.plant.spec.synthesis.form is Form.PRINTED:
            design = design_theorem1(problem, found, _judged(problem, found))
            break
        progress("proving")
        design = design_theorem1(problem, found, proved_theorem1(problem, found, arithmetic))
        certificate = design.certificate
        require_signals(problem.plant, certificate.failures)
        fixed = not problem.is_free or any(not e.holds for e in certificate.assumption_checks)
        if certificate.verdict is Verdict.CERTIFIED or fixed:
            break
        progress("a margin was too thin: rounding again")
    return replace(design, arithmetic=arithmetic)


def proved_theorem1(
    problem: Theorem1Problem, found: Theorem1Evaluation, arithmetic: Arithmetic = DEFAULT
) -> Certificate:
    """Write the certificate of a candidate and judge it."""
    from bfppc_synth.certificate.produce import judge, produce_certificate, tool_name
    from bfppc_synth.spec.canonical import plant_json

    document = json.loads(plant_json(problem.plant.spec))
    produced = produce_certificate(
        document,
        found.gains,
        found.half_widths,
        tool=tool_name(),
        c_0=found.c_0,
        arithmetic=arithmetic,
        chosen=problem.plant.spec.chosen,
    )
    return judge(document, produced)


def read_proof(folder: Path) -> str:
    """Text of a folder's certificate, empty where it has none."""
    proof = folder / "certificate.json"
    return proof.read_text(encoding="utf-8") if proof.is_file() else ""


def restore_theorem1(problem: Theorem1Problem, document: Mapping[str, Any], folder: Path) -> Design:
    """Read the gains of a report back into a design; nothing is searched.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the report lacks something.
    UsageError
        If the gains do not fit the plant file.
    """
    gains = tuple(
        Theorem1Gain(gamma=g["gamma"], H=tuple(g["H"]), H_star=g["H_star"], c=g["c"], N=g["N"])
        for g in document["gains"]
    )
    widths = tuple(float(p) for p in document["omega"]["p"])
    found = Theorem1Judge(problem).evaluate(gains, widths, document["theorem1"]["c_0"])
    if found is None:
        raise UsageError("the gains of report.json do not fit plant.yaml")
    verdict = Verdict(document["status"])
    certificate = replace(_judged(problem, found), verdict=verdict, document=read_proof(folder))
    return design_theorem1(problem, found, certificate)


def _judged(problem: Theorem1Problem, found: Theorem1Evaluation) -> Certificate:
    """Every inequality as evaluated in floats."""
    names = problem.plant.spec.states
    weak = problem.theorem.strictness is Strictness.WEAK
    inequalities = tuple(
        Inequality(
            id=f"{demand.name}[{names[demand.step]}]",
            equation=demand.equation,
            lhs=(demand.lhs, demand.lhs),
            rhs=(demand.rhs, demand.rhs),
            holds=demand.lhs > demand.rhs or (weak and demand.lhs == demand.rhs),
        )
        for demand in found.demands
    )
    printed = problem.plant.spec.synthesis.form is Form.PRINTED
    failed = tuple(
        f"{entry.id} {entry.equation}: {entry.lhs[0]:.6g} is not above {entry.rhs[0]:.6g}"
        for entry in inequalities
        if not entry.holds
    )
    verdict = Verdict.PRINTED if printed else Verdict.UNDECIDED
    return Certificate(
        verdict=verdict,
        inequalities=inequalities,
        assumptions=(),
        failures=(*((NEVER_CERTIFIED,) if printed else ()), *failed),
    )


def design_theorem1(
    problem: Theorem1Problem, found: Theorem1Evaluation, certificate: Certificate
) -> Design:
    """Assemble what code generation, simulation and report read."""
    spec = problem.plant.spec
    top = [table[-1] for table in found.chain.tables]
    return Design(
        spec=spec,
        plant=problem.plant,
        majorants=problem.majorants,
        signals=bound_signals(problem.plant),
        center=problem.center,
        conditions=conditions(spec),
        gains=found.gains,
        omega=found.half_widths,
        bounds=found.bounds,
        certificate=certificate,
        largest_certified_period=0.0,
        theorem1=Theorem1Bounds(
            c_0=found.c_0,
            noise=problem.noise,
            epsilon=found.chain.epsilon,
            needed=tuple(node.needed for node in top),
            height=tuple(node.H for node in top),
        ),
    )


def _no_design(problem: Theorem1Problem, progress: Callable[[str], None]) -> BfppcError:
    """Say why nothing was found, and what the least peak input found is."""
    path = problem.plant.spec.path
    if not problem.is_free:
        return NotCertifiedError(
            f"no certified design for {path}: with these gains a bound breaks down on the"
            " reachable box (a pole, or another domain error)"
        )
    if problem.limit is not None:
        cheap = replace(problem, limit=None, weights=Weights(peak_input=1.0, slope=0.01))
        least = search_theorem1(cheap, progress)
        if least is not None:
            return NoGainsError(
                None,
                Diagnosis(
                    headline=f"no certified design for {path}: the least peak input found with"
                    f" theorem1 is {least.bounds.U:.4g}, above actuator.limit {problem.limit:.6g}",
                    least_input=least.bounds.U,
                ),
            )
    return NoGainsError(
        None,
        Diagnosis(
            headline=f"no certified design for {path}: no gains were found for theorem1, whose"
            f" errors cost twice the resolution (accuracy {problem.accuracy:.6g} against delta_M"
            f" {problem.noise[0]:.6g})"
        ),
    )
