"""The nearest miss: the gains that break every inequality by the least common factor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.gains.evaluation import Evaluation, Judge
from bfppc_synth.gains.problem import assemble, patterns, slots
from bfppc_synth.gains.search import STARTS, alternatives, begin
from bfppc_synth.gains.solve import ElasticProgram
from bfppc_synth.model.shapes import Shape

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.gains.problem import DesignProblem, Slot

# The first start that settles is taken, but never on the word of one alone.
_ENOUGH = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Miss:
    """Gains and half-widths, and by which factor (its log) they miss.

    ``pressures`` tell which inequalities, by name and 0-based step, it is that press; they sum
    to about 1. An estimate: the program is not convex, and nothing here is proved.
    """

    values: Mapping[Slot, float]
    inner: float
    alternative: str
    log_factor: float
    pressures: tuple[tuple[tuple[str, int], float], ...]

    @property
    def holds(self) -> bool:
        """Whether nothing is missing."""
        return self.log_factor <= 0.0


def nearest_miss(problem: DesignProblem, near: Miss | None = None) -> Miss | None:
    """Minimize the largest relative violation over all inequalities and the limit.

    Parameters
    ----------
    problem : DesignProblem
        What is fixed, free and asked.
    near : Miss, optional
        Of a similar problem: the first start.

    Returns
    -------
    Miss or None
        None where nothing is free, or no start keeps every bound finite.

    References
    ----------
    docs/theory.md section 5: an infeasible problem is answered with what to relax.
    """
    pattern = tuple(patterns(gains)[0] for gains in problem.gains)
    free = slots(problem, pattern)
    if not free:
        return None
    judge = Judge(problem)
    found = [_missed(judge, free, alternative, near) for alternative in alternatives(problem)]
    return min(
        (miss for miss in found if miss is not None),
        key=lambda miss: miss.log_factor,
        default=None,
    )


def _missed(
    judge: Judge, free: tuple[Slot, ...], alternative: str, near: Miss | None
) -> Miss | None:
    program = ElasticProgram(judge.problem, free, alternative)
    best: Miss | None = None
    if near is not None and set(near.values) == set(free):
        best = _solved(judge, program, alternative, (near.values, near.inner))
        if best is not None:
            return best
    settled = 0
    for ratio in STARTS:
        start = begin(judge, free, ratio, 0.0)
        miss = None if start is None else _solved(judge, program, alternative, start)
        if miss is None:
            continue
        best = miss if best is None or miss.log_factor < best.log_factor else best
        settled += 1
        if settled >= _ENOUGH:
            break
    return best


def _solved(
    judge: Judge,
    program: ElasticProgram,
    alternative: str,
    start: tuple[Mapping[Slot, float], float],
) -> Miss | None:
    values = program.solve(*start)
    if values is None:
        return None
    return Miss(
        values=values,
        inner=0.7 * assemble(judge.problem, values, judge.numbers)[1][-1],
        alternative=alternative,
        log_factor=program.miss,
        pressures=tuple(sorted(program.pressures().items(), key=lambda pair: -pair[1])),
    )


def judged(problem: DesignProblem, miss: Miss) -> Evaluation | None:
    """Evaluate the chain of bounds of what misses least, in floats."""
    judge = Judge(problem)
    generic, widths = assemble(problem, miss.values, judge.numbers)
    shapes = tuple(Shape(k=s.k, M=s.M, epsilon=s.epsilon, c=s.c, N=s.N) for s in generic)
    return judge.evaluate(shapes, widths, miss.alternative)


def factor(miss: Miss | None) -> float:
    """Return the log of the common factor; infinity where no start leads anywhere."""
    return math.inf if miss is None else miss.log_factor
