"""What many runs came to: sums and maxima that do not depend on the order of the runs."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bfppc_synth.errors import UsageError
from bfppc_synth.simulation.drawing import Adversary

if TYPE_CHECKING:
    from collections.abc import Mapping

#: Bins of a histogram between 0 and the bound; one more holds what reaches it.
BINS = 50

#: Runs that left are listed up to this many, the first by number.
LISTED = 100


@dataclass(slots=True, kw_only=True)
class Tally:
    """Counts of some runs.

    ``worst`` is (ratio, run) of every quantity: ``errors`` errors, u and, where there is one,
    the funnel; ``bins`` their histograms; ``left`` the first runs that left; ``adversaries``
    per kind: runs, runs that left, largest max |e_i| / p_i and its run.
    """

    errors: int
    runs: int
    outside: int
    left: list[int]
    worst: list[tuple[float, int]]
    bins: list[list[int]]
    adversaries: dict[str, tuple[int, int, float, int]]

    @classmethod
    def empty(cls, errors: int, *, funnel: bool) -> Tally:
        """Count nothing yet."""
        quantities = errors + 1 + funnel
        return cls(
            errors=errors,
            runs=0,
            outside=0,
            left=[],
            worst=[(-1.0, -1)] * quantities,
            bins=[[0] * (BINS + 1) for _ in range(quantities)],
            adversaries={kind.value: (0, 0, -1.0, -1) for kind in Adversary},
        )

    def count(
        self, number: int, adversary: Adversary, ratios: tuple[float, ...], *, inside: bool
    ) -> None:
        """Count one run."""
        self.runs += 1
        if not inside:
            self.outside += 1
            self.left = heapq.nsmallest(LISTED, [*self.left, number])
        for index, ratio in enumerate(ratios):
            self.worst[index] = _worse(self.worst[index], (ratio, number))
            self.bins[index][min(int(min(ratio, 1.0) * BINS), BINS)] += 1
        runs, left, ratio, run = self.adversaries[adversary.value]
        top = _worse((ratio, run), (max(ratios[: self.errors]), number))
        self.adversaries[adversary.value] = (runs + 1, left + (not inside), *top)

    def add(self, other: Tally) -> None:
        """Count what another tally counts; the order does not matter."""
        self.runs += other.runs
        self.outside += other.outside
        self.left = heapq.nsmallest(LISTED, [*self.left, *other.left])
        self.worst = [_worse(a, b) for a, b in zip(self.worst, other.worst, strict=True)]
        for mine, theirs in zip(self.bins, other.bins, strict=True):
            mine[:] = [a + b for a, b in zip(mine, theirs, strict=True)]
        for kind, (runs, left, ratio, run) in other.adversaries.items():
            mine_runs, mine_left, *top = self.adversaries[kind]
            best = _worse((top[0], int(top[1])), (ratio, run))
            self.adversaries[kind] = (mine_runs + runs, mine_left + left, *best)

    def document(self) -> dict[str, Any]:
        """Lay the tally out for JSON."""
        return {
            "runs": self.runs,
            "outside": self.outside,
            "left": list(self.left),
            "worst": [list(pair) for pair in self.worst],
            "bins": [list(row) for row in self.bins],
            "adversaries": {kind: list(row) for kind, row in self.adversaries.items()},
        }

    @classmethod
    def read(cls, document: Mapping[str, Any], like: Tally) -> Tally:
        """Read a tally of the same shape as ``like``.

        Raises
        ------
        UsageError
            If the document is none.
        """
        try:
            found = cls(
                errors=like.errors,
                runs=int(document["runs"]),
                outside=int(document["outside"]),
                left=[int(number) for number in document["left"]],
                worst=[(float(ratio), int(run)) for ratio, run in document["worst"]],
                bins=[[int(count) for count in row] for row in document["bins"]],
                adversaries={
                    str(kind): (int(row[0]), int(row[1]), float(row[2]), int(row[3]))
                    for kind, row in document["adversaries"].items()
                },
            )
        except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
            raise UsageError("no tally of a campaign") from error
        shaped = (
            len(found.worst) == len(like.worst)
            and [len(row) for row in found.bins] == [len(row) for row in like.bins]
            and set(found.adversaries) == set(like.adversaries)
            and all(sum(row) == found.runs for row in found.bins)
        )
        if not shaped:
            raise UsageError("no tally of this campaign")
        return found


def _worse(a: tuple[float, int], b: tuple[float, int]) -> tuple[float, int]:
    """Take the larger ratio, of equal ones the earlier run."""
    if a[1] < 0 or b[1] < 0:
        return b if a[1] < 0 else a
    return a if (a[0], -a[1]) >= (b[0], -b[1]) else b


def failure_bound(runs: int, outside: int, *, confidence: float) -> float:
    """Bound the probability that a run leaves, from above (Clopper and Pearson, one side).

    Parameters
    ----------
    runs, outside : int
        Independent runs, and how many of them left.
    confidence : float
        Probability with which the bound holds, e.g. 0.95.

    Returns
    -------
    float
        The largest probability under which ``outside`` or fewer would still be seen with
        probability 1 - confidence. It is about the drawn distribution, no proof.
    """
    if outside >= runs:
        return 1.0
    if outside == 0:
        from math import expm1, log

        return -expm1(log(1.0 - confidence) / runs)
    from scipy.special import betaincinv

    return float(betaincinv(outside + 1, runs - outside, confidence))
