"""Theorem 1's design problem: what a file fixes and what is free."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from bfppc_synth.bounds.theorem1 import Chain1Input, Step1, faded

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.bounds.feedback import Numbers
    from bfppc_synth.gains.methods.theorem1 import Theorem1Form
    from bfppc_synth.gains.problem import Weights
    from bfppc_synth.model.bounds import CenterBounds, Majorants
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.spec import SynthesisSpec


@dataclass(frozen=True, slots=True, kw_only=True)
class Given1:
    """What the file fixes of one step, as floats; None is free. N is always fixed."""

    gamma: float | None
    H: tuple[float, ...] | None
    H_star: float | None
    c: float | None
    N: int
    p: float | None
    epsilon: float | None

    @property
    def decided(self) -> bool:
        """Whether nothing of this step is left to the search."""
        return None not in (self.gamma, self.H, self.c, self.p)


@dataclass(frozen=True, slots=True, kw_only=True)
class Theorem1Problem:
    """Everything that the search of Theorem 1 reads.

    ``center`` bounds rho x_i(0) by the true starts; ``noise`` is delta_{M,i}, twice the
    measurement error; ``rate`` is rho_M [1/s]; ``nodes`` the values of rho at which the chain
    is evaluated. The p of the first step is the accuracy.
    """

    plant: Plant
    majorants: Majorants
    center: CenterBounds
    noise: tuple[float, ...]
    rate: float
    steps: tuple[Given1, ...]
    c_0: float | None
    nodes: tuple[float, ...]
    theorem: Theorem1Form
    weights: Weights
    limit: float | None
    margin: float

    @property
    def order(self) -> int:
        """Number of steps n."""
        return len(self.steps)

    @property
    def accuracy(self) -> float:
        """p_1."""
        return self.steps[0].p or 0.0

    @property
    def centers(self) -> tuple[CenterBounds, ...]:
        """The center's range at every node of rho."""
        return tuple(faded(self.center, rho) for rho in self.nodes)

    @property
    def is_free(self) -> bool:
        """Whether anything is left to the search."""
        return self.c_0 is None or not all(step.decided for step in self.steps)


@dataclass(frozen=True, slots=True, kw_only=True)
class Unknown:
    """A free positive number: gamma, c or epsilon of a step (from 0), or c_0 (step -1)."""

    kind: str
    step: int


def unknowns(problem: Theorem1Problem) -> tuple[Unknown, ...]:
    """List what is free, step by step; H_i follows from the chain and is no unknown."""
    out = [Unknown(kind="c_0", step=-1)] if problem.c_0 is None else []
    for i, given in enumerate(problem.steps):
        if given.p is None and given.epsilon is None:
            out.append(Unknown(kind="epsilon", step=i))
        if given.gamma is None:
            out.append(Unknown(kind="gamma", step=i))
        if given.c is None:
            out.append(Unknown(kind="c", step=i))
    return tuple(out)


def candidate_step(
    given: Given1, i: int, free: Mapping[Unknown, Any], numbers: Numbers[Any] | None = None
) -> Step1[Any]:
    """One step with its free numbers filled in; ``numbers`` None leaves fixed ones as floats."""

    def value(kind: str, fixed: float | None) -> Any:
        found = free.get(Unknown(kind=kind, step=i))
        if found is not None or fixed is None:
            return found
        return fixed if numbers is None else numbers.number(fixed)

    return Step1(
        gamma=value("gamma", given.gamma),
        H=given.H,
        H_star=given.H_star,
        c=value("c", given.c),
        N=given.N,
        p=given.p,
        epsilon=value("epsilon", given.epsilon),
    )


def chain1_input(
    problem: Theorem1Problem, steps: tuple[Step1[Any], ...], c_0: Any
) -> Chain1Input[Any]:
    """Put a candidate of any number type beside what the problem fixes."""
    return Chain1Input(
        steps=steps,
        c_0=c_0,
        nodes=problem.nodes,
        noise=problem.noise,
        feed=problem.center.feed,
        rate=problem.rate,
        room=problem.margin,
        facet=problem.theorem.facet,
    )


def given_steps(spec: SynthesisSpec, accuracy: float) -> tuple[Given1, ...]:
    """Read the fixed numbers as the binary64 numbers that the code will contain.

    Parameters
    ----------
    spec : SynthesisSpec
        Gains, p and the theorem1 section.
    accuracy : float
        p_1 [unit of x_1].

    Returns
    -------
    tuple[Given1, ...]
        One per state; in the sound form a fixed p is what counts, also beside a fixed epsilon.
    """
    rooms = spec.theorem1.epsilon if spec.theorem1 is not None else (None,) * len(spec.p)
    out = []
    for i, (gain, p, room) in enumerate(zip(spec.gains, spec.p, rooms, strict=True)):
        out.append(
            Given1(
                gamma=_float(gain.gamma),
                H=None if gain.H is None else tuple(h.approximate for h in gain.H),
                H_star=_float(gain.H_star),
                c=_float(gain.c),
                N=gain.N,
                p=accuracy if i == 0 else _float(p),
                epsilon=None if i == 0 else _float(room),
            )
        )
    return tuple(out)


def implied_c_0(steps: tuple[Given1, ...], noise: tuple[float, ...]) -> float | None:
    """c_0 where a file fixes p_2, eps_2 and gamma_1 H_1: what p_2's formula leaves for it.

    The paper's Example 1 fixes them so that nothing is left: p_2 = 2 + delta_M + 1.

    References
    ----------
    The paper's (14): p_2 = gamma_1 H_1 delta_M + c_0 + delta_M + eps_2.
    """
    if len(steps) < 2:
        return None
    first, second = steps[0], steps[1]
    if first.gamma is None or first.H is None or second.p is None or second.epsilon is None:
        return None
    # Decimals of the file: as floats their difference would not be exactly 0.
    gamma, height, p, room, *deltas = (
        Fraction(repr(value))
        for value in (first.gamma, math.fsum(first.H), second.p, second.epsilon, *noise[:2])
    )
    return float(max(Fraction(0), p - gamma * height * deltas[0] - deltas[1] - room))


def _float(constant: Any) -> float | None:
    return None if constant is None else float(constant.approximate)
