"""The center nominal over all times and starts: enclosures of r_i, v, dv and the model error.

docs/theory.md section 4. Time is cut into cells; on each, what is wanted is enclosed by the
mean value form in time and starts. The separate checker proves the same bounds again.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
import sympy as sp

from bfppc_synth.bounds.derivative import derivative
from bfppc_synth.bounds.dual_arrays import Dual, constant, coordinate, mean_value
from bfppc_synth.bounds.interval_arrays import Interval, IntervalFunctions
from bfppc_synth.bounds.nominal.cells import CELLS, Cells, halved, later_cells, transition_cells
from bfppc_synth.bounds.nominal.center import NominalCenter, overflow, require_sizes
from bfppc_synth.bounds.nominal.following import Follower, known_part
from bfppc_synth.bounds.nominal.model import (
    nominal_model,
    nominal_parameters,
    sided_arguments,
)
from bfppc_synth.bounds.rounding import above
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.resolution import upper_bound
from bfppc_synth.model.bounds import CenterBounds

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bfppc_synth.model.nominal import NominalModel
    from bfppc_synth.model.plant import Plant

Key: TypeAlias = tuple[int | str, ...]
"""What is bounded: ("r", i), ("rate", i), ("error", i), ("share", i, parameter), ("g", i)."""

_START_CELLS = 4
# A range is searched to this share of its size, unless that takes more cells than these.
_GAP = 2e-3
_MOST_CELLS = 30_000
_MOST_CELLS_OF_STARTS = 1_200
_MOST_FAILURES = 5
_BASE = IntervalFunctions()
_ZERO = _BASE.number(sp.S.Zero)


class Enclosed(NamedTuple):
    """A quantity over cells, and about what it takes in each of them."""

    key: Key
    wide: Interval
    reached: Interval


def nominal_center(plant: Plant, transition: float) -> NominalCenter:
    """Bound the center nominal over all t >= 0 and all starts that may be latched.

    Parameters
    ----------
    plant : Plant
        The plant; its reference is an expression, or supplied at run time with n + 2 bounds.
    transition : float
        T_s [s].

    Returns
    -------
    NominalCenter
        Enclosures, rounding included, of what docs/theory.md section 4 takes suprema of.

    Raises
    ------
    EnvelopeError
        If the reference or the center has no enclosure (a kink, a pole, g^ that may be 0).

    References
    ----------
    docs/theory.md sections 2 (suprema over t) and 4.
    """
    model = nominal_model(plant, transition)
    found = _Followed(plant, model)
    follower = found.follower
    found.add(transition_cells(follower.reference, plant.time, 1.0, CELLS))
    if follower.runtime:
        found.add(Cells(reference=sp.S.Zero, symbols=(), speeds=(), ranges=()))
    else:
        for cells in later_cells(follower.reference, plant.time, transition, model.order + 2):
            found.add(cells)
    return found.result()


class _Followed:
    """Collects suprema batch by batch."""

    def __init__(self, plant: Plant, model: NominalModel) -> None:
        self._plant, self._model = plant, model
        self.follower = Follower(plant, model)
        middle = nominal_parameters(plant)
        self._errors = {
            symbol: Interval(
                _BASE.sub(_BASE.number(lower), _BASE.number(middle[symbol])).lower,
                _BASE.sub(_BASE.number(upper), _BASE.number(middle[symbol])).upper,
            )
            for symbol, (lower, upper) in zip(plant.parameters, plant.ranges, strict=True)
            if lower != upper
        }
        self._slopes = [self._sensitivities(i) for i in range(model.order)]
        self._sided = [sided_arguments(plant, i) for i in range(model.order)]
        self._found: dict[Key, tuple[float, float]] = {}

    def _sensitivities(self, index: int) -> list[tuple[sp.Symbol, sp.Expr]]:
        """Differentiate f_i + g_i r_{i+1} by the uncertain parameters."""
        known = known_part(self._plant, index)
        slopes = [(symbol, derivative(known, symbol)) for symbol in self._errors]
        return [(symbol, slope) for symbol, slope in slopes if slope != 0]

    def add(self, cells: Cells) -> None:
        """Take one batch into every range.

        Cells that may still raise a range by more than two thousandths are quartered.
        """
        with np.errstate(over="ignore", invalid="ignore"):
            self._add(cells)

    def _add(self, cells: Cells) -> None:
        spent, failures = 0, 0
        # Narrower cells of time do not take away what a wide start adds to an enclosure.
        most = _MOST_CELLS_OF_STARTS if self.follower.coordinates(cells) else _MOST_CELLS
        while True:
            try:
                found = self._enclose(cells)
            except EnvelopeError:
                # On narrower cells a denominator may turn out to stay away from 0.
                failures += 1
                if not cells.symbols or failures > _MOST_FAILURES:
                    raise
                cells = halved(cells, None)
                continue
            count = np.broadcast_shapes(*(item.wide.lower.shape for item in found))
            spent += math.prod(count)
            open_cells = np.zeros(count, dtype=bool)
            if cells.symbols and spent < most:
                for item in found:
                    open_cells |= self._may_raise(item)
            self._take(found, ~open_cells)
            if not open_cells.any():
                return
            # Twice at once: a batch costs more than its cells.
            cells = halved(halved(cells, open_cells), None)

    def _may_raise(self, item: Enclosed) -> NDArray[np.bool_] | bool:
        """Which cells might contain a new extreme value that matters."""
        if item.key[0] not in {"r", "rate", "error"}:
            return False
        low, high = self._found.get(item.key, (math.inf, -math.inf))
        low = min(low, float(np.min(item.reached.lower)))
        high = max(high, float(np.max(item.reached.upper)))
        room = _GAP * max(abs(low), abs(high))
        result: NDArray[np.bool_]
        if item.key[0] == "r":
            result = (item.wide.upper > high + room) | (item.wide.lower < low - room)
        else:
            # Of a rate or an error only the size counts.
            size = max(-low, high)
            result = item.wide.magnitude() > size + room
        return result

    def _take(self, found: list[Enclosed], closed: NDArray[np.bool_]) -> None:
        if not closed.any():
            return
        for item in found:
            lower = np.broadcast_to(item.wide.lower, closed.shape)[closed]
            upper = np.broadcast_to(item.wide.upper, closed.shape)[closed]
            low, high = self._found.get(item.key, (math.inf, -math.inf))
            ends = float(np.min(lower)), float(np.max(upper))
            # What overflows may be no number at all.
            ends = (-math.inf, math.inf) if any(map(math.isnan, ends)) else ends
            self._found[item.key] = min(low, ends[0]), max(high, ends[1])

    def _size(self, *key: int | str) -> float:
        low, high = self._found.get(key, (0.0, 0.0))
        return max(-low, high) + 0.0

    def result(self) -> NominalCenter:
        """Close the record."""
        order = self._model.order
        require_sizes([self._found["r", i] for i in range(order + 1)], self._model.states)
        if not all(math.isfinite(end) for pair in self._found.values() for end in pair):
            raise overflow("the center overflows binary64")
        self._require_sides()
        ends = [self._found["r", i] for i in range(order + 1)]
        size = self._size("r", order)
        center = CenterBounds(
            r_lower=tuple(low for low, _ in ends[:order]),
            r_upper=tuple(high for _, high in ends[:order]),
            rate=tuple(self._size("rate", i) for i in range(order)),
            feed=(0.0,) * order,
            v=size,
            v_rate=self._size("rate", order),
            v_start=self._early(size),
        )
        return NominalCenter(
            model=self._model,
            center=center,
            ahead=tuple(ends[1:]),
            model_error=tuple(self._size("error", i) for i in range(order)),
            parameter_errors=tuple(
                tuple((symbol.name, self._size("share", i, symbol.name)) for symbol, _ in slopes)
                for i, slopes in enumerate(self._slopes)
            ),
            authority=tuple(self._found["g", i] for i in range(order)),
        )

    def _require_sides(self) -> None:
        """Refuse an abs in g whose argument changes sign along the center."""
        for i, parts in enumerate(self._sided):
            for part in parts:
                if not self._found["side", i, str(part)][0] > 0.0:
                    raise EnvelopeError(
                        f"dynamics.{self._plant.states[i].name}.g has a kink where {part} is 0,"
                        " and the center may pass there",
                        subexpression=str(part),
                        fix="narrow initial or the reference, or use center performance",
                    )

    def _early(self, size: float) -> float:
        """Bound |v| on [0, tau]: while the first command is awaited, u = 0."""
        delay = above(upper_bound(self._plant.spec.sampling.delay))
        if delay == 0.0:
            return 0.0
        if delay >= self._model.transition:
            return size
        share = min(1.0, above(Fraction(delay) / Fraction(self._model.transition)))
        reference = self.follower.reference
        cells = transition_cells(reference, self._plant.time, share, _START_CELLS)
        found = self._enclose(cells)
        early = next(item for item in found if item.key == ("r", self._model.order))
        return min(size, float(np.max(early.wide.magnitude())))

    def _enclose(self, cells: Cells) -> list[Enclosed]:
        """r_1..r_n, v; their rates; what the parameters add; g^: over one batch of cells."""
        follower, axes = self.follower, len(cells.ranges)
        boxes = [*cells.ranges, *follower.coordinates(cells)]
        middles = [_middle(box) for box in boxes]
        reach = tuple(_BASE.sub(box, at) for box, at in zip(boxes, middles, strict=True))
        count = len(boxes)
        over = [coordinate(box, count, j) for j, box in enumerate(boxes)]
        wide = follower.series(cells, over)
        thin = follower.series(cells, [constant(at, 0) for at in middles])
        found: list[Enclosed] = []

        def keep(key: Key, over: Dual, at: Dual, factor: Interval | None = None) -> Enclosed:
            value = mean_value(over, at, reach)
            # What the starts add is no excess that narrower cells of time would take away.
            fixed = (None if part is None else _middle(part) for part in over.partials[axes:])
            still = Dual(over.value, ((None,) * axes + tuple(fixed)))
            reached = mean_value(still, at, reach)
            if factor is not None:
                value, reached = _BASE.mul(value, factor), _BASE.mul(reached, factor)
            found.append(Enclosed(key, value, reached))
            return found[-1]

        near: list[Dual] = []
        for i, (series, middle) in enumerate(zip(wide, thin, strict=True)):
            # What reads the center starts from the tighter enclosure.
            value = keep(("r", i), series[0], middle[0]).wide
            near.append(Dual(value, series[0].partials))
            if len(series) > 1:
                keep(("rate", i), series[1], middle[1])
        there = [series[0] for series in thin]
        for i, slopes in enumerate(self._slopes):
            total, reached = _ZERO, _ZERO
            for symbol, slope in slopes:
                part = keep(
                    ("share", i, symbol.name),
                    follower.at(slope, i, near, count),
                    follower.at(slope, i, there, 0),
                    self._errors[symbol],
                )
                total, reached = _BASE.add(total, part.wide), _BASE.add(reached, part.reached)
            if slopes:
                found.append(Enclosed(("error", i), total, reached))
            g = self._model.g[i]
            keep(("g", i), follower.at(g, i, near, count), follower.at(g, i, there, 0))
            for part in self._sided[i]:
                at = follower.at(part, i, there, 0)
                keep(("side", i, str(part)), follower.at(part, i, near, count), at)
        return found


def _middle(box: Interval) -> Interval:
    at = box.lower + 0.5 * (box.upper - box.lower)
    return Interval(at, at)
