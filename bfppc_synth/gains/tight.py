"""Counterexample-guided search: a program over finitely many worst points, repaired, repeated."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.bounds.feedback import feedback
from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.bounds.tight.search import Effort
from bfppc_synth.gains.evaluation import Evaluation, Judge
from bfppc_synth.gains.problem import Kind, Slot, assemble, is_free, patterns, slots
from bfppc_synth.gains.search import alternatives, fixed_design, linearized
from bfppc_synth.gains.solve import Program
from bfppc_synth.gains.tight_repair import Candidate, Repair, Widening
from bfppc_synth.gains.units import per_rate
from bfppc_synth.model.shapes import Shape

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from bfppc_synth.bounds.tight.bounds import TightSearch
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.gains.tight_points import Points

ROUNDS = 6
_FEWER_ROUNDS = 2
# The relaxed program's cost and the best design's agree when they are this close, in logs.
AGREEMENT = 5e-3
_DIGITS = (4, 6, 9)
# Logs of gains and widths move by this much a round: the points say little about far away.
_REACH = 1.0
_CLOSER = 0.5
_FEW_STATES = 3
_MANY_CUTS = 800
# Bend of a tanh that starts in place of a linear shape.
_STRAIGHT = 0.1
# Shares of the load that p_{i+1} starts at where no termwise design is there to start from.
_SHARES = (0.3, 0.05, 1.5)
_NUMBERS = FloatNumbers()


def effort_of(order: int) -> Effort:
    """Say how many cells a load is worth: what a tree of the certificate can hold."""
    return Effort() if order <= _FEW_STATES else Effort(cuts=_MANY_CUTS)


def search_tight(
    problem: DesignProblem,
    search: TightSearch,
    start: Evaluation | None,
    progress: Callable[[str], None],
    widening: Widening | None = None,
    effort: Effort | None = None,
) -> Candidate | None:
    """Find the best design by tight bounds.

    Parameters
    ----------
    problem : DesignProblem
        What is fixed, free and wanted.
    search : TightSearch
        Bounds loads rigorously up to rounding.
    start : Evaluation, optional
        The termwise design, which the result is never worse than.
    progress : callable
        Receives one sentence per round.
    widening : Widening, optional
        Claims that the checker wants wider.
    effort : Effort, optional
        How far each load is searched.

    Returns
    -------
    Candidate or None
        With all inequalities kept in floats, or the given gains however they are judged; None
        where nothing was found.

    References
    ----------
    docs/theory.md section 9.
    """
    judge = Judge(problem)
    repair = Repair(
        judge, search, effort or effort_of(problem.order), widening or Widening.none(problem.order)
    )
    if not is_free(problem):
        shapes, widths = fixed_design(problem)
        found = [repair.judged(shapes, widths, name) for name in problem.theorem.alternatives()]
        given = [candidate for candidate in found if candidate is not None]
        return min(given, key=lambda each: each.evaluation.shortfall, default=None)
    best: Candidate | None = None
    for alternative in alternatives(problem):
        loop = _Loop(repair, alternative, progress)
        # A second form has the first one's design to start from.
        reached = loop.run(start) if best is None else loop.run(best.evaluation, _FEWER_ROUNDS)
        if reached is not None and (best is None or _cost(reached) < _cost(best)):
            best = reached
    return best


def repaired(
    problem: DesignProblem, search: TightSearch, candidate: Candidate, widening: Widening
) -> Candidate | None:
    """Set the levels of a design again, with other claims or another margin; search nothing."""
    judge, given = Judge(problem), candidate.evaluation
    repair = Repair(judge, search, effort_of(problem.order), widening)
    values = values_as_they_are(problem, given)
    if not is_free(problem):
        return repair.judged(given.shapes, given.half_widths, given.alternative)
    found = (repair.feasible(values, given.alternative, digits) for digits in _DIGITS)
    return next((candidate for candidate in found if candidate is not None), None)


class _Loop:
    """The rounds of one alternative."""

    def __init__(self, repair: Repair, alternative: str, progress: Callable[[str], None]) -> None:
        self._repair, self._alternative, self._progress = repair, alternative, progress
        self._problem = repair.judge.problem
        pattern = tuple(patterns(gains)[0] for gains in self._problem.gains)
        self._free = slots(self._problem, pattern)
        self._best: Candidate | None = None
        self._points: Points | None = None

    def run(self, start: Evaluation | None, rounds: int = ROUNDS) -> Candidate | None:
        """Repeat until the relaxed program and the best design agree."""
        if start is not None:
            self._take(values_as_they_are(self._problem, start))
        if self._best is None:
            for share in _SHARES:
                self._take(self._begun(share))
        reach = _REACH
        for number in range(1, rounds + 1):
            if self._best is None or self._points is None:
                break
            self._progress(f"tight bounds ({self._alternative}), round {number}")
            before = _cost(self._best)
            relaxed = self._relaxed(self._best, reach)
            if relaxed is None:
                break
            bound = self._relaxed_cost(relaxed)
            self._take(relaxed)
            if _cost(self._best) - bound <= AGREEMENT:
                break
            if _cost(self._best) >= before:
                # The points said too little about so far away.
                reach *= _CLOSER
        return self._best

    def _take(self, values: Mapping[Slot, float] | None) -> None:
        """Repair values into a design, keep its worst points, and the design if it is better."""
        if values is None:
            return
        for variant in (linearized(self._problem, values), dict(values)):
            for digits in _DIGITS:
                found = self._repair.feasible(variant, self._alternative, digits)
                if found is None:
                    continue
                points = found.points
                self._points = points if self._points is None else self._points.joined(points)
                if self._best is None or _cost(found) < _cost(self._best):
                    self._best = found
                return

    def _relaxed(self, start: Candidate, reach: float) -> dict[Slot, float] | None:
        """Solve the program over the points found so far."""
        program = Program(self._problem, self._free, self._alternative, self._points)
        values = _free_values(self._problem, self._free, start.evaluation)
        return program.solve(values, 0.7 * start.evaluation.half_widths[-1], reach)

    def _relaxed_cost(self, values: Mapping[Slot, float]) -> float:
        judge = self._repair.judge
        generic, widths = assemble(self._problem, values, judge.numbers)
        shapes = tuple(Shape(k=s.k, M=s.M, epsilon=s.epsilon, c=s.c, N=s.N) for s in generic)
        found = judge.evaluate(shapes, widths, self._alternative)
        return -math.inf if found is None else found.cost

    def _begun(self, share: float) -> dict[Slot, float] | None:
        """Start down the chain by tight loads: p_{i+1} a share of step i's load."""
        problem, units = self._problem, per_rate(self._problem)
        values: dict[Slot, float] = {}
        shapes: tuple[Shape, ...] = ()
        widths: tuple[float, ...] = (problem.accuracy,)
        for step, gains in enumerate(problem.gains):
            trial = (*shapes, Shape(k=1.0, M=0.0, epsilon=1.0, c=0.0, N=gains.N))
            load = self._repair.searched(step, trial, widths)
            if not math.isfinite(load):
                return None
            ahead = 0.0
            if step + 1 < problem.order:
                fixed = problem.half_widths[step + 1]
                noise = 3.0 * problem.conditions.delta[step + 1]
                least = 1e-3 * widths[-1] * units[step]
                wide = max(share * load, noise, least) if fixed is None else fixed
                values[Slot(kind=Kind.WIDTH, step=step + 1)] = wide
                widths, ahead = (*widths, wide), wide
            level = 1.3 * (load + ahead) + 1e-3 * widths[step] * units[step]
            for kind in (Kind.LINEAR, Kind.TANH, Kind.POWER, Kind.HEIGHT):
                values[Slot(kind=kind, step=step)] = level
            values[Slot(kind=Kind.BEND, step=step)] = 0.7
            shapes = (*shapes, Shape(k=level / widths[step], M=0.0, epsilon=1.0, c=0.0, N=gains.N))
        return {slot: values[slot] for slot in self._free}


