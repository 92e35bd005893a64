"""One form of a method as a judge of candidates, whatever the method."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Protocol

from bfppc_synth.gains.evaluation import Judge
from bfppc_synth.gains.methods.demands import Demand
from bfppc_synth.gains.methods.theorem3 import stage_demands
from bfppc_synth.gains.problem import Weights
from bfppc_synth.gains.theorem1.judge import Theorem1Judge
from bfppc_synth.gains.tight import effort_of
from bfppc_synth.gains.tight_repair import Repair, Widening
from bfppc_synth.model.certificate import Strictness
from bfppc_synth.model.shapes import Shape, Theorem1Gain
from bfppc_synth.model.spec import BoundsKind, Form, Method
from bfppc_synth.synthesis.prepare import prepare
from bfppc_synth.synthesis.theorem1 import prepare_theorem1
from bfppc_synth.synthesis.tight import finder_of

if TYPE_CHECKING:
    from bfppc_synth.audit.records import Candidate
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.gains.theorem1.problem import Theorem1Problem
    from bfppc_synth.model.bounds import CenterBounds, ChainBounds, SignalBounds
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.spec import PlantSpec

EVEN = Weights(peak_input=1.0, slope=1.0)
# What the search keeps of every inequality; the audit itself keeps nothing.
ROOM = 2e-4


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """A candidate's constants and demands in one form; ``alternative`` is U2 or U2'."""

    bounds: ChainBounds[float]
    demands: tuple[Demand[float], ...]
    alternative: str


class FormJudge(Protocol):
    """What the audit asks of a form."""

    plant: Plant
    center: CenterBounds

    def judge(self, candidate: Candidate, alternative: str = "") -> Judged | None:
        """Evaluate a candidate; None where a bound breaks down on its reachable box."""

    def relation(self, demand: Demand[float]) -> str:
        """Return ``>`` or ``>=``, as the form's text has it."""


def holds(demand: Demand[float], relation: str) -> bool:
    """Whether a demand is met."""
    return demand.lhs > demand.rhs or (relation == ">=" and demand.lhs == demand.rhs)


class ShapeForm:
    """Theorem U, Theorem 2, Theorem 3: shapes k e + M tanh(M e / epsilon) + c e^N."""

    def __init__(self, problem: DesignProblem, signals: SignalBounds) -> None:
        self.problem = problem
        self.plant = problem.plant
        self.center = problem.center
        self._judge = Judge(problem)
        self._tight: Repair | None = None
        if problem.plant.spec.synthesis.bounds is BoundsKind.TIGHT:
            finder, none = finder_of(problem, signals), Widening.none(problem.order)
            self._tight = Repair(self._judge, finder, effort_of(problem.order), none)
        self._printed = problem.plant.spec.synthesis.form is Form.PRINTED

    def judge(self, candidate: Candidate, alternative: str = "") -> Judged | None:
        """Evaluate a candidate in the named alternative, else in the one with the most room."""
        shapes = tuple(map(_shape, candidate.gains))
        tight = None
        if self._tight is not None:
            if min(candidate.half_widths) <= 0.0:
                return None
            tight = self._tight.claims(shapes, candidate.half_widths)
        if alternative:
            found = self._judge.evaluate(shapes, candidate.half_widths, alternative, tight)
        else:
            found = self._judge.best(shapes, candidate.half_widths, tight)
        if found is None:
            return None
        stages = stage_demands(self.problem)
        if self._printed:
            stages = _ordered(self.problem, candidate.half_widths)
        fixed = (*stages, *_limits(self.problem, found.bounds.U))
        return Judged(
            bounds=found.bounds,
            demands=(*found.demands, *fixed),
            alternative=found.alternative,
        )

    def relation(self, demand: Demand[float]) -> str:
        """Return ``>=`` for the paper's (65) and (71); its order of the p_{i,m} is strict."""
        weak = self._judge.problem.theorem.strictness is Strictness.WEAK
        return ">=" if (weak and demand.name == "T2") or demand.name == "limit" else ">"


class HeightForm:
    """Theorem 1: gamma H(rho) e + c e^N."""

    def __init__(self, problem: Theorem1Problem) -> None:
        self.problem = problem
        self.plant = problem.plant
        self.center = problem.center
        self._judge = Theorem1Judge(problem)

    def judge(self, candidate: Candidate, alternative: str = "") -> Judged | None:
        """Evaluate a candidate; there is one alternative."""
        del alternative
        gains = tuple(map(_height, candidate.gains))
        found = self._judge.evaluate(gains, candidate.half_widths, candidate.c_0 or 0.0)
        if found is None:
            return None
        return Judged(
            bounds=found.bounds,
            demands=(*found.demands, *_limits(self.problem, found.bounds.U)),
            alternative="",
        )

    def relation(self, demand: Demand[float]) -> str:
        """Return ``>=`` for the paper's (39), and for what H_i and c_0 must cover."""
        weak = self.problem.theorem.strictness is Strictness.WEAK
        return ">=" if weak or demand.name in ("T1.H", "T1.c", "limit") else ">"


def form_judge(spec: PlantSpec) -> ShapeForm | HeightForm:
    """Make the judge of a plant file's method and form.

    Parameters
    ----------
    spec : PlantSpec
        Whatever is left open in it does not matter here.

    Returns
    -------
    ShapeForm or HeightForm
        Both are FormJudges.

    Raises
    ------
    PlantFileError
        A bound breaks down on the smallest box, or the reference cannot be enclosed.
    NoDesignError
        A free stage of Theorem 3 has no tube.
    """
    if spec.synthesis.method is Method.THEOREM1:
        return HeightForm(prepare_theorem1(spec, EVEN, ROOM))
    return ShapeForm(*prepare(spec))


def _limits(problem: DesignProblem | Theorem1Problem, peak: float) -> tuple[Demand[float], ...]:
    if problem.limit is None:
        return ()
    last = problem.order - 1
    return (
        Demand(name="limit", equation="actuator.limit", step=last, lhs=problem.limit, rhs=peak),
    )


def _ordered(problem: DesignProblem, last: tuple[float, ...]) -> tuple[Demand[float], ...]:
    """p_{i,m} < p_{i,m+1}, what the paper asks of the stages besides (65) and (71)."""
    stages = () if problem.staging is None else problem.staging.stages
    widths = [*(stage.omega for stage in stages), last]
    return tuple(
        Demand(name=f"T3.order{number}", equation="(75)", step=i, lhs=wider, rhs=p)
        for number, (earlier, later) in enumerate(pairwise(widths), start=1)
        for i, (p, wider) in enumerate(zip(earlier, later, strict=True))
    )


def _shape(gain: Gain) -> Shape:
    return gain if isinstance(gain, Shape) else gain.shape


def _height(gain: Gain) -> Theorem1Gain:
    if isinstance(gain, Theorem1Gain):
        return gain
    return Theorem1Gain(gamma=gain.k, H=(1.0,), H_star=1.0, c=gain.c, N=gain.N)
