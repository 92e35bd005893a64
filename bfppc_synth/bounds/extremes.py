"""Least and largest value of an expression over a box, by branch and bound."""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import sympy as sp

from bfppc_synth.bounds.derivative import derivative
from bfppc_synth.bounds.natural import ARGUMENT_ROUNDING, ROUNDING, Range, natural, range_of_sum
from bfppc_synth.errors import EnvelopeError

if TYPE_CHECKING:
    from collections.abc import Mapping

Box: TypeAlias = tuple[Range, ...]

RELATIVE_GAP = 1e-9
# A smooth maximum takes some hundred boxes; beyond the work limit, counted in operations (some
# microseconds each), the bound found so far is returned: sound, but not tight.
MOST_OPERATIONS = 60_000
MOST_BOXES = 1500
FEWEST_BOXES = 100
# A box this narrow (relative to the whole) on which the expression still has no value holds a
# pole or another domain error.
NARROWEST = 1e-12


class _Slope(NamedTuple):
    """Range of a partial derivative, and 1 or -1 where the expression is monotone."""

    lower: float
    upper: float
    trend: int


class Extremes:
    """The range of one expression over a box.

    Parameters
    ----------
    expression : sympy.Expr
        What to bound; a sign in it comes from ``derivative``, and is bounded almost
        everywhere.
    box : Mapping[sympy.Symbol, Range]
        A range for every symbol of it.
    narrow : frozenset[sympy.Symbol]
        Symbols whose range is split only where that is known to help: where the expression has
        no value because of one of these (1/s at s = 0), narrowing it cannot heal that.
    scale : float
        A magnitude below which differences do not matter [unit of the expression].

    most_boxes : int
        Work limit of each search; a lower one of its own holds for a long expression.

    Attributes
    ----------
    boxes : int
        How many boxes the searches looked at.

    References
    ----------
    docs/theory.md section 2; the mean-value form is what makes the search end: its excess
    shrinks with the square of a box's width.
    """

    def __init__(
        self,
        expression: sp.Expr,
        box: Mapping[sp.Symbol, Range],
        *,
        narrow: frozenset[sp.Symbol] = frozenset(),
        scale: float = 0.0,
        most_boxes: int = MOST_BOXES,
    ) -> None:
        self._expression = expression
        self._symbols = tuple(sorted(box, key=str))
        self._root: Box = tuple(box[symbol] for symbol in self._symbols)
        self._narrow = narrow
        self._splittable = tuple(
            index for index, symbol in enumerate(self._symbols) if symbol not in narrow
        )
        signs = sorted(expression.atoms(sp.sign), key=str)
        # A sign is a number in [-1, 1] as long as a box does not decide it: the mean-value
        # form then holds across the jump, with the hull of both sides.
        names = {sign: sp.Symbol(f"sign{index}", real=True) for index, sign in enumerate(signs)}
        smooth = expression.xreplace(names)
        self._signs = tuple((name, sign.args[0]) for sign, name in names.items())
        self._terms = sp.Add.make_args(smooth)
        self._slopes = tuple(
            sp.Add.make_args(derivative(smooth, symbol)) for symbol in self._symbols
        )
        self._scale = scale
        parts = (*self._terms, *sum(self._slopes, ()))
        self._size = 1 + sum(int(part.count_ops()) for part in parts)
        self._most_boxes = min(MOST_BOXES, max(FEWEST_BOXES, MOST_OPERATIONS // self._size))
        self._most_boxes = min(self._most_boxes, most_boxes)
        self.boxes = 0

    @property
    def work(self) -> int:
        """Operations spent so far."""
        return self.boxes * self._size

    def supremum(self, known: float = -math.inf) -> float:
        """Bound the expression from above.

        Parameters
        ----------
        known : float
            A value that the caller has reached elsewhere; less is not looked for.

        Returns
        -------
        float
            At least the supremum and ``known``, and within 1e-9 of the larger one (relative)
            unless the work limit ended the search.

        Raises
        ------
        EnvelopeError
            If the expression has no bounded value on some part of the box.
        """
        return self._search(1.0, known)

    def infimum(self, known: float = math.inf) -> float:
        """Bound the expression from below; the mirror of ``supremum``."""
        return -self._search(-1.0, -known)

    def _base(self, box: Box) -> dict[sp.Symbol, Range]:
        # An argument a t is rounded by a few units in the last place of a t, however fast the
        # oscillation: the same as evaluating at a neighbouring t, so that t is included.
        base = {
            symbol: (lower, upper)
            if symbol in self._narrow
            else (lower - ARGUMENT_ROUNDING * abs(lower), upper + ARGUMENT_ROUNDING * abs(upper))
            for symbol, (lower, upper) in zip(self._symbols, box, strict=True)
        }
        for name, inner in self._signs:
            lower, upper = natural(inner, base)
            # The sign stands beside the derivative of its argument, which is 0 almost
            # everywhere on the set where the argument is 0: either sign will do there.
            base[name] = (1.0, 1.0) if lower >= 0.0 else (-1.0, -1.0 if upper <= 0.0 else 1.0)
        return base

    def _value(self, side: float, base: Mapping[sp.Symbol, Range]) -> Range:
        lower, upper = range_of_sum(self._terms, base).widened()
        return (lower, upper) if side > 0 else (-upper, -lower)

    def _search(self, side: float, known: float) -> float:
        best, scale = known, self._scale
        failure = self._unbounded()
        fresh: tuple[Box, ...] = (self._root,)
        queue: list[tuple[float, int, Box, int | None]] = []
        boxes = 0
        while True:
            for box in fresh:
                boxes += 1
                self.boxes += 1
                try:
                    enough = best + RELATIVE_GAP * scale
                    upper, reached, part, preferred = self._assess(side, box, enough)
                except EnvelopeError as error:
                    failure, upper, reached, part, preferred = error, math.inf, best, box, None
                best = max(best, reached)
                if math.isfinite(reached):
                    scale = max(scale, abs(reached))
                # Last in, first out among equals: a pole is found by depth, not by breadth.
                heapq.heappush(queue, (-upper, -boxes, part, preferred))
            bound, _, box, split = heapq.heappop(queue)
            bound = -bound
            if bound <= best + RELATIVE_GAP * scale:
                return max(bound, best)
            fresh = () if boxes >= self._most_boxes else self._halve(box, split)
            if not fresh:
                if math.isinf(bound):
                    raise failure
                return max(bound, best)

    def _unbounded(self) -> EnvelopeError:
        return EnvelopeError(
            f"{self._expression} is not bounded", subexpression=str(self._expression)
        )

    def _assess(self, side: float, box: Box, enough: float) -> tuple[float, float, Box, int | None]:
        """Bound on the box, a value reached, the part that matters, the index to split next."""
        base = self._base(box)
        _, upper = self._value(side, base)
        if upper <= enough:
            return upper, -math.inf, box, None
        slopes = self._slopes_on(side, box, base)
        undecided = {name: base[name] for name, _ in self._signs if base[name] == (-1.0, 1.0)}
        part = box
        if not undecided:
            # Where the expression is monotone in a symbol, and nothing jumps, its maximum is at
            # one end.
            part = tuple(
                edge if slope is None or not slope.trend else (edge[slope.trend > 0],) * 2
                for edge, slope in zip(box, slopes, strict=True)
            )
        if part != box:
            upper = min(upper, self._value(side, self._base(part))[1])
        middle = tuple(lower + (up - lower) / 2 for lower, up in part)
        point = self._base(tuple((at, at) for at in middle))
        reached, value = self._value(side, point)
        if undecided:
            _, value = self._value(side, point | undecided)
        spreads = tuple(
            self._spread(edge, at, slope)
            for edge, at, slope in zip(part, middle, slopes, strict=True)
        )
        upper = min(upper, value + sum(spreads))
        preferred = max(range(len(part)), key=lambda index: spreads[index], default=None)
        if preferred is not None and not 0.0 < spreads[preferred] < math.inf:
            preferred = None
        return upper, reached, part, preferred

    @staticmethod
    def _spread(edge: Range, at: float, slope: _Slope | None) -> float:
        lower, upper = edge
        if lower == upper:
            return 0.0
        if slope is None:
            return math.inf
        reach = max(upper - at, at - lower) + ARGUMENT_ROUNDING * abs(at)
        return max(abs(slope.lower), abs(slope.upper)) * reach

    def _slopes_on(
        self, side: float, box: Box, base: Mapping[sp.Symbol, Range]
    ) -> tuple[_Slope | None, ...]:
        allowance = ROUNDING * range_of_sum(self._terms, base).size
        found: list[_Slope | None] = []
        for terms, (first, last) in zip(self._slopes, box, strict=True):
            if first == last:
                found.append(None)
                continue
            try:
                slope = range_of_sum(terms, base)
            except EnvelopeError:
                found.append(None)
                continue
            # A sign that only rounding made may move the value by this much; where that is
            # less than what the value is widened by anyway, the sign can be trusted.
            trend = 0
            if ARGUMENT_ROUNDING * slope.size * (last - first) <= allowance:
                trend = 1 if slope.lower >= 0.0 else -1 if slope.upper <= 0.0 else 0
            lower, upper = slope.widened()
            if side > 0:
                found.append(_Slope(lower, upper, trend))
            else:
                found.append(_Slope(-upper, -lower, -trend))
        return tuple(found)

    def _halve(self, box: Box, preferred: int | None) -> tuple[Box, ...]:
        shares = {
            index: (box[index][1] - box[index][0]) / (self._root[index][1] - self._root[index][0])
            for index in self._splittable
            if box[index][0] < box[index][1]
        }
        if preferred is None:
            if not shares or max(shares.values()) < NARROWEST:
                return ()
            preferred = max(shares, key=lambda index: shares[index])
        lower, upper = box[preferred]
        middle = lower + (upper - lower) / 2
        if not lower < middle < upper:
            return ()
        return (
            (*box[:preferred], (lower, middle), *box[preferred + 1 :]),
            (*box[:preferred], (middle, upper), *box[preferred + 1 :]),
        )
