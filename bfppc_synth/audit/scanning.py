"""Where a bound of the plant file fails: sampled on a box, and looked for beyond it.

A point found disproves a bound; finding none proves nothing, that is the separate checker's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import islice, product
from typing import TYPE_CHECKING

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate, evaluate_float

if TYPE_CHECKING:
    from collections.abc import Iterator

    import sympy as sp

    from bfppc_synth.model.plant import Plant

Box = dict["sp.Symbol", tuple[float, float]]
Values = dict["sp.Symbol", float]

_POINTS = 1200
_CORNERS = 1024
# How far beyond the box an axis is looked along: times its reach, and at least this.
_BEYOND = 5.0
_LEAST = 10.0
_AXIS = 1600
_ROUNDING = 1e-9
# Steps of the additive recurrence in dimension j: square roots of primes, fractional parts.
_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53)


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """``upper`` - ``lower`` must not be negative, ``size`` is what they are compared by."""

    upper: sp.Expr
    lower: sp.Expr

    def at(self, values: Values) -> float:
        """Return the gap, relative to the sides; -1 where a side has no value."""
        try:
            high = evaluate_float(self.upper, values)
            low = evaluate_float(self.lower, values)
        except (EnvelopeError, OverflowError):
            return -1.0
        scale = max(abs(high), abs(low), 1e-300)
        return (high - low) / scale if math.isfinite(scale) else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Beyond:
    """A place on an axis outside the box: ``value`` of the state where something happens."""

    state: str
    value: float


def parameter_ranges(plant: Plant) -> Box:
    """Ranges of the parameters as floats."""
    return {
        symbol: (evaluate(lower, {}, FLOAT_FUNCTIONS), evaluate(upper, {}, FLOAT_FUNCTIONS))
        for symbol, (lower, upper) in zip(plant.parameters, plant.ranges, strict=True)
    }


def violation_in(gap: Gap, box: Box) -> Values | None:
    """Sample a box (middle, faces, corners, a spread of points) for a negative gap."""
    for values in _spread(box):
        if gap.at(values) < -_ROUNDING:
            return values
    return None


def _spread(box: Box) -> Iterator[Values]:
    middle = {symbol: 0.5 * (low + high) for symbol, (low, high) in box.items()}
    yield middle
    for symbol, ends in box.items():
        for end in ends:
            yield {**middle, symbol: end}
    for corner in islice(product(*box.values()), _CORNERS):
        yield dict(zip(box, corner, strict=True))
    steps = [math.sqrt(prime) % 1.0 for prime in _PRIMES]
    for k in range(_POINTS):
        yield {
            symbol: low + (high - low) * ((0.5 + k * steps[j % len(steps)]) % 1.0)
            for j, (symbol, (low, high)) in enumerate(box.items())
        }


def violation_beyond(gap: Gap, box: Box, states: tuple[sp.Symbol, ...]) -> Beyond | None:
    """Find the violation nearest to the box on the axes of the states, the others at 0."""
    found: list[tuple[float, Beyond]] = []
    used = gap.upper.free_symbols | gap.lower.free_symbols
    for symbol, values, grid in _axes(box, tuple(state for state in states if state in used)):
        inside = 0.0
        for value in grid:
            if gap.at({**values, symbol: value}) < -_ROUNDING:
                edge = _bisected(gap, {**values}, symbol, inside, value)
                found.append((abs(edge), Beyond(state=symbol.name, value=edge)))
                break
            inside = value
    return min(found, key=lambda pair: pair[0])[1] if found else None


def zero_beyond(function: sp.Expr, box: Box, states: tuple[sp.Symbol, ...]) -> Beyond | None:
    """Find the nearest place on an axis where a positive function comes down to 0."""
    found: list[tuple[float, Beyond]] = []
    used = function.free_symbols
    for symbol, values, grid in _axes(box, tuple(state for state in states if state in used)):
        heights = [_height(function, {**values, symbol: value}) for value in grid]
        for j in range(1, len(grid) - 1):
            before, here, after = heights[j - 1 : j + 2]
            # A dip: not above its neighbours, and no flat stretch.
            if here > min(before, after) or before == after == here:
                continue
            place = _lowest(function, {**values}, symbol, grid[j - 1], grid[j + 1])
            if _height(function, {**values, symbol: place}) <= 1e-6 * max(heights):
                found.append((abs(place), Beyond(state=symbol.name, value=place)))
                break
    return min(found, key=lambda pair: pair[0])[1] if found else None


def _axes(
    box: Box, states: tuple[sp.Symbol, ...]
) -> Iterator[tuple[sp.Symbol, Values, list[float]]]:
    middle = {
        symbol: 0.0 if symbol in states else 0.5 * (low + high)
        for symbol, (low, high) in box.items()
    }
    for symbol in states:
        reach = max(abs(box[symbol][0]), abs(box[symbol][1]))
        far = max(_BEYOND * reach, _LEAST)
        for side in (1.0, -1.0):
            yield symbol, middle, [side * far * k / _AXIS for k in range(1, _AXIS + 1)]


def _height(function: sp.Expr, values: Values) -> float:
    try:
        return evaluate_float(function, values)
    except (EnvelopeError, OverflowError):
        return math.inf


def _bisected(gap: Gap, values: Values, symbol: sp.Symbol, good: float, bad: float) -> float:
    for _ in range(40):
        middle = 0.5 * (good + bad)
        if gap.at({**values, symbol: middle}) < -_ROUNDING:
            bad = middle
        else:
            good = middle
    return bad


def _lowest(
    function: sp.Expr, values: Values, symbol: sp.Symbol, left: float, right: float
) -> float:
    """Narrow a bracket of a minimum by thirds."""
    for _ in range(80):
        low, high = left + (right - left) / 3.0, right - (right - left) / 3.0
        if _height(function, {**values, symbol: low}) < _height(function, {**values, symbol: high}):
            right = high
        else:
            left = low
    return 0.5 * (left + right)
