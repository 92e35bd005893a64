"""What is asked of a worker and what it answers: small records that travel between processes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.tight import TightBounds


class Status(StrEnum):
    """What became of a point."""

    CERTIFIED = "certified"  # the checker proves it
    INFEASIBLE = "infeasible"  # no gains were found
    REFUSED = "refused"  # the value is a mistake in this plant file
    UNDECIDED = "undecided"  # gains that the checker does not prove
    FAILED = "failed"  # an unexpected error


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """A plant file of the sweep: its place in the grid, its values, its text."""

    index: int
    at: tuple[str, ...]
    source: str
    path: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A design in floats, and the point whose search found it.

    ``alternative`` is the form of the last inequality, empty with theorem1; ``c_0`` is theorem1's,
    ``transition`` center nominal's T_s [s]. ``measure`` is what the sweep makes small.
    """

    origin: int
    gains: tuple[Gain, ...]
    half_widths: tuple[float, ...]
    alternative: str
    c_0: float | None
    transition: float | None
    tight: TightBounds | None
    U: float
    slope: float
    measure: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What is known of a point; ``certificate`` is the text that the checker proved."""

    index: int
    status: Status
    found: Found | None = None
    reason: str = ""
    certificate: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chunk:
    """Points that one worker solves one after the other, each from the one before."""

    points: tuple[Point, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ProofChunk:
    """Points with what their searches found, and all that the searches of others found."""

    points: tuple[Point, ...]
    answers: tuple[Answer, ...]
    others: tuple[Found, ...]
