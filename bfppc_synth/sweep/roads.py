"""One point's problem: search it, judge another point's design by it, prove a design of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from bfppc_synth.bounds.funnel import require_signals
from bfppc_synth.gains.evaluation import Evaluation, Judge
from bfppc_synth.gains.problem import Weights, is_free
from bfppc_synth.gains.search import search
from bfppc_synth.gains.theorem1.judge import Theorem1Judge
from bfppc_synth.gains.theorem1.search import search_theorem1
from bfppc_synth.model.shapes import Shape, Theorem1Gain
from bfppc_synth.model.spec import BoundsKind, Method, Objective
from bfppc_synth.sweep.records import Found
from bfppc_synth.synthesis.prepare import MARGINS, prepare, problem_of_theorem1
from bfppc_synth.synthesis.proof import proved
from bfppc_synth.synthesis.theorem1 import proved_theorem1
from bfppc_synth.synthesis.tight import synthesize_tight

if TYPE_CHECKING:
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.gains.theorem1.judge import Theorem1Evaluation
    from bfppc_synth.gains.theorem1.problem import Theorem1Problem
    from bfppc_synth.model.bounds import SignalBounds
    from bfppc_synth.model.certificate import Certificate
    from bfppc_synth.model.spec import PlantSpec


class Road(Protocol):
    """What a sweep asks of a method."""

    @property
    def free(self) -> bool:
        """Whether the file leaves anything to a search."""
        ...

    def searched(self, origin: int, near: Found | None, margin: float) -> Found | None:
        """Search a design, from a neighbour's where there is one."""
        ...

    def judged(self, other: Found) -> Found | None:
        """Take over another point's design where it keeps every inequality here, in floats."""
        ...

    def proved(self, found: Found) -> Certificate:
        """Ask the checker about a design."""
        ...

    def reason(self) -> str:
        """Say in one line why nothing was found."""
        ...


def road_of(spec: PlantSpec, transition: float | None = None) -> Road:
    """Prepare one plant file; ``transition`` is T_s [s] where it is decided already.

    Raises
    ------
    BfppcError
        As synthesis does before its search.
    """
    if spec.synthesis.method is Method.THEOREM1:
        return _Theorem1Road(problem_of_theorem1(spec))
    problem, signals = prepare(spec, transition=transition)
    if spec.synthesis.bounds is BoundsKind.TIGHT:
        return _TightRoad(problem, signals)
    return _ChainRoad(problem, signals)


def _measure(spec: PlantSpec, peak: float, cost: float) -> float:
    """Of the objective peak-input its peak input alone, else all that is minimized."""
    return peak if spec.synthesis.objective == ((Objective.PEAK_INPUT, 1.0),) else cost


def _silent(message: str) -> None:
    del message


