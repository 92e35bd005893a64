"""How long the transition of center nominal lasts, where the plant file leaves it open."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.gains.elastic import factor, nearest_miss
from bfppc_synth.gains.problem import Weights, is_free
from bfppc_synth.gains.rounding import to_digits
from bfppc_synth.gains.search import search

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.gains.evaluation import Evaluation
    from bfppc_synth.gains.problem import DesignProblem

# Octaves below the longest, from the middle outward: what one costs tells which others cannot
# pay. Beyond the ends only while that still helps.
_FIRST = (-3, -4, -2, -5, -1, -6, 0, -7)
_FURTHEST = 14
_REFINEMENTS = 4
_DIGITS = 3
# A gain this small does not justify another octave.
_FLAT = 1e-4
# A nearest miss of this much (a log) is no rounding of the solver's.
_CLEAR = 0.02
# What half the time is worth, and all that it may cost: where the cost is flat, the shorter
# transition is taken.
_PATIENCE = 1e-3


def choose_transition(
    pose: Callable[[float], DesignProblem],
    progress: Callable[[str], None],
    *,
    longest: float = 10.0,
) -> float:
    """Search T_s on a grid of its logarithm, then around the best.

    Parameters
    ----------
    pose : callable
        The design problem for a T_s [s]; it may raise EnvelopeError.
    progress : callable
        Receives one sentence.
    longest : float
        The longest T_s [s] that is considered while a shorter one has a design.

    Returns
    -------
    float
        T_s [s], three digits. Where no T_s has a design, the one with the least peak input
        without a limit, else the one with the least feedforward.

    Raises
    ------
    EnvelopeError
        If the center has no enclosure for any T_s.

    References
    ----------
    docs/theory.md section 4: a short T_s costs feedforward, a long one tracks late, and no T_s
    is too long for the peak input alone, so it has to end within ``longest``. No shorter T_s that
    was tried costs less; a longer one may, by a thousandth for twice the time, and no more than
    that for any.
    """
    progress("choosing the transition time")
    candidates = _Candidates(pose, longest)
    best = candidates.best()
    if math.isinf(candidates.cost(best)):
        candidates = candidates.without_limit()
        best = candidates.best()
    if math.isinf(candidates.cost(best)):
        return candidates.least_feedforward()
    step = math.sqrt(2.0)
    for _ in range(_REFINEMENTS):
        for neighbour in (best / step, best * step):
            if (near := to_digits(neighbour, _DIGITS)) <= max(longest, best):
                candidates.cost(near)
        best = candidates.preferred()
        step = math.sqrt(step)
    return best


class _Candidates:
    """Costs of the T_s tried so far."""

    def __init__(self, pose: Callable[[float], DesignProblem], longest: float) -> None:
        self._pose, self._longest = pose, longest
        self._costs: dict[float, float] = {}
        self._known: dict[float, Evaluation] = {}
        self._feedforward: dict[float, float] = {}
        self._failure: EnvelopeError | None = None
        # Where no T_s of the grid has a design, a miss tells sooner than a search that fails.
        self._doubtful = False
        # Gains that are all given cost the same: only the room in their inequalities counts.
        self._patience = 0.0

    def without_limit(self) -> _Candidates:
        """Ask the same problems for the least peak input only."""

        def pose(transition: float) -> DesignProblem:
            weights = Weights(peak_input=1.0, slope=0.01)
            return replace(self._pose(transition), limit=None, weights=weights)

        candidates = _Candidates(pose, self._longest)
        candidates._doubtful = True
        return candidates

    def cost(self, transition: float) -> float:
        """Return what the search reaches with this T_s; infinity where it finds nothing."""
        if transition not in self._costs:
            self._costs[transition] = self._searched(transition)
        return self._costs[transition]

    def price(self, transition: float) -> float:
        """Return the cost and what the time itself is worth."""
        return self.cost(transition) + self._patience * math.log2(transition)

    def best(self) -> float:
        """Best of the grid, which grows downward as long as that helps.

        Upward it grows only until there is a design: sup|v| falls with T_s for ever.
        """
        tried = [(self.price(self._at(k)), k) for k in _FIRST]
        while True:
            best, k = min(tried)
            shortest = min(j for _, j in tried)
            if k != shortest or k <= -_FURTHEST or math.isinf(best):
                break
            tried.append((self.price(self._at(k - 1)), k - 1))
            if self.cost(self._at(k - 1)) > self.cost(self._at(k)) - _FLAT:
                break
        k = 0
        self._doubtful = math.isinf(min(tried)[0])
        while math.isinf(min(tried)[0]) and k < _FURTHEST:
            k += 1
            tried.append((self.price(self._at(k)), k))
        return self.preferred()

    def preferred(self) -> float:
        """Return the least price among what costs hardly more than the best."""
        enough = min(self._costs.values()) + self._patience
        near = [at for at, cost in self._costs.items() if cost <= enough]
        return min(near, key=self.price)

    def least_feedforward(self) -> float:
        """T_s of the smallest sup|v|."""
        if not self._feedforward:
            raise self._failure or EnvelopeError("the center has no enclosure", subexpression="")
        return min(self._feedforward, key=lambda at: self._feedforward[at])

    def _searched(self, transition: float) -> float:
        try:
            problem = self._pose(transition)
        except EnvelopeError as error:
            self._failure = error
            return math.inf
        self._feedforward[transition] = problem.center.v
        free = is_free(problem)
        if free and self._is_hopeless(problem):
            return math.inf
        if free and self._doubtful and factor(nearest_miss(problem)) > _CLEAR:
            return math.inf
        near = min(self._known, key=lambda at: abs(math.log(at / transition)), default=None)
        known = None if near is None else self._known[near]
        found = search(problem, lambda _message: None, resume=known)
        if found is None:
            return math.inf
        self._known[transition] = found
        if free:
            weights = problem.weights
            self._patience = _PATIENCE * max(weights.peak_input, weights.slope)
        # Gains that are all given have no best cost, only a T_s that leaves them most room.
        return found.cost if free else found.shortfall

    def _is_hopeless(self, problem: DesignProblem) -> bool:
        """Whether the feedforward alone exceeds the limit, or costs more than the best so far."""
        feedforward = problem.center.v
        if problem.limit is not None and feedforward > problem.limit:
            return True
        # A small exponent of the slope does not make up for this factor of the peak input.
        best = min(self._costs.values(), default=math.inf)
        weights = problem.weights
        if feedforward <= 0.0 or weights.slope > 0.1 * weights.peak_input:
            return False
        return weights.peak_input * (math.log(feedforward) - math.log(2.0)) > best

    def _at(self, octave: int) -> float:
        # Rounded down: a funnel allows nothing above its longest.
        return to_digits(self._longest * 2.0**octave, _DIGITS, upward=-1)
