"""How good a design is among all that the search could have found."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimality:
    """What is known of the least cost; an estimate in floats, nothing that is certified.

    ``gap`` is there where the program is a geometric one: the design costs at most this share
    more than the best that keeps the margins of the search (per unit of weight: of U alone for
    objective peak-input), ``gap_without_margins`` more than the best of all. ``spread`` is how
    far the costs of the starts lie apart, as such a share too; ``starts`` counts those that led
    to a design.
    """

    gap: float | None
    gap_without_margins: float | None
    spread: float
    starts: int
