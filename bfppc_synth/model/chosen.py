"""A requirement that the search has set: the smallest accuracy, the largest period or steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bfppc_synth.model.spec import Objective


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """What an inverse objective found, a binary64 number.

    ``value`` is p_1 [unit of x_1] for ACCURACY, h [s] for PERIOD, the common factor on the
    quantizers of the plant file for RESOLUTION.
    """

    objective: Objective
    value: float
