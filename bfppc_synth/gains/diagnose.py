"""Why there is no design, in the user's words."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.errors import BfppcError, NoDesignError, NotCertifiedError
from bfppc_synth.gains.problem import DesignProblem, Weights
from bfppc_synth.gains.search import search
from bfppc_synth.gains.terms import binding_terms

if TYPE_CHECKING:
    from bfppc_synth.gains.evaluation import Evaluation


def no_design(problem: DesignProblem, *, free: bool) -> BfppcError:
    """Say why the search found nothing, and what the least certified peak input is.

    Parameters
    ----------
    problem : DesignProblem
        The problem without a solution.
    free : bool
        Whether anything was left to the search.

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
        least = search(_for_least_input(problem), lambda _: None)
        if least is not None:
            return NoDesignError(_over_the_limit(problem, least))
    timing = problem.conditions
    if timing.hold > 0.0 or any(timing.delta):
        relaxed = replace(
            problem,
            conditions=replace(timing, hold=0.0, delay=0.0, delta=(0.0,) * problem.order),
            limit=None,
        )
        exact = search(relaxed, lambda _: None)
        if exact is not None:
            return NoDesignError(
                f"no certified design for {path}: with exact continuous measurement there is one"
                f" (peak input {exact.bounds.U:.3g}), but not with this resolution and period\n"
                "  fix: sample faster, shorten the delay, use a finer quantizer, or allow a larger"
                " accuracy"
            )
    return NoDesignError(
        f"no certified design for {path}: no gains were found, even with exact continuous"
        " measurement and no limit\n"
        "  fix: allow a larger accuracy, a slower rho (larger t_s), or a smaller initial set"
    )


def _for_least_input(problem: DesignProblem) -> DesignProblem:
    return replace(problem, limit=None, weights=Weights(peak_input=1.0, slope=0.01))


def _over_the_limit(problem: DesignProblem, least: Evaluation) -> str:
    last = problem.order - 1
    shares = binding_terms(least.bounds, least.half_widths, problem.center, last)
    lines = [
        (
            f"no certified design for {problem.plant.spec.path}: the least certified peak input"
            f" found is {least.bounds.U:.4g}, above actuator.limit {problem.limit:.6g}"
        )
    ]
    if shares:
        name, share = shares[0]
        lines.append(f"  what drives it: {name} takes {share:.0%} of F_{last + 1}*")
    lines.append(f"  would suffice: actuator.limit {least.bounds.U * 1.01:.4g}")
    return "\n".join(lines)
