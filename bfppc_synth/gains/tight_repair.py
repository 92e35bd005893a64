"""Make a feasible design of any widths and bends: levels down the chain, by rigorous loads.

load_i reads the gains of the steps before it and p_1..p_{i+1} only, so that each phi_i can be set
to what its own load asks for, raised or lowered, before the next load is looked for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.bounds.chain import chain_input, evaluate_chain
from bfppc_synth.bounds.feedback import feedback
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.gains.problem import Kind, Slot, assemble
from bfppc_synth.gains.rounding import grown, rounded, scaled, to_digits
from bfppc_synth.gains.solve import LEAST_RATE
from bfppc_synth.gains.tight_points import Points
from bfppc_synth.gains.units import per_rate
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.tight import Termwise, TightBounds

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.bounds.tight.bounds import Supremum, TightSearch
    from bfppc_synth.bounds.tight.search import Effort
    from bfppc_synth.gains.evaluation import Evaluation, Judge

# Room of a claim above what was found, relative to F_i*: trees stay small where it is there.
_ROOM = 1e-3
# What rounding may add to a termwise load, so that the checker finds it not smaller.
_ABOVE = 1.0 + 1e-9
_TERMWISE = 1.005
_NEAR = 1.0 + 1e-4
_TURNS = 80
_CLOSE = 2e-5


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A judged design, the worst points of its loads, and the termwise loads beside them."""

    evaluation: Evaluation
    points: Points
    termwise: Termwise


@dataclass(frozen=True, slots=True, kw_only=True)
class Widening:
    """Factors on the loads and on the rate that the checker left undecided; infinite: termwise.

    ``excess`` are the checker's own termwise loads over those of this search, where they were
    asked for.
    """

    load: tuple[float, ...]
    rate: float = 1.0
    excess: tuple[float, ...] = ()

    @staticmethod
    def none(order: int) -> Widening:
        """Widen nothing."""
        return Widening(load=(1.0,) * order)


