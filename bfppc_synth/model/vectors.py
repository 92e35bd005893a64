"""Samples with the answers that the generated Python controller gave to them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """What one call of ``step`` is given; ``reset`` comes before it.

    ``t`` in seconds; ``x`` n measured states; ``y_d`` the reference, with its derivatives where
    the law is passed them.
    """

    t: float
    x: tuple[float, ...]
    y_d: tuple[float, ...]
    reset: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The command and status of one sample.

    ``tolerance`` bounds |u - u'| for any other arithmetic that rounds each operation once and
    whose library functions keep to 4 units in the last place.
    """

    sample: Sample
    u: float
    status: int
    tolerance: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferencePoint:
    """The compiled-in reference at ``t`` [s] since the first sample, with its tolerance."""

    t: float
    value: float
    tolerance: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Vectors:
    """What the package's own tests replay: rows in order, and points of the reference."""

    rows: tuple[Answer, ...]
    points: tuple[ReferencePoint, ...]
