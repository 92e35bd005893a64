"""One search for every method: the same budget, the same runs, the same objective."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.errors import ShapeError
from bfppc_synth.simulation.baselines.loop import close_loop

if TYPE_CHECKING:
    from bfppc_synth.simulation.baselines.arrays import Array
    from bfppc_synth.simulation.baselines.cases import Cases
    from bfppc_synth.simulation.baselines.loop import Result
    from bfppc_synth.simulation.baselines.method import Method

#: The second half of the budget is drawn near the best of the first: within this factor of
#: every gain.
_NEAR = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Tuned:
    """The best gains that a search found.

    ``share`` of its own runs stayed inside, with at most ``peak`` of input [unit of u].
    """

    gains: dict[str, float]
    tried: int
    share: float
    peak: float


def tune(method: Method, cases: Cases, *, seed: int, budget: int) -> Tuned:
    """Search the gains of a method.

    Parameters
    ----------
    method : Method
        It has a law.
    cases : Cases
        The runs that every set of gains is tried on.
    seed : int
        Of the search; the method's key is mixed in.
    budget : int
        Sets of gains tried, at least 1.

    Returns
    -------
    Tuned
        Most runs inside the envelope; of those with equally many the least peak input of
        these runs, then the first.
    """
    generator = np.random.default_rng([seed, zlib.crc32(method.key.encode())])
    low = np.log([item.lower for item in method.tunables])
    high = np.log([item.upper for item in method.tunables])
    rounds = [budget - budget // 2, budget // 2]
    best: tuple[float, float] | None = None
    chosen = low
    for size, near in zip(rounds, (None, _NEAR), strict=True):
        if size == 0:
            continue
        if near is None:
            points = low + generator.random((size, len(low))) * (high - low)
        else:
            steps = (2.0 * generator.random((size, len(low))) - 1.0) * np.log(near)
            points = np.clip(chosen + steps, low, high)
        result = try_gains(method, cases, np.exp(points))
        # A loop that ended early has a small peak, so only those count that stayed inside.
        peaks = np.max(np.where(result.inside > 0.0, result.peak, 0.0), axis=0)
        first = int(np.lexsort((peaks, -result.share))[0])
        score = -float(result.share[first]), float(peaks[first])
        if best is None or score < best:
            best, chosen = score, points[first]
    if best is None:
        raise ShapeError("a search needs a budget of at least 1")
    values = (float(value) for value in np.exp(chosen))
    names = (item.name for item in method.tunables)
    return Tuned(
        gains=dict(zip(names, values, strict=True)), tried=budget, share=-best[0], peak=best[1]
    )


def try_gains(method: Method, cases: Cases, points: Array) -> Result:
    """Run sets of gains, shape (C, number of gains), against all cases."""
    if method.build is None:
        raise ShapeError(f"{method.title}: {method.missing}")
    columns = {item.name: points[:, j][np.newaxis, :] for j, item in enumerate(method.tunables)}
    law = method.build(cases.path, cases.clock.times, columns)
    return close_loop(cases, law, candidates=len(points))
