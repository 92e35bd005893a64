"""Why there is no design, in the user's words."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.errors import BfppcError, NoDesignError, NotCertifiedError
from bfppc_synth.gains.evaluation import Judge
from bfppc_synth.gains.problem import DesignProblem, FixedGains, Weights
from bfppc_synth.gains.search import search
from bfppc_synth.gains.terms import explained

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from bfppc_synth.gains.evaluation import Evaluation

# A user waits for the answer: few and coarse steps where each needs a search.
_WIDER = (2.0, 5.0, 20.0)
_FINER = tuple(0.5**k for k in range(1, 24))
_COARSER = 6.0


def no_design(problem: DesignProblem, *, free: bool, least: Evaluation | None = None) -> BfppcError:
    """Say why the search found nothing, and what would suffice instead.

    Parameters
    ----------
    problem : DesignProblem
        The problem without a solution.
    free : bool
        Whether anything was left to the search.
    least : Evaluation, optional
        The least peak input without the limit, where other bounds than termwise know it.

    Returns
    -------
    BfppcError
        NoDesignError (exit 3) where something was free, else NotCertifiedError (exit 4).
    """
    path = problem.plant.spec.path
    if not free:
        return NotCertifiedError(
            f"no certified design for {path}: with these gains a bound breaks down on the"
            " reachable box (a pole, another domain error, or no positive g_m)"
        )
    if problem.limit is not None:
        least = least or _least_input(replace(problem, limit=None))
        if least is not None:
            return NoDesignError(_over_the_limit(problem, least))
        problem = replace(problem, limit=None)
    released = _released(problem)
    if released != problem:
        found = _least_input(released)
        if found is not None:
            return NoDesignError(
                f"no certified design for {path}: the gains or p that synthesis fixes leave none;"
                f" without them there is one (peak input {found.bounds.U:.3g})\n"
                f"  fix: remove what synthesis.gains or synthesis.p fixes, or {_loosen(found)}"
            )
    timing = problem.conditions
    if timing.hold > 0.0 or any(timing.delta):
        exact = _least_input(_measured(problem, 0.0, 0.0))
        if exact is not None:
            return NoDesignError(
                f"no certified design for {path}: with exact continuous measurement there is one"
                f" (peak input {exact.bounds.U:.3g}), but not with this resolution and period\n"
                f"  would suffice{_any_of(_relaxations(problem))}"
            )
    options = _any_of(_accuracies(problem))
    return NoDesignError(
        f"no certified design for {path}: no gains were found, even with exact continuous"
        f" measurement and no limit\n  would suffice{options}"
    )


def _least_input(problem: DesignProblem) -> Evaluation | None:
    return search(
        replace(problem, weights=Weights(peak_input=1.0, slope=0.01)), lambda _message: None
    )


def _released(problem: DesignProblem) -> DesignProblem:
    """Free every gain and half-width; the powers N stay."""
    free = tuple(
        FixedGains(k=None, M=None, epsilon=None, c=None, N=gains.N) for gains in problem.gains
    )
    return replace(problem, gains=free, half_widths=(None,) * problem.order)


def _loosen(found: Evaluation) -> str:
    """Say which values the free design has."""
    widths = ", ".join(f"{p:.3g}" for p in found.half_widths)
    return f"move towards p = ({widths})"


def _measured(problem: DesignProblem, resolution: float, timing: float) -> DesignProblem:
    """Scale resolution and timing."""
    given = problem.conditions
    scaled = replace(
        given,
        hold=timing * given.hold,
        delay=timing * given.delay,
        delta=tuple(resolution * delta for delta in given.delta),
    )
    return replace(problem, conditions=scaled)


def _relaxations(problem: DesignProblem) -> Iterator[str]:
    """Name a period, a resolution and an accuracy that would do, each alone."""
    given = problem.conditions
    # The flattest design tolerates the most; its gains are judged, not searched, again.
    weights = Weights(peak_input=0.01, slope=1.0)
    if given.hold > 0.0:
        found = search(
            replace(_measured(problem, 1.0, 0.0), weights=weights), lambda _message: None
        )
        factor = _tolerated(found, lambda s: _measured(problem, 1.0, s))
        if factor is not None:
            yield f"period + delay {factor * given.hold:.3g} s"
    if any(given.delta):
        found = search(
            replace(_measured(problem, 0.0, 1.0), weights=weights), lambda _message: None
        )
        factor = _tolerated(found, lambda s: _measured(problem, s, 1.0))
        if factor is not None:
            yield f"{factor:.3g} times the resolution"
    yield from _accuracies(problem)


def _tolerated(found: Evaluation | None, change: Callable[[float], DesignProblem]) -> float | None:
    """Find a finer condition that these gains tolerate, then a coarser one by searching."""
    if found is None:
        return None
    factor = next((s for s in _FINER if _still_holds(found, change(s))), None)
    while factor is not None and _COARSER * factor < 1.0:
        if _least_input(change(_COARSER * factor)) is None:
            break
        factor *= _COARSER
    return factor


def _still_holds(found: Evaluation, problem: DesignProblem) -> bool:
    judge = Judge(problem)
    judged = judge.best(found.shapes, found.half_widths)
    return judged is not None and judge.accepts(judged)


def _accuracies(problem: DesignProblem) -> Iterator[str]:
    limit = math.inf if problem.limit is None else problem.limit
    for factor in _WIDER:
        accuracy = factor * problem.accuracy
        found = _least_input(replace(problem, limit=None, accuracy=accuracy))
        if found is not None and limit >= found.bounds.U:
            yield f"accuracy {accuracy:.3g}"
            return


def _any_of(options: Iterator[str]) -> str:
    found = tuple(options)
    if not found:
        return (
            ": none of the changes tried\n  fix: a smaller initial set, a slower rho (larger t_s),"
            " or tighter bounds on the plant, together with a larger accuracy"
        )
    return f" (any one): {' | '.join(found)}"


def _over_the_limit(problem: DesignProblem, least: Evaluation) -> str:
    last = problem.order - 1
    shares = explained(problem, least, last)
    lines = [
        (
            f"no certified design for {problem.plant.spec.path}: the least certified peak input"
            f" found is {least.bounds.U:.4g}, above actuator.limit {problem.limit:.6g}"
        )
    ]
    if shares:
        name, share = shares[0]
        lines.append(f"  what drives it: {name} takes {share:.0%} of F_{last + 1}*")
    options = [f"actuator.limit {least.bounds.U * 1.01:.4g}", *_accuracies(problem)]
    lines.append(f"  would suffice (any one): {' | '.join(options)}")
    return "\n".join(lines)
