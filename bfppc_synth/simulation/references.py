"""References and starts that a run may have (SPEC section 1, Simulation)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.errors import ShapeError

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.model.spec import Interval, PlantSpec

    Reference = Callable[[float], float]


def initial_box(spec: PlantSpec) -> tuple[tuple[float, float], ...]:
    """Return the range of each x_i(0) that has a reference to belong to.

    Parameters
    ----------
    spec : PlantSpec
        Its ``initial``; ``offset`` cuts the range of x_1(0) to Y_0 + offset.

    Returns
    -------
    tuple[tuple[float, float], ...]
        (lower, upper) per state [unit of x_i].
    """
    box = [_end_points(item) for item in spec.initial]
    if spec.offset is not None:
        reach = spec.reference.bounds[0].approximate + spec.offset.approximate
        lower, upper = box[0]
        box[0] = min(max(lower, -reach), reach), min(max(upper, -reach), reach)
    return tuple(box)


def first_references(spec: PlantSpec, x_1: float) -> tuple[float, float]:
    """Return the range of y_d(0) that a run-time reference may start in.

    Parameters
    ----------
    spec : PlantSpec
        Its reference bounds and offset.
    x_1 : float
        x_1(0) [unit of x_1].

    Returns
    -------
    tuple[float, float]
        Within [-Y_0, Y_0], and within the offset of x_1(0) where one is declared.
    """
    y_0 = spec.reference.bounds[0].approximate
    if spec.offset is None:
        return -y_0, y_0
    offset = spec.offset.approximate
    return min(max(x_1 - offset, -y_0), y_0), min(max(x_1 + offset, -y_0), y_0)


def sine(spec: PlantSpec, start: float, direction: float) -> Reference:
    """Make Y_0 sin(w t + phase), w the largest that respects every declared bound.

    Parameters
    ----------
    spec : PlantSpec
        Its reference bounds Y_0, Y_1, ..: |y_d^(j)| = Y_0 w^j <= Y_j.
    start : float
        y_d(0), within [-Y_0, Y_0].
    direction : float
        Sign of dy_d(0).

    Returns
    -------
    Callable[[float], float]
        y_d of the time since the first sample [s].
    """
    y_0, *rates = (bound.approximate for bound in spec.reference.bounds)
    if y_0 == 0.0:
        return lambda _: 0.0
    if not rates:
        raise ShapeError("reference.bounds: Y_0 alone does not bound the slope of the reference")
    w = min((rate / y_0) ** (1.0 / j) for j, rate in enumerate(rates, start=1))
    phase = math.asin(start / y_0)
    if direction < 0.0:
        phase = math.pi - phase
    return lambda t: y_0 * math.sin(w * t + phase)


def _end_points(interval: Interval) -> tuple[float, float]:
    return interval.lower.approximate, interval.upper.approximate
