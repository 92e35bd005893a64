"""Feedback shapes over cells: exact ranges of phi and phi', with slopes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.bounds.interval_arrays import Array, Interval
from bfppc_synth.bounds.tight.fields import Field
from bfppc_synth.bounds.tight.ranges import product

if TYPE_CHECKING:
    from bfppc_synth.model.shapes import Shape

_BENT = 1.0 / math.sqrt(3.0)
_MOST = 2.0 / (3.0 * math.sqrt(3.0))
# cosh is cut off where its square would overflow.
_FARTHEST = 350.0


class FieldLaw:
    """phi_1..phi_n on fields.

    Parameters
    ----------
    shapes : tuple[Shape, ...]
        Gains, the binary64 numbers of the controller.
    """

    def __init__(self, shapes: tuple[Shape, ...]) -> None:
        self._shapes = shapes

    def value(self, step: int, e: Field) -> Field:
        """Return phi(e), which rises, with its slope."""
        shape = self._shapes[step]
        rate = _steepness(shape, e.value)
        slope = None if e.slope is None else product(rate, e.slope)
        return Field(Interval(_phi(shape, e.value.lower), _phi(shape, e.value.upper)), slope)

    def rate(self, step: int, e: Field) -> Field:
        """Return phi'(e), with its slope."""
        shape, (lower, upper) = self._shapes[step], e.value
        slope = None
        if e.slope is not None:
            bend = Interval(np.zeros_like(lower), np.zeros_like(upper))
            if shape.M != 0.0:
                scale = np.array(-2.0 * shape.M * (shape.M / shape.epsilon) ** 2)
                bend = product(Interval(scale, scale), _hump(shape, e.value))
            if shape.c != 0.0:
                factor = shape.c * shape.N * (shape.N - 1)
                power = shape.N - 2
                bend = Interval(
                    bend.lower + factor * lower**power, bend.upper + factor * upper**power
                )
            slope = product(bend, e.slope)
        return Field(_steepness(shape, e.value), slope)


def _phi(shape: Shape, e: Array) -> Array:
    found = shape.k * e + shape.c * e**shape.N
    if shape.M != 0.0:
        found = found + shape.M * np.tanh(shape.M * e / shape.epsilon)
    return found


def _steepness(shape: Shape, e: Interval) -> Interval:
    far = e.magnitude()
    near = np.maximum(np.maximum(e.lower, -e.upper), 0.0)
    lower = shape.k + shape.c * shape.N * near ** (shape.N - 1)
    upper = shape.k + shape.c * shape.N * far ** (shape.N - 1)
    if shape.M != 0.0:
        steep, rate = shape.M * shape.M / shape.epsilon, shape.M / shape.epsilon
        least = steep / np.cosh(np.minimum(rate * far, _FARTHEST)) ** 2
        lower = lower + np.where(rate * far > _FARTHEST, 0.0, least)
        upper = upper + steep / np.cosh(np.minimum(rate * near, _FARTHEST)) ** 2
    return Interval(lower, upper)


def _hump(shape: Shape, e: Interval) -> Interval:
    """Range of w (1 - w^2), w = tanh(M e / epsilon): odd, one maximum on each side."""
    rate = shape.M / shape.epsilon
    low, high = np.tanh(rate * e.lower), np.tanh(rate * e.upper)
    first, last = low * (1.0 - low * low), high * (1.0 - high * high)
    top = (low <= _BENT) & (high >= _BENT)
    bottom = (low <= -_BENT) & (high >= -_BENT)
    return Interval(
        np.where(bottom, -_MOST, np.minimum(first, last)),
        np.where(top, _MOST, np.maximum(first, last)),
    )
