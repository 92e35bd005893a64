"""What a rate of one state is in units of the next one: floors and starts must know no units."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.errors import EnvelopeError

if TYPE_CHECKING:
    from bfppc_synth.gains.problem import DesignProblem


def per_rate(problem: DesignProblem) -> tuple[float, ...]:
    """Return 1 / g_{m,i} on the smallest box: what moves x_i by one unit a second.

    Parameters
    ----------
    problem : DesignProblem
        With any units of its states.

    Returns
    -------
    tuple[float, ...]
        One per step [unit of x_{i+1}, of u, by unit of x_i per s]; 1 where nothing is known yet.
        Replacing x_i by s_i x_i multiplies it by s_{i+1} / s_i.

    References
    ----------
    docs/theory.md section 5.
    """
    residual = problem.float_residual()
    smallest = (problem.accuracy, *(0.0,) * (problem.order - 1))
    found = []
    for step in range(problem.order):
        try:
            least = residual.gain_lower(step, smallest[: step + 1])
        except (EnvelopeError, OverflowError, ZeroDivisionError):
            least = 1.0
        found.append(1.0 / least if 0.0 < least < math.inf else 1.0)
    return tuple(found)
