"""One search for every method: the same budget, the same runs, the same objective."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.errors import ShapeError
from bfppc_synth.simulation.baselines.loop import close_loop

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.simulation.baselines.arrays import Array
    from bfppc_synth.simulation.baselines.cases import Cases
    from bfppc_synth.simulation.baselines.loop import Result
    from bfppc_synth.simulation.baselines.method import Law, Method

#: The second half of the budget is drawn near the best of the first: within this factor of
#: every gain.
_NEAR = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuned:
    """The best gains that a search found.

    ``share`` of its own runs stayed inside, ``completed`` reached the horizon; ``peak`` is the
    largest input of those inside, where there are none of those completed [unit of u].
    """

    gains: dict[str, float]
    tried: int
    share: float
    completed: float
    peak: float

    @property
    def point(self) -> Array:
        """The gains as the one set that ``law_of`` takes, shape (1, count)."""
        return np.array([list(self.gains.values())])


class JoinedLaw:
    """Several laws side by side, so that their plants move in one loop.

    Parameters
    ----------
    laws : sequence of pairs
        A law and how many sets of gains it has.
    """

    def __init__(self, laws: Sequence[tuple[Law, int]]) -> None:
        self._laws: list[tuple[Law, slice]] = []
        self.count = 0
        for law, count in laws:
            self._laws.append((law, slice(self.count, self.count + count)))
            self.count += count

    def command(self, k: int, measured: Sequence[Array]) -> Array:
        """Return every law's u at sample k in its own columns."""
        parts = [
            law.command(k, [state[:, columns] for state in measured]) for law, columns in self._laws
        ]
        return np.concatenate(parts, axis=1)


def tune(methods: Sequence[Method], cases: Cases, *, seed: int, budget: int) -> tuple[Tuned, ...]:
    """Search the gains of every method.

    Parameters
    ----------
    methods : sequence of Method
        Each has a law.
    cases : Cases
        The runs that every set of gains is tried on.
    seed : int
        Of the search; a method's key is mixed in, so that no method shifts another's draws.
    budget : int
        Sets of gains tried a method, at least 1.

    Returns
    -------
    tuple[Tuned, ...]
        Most runs inside the envelope; then most that reach the horizon; then the least peak
        input of these runs; then the first.
    """
    if budget < 1:
        raise ShapeError("a search needs a budget of at least 1")
    drawn = [_first(method, seed, budget - budget // 2) for method in methods]
    best = _tried(methods, cases, [points for _, points in drawn])
    if budget > 1:
        near = [
            _nearby(method, generator, point, budget // 2)
            for method, (generator, _), (*_, point) in zip(methods, drawn, best, strict=True)
        ]
        found = _tried(methods, cases, near)
        best = [min(pair, key=lambda row: row[:3]) for pair in zip(best, found, strict=True)]
    return tuple(
        Tuned(
            gains={
                item.name: float(value)
                for item, value in zip(method.tunables, np.exp(point), strict=True)
            },
            tried=budget,
            share=-inside,
            completed=-completed,
            peak=peak,
        )
        for method, (inside, completed, peak, point) in zip(methods, best, strict=True)
    )


def law_of(method: Method, cases: Cases, points: Array) -> tuple[Law, int]:
    """Make the law for sets of gains, shape (C, number of gains), and say how many they are."""
    if method.build is None:
        raise ShapeError(f"{method.title}: {method.missing}")
    columns = {item.name: points[:, j][np.newaxis, :] for j, item in enumerate(method.tunables)}
    return method.build(cases.path, cases.clock.times, columns), len(points)


def run_laws(cases: Cases, laws: Sequence[tuple[Law, int]], *, kept: int = 0) -> Result:
    """Run laws side by side against all cases; ``kept`` outputs of run 0 are recorded."""
    joined = JoinedLaw(laws)
    return close_loop(cases, joined, candidates=joined.count, kept=kept)


def _box(method: Method) -> tuple[Array, Array]:
    low = np.log([item.lower for item in method.tunables])
    return low, np.log([item.upper for item in method.tunables])


def _first(method: Method, seed: int, size: int) -> tuple[np.random.Generator, Array]:
    """Draw anywhere, uniformly in the logarithms, shape (size, number of gains)."""
    generator = np.random.default_rng([seed, zlib.crc32(method.key.encode())])
    low, high = _box(method)
    return generator, low + generator.random((size, len(low))) * (high - low)


def _nearby(method: Method, generator: np.random.Generator, point: Array, size: int) -> Array:
    low, high = _box(method)
    steps = (2.0 * generator.random((size, len(low))) - 1.0) * np.log(_NEAR)
    points: Array = np.clip(point + steps, low, high)
    return points


def _tried(
    methods: Sequence[Method], cases: Cases, points: Sequence[Array]
) -> list[tuple[float, float, float, Array]]:
    """Try sets of gains of every method; each one's best, after the numbers that rank it."""
    pairs = list(zip(methods, points, strict=True))
    result = run_laws(cases, [law_of(method, cases, np.exp(sets)) for method, sets in pairs])
    completed = 1.0 - np.maximum(result.undefined, result.diverged)
    # A loop that ended early has a small peak: it never wins by that.
    counted = np.where(result.share > 0.0, result.inside, completed)
    peaks = np.max(np.where(counted > 0.0, result.peak, 0.0), axis=0)
    best, begun = [], 0
    for sets in points:
        columns = slice(begun, begun + len(sets))
        ranks = (-result.share[columns], -completed.mean(axis=0)[columns], peaks[columns])
        first = int(np.lexsort(ranks[::-1])[0])
        inside, reached, peak = (float(rank[first]) for rank in ranks)
        best.append((inside, reached, peak, sets[first]))
        begun += len(sets)
    return best
