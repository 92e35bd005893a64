"""The audit itself: the file's numbers in both forms, their proof, their runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.audit.assumptions import assumptions
from bfppc_synth.audit.completion import complete
from bfppc_synth.audit.inequalities import Evaluated, side_by_side
from bfppc_synth.audit.judging import form_judge, holds
from bfppc_synth.audit.records import Audit, FormReport, Origin
from bfppc_synth.audit.runs import full_start, limits_of, run_from
from bfppc_synth.audit.variants import pinned, variant, with_handover
from bfppc_synth.errors import NoDesignError, NotCertifiedError, PlantFileError
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.spec import BoundsKind, Form, Method
from bfppc_synth.model.stages import Handover
from bfppc_synth.simulation.loop import coverage
from bfppc_synth.simulation.scheme import Coverage
from bfppc_synth.spec.objective import sought
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from bfppc_synth.audit.records import Candidate, Completion, RunReport
    from bfppc_synth.model.certificate import Certificate
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.model.trajectory import Trajectory

BREAKS_DOWN = (
    "with these gains a bound breaks down on the reachable box (a pole, another domain error,"
    " or no positive g_m)"
)
NOT_COVERED = (
    "the broken run is in steps of simulation.period, longer than the certificate covers: the law"
    " is continuous here, or meant to be sampled faster; a smaller simulation.period may hold"
)
_ABOUT_BOUNDS = {
    BoundsKind.TERMWISE: "bounds termwise: each term of F_i* is bounded apart",
    BoundsKind.TIGHT: "bounds tight: F_i* is the supremum of the whole residual",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Form:
    """One form of the audited file: what it says, or why it says nothing."""

    spec: PlantSpec
    evaluated: Evaluated | None
    failures: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether every inequality holds in floats."""
        if self.evaluated is None:
            return False
        judge, judged = self.evaluated.judge, self.evaluated.judged
        return all(holds(demand, judge.relation(demand)) for demand in judged.demands)


def audit_plant(
    spec: PlantSpec,
    starts: Sequence[Mapping[str, float]],
    progress: Callable[[str], None],
) -> tuple[Audit, tuple[tuple[Design, Trajectory], ...]]:
    """Audit the gains and half-widths of a plant file; writes nothing.

    Parameters
    ----------
    spec : PlantSpec
        The file, of any method and form.
    starts : Sequence[Mapping[str, float]]
        Initial states besides the file's, by state name [unit of x_i].
    progress : callable
        Receives one sentence per step.

    Returns
    -------
    tuple
        The audit, and its runs with the design that they are runs of, in the same order.

    Raises
    ------
    PlantFileError
        A bound breaks down on the smallest box, or the reference cannot be enclosed.
    NoDesignError
        Gains are open and no values of them were found.
    UsageError
        A start names a state that is not there.

    References
    ----------
    docs/theory.md sections 2, 3, 7, 8 and 10.
    """
    if sought(spec.synthesis) is not None:
        # What is audited is a law for requirements that are all given.
        spec = synthesize(spec, progress=progress).spec
    begin = [full_start(spec, given) for given in ({}, *starts)]
    progress("reading the gains")
    completion = complete(spec, progress)
    candidate = completion.candidate
    fixed = pinned(spec, candidate)
    own = fixed.synthesis.form
    progress("evaluating the inequalities")
    sound = _evaluate(variant(fixed, Form.SOUND), candidate, own)
    printed = None
    if spec.synthesis.method is not Method.UNIFIED:
        printed = _evaluate(variant(fixed, Form.PRINTED), candidate, own)
    progress("asking the separate checker")
    proved, refusal = _designed(sound.spec)
    design = proved if own is Form.SOUND else _designed(fixed)[0]
    runs = []
    for start in begin if design is not None else ():
        progress("simulating")
        if design is not None:
            limits = limits_of(design, completion)
            runs.append((*run_from(design, start, limits), design))
    forms = [form.evaluated for form in (printed, sound) if form is not None]
    known = tuple(form for form in forms if form is not None)
    certificate = None if proved is None else proved.certificate
    audit = Audit(
        spec=fixed,
        completion=completion,
        rows=side_by_side(
            fixed,
            candidate,
            None if printed is None else printed.evaluated,
            sound.evaluated,
        ),
        assumptions=assumptions(fixed, candidate, known, certificate),
        printed=None if printed is None else _reported(Form.PRINTED, printed, None, ()),
        sound=_reported(Form.SOUND, sound, certificate, refusal),
        runs=tuple(report for report, _, _ in runs),
        notes=(
            *_completed(completion),
            *_about_forms(spec, fixed, candidate),
            *_about_runs(proved, tuple((design, report) for report, _, design in runs)),
        ),
    )
    return audit, tuple((owner, run) for _, run, owner in runs)


