"""The code section of report.json: what a step computes, and how many digits it loses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.report.numbers import finite

if TYPE_CHECKING:
    from bfppc_synth.model.cost import StepCost
    from bfppc_synth.model.design import Design


def code_entry(design: Design, cost: StepCost | None) -> dict[str, object]:
    """Lay out facts about the generated code that no target is needed for.

    Parameters
    ----------
    design : Design
        Gives the slopes L_i, the reach X_1 [unit of x_1] and the peak U [unit of u].
    cost : StepCost | None
        Operations of one step; without them the section is left out.

    Returns
    -------
    dict[str, object]
        Empty, or ``code`` with the counts, ``slope_product`` L_1 .. L_n [unit of u per unit
        of x_1] and ``digits_lost``, the decimal logarithm of (L_1 .. L_n) X_1 / U: how much
        larger a relative error of x_1 is as a relative error of u, at least 0.
    """
    if cost is None:
        return {}
    bounds = design.bounds
    product = math.prod(bounds.L)
    amplified = product * bounds.X[0] / bounds.U if bounds.U > 0.0 else math.inf
    digits = math.log10(amplified) if amplified > 1.0 else 0.0
    return {
        "code": {
            "operations": {
                "additions": cost.additions,
                "multiplications": cost.multiplications,
                "divisions": cost.divisions,
                "comparisons": cost.choices,
                "functions": dict(cost.functions),
            },
            "step": cost.words(),
            "remembered": cost.remembered,
            "slope_product": finite(product),
            "digits_lost": finite(digits),
        }
    }
