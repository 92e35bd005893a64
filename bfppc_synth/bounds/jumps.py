"""How far an error jumps when the gains change: the 1-D suprema of handover containment."""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING, Any, TypeVar

from bfppc_synth.bounds.feedback import feedback, steepness
from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.model.shapes import Terms

if TYPE_CHECKING:
    from bfppc_synth.bounds.feedback import Numbers
    from bfppc_synth.model.shapes import GenericShape

T = TypeVar("T")

# The enclosure ends this close to the supremum; rounding of phi itself is far below it.
_TOLERANCE = 1e-7
_ROUNDING = 1e-12
_MOST_CELLS = 5000
_FLOATS = FloatNumbers()


def largest_jump(
    later: GenericShape[T],
    shift: T,
    earlier: GenericShape[T],
    reach: T,
    numbers: Numbers[T],
) -> T:
    """Bound |phi_later(e + d) - phi_earlier(e)| over |e| <= reach, |d| <= shift.

    phi_later increases and both are odd, so d = shift and both signs of e suffice: one
    dimension is left.

    Parameters
    ----------
    later, earlier : GenericShape[T]
        phi_{i,K} and phi_{i,m}.
    shift, reach : T
        Delta_i and p^_{i,m} [unit of x_i].
    numbers : Numbers[T]
        In floats the supremum is enclosed by branch and bound and its upper end returned; in
        every other number type it is what ``supremum`` makes of it.

    Returns
    -------
    T
        Delta_{i+1} [unit of x_{i+1}].

    References
    ----------
    docs/theory.md section 8, "containment".
    """
    if isinstance(numbers, FloatNumbers):
        enclosed: Any = _enclose(later, float(_any(shift)), earlier, float(_any(reach)))
        bound: T = enclosed
        return bound

    def difference(share: Any) -> Any:
        e = (2 * share - 1) * _any(reach)
        return feedback(later, e + shift, numbers) - _any(feedback(earlier, e, numbers))

    return numbers.supremum(difference)


def _any(value: object) -> Any:
    return value


def _enclose(
    later: GenericShape[Any], shift: float, earlier: GenericShape[Any], reach: float
) -> float:
    """Upper end of the supremum: the cell that may hold it is halved until it is narrow."""

    def value(e: float) -> float:
        return float(feedback(later, e + shift, _FLOATS) - _any(feedback(earlier, e, _FLOATS)))

    def upper(a: float, b: float) -> float:
        later_low, later_high = _slopes(later, a + shift, b + shift)
        low, high = _slopes(earlier, a, b)
        falls, rises = later_low - high, later_high - low
        if falls >= 0.0:
            return value(b)
        if rises <= 0.0:
            return value(a)
        # The mean value form, and the monotone one: each is an upper bound.
        middle = value(0.5 * (a + b)) + 0.5 * (b - a) * max(rises, -falls)
        corner = float(feedback(later, b + shift, _FLOATS) - _any(feedback(earlier, a, _FLOATS)))
        return min(middle, corner)

    scale = _scale(later, reach + shift) + _scale(earlier, reach)
    best = max(value(-reach), value(0.0), value(reach))
    cells = [(-upper(-reach, reach), -reach, reach)]
    for _ in range(_MOST_CELLS):
        bound, a, b = cells[0]
        if -bound <= best + _TOLERANCE * (abs(best) + 1e-3 * scale):
            break
        middle = 0.5 * (a + b)
        best = max(best, value(middle))
        heapq.heapreplace(cells, (-upper(a, middle), a, middle))
        heapq.heappush(cells, (-upper(middle, b), middle, b))
    size = max(-cells[0][0], best)
    return size + _ROUNDING * (size + scale)


def _scale(shape: GenericShape[Any], e: float) -> float:
    return float(feedback(shape, e, _FLOATS))


def _slopes(shape: GenericShape[Any], a: float, b: float) -> tuple[float, float]:
    """Range of phi' over [a, b]: tanh is flattest and the power steepest far from 0."""
    far = max(abs(a), abs(b))
    near = 0.0 if a <= 0.0 <= b else min(abs(a), abs(b))
    if shape.terms & (Terms.TANH | Terms.POWER) != Terms.TANH | Terms.POWER:
        ends = [float(steepness(shape, e, _FLOATS)) for e in (near, far)]
        return min(ends), max(ends)
    linear = shape.k if Terms.LINEAR in shape.terms else 0.0
    steep = shape.M * shape.M / shape.epsilon
    bent = [steep * (1.0 - math.tanh(shape.M * e / shape.epsilon) ** 2) for e in (near, far)]
    power = [shape.c * shape.N * e ** (shape.N - 1) for e in (near, far)]
    return linear + bent[1] + power[0], linear + bent[0] + power[1]
