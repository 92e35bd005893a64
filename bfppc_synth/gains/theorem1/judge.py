"""A candidate of Theorem 1 judged in floats: its chain, its inequalities, what it costs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.bounds.residual import float_residual
from bfppc_synth.bounds.theorem1 import Chain1, Step1, evaluate_theorem1
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.gains.theorem1.problem import Theorem1Problem, chain1_input
from bfppc_synth.model.bounds import ChainBounds
from bfppc_synth.model.certificate import Strictness

if TYPE_CHECKING:
    from bfppc_synth.gains.methods.demands import Demand
    from bfppc_synth.model.shapes import Theorem1Gain


@dataclass(frozen=True, slots=True, kw_only=True)
class Theorem1Evaluation:
    """Gains and half-widths with everything that follows from them.

    ``shortfall`` is the largest relative amount by which a right side exceeds its left side.
    ``demands`` has one entry per inequality: of several nodes of rho the worst.
    """

    gains: tuple[Theorem1Gain, ...]
    half_widths: tuple[float, ...]
    c_0: float
    chain: Chain1[float]
    bounds: ChainBounds[float]
    demands: tuple[Demand[float], ...]
    shortfall: float
    cost: float

    def holds(self, margin: float) -> bool:
        """Whether every inequality holds with this relative margin, and the limit is kept."""
        return self.shortfall <= -margin


class Theorem1Judge:
    """Evaluates candidates of one problem; the residuals are prepared once."""

    def __init__(self, problem: Theorem1Problem) -> None:
        self.problem = problem
        self.numbers = FloatNumbers()
        self.residuals = tuple(
            float_residual(problem.plant, problem.majorants, center) for center in problem.centers
        )

    def chain(
        self, steps: tuple[Step1[float], ...], c_0: float
    ) -> tuple[Chain1[float], tuple[Demand[float], ...]] | None:
        """Evaluate the first steps; None where an envelope or a number breaks down."""
        start = chain1_input(self.problem, steps, c_0)
        try:
            chain = evaluate_theorem1(start, self.residuals, self.numbers)
            demands = self.problem.theorem.demands(start, chain, self.problem.order)
        except (EnvelopeError, OverflowError, ZeroDivisionError):
            return None
        sides = [side for demand in demands for side in (demand.lhs, demand.rhs)]
        return (chain, demands) if all(map(math.isfinite, sides)) else None

    def evaluate(
        self, gains: tuple[Theorem1Gain, ...], half_widths: tuple[float, ...], c_0: float
    ) -> Theorem1Evaluation | None:
        """Evaluate a whole candidate.

        Returns
        -------
        Theorem1Evaluation or None
            None if the reachable box leaves the domain of a function or a bound overflows.
        """
        problem = self.problem
        steps = tuple(
            Step1(
                gamma=gain.gamma,
                H=gain.H,
                H_star=gain.H_star,
                c=gain.c,
                N=gain.N,
                p=p,
                epsilon=given.epsilon,
            )
            for gain, p, given in zip(gains, half_widths, problem.steps, strict=True)
        )
        found = self.chain(steps, c_0)
        if found is None:
            return None
        chain, demands = found
        shortfall = max(lack(demand.lhs, demand.rhs) for demand in demands)
        bounds = _as_bounds(problem, chain)
        if problem.limit is not None:
            shortfall = max(shortfall, lack(problem.limit, bounds.U))
        weights = problem.weights
        cost = weights.peak_input * _log(bounds.U) + weights.slope * _log(bounds.slope)
        return Theorem1Evaluation(
            gains=gains,
            half_widths=half_widths,
            c_0=c_0,
            chain=chain,
            bounds=bounds,
            demands=_worst(demands),
            shortfall=shortfall,
            cost=cost,
        )

    def accepts(self, evaluation: Theorem1Evaluation) -> bool:
        """Whether every inequality holds, strictly where the form asks for it."""
        if self.problem.theorem.strictness is Strictness.WEAK:
            return evaluation.shortfall <= 0.0
        return evaluation.shortfall < 0.0


def lack(lhs: float, rhs: float) -> float:
    """Relative amount by which the right side exceeds the left one."""
    scale = max(abs(lhs), abs(rhs))
    return (rhs - lhs) / scale if scale > 0.0 else 0.0


def _worst(demands: tuple[Demand[float], ...]) -> tuple[Demand[float], ...]:
    kept: dict[tuple[str, int], Demand[float]] = {}
    for demand in demands:
        key = (demand.name, demand.step)
        held = kept.get(key)
        if held is None or lack(demand.lhs, demand.rhs) > lack(held.lhs, held.rhs):
            kept[key] = demand
    return tuple(kept.values())


def _as_bounds(problem: Theorem1Problem, chain: Chain1[float]) -> ChainBounds[float]:
    """Give the constants at rho = 1 under the names of sections 2 and 3; eta_i is D_i."""
    top = [table[-1] for table in chain.tables]
    center = problem.center
    sizes = [max(-low, up) for low, up in zip(center.r_lower, center.r_upper, strict=True)]
    ahead = [*(node.p for node in top[1:]), 0.0]
    rates = [node.B for node in top[1:]]
    ones = (1.0,) * problem.order
    return ChainBounds(
        X=tuple(size + node.xi for size, node in zip(sizes, top, strict=True)),
        xi=tuple(node.xi for node in top),
        A=tuple(node.A for node in top),
        L=tuple(node.L for node in top),
        W=tuple(node.W for node in top),
        s=center.feed,
        B=(*rates, 0.0),
        D=tuple(node.W + node.B for node in top),
        G=ones,
        g_min=ones,
        F_star=tuple(node.needed + p for node, p in zip(top, ahead, strict=True)),
        eta=tuple(node.D for node in top),
        Lambda=tuple(node.delta for node in top),
        zeta=top[-1].D,
        V=top[-1].load + chain.peak,
        U=chain.peak,
        slope=chain.slope,
        delta_v=0.0,
    )


def _log(value: float) -> float:
    return math.log(value) if value > 0.0 else -700.0
