"""The code section of report.json: what a step computes, costs, and loses of its digits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.model.target import NOT_ASKED, PROCESSOR, TargetCost
from bfppc_synth.report.numbers import finite

if TYPE_CHECKING:
    from bfppc_synth.model.cost import StepCost
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.target import NotMeasured


def code_entry(
    design: Design, cost: StepCost | None, target: TargetCost | NotMeasured = NOT_ASKED
) -> dict[str, object]:
    """Lay out facts about the generated code, and what was measured of it on a target.

    Parameters
    ----------
    design : Design
        Gives the slopes L_i, the reach X_1 [unit of x_1] and the peak U [unit of u].
    cost : StepCost | None
        Operations of one step; without them the section is left out.
    target : TargetCost | NotMeasured
        Instructions and bytes of one step, or why there are none.

    Returns
    -------
    dict[str, object]
        Empty, or ``code`` with the counts, ``slope_product`` L_1 .. L_n [unit of u per unit
        of x_1] and ``digits_lost``, the decimal logarithm of (L_1 .. L_n) X_1 / U: how much
        larger a relative error of x_1 is as a relative error of u, at least 0; and ``target``,
        whose numbers are None and ``not_measured`` the reason where nothing was measured.
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
            "target": _target_entry(target),
        }
    }


def _target_entry(target: TargetCost | NotMeasured) -> dict[str, object]:
    """Lay out a measurement; the keys are the same where there is none."""
    measured = target if isinstance(target, TargetCost) else None
    return {
        "processor": PROCESSOR,
        "compiler": measured and measured.compiler,
        "emulator": measured and measured.emulator,
        "instructions": {
            "least": measured and measured.least,
            "average": measured and measured.average,
            "most": measured and measured.most,
        },
        "stack_bytes": measured and measured.stack,
        "code_bytes": measured and measured.code,
        "state_bytes": measured and measured.state,
        "not_measured": None if isinstance(target, TargetCost) else target.reason,
    }
