"""What the plant file's objective minimizes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.gains.problem import Weights
from bfppc_synth.model.spec import Objective

if TYPE_CHECKING:
    from bfppc_synth.model.spec import PlantSpec

# What an objective adds of the other quantity: 1 % of U buys orders of magnitude of slope.
SIDE_WEIGHT = 0.01
LEADING = {
    Objective.PEAK_INPUT: Weights(peak_input=1.0, slope=SIDE_WEIGHT),
    Objective.SLOPE: Weights(peak_input=SIDE_WEIGHT, slope=1.0),
    Objective.BALANCED: Weights(peak_input=1.0, slope=1.0),
}


def weights_of(spec: PlantSpec) -> Weights:
    """Return the exponents of U and of the slope of phi_n.

    An inverse objective alone weighs designs of one requirement as peak-input does.
    """
    objective = tuple(pair for pair in spec.synthesis.objective if pair[0] in LEADING)
    if not objective:
        return LEADING[Objective.PEAK_INPUT]
    if len(objective) == 1 and len(spec.synthesis.objective) == 1:
        return LEADING[objective[0][0]]
    given = dict(objective)
    both = given.get(Objective.BALANCED, 0.0)
    peak = given.get(Objective.PEAK_INPUT, 0.0) + both
    slope = given.get(Objective.SLOPE, 0.0) + both
    least = SIDE_WEIGHT * max(peak, slope)
    return Weights(peak_input=max(peak, least), slope=max(slope, least))