class Repair:
    """Levels, loads and claims for one problem.

    Parameters
    ----------
    judge : Judge
        The problem and its float chain.
    search : TightSearch
        Finds loads and the rate.
    effort : Effort
        How far each is searched.
    widening : Widening
        What the checker asked for.

    References
    ----------
    docs/theory.md sections 5 and 9.
    """

    def __init__(
        self, judge: Judge, search: TightSearch, effort: Effort, widening: Widening
    ) -> None:
        self.judge, self._search = judge, search
        self._effort, self._widening = effort, widening
        self._units = per_rate(judge.problem)
        self._found: dict[tuple[object, ...], Supremum] = {}

    def feasible(
        self, values: Mapping[Slot, float], alternative: str, digits: int
    ) -> Candidate | None:
        """Set every free level to what its load asks for.

        Parameters
        ----------
        values : Mapping[Slot, float]
            Widths, bends and levels; the levels are starts.
        alternative : str
            Which form of the last inequality is kept.
        digits : int
            Significant digits of every free number.

        Returns
        -------
        Candidate or None
            A design that keeps half of the problem's margin everywhere, or None.
        """
        problem = self.judge.problem
        generic, widths = assemble(problem, values, self.judge.numbers)
        kinds = {slot for slot in values if slot.kind is not Kind.WIDTH}
        half_widths = tuple(
            to_digits(p, digits) if Slot(kind=Kind.WIDTH, step=i) in values else p
            for i, p in enumerate(widths)
        )
        shapes = tuple(
            rounded(Shape(k=s.k, M=s.M, epsilon=s.epsilon, c=s.c, N=s.N), kinds, i, digits)
            for i, s in enumerate(generic)
        )
        loads: list[float] = []
        for step in range(problem.order - 1):
            loads.append(self._claimed(step, shapes, half_widths))
            if not math.isfinite(loads[-1]):
                return None
            wanted = (1.0 + problem.margin) * (loads[-1] + half_widths[step + 1])
            shape = self._leveled(shapes[step], kinds, step, half_widths[step], wanted, digits)
            shapes = (*shapes[:step], shape, *shapes[step + 1 :])
        return self._closed(shapes, half_widths, kinds, alternative, digits)

    def judged(
        self, shapes: tuple[Shape, ...], half_widths: tuple[float, ...], alternative: str
    ) -> Candidate | None:
        """Evaluate a design as it is; None where a bound breaks down."""
        order = len(shapes)
        tight = self.claims(shapes, half_widths)
        found = self.judge.evaluate(shapes, half_widths, alternative, tight)
        if found is None:
            return None
        facets = tuple(self._load(i, shapes, half_widths).points for i in range(order))
        moved = self._moved(shapes, half_widths)
        termwise = self._termwise(shapes, half_widths)
        least = tuple(LEAST_RATE * p for p in half_widths)
        demands = (max(pair) for pair in zip(found.bounds.F_star, least, strict=True))
        scales = (*demands, max(tight.rate, least[-1]))
        return Candidate(
            evaluation=found,
            points=Points(facets=facets, rate=() if moved is None else moved.points, scales=scales),
            termwise=Termwise(load=termwise.load, rate=termwise.rate, U=None),
        )

    def claims(self, shapes: tuple[Shape, ...], half_widths: tuple[float, ...]) -> TightBounds:
        """Bound all loads and the rate of a design."""
        loads = tuple(self._claimed(i, shapes, half_widths) for i in range(len(shapes)))
        return TightBounds(load=loads, rate=self._rate(shapes, half_widths))

    def searched(
        self, step: int, shapes: tuple[Shape, ...], half_widths: tuple[float, ...]
    ) -> float:
        """load_i as it was found, for a chain that may end at step i."""
        return max(self._load(step, shapes, half_widths).upper, 0.0)

    def _closed(
        self,
        shapes: tuple[Shape, ...],
        half_widths: tuple[float, ...],
        kinds: set[Slot],
        alternative: str,
        digits: int,
    ) -> Candidate | None:
        """Set the last level: what it is asked for depends on itself through zeta."""
        last, margin = len(shapes) - 1, self.judge.problem.margin
        tight = self.claims(shapes, half_widths)
        free = [slot for slot in kinds if slot.step == last]
        for turn in range(_TURNS):
            found = self.judge.evaluate(shapes, half_widths, alternative, tight)
            if found is None:
                return None
            # A load of 0 asks for nothing, and a feedback of 0 is none.
            least = LEAST_RATE * half_widths[last] * self._units[last]
            lack = max(
                (d.rhs + least) * (1.0 + margin) / d.lhs if d.lhs > 0.0 else math.inf
                for d in found.demands
                if d.step == last and d.name == alternative
            )
            if not free or 1.0 - (_CLOSE if turn < _TURNS // 2 else 1.0) <= lack <= 1.0:
                break
            if not math.isfinite(lack):
                return None
            before = shapes[last]
            if 1.0 < lack < 1.0 + 10.0**-digits:
                shape = grown(before, kinds, last, lack, digits)
            else:
                # Half of the way down on the logarithmic scale, where U2 bends most.
                factor = min(lack, 10.0) if lack > 1.0 else max(lack, 0.01)
                shape = scaled(before, kinds, last, max(factor, 1e-30), digits)
            if shape == before:
                shape = grown(before, kinds, last, max(lack, 1.0), digits)
                if lack <= 1.0:
                    break
            shapes = (*shapes[:last], shape)
        candidate = self.judged(shapes, half_widths, alternative)
        if candidate is None or not candidate.evaluation.holds(margin / 2):
            return None
        return candidate

    def _leveled(
        self, shape: Shape, kinds: set[Slot], step: int, p: float, wanted: float, digits: int
    ) -> Shape:
        """Bring phi(p) to ``wanted`` or a little above, with the gains that are free."""
        numbers = self.judge.numbers
        if not any(slot.step == step for slot in kinds):
            return shape
        for _ in range(_TURNS):
            reached = feedback(shape.generic, p, numbers)
            lack = wanted / reached if reached > 0.0 else 2.0
            if 1.0 - 10.0 ** (1 - digits) <= lack <= 1.0:
                break
            changed = scaled(shape, kinds, step, lack, digits)
            if changed == shape:
                if lack <= 1.0:
                    break
                changed = grown(shape, kinds, step, lack, digits)
            shape = changed
        for _ in range(_TURNS):
            if feedback(shape.generic, p, numbers) >= wanted:
                break
            shape = grown(shape, kinds, step, 1.0 + 10.0**-digits, digits)
        return shape

    def _claimed(
        self, step: int, shapes: tuple[Shape, ...], half_widths: tuple[float, ...]
    ) -> float:
        """load_i as it is claimed: what was found and its room, never above the termwise one."""
        found = self._load(step, shapes, half_widths)
        ahead = half_widths[step + 1] if step + 1 < len(half_widths) else 0.0
        least = LEAST_RATE * half_widths[step] * self._units[step]
        wide = max(found.upper, 0.0) + _ROOM * (max(found.upper, 0.0) + ahead) + 1e-3 * least
        termwise, factor = self._termwise(shapes, half_widths).load[step], self._widening.load[step]
        if math.isinf(factor):
            # The checker's own termwise value may be a little above this one.
            excess = self._widening.excess
            return (excess[step] * _NEAR if excess else _TERMWISE) * termwise
        return min(factor * wide, termwise)

    def _rate(self, shapes: tuple[Shape, ...], half_widths: tuple[float, ...]) -> float:
        termwise = self._termwise(shapes, half_widths).rate
        found = self._moved(shapes, half_widths)
        if found is None:
            # Nothing asks for less.
            return _TERMWISE * termwise * min(self._widening.rate, 2.0)
        if math.isinf(self._widening.rate):
            return _TERMWISE * termwise
        wide = max(found.upper, 0.0) * (1.0 + _ROOM) * self._widening.rate
        return min(wide + LEAST_RATE * 1e-3 * half_widths[-1], termwise)

    def _load(
        self, step: int, shapes: tuple[Shape, ...], half_widths: tuple[float, ...]
    ) -> Supremum:
        key = (step, shapes[:step], half_widths[: step + 2])
        if key not in self._found:
            self._found[key] = self._search.load(step, shapes, half_widths, self._effort)
        return self._found[key]

    def _moved(self, shapes: tuple[Shape, ...], half_widths: tuple[float, ...]) -> Supremum | None:
        """Return the rate where anything depends on it."""
        held = self.judge.problem.conditions.hold > 0.0
        if not held and math.isfinite(self._termwise(shapes, half_widths).rate):
            return None
        key = ("rate", shapes[:-1], half_widths)
        if key not in self._found:
            self._found[key] = self._search.rate(shapes, half_widths, self._effort)
        return self._found[key]

    def _termwise(self, shapes: tuple[Shape, ...], half_widths: tuple[float, ...]) -> TightBounds:
        """D_i / g_{m,i} + s_{i+1} and D_n; infinite where they break down."""
        problem, numbers = self.judge.problem, self.judge.numbers
        generic = tuple(shape.generic for shape in shapes)
        start = chain_input(generic, half_widths, problem.center, problem.conditions, numbers)
        try:
            bounds = evaluate_chain(start, self.judge.residual, numbers, problem.theorem.rules)
        except (EnvelopeError, OverflowError, ZeroDivisionError):
            return TightBounds(load=(math.inf,) * len(shapes), rate=math.inf)
        loads = []
        for i, (load, g) in enumerate(zip(bounds.D, bounds.g_min, strict=True)):
            ahead = start.feed[i] if i + 1 < len(shapes) else 0.0
            whole = load / g + ahead if g > 0.0 else math.inf
            least = 1e-15 * half_widths[i] * self._units[i]
            loads.append(whole * _ABOVE + least if whole < math.inf else math.inf)
        return TightBounds(load=tuple(loads), rate=bounds.D[-1] * _ABOVE + 1e-15 * half_widths[-1])
