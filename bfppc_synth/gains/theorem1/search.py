"""Theorem 1's search: starts, solves, rounding, and the best of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bfppc_synth.bounds.theorem1 import evaluate_theorem1
from bfppc_synth.gains.methods.theorem1 import power_growth
from bfppc_synth.gains.solve import PositiveProgram
from bfppc_synth.gains.theorem1.judge import Theorem1Evaluation, Theorem1Judge
from bfppc_synth.gains.theorem1.problem import (
    Theorem1Problem,
    Unknown,
    candidate_step,
    chain1_input,
    unknowns,
)
from bfppc_synth.gains.theorem1.rounding import round_theorem1
from bfppc_synth.model.shapes import Theorem1Gain

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.bounds.chain import Residual
    from bfppc_synth.bounds.feedback import Numbers
    from bfppc_synth.model.bounds import CenterBounds, Majorants
    from bfppc_synth.model.plant import Plant

# Ratio of eps_{i+1} to H_i in the starts.
STARTS = (0.3, 1.0, 0.05, 3.0)
DIGITS = (4, 6, 9)
AGREEMENT = 1e-3
# A free power term below this share of phi_i(p_i) is left out.
LEAST_SHARE = 0.01
WIDE = (1e-9, 1e9)
# c_i and c_0 cost little and may be worth nothing: keep them from running to 0.
DOWNWARD = (1e-3, 1e6)


def search_theorem1(
    problem: Theorem1Problem, progress: Callable[[str], None]
) -> Theorem1Evaluation | None:
    """Find the best rounded candidate.

    Parameters
    ----------
    problem : Theorem1Problem
        What is fixed, free and wanted.
    progress : callable
        Receives one sentence per solve.

    Returns
    -------
    Theorem1Evaluation or None
        A candidate that keeps every inequality in floats with room for the checker, or None;
        where nothing is free, the fixed numbers as they are.

    References
    ----------
    docs/theory.md sections 5 and 7.
    """
    if not problem.is_free:
        return Theorem1Judge(problem).evaluate(*_fixed(problem))
    # Next to a power term that exact measurement makes free a local solver overlooks none at all.
    flat = replace(
        problem,
        steps=tuple(replace(step, c=0.0) if step.c is None else step for step in problem.steps),
    )
    variants = (problem, flat) if flat.is_free and flat.steps != problem.steps else (problem,)
    found = [_best(variant, progress) for variant in variants]
    return min(
        (candidate for candidate in found if candidate is not None),
        key=lambda evaluation: evaluation.cost,
        default=None,
    )


def _best(problem: Theorem1Problem, progress: Callable[[str], None]) -> Theorem1Evaluation | None:
    judge = Theorem1Judge(problem)
    program = PositiveProgram(_Logs(problem))
    best: Theorem1Evaluation | None = None
    for number, ratio in enumerate(STARTS, start=1):
        progress(f"solving the gain inequalities (T1), start {number}")
        values = _begin(judge, ratio)
        if values is None:
            continue
        slots = unknowns(problem)
        boxes = tuple(DOWNWARD if slot.kind in ("c", "c_0") else WIDE for slot in slots)
        solution = program.solve(tuple(values[slot] for slot in slots), boxes)
        if solution is None:
            continue
        candidate = _rounded(judge, dict(zip(slots, solution, strict=True)))
        if candidate is None:
            continue
        if best is not None and abs(candidate.cost - best.cost) <= AGREEMENT:
            return min(best, candidate, key=lambda evaluation: evaluation.cost)
        if best is None or candidate.cost < best.cost:
            best = candidate
    return best


class _Logs:
    """The problem as the solver reads it."""

    def __init__(self, problem: Theorem1Problem) -> None:
        self._problem = problem
        self._slots = unknowns(problem)
        self.plant: Plant = problem.plant
        self.majorants: Majorants = problem.majorants
        self.centers: tuple[CenterBounds, ...] = problem.centers
        self.accuracy = problem.accuracy
        self.margin = problem.margin
        self.count = len(self._slots)

    def formulate(
        self,
        values: tuple[Any, ...],
        residuals: tuple[Residual[Any], ...],
        numbers: Numbers[Any],
    ) -> tuple[tuple[tuple[float, Any], ...], tuple[tuple[Any, Any], ...]]:
        """Cost and inequalities over any number type."""
        problem = self._problem
        free = dict(zip(self._slots, values, strict=True))
        c_0 = free.get(Unknown(kind="c_0", step=-1), problem.c_0)
        steps = tuple(
            candidate_step(given, i, free, numbers) for i, given in enumerate(problem.steps)
        )
        start = chain1_input(problem, steps, numbers.number(0.0) + c_0)
        chain = evaluate_theorem1(start, residuals, numbers)
        demands = problem.theorem.demands(start, chain, problem.order)
        pairs = [(demand.lhs, demand.rhs) for demand in demands]
        if problem.limit is not None:
            pairs.append((numbers.number(problem.limit), chain.peak))
        weights = problem.weights
        return ((weights.peak_input, chain.peak), (weights.slope, chain.slope)), tuple(pairs)


def _fixed(
    problem: Theorem1Problem,
) -> tuple[tuple[Theorem1Gain, ...], tuple[float, ...], float]:
    gains = tuple(
        Theorem1Gain(
            gamma=step.gamma or 0.0,
            H=step.H or (0.0,),
            H_star=(step.H or (0.0,))[0] if step.H_star is None else step.H_star,
            c=step.c or 0.0,
            N=step.N,
        )
        for step in problem.steps
    )
    return gains, tuple(step.p or 0.0 for step in problem.steps), problem.c_0 or 0.0


def _begin(judge: Theorem1Judge, ratio: float) -> dict[Unknown, float] | None:
    """Start down the chain: eps_{i+1} a share of H_i, gamma_i above what (39) asks."""
    problem = judge.problem
    values: dict[Unknown, float] = {}
    c_0 = problem.c_0
    if c_0 is None:
        c_0 = 0.05 * problem.accuracy
        values[Unknown(kind="c_0", step=-1)] = c_0
    for i, given in enumerate(problem.steps):
        slot = {kind: Unknown(kind=kind, step=i) for kind in ("gamma", "c", "epsilon")}
        trial = dict(values)
        trial[slot["gamma"]] = given.gamma or 1.0
        trial[slot["c"]] = given.c or 0.0
        steps = [candidate_step(problem.steps[j], j, trial) for j in range(i + 1)]
        found = judge.chain(tuple(steps), c_0)
        if found is None:
            return None
        node, room = found[0].tables[i][-1], found[0].epsilon[i]
        if room <= 0.0 or node.H <= 0.0:
            return None
        ahead = c_0
        if i + 1 < problem.order:
            after = problem.steps[i + 1]
            guess = max(ratio * node.H, 1e-3 * node.p)
            if after.p is None and after.epsilon is None:
                values[Unknown(kind="epsilon", step=i + 1)] = guess
            ahead += problem.noise[i + 1] + (after.epsilon or guess)
        if given.gamma is None:
            values[slot["gamma"]] = 1.3 * (node.H + ahead) / (node.H * room)
        if given.c is None:
            values[slot["c"]] = 0.5 * c_0 / power_growth(node.p, max(node.D, 1e-9), given.N)
    return values


def _rounded(judge: Theorem1Judge, solution: dict[Unknown, float]) -> Theorem1Evaluation | None:
    for values in (_without_small_powers(judge, solution), solution):
        for digits in DIGITS:
            found = round_theorem1(judge, values, digits)
            if found is not None:
                return found
    return None


def _without_small_powers(
    judge: Theorem1Judge, solution: dict[Unknown, float]
) -> dict[Unknown, float]:
    problem = judge.problem
    c_0 = solution.get(Unknown(kind="c_0", step=-1), problem.c_0)
    steps = tuple(candidate_step(given, i, solution) for i, given in enumerate(problem.steps))
    found = judge.chain(steps, c_0 or 0.0)
    if found is None:
        return solution
    values = dict(solution)
    for i, step in enumerate(steps):
        node, slot = found[0].tables[i][-1], Unknown(kind="c", step=i)
        if slot in values and step.c * node.p**step.N < LEAST_SHARE * node.A:
            values[slot] = 0.0
    return values
