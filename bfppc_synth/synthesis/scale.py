"""Where the search of an inverse objective begins: the size of things, before any design."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.expressions.resolution import resolution, upper_bound
from bfppc_synth.model.spec import Objective

if TYPE_CHECKING:
    from bfppc_synth.model.spec import PlantSpec

# A share of where x_1 starts, and of the noise that no tube may be narrower than.
_SHARE, _ABOVE_NOISE = 0.1, 4.0
# Samples that are fast for most machines [s].
_PERIOD = 1e-4


def first_guess(spec: PlantSpec, objective: Objective) -> float:
    """Return the value that is tried first.

    Parameters
    ----------
    spec : PlantSpec
        The plant file; nothing in it limits the value.
    objective : Objective
        What is sought.

    Returns
    -------
    float
        p_1 [unit of x_1], h [s], or a factor; positive.
    """
    if objective is Objective.PERIOD:
        # Where a question sets the file's period aside, runs are still made in steps of it.
        timed = spec.gives("sampling.period") or spec.gives("simulation.period")
        return spec.simulation.period if timed else _PERIOD
    if objective is Objective.RESOLUTION:
        return 1.0
    first = spec.initial[0]
    sizes = [abs(float(upper_bound(end))) for end in (first.lower, first.upper)]
    noise = float(resolution(spec.measurement.quantizers[0], spec.measurement.noise[0]))
    return max(_SHARE * (max(sizes) or 1.0), _ABOVE_NOISE * noise)
