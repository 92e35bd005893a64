"""One value of what an inverse objective seeks -> the best design there, in floats."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import TYPE_CHECKING

from bfppc_synth.bounds.signals import conditions
from bfppc_synth.errors import EnvelopeError, NoDesignError, PlantFileError
from bfppc_synth.gains.evaluation import Evaluation, Judge
from bfppc_synth.gains.methods.theorem3 import retimed
from bfppc_synth.gains.problem import DesignProblem, is_free
from bfppc_synth.gains.search import STARTS, search
from bfppc_synth.gains.theorem1.judge import Theorem1Judge
from bfppc_synth.gains.theorem1.search import search_theorem1
from bfppc_synth.gains.tight import search_tight
from bfppc_synth.model.chosen import Chosen
from bfppc_synth.model.spec import BoundsKind, Method, Objective
from bfppc_synth.spec.resolve import resolved
from bfppc_synth.synthesis.prepare import prepare, problem_of_theorem1
from bfppc_synth.synthesis.tight import finder_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.gains.theorem1.problem import Theorem1Problem
    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.bounds import SignalBounds
    from bfppc_synth.model.spec import PlantSpec

# A design so near is the only start of the next search [log].
_NEAR = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Probe:
    """What the search reaches with one value; ``evaluation`` is where the next one may start."""

    value: float
    U: float
    slope: float
    cost: float
    evaluation: Evaluation | None = None


class Limit(Enum):
    """Whether the designs of a curve keep the actuator limit, or only tell their peak input."""

    KEPT = auto()
    IGNORED = auto()


class Prober:
    """Designs value by value, each searched from its nearest neighbour's.

    ``failure`` is the first mistake that a value met, ``mistaken`` counts them; ``transition``
    the T_s [s] that is taken, None as long as it is chosen anew.
    """

    def __init__(
        self,
        spec: PlantSpec,
        objective: Objective,
        arithmetic: Arithmetic,
        progress: Callable[[str], None],
        limit: Limit,
        bounds: BoundsKind,
    ) -> None:
        self.spec = spec
        self.objective = objective
        self._limit = limit
        self._base: tuple[DesignProblem, SignalBounds] | None = None
        self._tight = bounds is BoundsKind.TIGHT
        self.failure: PlantFileError | None = None
        self.mistaken = 0
        self.transition: float | None = None
        self._arithmetic = arithmetic
        self._progress = progress
        self._known: dict[float, Probe | None] = {}

    @property
    def found(self) -> tuple[Probe, ...]:
        """Every value that has a design so far."""
        return tuple(probe for probe in self._known.values() if probe is not None)

    def at(self, value: float) -> Probe | None:
        """Return the design of a value, None where there is none."""
        if value not in self._known:
            self._known[value] = self._tried(value, _NEAR)
        return self._known[value]

    def again(self, value: float) -> Probe | None:
        """Return the design of a value, found from all starts if not from its neighbour."""
        self._known[value] = self._known.get(value) or self._tried(value, 0.0)
        return self._known[value]

    def forget(self) -> None:
        """Drop what was found, to begin again with another T_s."""
        self._known.clear()
        self._base = None

    def _tried(self, value: float, near: float) -> Probe | None:
        self._progress(f"trying {self.objective} {value:.4g}")
        try:
            return self._searched(value, near)
        except PlantFileError as error:
            # What breaks down here may hold elsewhere: a smaller box, a finer step.
            self.failure = self.failure or error
            self.mistaken += 1
        except (EnvelopeError, NoDesignError):
            pass
        return None

    def _searched(self, value: float, near: float) -> Probe | None:
        spec = resolved(self.spec, Chosen(objective=self.objective, value=value))
        ignored = self._limit is Limit.IGNORED
        if spec.synthesis.method is Method.THEOREM1:
            problem_1 = problem_of_theorem1(spec)
            return _of_theorem1(replace(problem_1, limit=None) if ignored else problem_1, value)
        problem, signals = self._posed(spec)
        if self.transition is None and problem.nominal is not None:
            self.transition = problem.nominal.model.transition
        if ignored:
            problem = replace(problem, limit=None)
        found = self._best(problem, signals, value, near)
        if found is None or not Judge(problem).accepts(found):
            return None
        return Probe(
            value=value,
            U=found.bounds.U,
            slope=found.bounds.slope,
            cost=found.cost,
            evaluation=found,
        )

    def _posed(self, spec: PlantSpec) -> tuple[DesignProblem, SignalBounds]:
        """Pose the problem of one value; center and majorants know nothing of a period."""
        timed = self.objective is Objective.PERIOD and not self._arithmetic.single
        if timed and self._base is not None:
            problem, signals = self._base
            retold = replace(problem, plant=replace(problem.plant, spec=spec))
            changed = retimed(retold, conditions(spec))
            if changed is None:
                raise NoDesignError(spec.path)
            return changed, signals
        posed = prepare(spec, transition=self.transition, arithmetic=self._arithmetic)
        self._base = posed
        return posed

    def _best(
        self, problem: DesignProblem, signals: SignalBounds, value: float, near: float
    ) -> Evaluation | None:
        def distance(probe: Probe) -> float:
            return abs(math.log(probe.value / value))

        beside = min(self.found, key=distance, default=None)
        known = None if beside is None else beside.evaluation
        if not self._tight:
            # So near to a design another start finds nothing that this one does not, as a rule.
            close = beside is not None and distance(beside) < near and known is not None
            return search(problem, _silent, resume=known, starts=() if close else STARTS)
        start = (known or search(problem, _silent)) if is_free(problem) else None
        candidate = search_tight(problem, finder_of(problem, signals), start, _silent)
        return None if candidate is None else candidate.evaluation


def _of_theorem1(problem: Theorem1Problem, value: float) -> Probe | None:
    found = search_theorem1(problem, _silent)
    if found is None or not Theorem1Judge(problem).accepts(found):
        return None
    return Probe(value=value, U=found.bounds.U, slope=found.bounds.slope, cost=found.cost)


def _silent(message: str) -> None:
    del message