class _ChainRoad:
    """Methods unified, theorem2 and theorem3."""

    def __init__(self, problem: DesignProblem, signals: SignalBounds) -> None:
        self._problem = problem
        self._signals = signals
        self._judge = Judge(problem)

    @property
    def free(self) -> bool:
        return is_free(self._problem)

    def searched(self, origin: int, near: Found | None, margin: float) -> Found | None:
        resume = None if near is None else self._evaluated(near)
        problem = replace(self._problem, margin=margin)
        found = search(problem, _silent, resume=resume)
        return None if found is None else self._found(origin, found)

    def judged(self, other: Found) -> Found | None:
        if other.half_widths[0] > self._problem.accuracy:
            return None
        evaluated = self._evaluated(other)
        if evaluated is None or not evaluated.holds(self._problem.margin / 2):
            return None
        return self._found(other.origin, evaluated)

    def proved(self, found: Found) -> Certificate:
        evaluated = self._evaluated(found)
        if evaluated is None:
            raise LookupError("a design that was judged before")
        certificate = proved(self._problem, evaluated)
        require_signals(self._problem.plant, certificate.failures)
        return certificate

    def reason(self) -> str:
        problem = self._problem
        if not self.free:
            return "with these gains a bound breaks down on the reachable box"
        if problem.limit is not None:
            least = self._least(replace(problem, limit=None))
            if least is not None:
                return (
                    f"the least peak input found is {least.bounds.U:.4g}, above actuator.limit"
                    f" {problem.limit:.6g}"
                )
            problem = replace(problem, limit=None)
        given = problem.conditions
        coarse = any(given.delta)
        if given.hold > 0.0 and self._possible(problem, hold=0.0, share=1.0):
            return "sampling.period and delay are too long for any gains found"
        if coarse and self._possible(problem, hold=given.hold, share=0.0):
            return "the resolution is too coarse for any gains found"
        if coarse and given.hold > 0.0 and self._possible(problem, hold=0.0, share=0.0):
            return "resolution and period together are too coarse for any gains found"
        return "no gains were found, even with exact continuous measurement and no limit"

    def _possible(self, problem: DesignProblem, *, hold: float, share: float) -> bool:
        given = problem.conditions
        finer = replace(
            given,
            hold=hold,
            delay=min(given.delay, hold),
            delta=tuple(share * delta for delta in given.delta),
        )
        return self._least(replace(problem, conditions=finer)) is not None

    def _least(self, problem: DesignProblem) -> Evaluation | None:
        return search(replace(problem, weights=Weights(peak_input=1.0, slope=0.01)), _silent)

    def _evaluated(self, found: Found) -> Evaluation | None:
        shapes = tuple(gain for gain in found.gains if isinstance(gain, Shape))
        return self._judge.evaluate(shapes, found.half_widths, found.alternative, found.tight)

    def _found(self, origin: int, found: Evaluation) -> Found:
        nominal, peak = self._problem.nominal, found.bounds.U
        return Found(
            origin=origin,
            gains=found.shapes,
            half_widths=found.half_widths,
            alternative=found.alternative,
            c_0=None,
            transition=None if nominal is None else nominal.model.transition,
            tight=found.tight,
            U=peak,
            slope=found.bounds.slope,
            measure=_measure(self._problem.plant.spec, peak, found.cost),
        )


class _TightRoad(_ChainRoad):
    """`bounds: tight`: its own search, which proves what it returns."""

    def searched(self, origin: int, near: Found | None, margin: float) -> Found | None:
        # It raises what the user reads where there is no design.
        del near
        problem = replace(self._problem, margin=margin)
        later = tuple(room for room in MARGINS if room > margin)
        found = synthesize_tight(problem, self._signals, (margin, *later), _silent)
        return self._found(origin, found.evaluation)


class _Theorem1Road:
    """Method theorem1."""

    def __init__(self, problem: Theorem1Problem) -> None:
        self._problem = problem
        self._judge = Theorem1Judge(problem)

    @property
    def free(self) -> bool:
        return self._problem.is_free

    def searched(self, origin: int, near: Found | None, margin: float) -> Found | None:
        del near
        found = search_theorem1(replace(self._problem, margin=margin), _silent)
        return None if found is None else self._found(origin, found)

    def judged(self, other: Found) -> Found | None:
        if other.half_widths[0] > self._problem.accuracy:
            return None
        evaluated = self._evaluated(other)
        if evaluated is None or not evaluated.holds(self._problem.margin / 2):
            return None
        return self._found(other.origin, evaluated)

    def proved(self, found: Found) -> Certificate:
        evaluated = self._evaluated(found)
        if evaluated is None:
            raise LookupError("a design that was judged before")
        certificate = proved_theorem1(self._problem, evaluated)
        require_signals(self._problem.plant, certificate.failures)
        return certificate

    def reason(self) -> str:
        problem = self._problem
        if not self.free:
            return "with these gains a bound breaks down on the reachable box"
        if problem.limit is not None:
            unlimited = replace(problem, limit=None, weights=Weights(peak_input=1.0, slope=0.01))
            least = search_theorem1(unlimited, _silent)
            if least is not None:
                return (
                    f"the least peak input found is {least.bounds.U:.4g}, above actuator.limit"
                    f" {problem.limit:.6g}"
                )
        return "no gains of theorem1 were found"

    def _evaluated(self, found: Found) -> Theorem1Evaluation | None:
        gains = tuple(gain for gain in found.gains if isinstance(gain, Theorem1Gain))
        return self._judge.evaluate(gains, found.half_widths, found.c_0 or 0.0)

    def _found(self, origin: int, found: Theorem1Evaluation) -> Found:
        peak = found.bounds.U
        return Found(
            origin=origin,
            gains=found.gains,
            half_widths=found.half_widths,
            alternative="",
            c_0=found.c_0,
            transition=None,
            tight=None,
            U=peak,
            slope=found.bounds.slope,
            measure=_measure(self._problem.plant.spec, peak, found.cost),
        )
