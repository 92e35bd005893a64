"""A quantity of the plant file that one number relaxes, written back as YAML."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Decimal

from bfppc_synth.spec.edits import Edit

#: A factor on what the file says; its edits, rounded to the side that asks for less.
Change = Callable[[float], tuple[Edit, ...]]

#: What the same relative change is worth: of a wish; of what has to be bought; of a fact about
#: the plant, its starts and what disturbs it, which a user can hardly change.
WISH, BOUGHT, FACT = 1.0, 1.3, 2.0

_DIGITS = 3
_ROUNDINGS = {1: ROUND_CEILING, 0: ROUND_HALF_EVEN, -1: ROUND_FLOOR}
# How far a larger value is looked for: beyond, the file would be about another machine.
FAR = (1.2, 2.0, 6.0, 30.0, 1000.0)
NEAR = tuple(1.0 / factor for factor in FAR)


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement:
    """One thing that could be asked for less.

    ``path`` names it in the file, ``given`` is its text there; ``factors`` are tried in turn,
    from near to far, and ``extreme`` is the most that can be given up (0 where the quantity may
    vanish), None where there is no such end; ``weight`` is WISH, BOUGHT or FACT.
    """

    path: str
    given: str
    change: Change
    factors: tuple[float, ...]
    extreme: float | None = None
    weight: float = WISH

    def written(self, factor: float) -> str:
        """Return the value that this factor leads to; with its paths where it is several."""
        edits = self.change(factor)
        if len(edits) == 1 and edits[0].text is not None:
            return edits[0].text
        return ", ".join(f"{edit.path} {edit.text}" for edit in edits)


def number(value: float, upward: int, digits: int = _DIGITS) -> str:
    """Write a number in few digits, rounded up (1), down (-1) or to nearest (0).

    Noise of floats in the thirteenth digit does not count: 0.01 / 2 is 0.005 on either side.
    """
    exact = Decimal(f"{value:.12g}")
    if not exact:
        return "0"
    unit = Decimal(1).scaleb(exact.adjusted() + 1 - digits)
    rounded = exact.quantize(unit, rounding=_ROUNDINGS[upward])
    return f"{float(rounded):.{max(10, digits)}g}"


def relative_change(factor: float) -> float:
    """Return by how much a factor changes a value, the same for a half and for twice."""
    return math.inf if factor <= 0.0 else abs(math.log(factor))
