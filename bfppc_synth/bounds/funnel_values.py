"""The funnel at given times, for what is simulated and drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.bounds.interval_arrays import IntervalFunctions, interval
from bfppc_synth.expressions.evaluate import evaluate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bfppc_synth.model.plant import Plant


def funnel_values(plant: Plant, t: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Evaluate the funnel.

    Parameters
    ----------
    plant : Plant
        With or without a funnel.
    t : array (N,)
        Times since the first sample [s].

    Returns
    -------
    array (N,) or None
        Bound on |y - y_d| [unit of y], rounded up; None without a funnel.
    """
    if plant.funnel is None:
        return None
    found = evaluate(plant.funnel, {plant.time: interval(t, t)}, IntervalFunctions())
    return np.broadcast_to(found.upper, t.shape)
