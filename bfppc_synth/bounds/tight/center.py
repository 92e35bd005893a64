"""The center's r, dr over cells of time and starts, remembered: gains do not move them.

Each span covers a part of all times by coordinates of its own (docs/theory.md section 9).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bfppc_synth.bounds.dual_arrays import Dual, coordinate
from bfppc_synth.bounds.interval_arrays import Array, Interval
from bfppc_synth.errors import EnvelopeError

if TYPE_CHECKING:
    from numpy.typing import NDArray

_FIRST_CAPACITY = 256
_MOST_CUTS = 6


class Evaluate(Protocol):
    """r_1..r_n, v, dr_1..dr_n as duals at coordinates."""

    def __call__(self, at: list[Dual]) -> list[Dual]:
        """Return 2 n + 1 duals."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Coordinates that cover some of the times (and all starts that matter there).

    ``axes`` are the ranges of the coordinates; ``pieces`` into how many cells each is cut
    before the search starts.
    """

    evaluate: Evaluate
    axes: tuple[tuple[float, float], ...]
    pieces: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rows:
    """r_1..r_n, v, dr_1..dr_n: over the cells and in their middle.

    ``value`` has shape (2 n + 1, cells), ``slope`` (2 n + 1, coordinates, cells), ``middle``
    (2 n + 1, cells).
    """

    value: Interval
    slope: Interval
    middle: Interval


class CenterTable:
    """What one span's center is on the cells that were asked for so far."""

    def __init__(self, span: Span, order: int) -> None:
        self.span = span
        self.count = len(span.axes)
        self._quantities = 2 * order + 1
        self._known: dict[bytes, int] = {}
        shape = (self._quantities, _FIRST_CAPACITY)
        wide = (self._quantities, self.count, _FIRST_CAPACITY)
        self._value = [np.empty(shape) for _ in range(2)]
        self._slope = [np.empty(wide) for _ in range(2)]
        self._middle = [np.empty(shape) for _ in range(2)]

    def roots(self) -> tuple[Array, Array]:
        """Cells that the search starts from, ends of shape (coordinates, cells).

        Raises
        ------
        EnvelopeError
            If the center has no enclosure on narrow cells either.
        """
        pieces = self.span.pieces
        for _ in range(_MOST_CUTS):
            lower, upper = _grid(self.span.axes, pieces)
            try:
                self.rows(lower, upper)
            except EnvelopeError:
                # On narrower cells a denominator may turn out to stay away from 0.
                pieces = tuple(2 * count for count in pieces)
            else:
                return lower, upper
        lower, upper = _grid(self.span.axes, pieces)
        self.rows(lower, upper)
        return lower, upper

    def rows(self, lower: Array, upper: Array) -> Rows:
        """Look cells up, and evaluate those that are new in one batch."""
        keys = [key.tobytes() for key in np.ascontiguousarray(np.vstack((lower, upper)).T)]
        fresh = dict.fromkeys(key for key in keys if key not in self._known)
        if fresh:
            first = {key: column for column, key in reversed(list(enumerate(keys)))}
            columns = np.array([first[key] for key in fresh])
            self._add(list(fresh), lower[:, columns], upper[:, columns])
        at: NDArray[np.int_] = np.array([self._known[key] for key in keys], dtype=int)
        return Rows(
            value=Interval(*(part[:, at] for part in self._value)),
            slope=Interval(*(part[:, :, at] for part in self._slope)),
            middle=Interval(*(part[:, at] for part in self._middle)),
        )

    def _add(self, keys: list[bytes], lower: Array, upper: Array) -> None:
        size, start = len(keys), len(self._known)
        middle = lower + 0.5 * (upper - lower)
        both = [
            coordinate(
                Interval(np.append(low, at), np.append(high, at)),
                self.count,
                j,
            )
            for j, (low, high, at) in enumerate(zip(lower, upper, middle, strict=True))
        ]
        found = self.span.evaluate(both)
        while start + size > self._value[0].shape[-1]:
            for store in (self._value, self._slope, self._middle):
                store[:] = [np.concatenate((part, np.empty_like(part)), axis=-1) for part in store]
        place = slice(start, start + size)
        for q, dual in enumerate(found):
            ends = [np.broadcast_to(end, (2 * size,)) for end in dual.value]
            total = [end[size:].copy() for end in ends]
            for end, part in zip(ends, self._middle, strict=True):
                part[q, place] = end[size:]
            for j in range(self.count):
                partial = dual.partials[j]
                if partial is None:
                    slope = Interval(np.zeros(size), np.zeros(size))
                else:
                    slope = Interval(*(np.broadcast_to(p, (2 * size,))[:size] for p in partial))
                self._slope[0][q, j, place] = slope.lower
                self._slope[1][q, j, place] = slope.upper
                # Half of the width on either side of the middle.
                reach = slope.magnitude() * np.maximum(upper[j] - middle[j], middle[j] - lower[j])
                total = [total[0] - reach, total[1] + reach]
            self._value[0][q, place] = np.maximum(ends[0][:size], total[0])
            self._value[1][q, place] = np.minimum(ends[1][:size], total[1])
        for offset, key in enumerate(keys):
            self._known[key] = start + offset


def _grid(axes: tuple[tuple[float, float], ...], pieces: tuple[int, ...]) -> tuple[Array, Array]:
    """Cut a box into a product of cells."""
    if not axes:
        return np.empty((0, 1)), np.empty((0, 1))
    ends = [
        np.linspace(low, high, count + 1) for (low, high), count in zip(axes, pieces, strict=True)
    ]
    for edge, (_, high) in zip(ends, axes, strict=True):
        edge[-1] = high
    lower = np.meshgrid(*(edge[:-1] for edge in ends), indexing="ij")
    upper = np.meshgrid(*(edge[1:] for edge in ends), indexing="ij")
    return np.array([a.ravel() for a in lower]), np.array([a.ravel() for a in upper])
