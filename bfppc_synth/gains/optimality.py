"""From the record of a search to what is said of its optimum."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.model.optimality import Optimality

if TYPE_CHECKING:
    from bfppc_synth.gains.evaluation import Evaluation
    from bfppc_synth.gains.problem import DesignProblem


def optimality_of(problem: DesignProblem, found: Evaluation) -> Optimality | None:
    """Say how far the cost of a design may be above the least one.

    Parameters
    ----------
    problem : DesignProblem
        Its weights are the exponents of the cost.
    found : Evaluation
        A design as the search returned it.

    Returns
    -------
    Optimality or None
        None where nothing was searched, or the search kept no record (bounds tight).

    References
    ----------
    docs/theory.md section 5: with one free shape a step the problem is a geometric program, and
    a local optimum is global; otherwise nothing but the spread of the starts is known.
    """
    if not found.starts:
        return None
    total = problem.weights.peak_input + problem.weights.slope
    gaps: tuple[float | None, float | None] = (None, None)
    if found.lower is not None and math.isfinite(found.lower[1]):
        kept, free = (math.expm1(max(found.cost - low, 0.0) / total) for low in found.lower)
        gaps = (kept, free)
    spread = math.expm1((max(found.starts) - min(found.starts)) / total)
    return Optimality(
        gap=gaps[0], gap_without_margins=gaps[1], spread=spread, starts=len(found.starts)
    )
