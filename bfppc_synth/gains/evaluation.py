"""A candidate judged in floats: its chain, its inequalities, what it costs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.bounds.chain import Loads, chain_input, evaluate_chain
from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.model.certificate import Strictness

if TYPE_CHECKING:
    from bfppc_synth.gains.methods.demands import Demand
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.bounds import ChainBounds
    from bfppc_synth.model.shapes import Shape
    from bfppc_synth.model.tight import TightBounds


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """Shapes and half-widths with everything that follows from them.

    ``shortfall`` is the largest relative amount by which a right side exceeds its left side
    (negative: every inequality holds with that much room). ``tight`` are the loads that it was
    judged with; None where they are termwise. ``starts`` are the costs that the starts of its
    search reached; ``lower`` are bounds below the cost of a geometric program's
    designs: of those that keep the room the search asks for, and of all.
    """

    shapes: tuple[Shape, ...]
    half_widths: tuple[float, ...]
    alternative: str
    bounds: ChainBounds[float]
    demands: tuple[Demand[float], ...]
    shortfall: float
    cost: float
    tight: TightBounds | None = None
    starts: tuple[float, ...] = ()
    lower: tuple[float, float] | None = None

    def holds(self, margin: float) -> bool:
        """Whether every inequality holds with this relative margin, and the limit is kept."""
        return self.shortfall <= -margin


class Judge:
    """Evaluates candidates of one problem; the residual is prepared once."""

    def __init__(self, problem: DesignProblem) -> None:
        self.problem = problem
        self.numbers = FloatNumbers()
        self.residual = problem.float_residual()

    def evaluate(
        self,
        shapes: tuple[Shape, ...],
        half_widths: tuple[float, ...],
        alternative: str,
        tight: TightBounds | None = None,
    ) -> Evaluation | None:
        """Evaluate one alternative; None where an envelope or a number breaks down.

        Returns
        -------
        Evaluation or None
            None if the reachable box leaves the domain of a function or a bound overflows.
        """
        problem = self.problem
        generic = tuple(shape.generic for shape in shapes)
        start = chain_input(generic, half_widths, problem.center, problem.conditions, self.numbers)
        try:
            loads = None if tight is None else Loads(load=tight.load, rate=tight.rate)
            bounds = evaluate_chain(
                start, self.residual, self.numbers, problem.theorem.rules, loads
            )
            if min(bounds.g_min) <= 0.0:
                return None
            demands = problem.theorem.demands(alternative, start, bounds, self.numbers, None)
        except (EnvelopeError, OverflowError, ZeroDivisionError):
            return None
        sides = [(demand.lhs, demand.rhs) for demand in demands]
        if not all(math.isfinite(side) for pair in sides for side in pair):
            return None
        shortfall = max(_shortfall(lhs, rhs) for lhs, rhs in sides)
        if problem.limit is not None:
            shortfall = max(shortfall, _shortfall(problem.limit, bounds.U))
        weights = problem.weights
        cost = weights.peak_input * _log(bounds.U) + weights.slope * _log(bounds.slope)
        return Evaluation(
            shapes=shapes,
            half_widths=half_widths,
            alternative=alternative,
            bounds=bounds,
            demands=demands,
            shortfall=shortfall,
            cost=cost,
            tight=tight,
        )

    def best(
        self,
        shapes: tuple[Shape, ...],
        half_widths: tuple[float, ...],
        tight: TightBounds | None = None,
    ) -> Evaluation | None:
        """Return the alternative with the most room."""
        found = [
            self.evaluate(shapes, half_widths, alternative, tight)
            for alternative in self.problem.theorem.alternatives()
        ]
        judged = [evaluation for evaluation in found if evaluation is not None]
        return min(judged, key=lambda evaluation: evaluation.shortfall, default=None)

    def accepts(self, evaluation: Evaluation) -> bool:
        """Whether every inequality holds, strictly where the method asks for it."""
        if self.problem.theorem.strictness is Strictness.WEAK:
            return evaluation.shortfall <= 0.0
        return evaluation.shortfall < 0.0


def _shortfall(lhs: float, rhs: float) -> float:
    scale = max(abs(lhs), abs(rhs))
    return (rhs - lhs) / scale if scale > 0.0 else 0.0


def _log(value: float) -> float:
    return math.log(value) if value > 0.0 else -700.0
