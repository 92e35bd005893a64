"""Theorem 3 made sound: free stages that are watched, and a last one that is certified."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

from bfppc_synth.bounds.jumps import largest_jump
from bfppc_synth.bounds.stages import (
    StageInput,
    Surroundings,
    center_after,
    free_stages,
    needed_widths,
    sample_time,
)
from bfppc_synth.errors import NoDesignError
from bfppc_synth.gains.methods.demands import Demand
from bfppc_synth.gains.methods.unified import Unified
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.spec import Form
from bfppc_synth.model.stages import Handover

if TYPE_CHECKING:
    from bfppc_synth.bounds.chain import ChainInput
    from bfppc_synth.bounds.feedback import Numbers
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.bounds import ChainBounds, Conditions, SignalBounds
    from bfppc_synth.model.spec import GainSpec, SynthesisSpec
    from bfppc_synth.model.stages import Stage, StageSpec

T = TypeVar("T")

EQUATION = "(75), docs/theory.md section 8"


@dataclass(frozen=True, slots=True, kw_only=True)
class Staging:
    """The free stages of a problem, and what they were computed from."""

    inputs: tuple[StageInput, ...]
    around: Surroundings
    stages: tuple[Stage, ...]


class Reanchored(Unified):
    """Stage K around the center that the last handover makes: section 3 as it stands."""


@dataclass(frozen=True, slots=True)
class Contained(Unified):
    """Stage K around the first center; its tube must also contain every jump into it."""

    stages: tuple[Stage, ...]
    delay: float

    def alternatives(self) -> tuple[str, ...]:
        """U2' counts on every input in force pushing inward: a late one of stage m need not."""
        return ("U2",) if self.delay > 0.0 else Unified.alternatives(self)

    def demands(
        self,
        alternative: str,
        start: ChainInput[T],
        bounds: ChainBounds[T],
        numbers: Numbers[T],
        inner: T | None,
    ) -> tuple[Demand[T], ...]:
        """Those of Theorem U, and p_{i,K} > p^_{i,m} + Delta_i (+ tau V_n) for every stage m.

        A cascade may end in stage K from any stage m at one sample; the intermediate laws are
        then never applied.

        References
        ----------
        docs/theory.md section 8, "containment".
        """
        # A dataclass with slots is a new class: super() without arguments would miss it.
        out = list(Unified.demands(self, alternative, start, bounds, numbers, inner))
        last = len(start.shapes) - 1
        for number, stage in enumerate(self.stages, start=1):
            jump: Any = numbers.number(0.0)
            for i, shape in enumerate(start.shapes):
                reach = numbers.number(stage.widened[i])
                arrived: Any = reach + jump
                if i == last:
                    arrived = arrived + start.delay * _any(bounds.V)
                out.append(
                    Demand(
                        name=f"T3.handover{number}",
                        equation=EQUATION,
                        step=i,
                        lhs=start.half_widths[i],
                        rhs=arrived,
                    )
                )
                if i < last:
                    earlier = _lifted(stage.gains[i], numbers)
                    jump = largest_jump(shape, jump, earlier, reach, numbers)
        return tuple(out)


def _any(value: object) -> Any:
    return value


def _lifted(shape: Shape, numbers: Numbers[Any]) -> Any:
    generic = shape.generic
    return replace(
        generic,
        k=numbers.number(shape.k),
        M=numbers.number(shape.M),
        epsilon=numbers.number(shape.epsilon),
        c=numbers.number(shape.c),
    )


def staged(
    problem: DesignProblem, signals: SignalBounds, synthesis: SynthesisSpec
) -> DesignProblem:
    """Turn the problem of stage 1's center into the one of stage K.

    Parameters
    ----------
    problem : DesignProblem
        As for the unified method (form printed: theorem2), around the first center.
    signals : SignalBounds
        Their rho bounds are those of rhobar too.
    synthesis : SynthesisSpec
        Stages 1..K-1 and the handover. The printed form changes the gains and nothing else.

    Returns
    -------
    DesignProblem
        With the center, the theorem and the staging of stage K.

    Raises
    ------
    NoDesignError
        If a stage's errors cannot be bounded between two samples.

    References
    ----------
    docs/theory.md section 8.
    """
    printed = synthesis.form is Form.PRINTED
    around = Surroundings(
        plant=problem.plant,
        majorants=problem.majorants,
        signals=signals,
        center=problem.center,
        conditions=problem.conditions,
        handover=Handover.CONTAINMENT if printed else synthesis.handover,
    )
    inputs = tuple(stage_input(stage) for stage in synthesis.stages)
    found, broken = free_stages(inputs, around)
    if broken is not None:
        raise NoDesignError(_no_tube(problem, broken))
    staging = Staging(inputs=inputs, around=around, stages=found)
    if printed:
        center = center_after(found, around)
        return replace(problem, center=center, staging=staging)
    return _around(problem, staging)


def retimed(problem: DesignProblem, conditions: Conditions) -> DesignProblem | None:
    """Pose the problem again under other conditions; None where a free stage has no tube then."""
    changed = replace(problem, conditions=conditions)
    staging = problem.staging
    if staging is None:
        return changed
    around = replace(staging.around, conditions=conditions)
    found, broken = free_stages(staging.inputs, around)
    if broken is not None:
        return None
    return _around(changed, replace(staging, around=around, stages=found))


def stage_input(stage: StageSpec) -> StageInput:
    """Read one stage as the binary64 numbers that the code will contain; absent gains are 0."""
    return StageInput(
        gains=tuple(_shape(gain) for gain in stage.gains),
        half_widths=tuple(0.0 if p is None else float(p.approximate) for p in stage.p),
    )


def stage_demands(problem: DesignProblem) -> tuple[Demand[float], ...]:
    """p^_{i,m} > p_{i,m} + eta_{i,m} + h V_{i,m}, every free stage: fixed before the search."""
    if problem.staging is None:
        return ()
    period = sample_time(problem.staging.around.conditions)
    return tuple(
        Demand(
            name=f"T3.stage{number}", equation=EQUATION, step=i, lhs=stage.widened[i], rhs=needed
        )
        for number, stage in enumerate(problem.staging.stages, start=1)
        for i, needed in enumerate(needed_widths(stage, period))
    )


def _shape(gain: GainSpec) -> Shape:
    k, M, epsilon, c = (
        None if constant is None else float(constant.approximate)
        for constant in (gain.k, gain.M, gain.epsilon, gain.c)
    )
    return Shape(k=k or 0.0, M=M or 0.0, epsilon=epsilon or 1.0, c=c or 0.0, N=gain.N)


def _around(problem: DesignProblem, staging: Staging) -> DesignProblem:
    contained = staging.around.handover is Handover.CONTAINMENT
    return replace(
        problem,
        center=center_after(staging.stages, staging.around),
        theorem=Contained(staging.stages, problem.conditions.delay) if contained else Reanchored(),
        staging=staging,
    )


def _no_tube(problem: DesignProblem, broken: int) -> str:
    period = sample_time(problem.conditions)
    return (
        f"no certified design for {problem.plant.spec.path}: synthesis.stages.{broken}: between"
        f" two samples ({period:.3g} s) the errors of stage {broken + 1} may leave every tube, or"
        " a bound breaks down there\n"
        "  fix: sample faster, or give that stage smaller gains or a smaller p"
    )