def _evaluate(spec: PlantSpec, candidate: Candidate, own: Form) -> _Form:
    """Judge one form; what only the other form of the file meets is no reason to stop."""
    try:
        judge = form_judge(spec)
    except (NoDesignError, PlantFileError) as error:
        if isinstance(error, PlantFileError) and spec.synthesis.form is own:
            raise
        return _Form(spec=spec, evaluated=None, failures=(str(error),))
    judged = judge.judge(candidate)
    if judged is None:
        return _Form(spec=spec, evaluated=None, failures=(BREAKS_DOWN,))
    return _Form(spec=spec, evaluated=Evaluated(judge=judge, judged=judged))


def _designed(spec: PlantSpec) -> tuple[Design | None, tuple[str, ...]]:
    """Take the road of ``synth`` with nothing left to search for."""
    try:
        return synthesize(spec), ()
    except (NoDesignError, NotCertifiedError, PlantFileError) as error:
        return None, (str(error),)


def _reported(
    form: Form, found: _Form, certificate: Certificate | None, refusal: tuple[str, ...]
) -> FormReport:
    failures = found.failures
    if certificate is not None:
        failures = certificate.failures
    elif not failures:
        failures = refusal
    return FormReport(
        form=form,
        bounds=None if found.evaluated is None else found.evaluated.judged.bounds,
        holds=found.holds,
        failures=failures,
        certificate=certificate,
    )


def _completed(completion: Completion) -> tuple[str, ...]:
    """Say what the file leaves open and what was taken for it."""
    notes = []
    if completion.zeroed:
        notes.append(
            "terms beside those that the file names, taken as 0 (`synth` would choose them):"
            f" {', '.join(completion.zeroed)}"
        )
    filled = ", ".join(completion.filled)
    if completion.origin is Origin.SOLVED:
        notes.append(f"left open by the file and solved for: {filled}")
    elif completion.origin is Origin.CLOSEST:
        notes.append(
            f"left open by the file, no value meets every inequality: {filled};"
            " the table is for the values that come closest"
        )
    return tuple(notes)


def _about_forms(spec: PlantSpec, fixed: PlantSpec, candidate: Candidate) -> tuple[str, ...]:
    synthesis = spec.synthesis
    if synthesis.method is Method.UNIFIED:
        unprinted = "method unified is not in the paper: it has no printed form"
        return (unprinted, _ABOUT_BOUNDS[synthesis.bounds])
    notes = []
    if synthesis.form is Form.PRINTED:
        notes.append("a printed form is never certified: a proof is one of the sound form")
    if synthesis.method is Method.THEOREM3 and synthesis.form is Form.PRINTED:
        renewed = _evaluate(with_handover(fixed, Handover.REANCHOR), candidate, Form.PRINTED)
        verb = "holds" if renewed.holds else "does not hold"
        notes.append(
            "the sound form is that of `handover: containment`, the law as printed; that of"
            f" `handover: reanchor`, another law, {verb} with these gains"
        )
    return tuple(notes)


def _about_runs(
    proved: Design | None, runs: tuple[tuple[Design, RunReport], ...]
) -> tuple[str, ...]:
    """Weigh a broken run from a declared start against a proof."""
    certified = proved is not None and proved.certificate.verdict is Verdict.CERTIFIED
    broken = [design for design, run in runs if run.declared and not run.held]
    if not certified or not broken:
        return ()
    if coverage(broken[0]) is Coverage.COVERED:
        return ("a run that the certificate covers left its bounds: one of the two is wrong",)
    return (NOT_COVERED,)
