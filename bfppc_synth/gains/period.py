"""The largest sample period that given gains tolerate."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.gains.evaluation import Judge
from bfppc_synth.gains.methods.theorem3 import retimed

if TYPE_CHECKING:
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.shapes import Shape
    from bfppc_synth.model.tight import TightBounds

_KEPT = 1e-6
_STEPS = 40


def largest_period(
    problem: DesignProblem,
    shapes: tuple[Shape, ...],
    half_widths: tuple[float, ...],
    tight: TightBounds | None = None,
) -> float:
    """Bisect for the largest h at which every inequality still holds.

    Parameters
    ----------
    problem : DesignProblem
        The delay is kept; the actuator limit does not depend on h.
    shapes, half_widths
        The design.
    tight : TightBounds, optional
        Its tight bounds, which do not depend on h.

    Returns
    -------
    float
        A lower bound on the largest period [s], to three digits, 0 if none was found.

    References
    ----------
    docs/theory.md section 3: zeta grows linearly in h with center performance.
    """

    def fits(period: float) -> bool:
        conditions = replace(problem.conditions, hold=period + problem.conditions.delay)
        posed = retimed(problem, conditions)
        if posed is None:
            return False
        found = Judge(posed).best(shapes, half_widths, tight)
        return found is not None and found.holds(_KEPT)

    low, high = -30.0, 3.0
    if not fits(math.exp(low)):
        return 0.0
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        if fits(math.exp(middle)):
            low = middle
        else:
            high = middle
    value = math.exp(low)
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.floor(value / unit) * unit:.2e}")