def values_as_they_are(problem: DesignProblem, found: Evaluation) -> dict[Slot, float]:
    """Read the free variables off a design, each term that it has as its own."""
    values: dict[Slot, float] = {}
    for step, (shape, p, gains) in enumerate(
        zip(found.shapes, found.half_widths, problem.gains, strict=True)
    ):
        if step > 0 and problem.half_widths[step] is None:
            values[Slot(kind=Kind.WIDTH, step=step)] = p
        if gains.k is None and shape.k != 0.0:
            values[Slot(kind=Kind.LINEAR, step=step)] = shape.k * p
        if gains.c is None and shape.c != 0.0:
            values[Slot(kind=Kind.POWER, step=step)] = shape.c * p**shape.N
        if shape.M == 0.0 or (gains.M is not None and gains.epsilon is not None):
            continue
        bend = shape.M * p / shape.epsilon
        if gains.M is None and gains.epsilon is None:
            values[Slot(kind=Kind.TANH, step=step)] = shape.M * math.tanh(bend)
            values[Slot(kind=Kind.BEND, step=step)] = bend
        elif gains.M is None:
            values[Slot(kind=Kind.HEIGHT, step=step)] = shape.M
        else:
            values[Slot(kind=Kind.BEND, step=step)] = bend
    return values


def _free_values(
    problem: DesignProblem, free: tuple[Slot, ...], found: Evaluation
) -> dict[Slot, float]:
    """Read the variables of a pattern off a design whose terms may be others."""
    known = values_as_they_are(problem, found)
    values: dict[Slot, float] = {}
    for slot in free:
        shape, p = found.shapes[slot.step], found.half_widths[slot.step]
        if slot in known:
            values[slot] = known[slot]
        elif slot.kind is Kind.BEND:
            values[slot] = _STRAIGHT
        else:
            # The whole level, whichever term has it now.
            values[slot] = max(feedback(shape.generic, p, _NUMBERS), 1e-100)
    return values


def _cost(candidate: Candidate) -> float:
    return candidate.evaluation.cost
