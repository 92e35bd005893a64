"""What a design's peak input owes to one requirement."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensitivity:
    """What asking 10 % less of one requirement buys: an estimate, nothing is proved of it.

    ``path`` names the requirement in the plant file, ``given`` is its text there and ``eased``
    what is asked instead. ``peak_input`` and ``slope`` are the relative changes of U and of the
    slope of phi_n when the gains are chosen anew (below 0: less).
    """

    path: str
    given: str
    eased: str
    peak_input: float
    slope: float
