"""A candidate for a file that leaves numbers open: solved for, else the closest there is."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.audit.judging import EVEN, ROOM, form_judge
from bfppc_synth.audit.records import Candidate, Completion, Origin
from bfppc_synth.audit.variants import C_0, open_keys, without_absent_terms
from bfppc_synth.errors import NoDesignError
from bfppc_synth.gains.search import search
from bfppc_synth.gains.theorem1.judge import lack
from bfppc_synth.gains.theorem1.search import search_theorem1
from bfppc_synth.model.shapes import Shape, Theorem1Gain
from bfppc_synth.model.spec import Form, Method
from bfppc_synth.synthesis.prepare import prepare
from bfppc_synth.synthesis.synthesize import synthesize
from bfppc_synth.synthesis.theorem1 import prepare_theorem1

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.audit.judging import FormJudge
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.spec import GainSpec, PlantSpec

# Free half-widths (and c_0) of the closest candidate: multiples of p_1 to begin with.
_STARTS = (1e-2, 1.0, 1e2, 1e4)
_STEPS = (8.0, 2.0, 1.3, 1.05, 1.01)
# A side that is no number is worse than any that is.
_BROKEN = 1e9


def complete(spec: PlantSpec, progress: Callable[[str], None]) -> Completion:
    """Fill in what a plant file leaves open.

    What is audited is the law that the file names: a term is 0 where a step names others. The
    rest is solved for, as ``synth`` would; where nothing does, open half-widths are those that
    come closest.

    Parameters
    ----------
    spec : PlantSpec
        The file.
    progress : callable
        Receives one sentence per solve.

    Returns
    -------
    Completion
        A candidate in which nothing is open, and the paths that were filled in.

    Raises
    ------
    NoDesignError
        If gains are open and no values of them were found.
    """
    named, zeroed = without_absent_terms(spec)
    left = _open(named)
    found = _solved(named, progress)
    if found is None and not all(".p." in path or path == C_0 for path in left):
        raise NoDesignError(
            f"nothing to audit in {spec.path}: it leaves {', '.join(left)} open, and no values"
            " were found with which the inequalities hold\n"
            "  fix: give the gains that shall be checked"
        )
    origin = Origin.SOLVED if left else Origin.GIVEN
    if found is None:
        found, origin = _closest(named), Origin.CLOSEST
    return Completion(candidate=found, origin=origin, filled=left, zeroed=zeroed)


def _solved(spec: PlantSpec, progress: Callable[[str], None]) -> Candidate | None:
    """Search; where nothing is open, take the file's numbers as they are."""
    if not _open(spec):
        return _as_given(spec)
    if spec.synthesis.form is Form.SOUND:
        # The full road rounds again where the separate checker finds a margin too thin.
        try:
            design = synthesize(spec, progress=progress)
        except NoDesignError:
            return None
        bounds = design.theorem1
        return Candidate(
            gains=design.gains,
            half_widths=design.omega,
            c_0=None if bounds is None else bounds.c_0,
        )
    # Nothing is proved of the printed form: where a fixed number leaves no room, none is kept.
    for room in (ROOM, 0.0):
        if spec.synthesis.method is Method.THEOREM1:
            problem_1 = replace(prepare_theorem1(spec, EVEN, ROOM), margin=room)
            judged = search_theorem1(problem_1, progress)
            if judged is not None:
                return Candidate(gains=judged.gains, half_widths=judged.half_widths, c_0=judged.c_0)
            continue
        problem = replace(prepare(spec)[0], margin=room)
        found = search(problem, progress)
        if found is not None:
            return Candidate(gains=found.shapes, half_widths=found.half_widths)
    return None


def _open(spec: PlantSpec) -> tuple[str, ...]:
    """List what is open, but not a c_0 that the printed formula of p_2 leaves no choice for."""
    keys = open_keys(spec)
    if C_0 in keys and prepare_theorem1(spec, EVEN, ROOM).c_0 is not None:
        return tuple(key for key in keys if key != C_0)
    return keys


def _as_given(spec: PlantSpec) -> Candidate:
    """Read the file's numbers as they are; an open p is p_1 for a start."""
    accuracy = spec.performance.accuracy
    first = 1.0 if accuracy is None else accuracy.approximate
    widths = (first, *(first if p is None else p.approximate for p in spec.synthesis.p[1:]))
    c_0 = None
    if spec.synthesis.method is Method.THEOREM1:
        c_0 = prepare_theorem1(spec, EVEN, ROOM).c_0 or 0.0
    return Candidate(gains=tuple(map(_gain, spec.synthesis.gains)), half_widths=widths, c_0=c_0)


def _gain(given: GainSpec) -> Gain:
    k, M, epsilon, c, gamma, H_star = (
        None if value is None else value.approximate
        for value in (given.k, given.M, given.epsilon, given.c, given.gamma, given.H_star)
    )
    if given.H is not None:
        H = tuple(coefficient.approximate for coefficient in given.H)
        star = H[0] if H_star is None else H_star
        return Theorem1Gain(gamma=gamma or 0.0, H=H, H_star=star, c=c or 0.0, N=given.N)
    return Shape(k=k or 0.0, M=M or 0.0, epsilon=epsilon or 1.0, c=c or 0.0, N=given.N)


def _closest(spec: PlantSpec) -> Candidate:
    """Walk along one free number at a time towards the least shortfall."""
    judge = form_judge(spec)
    base = _as_given(spec)
    slots = [i for i in range(1, spec.order) if spec.synthesis.p[i] is None]
    options = spec.synthesis.theorem1
    if base.c_0 is not None and (options is None or options.c_0 is None):
        slots.append(-1)
    best, least = base, math.inf
    for start in _STARTS:
        trial = base
        for slot in slots:
            trial = _moved(trial, slot, start * base.half_widths[0])
        trial, short = _walked(judge, trial, slots)
        if short < least:
            best, least = trial, short
    return best


def _walked(judge: FormJudge, trial: Candidate, slots: list[int]) -> tuple[Candidate, float]:
    short = _shortfall(judge, trial)
    for step in _STEPS:
        improved = True
        for _ in range(40):
            if not improved:
                break
            improved = False
            for slot in slots:
                value = (trial.c_0 or 0.0) if slot < 0 else trial.half_widths[slot]
                for factor in (step, 1.0 / step):
                    other = _moved(trial, slot, value * factor)
                    found = _shortfall(judge, other)
                    if found < short:
                        trial, short, improved = other, found, True
    return trial, short


def _moved(candidate: Candidate, slot: int, value: float) -> Candidate:
    if slot < 0:
        return replace(candidate, c_0=value)
    widths = candidate.half_widths
    return replace(candidate, half_widths=(*widths[:slot], value, *widths[slot + 1 :]))


def _shortfall(judge: FormJudge, candidate: Candidate) -> float:
    judged = judge.judge(candidate)
    if judged is None:
        return _BROKEN
    return max(lack(demand.lhs, demand.rhs) for demand in judged.demands)
