"""References and starts that a run may have (SPEC section 1, Simulation)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.errors import ShapeError

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.model.spec import Interval, PlantSpec

    Reference = Callable[[float], float]
    # Time since the first sample [s] -> y_d, dy_d, .., y_d^(n).
    Derivatives = Callable[[float], tuple[float, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sine:
    """Y_0 sin(w t + phase), t [s] since the first sample, with ``order`` exact derivatives."""

    amplitude: float
    frequency: float
    phase: float
    order: int

    def __call__(self, t: float) -> float:
        """Return y_d at t."""
        return self.amplitude * math.sin(self.frequency * t + self.phase)

    def derivatives(self, t: float) -> tuple[float, ...]:
        """Return y_d, dy_d, .. at t."""
        w, angle = self.frequency, self.frequency * t + self.phase
        waves = math.sin(angle), math.cos(angle), -math.sin(angle), -math.cos(angle)
        return tuple(self.amplitude * w**j * waves[j % 4] for j in range(self.order + 1))


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


def sine(spec: PlantSpec, start: float, direction: float) -> Sine:
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
    Sine
        y_d of the time since the first sample [s], with n derivatives.
    """
    y_0, *rates = (bound.approximate for bound in spec.reference.bounds)
    if y_0 == 0.0:
        return Sine(amplitude=0.0, frequency=0.0, phase=0.0, order=spec.order)
    if not rates:
        raise ShapeError("reference.bounds: Y_0 alone does not bound the slope of the reference")
    w = min((rate / y_0) ** (1.0 / j) for j, rate in enumerate(rates, start=1))
    phase = math.asin(start / y_0)
    if direction < 0.0:
        phase = math.pi - phase
    return Sine(amplitude=y_0, frequency=w, phase=phase, order=spec.order)


def _end_points(interval: Interval) -> tuple[float, float]:
    return interval.lower.approximate, interval.upper.approximate
