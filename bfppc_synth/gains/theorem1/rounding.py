"""Round a candidate of Theorem 1 to few digits in the safe direction, step by step."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.gains.methods.theorem1 import power_growth
from bfppc_synth.gains.rounding import to_digits
from bfppc_synth.gains.theorem1.judge import lack
from bfppc_synth.gains.theorem1.problem import Unknown, candidate_step
from bfppc_synth.model.shapes import Theorem1Gain

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.bounds.theorem1 import Step1
    from bfppc_synth.gains.theorem1.judge import Theorem1Evaluation, Theorem1Judge


def round_theorem1(
    judge: Theorem1Judge, values: Mapping[Unknown, float], digits: int
) -> Theorem1Evaluation | None:
    """Round a candidate in the safe direction, each step before the next one is judged.

    Parameters
    ----------
    judge : Theorem1Judge
        The problem and its float chain.
    values : Mapping[Unknown, float]
        The free numbers as the search found them.
    digits : int
        Significant digits of every free number.

    Returns
    -------
    Theorem1Evaluation or None
        A design that keeps the problem's margin in every inequality, or None.
    """
    problem = judge.problem
    spare = 1.0 + problem.margin
    c_0 = problem.c_0
    if c_0 is None:
        c_0 = to_digits(values[Unknown(kind="c_0", step=-1)], digits, upward=1)
    steps = [candidate_step(given, i, values) for i, given in enumerate(problem.steps)]
    for i, given in enumerate(problem.steps):
        found = judge.chain(tuple(steps[: i + 1]), c_0)
        if found is None:
            return None
        node, step = found[0].tables[i][-1], steps[i]
        if step.p is None:
            # Rounded down: the step before has promised no more than eps_i on top of D_i.
            free = given.epsilon is None
            p = to_digits(node.p, digits, upward=-1) if free else node.p
            steps[i] = step = replace(step, p=p)
            found = judge.chain(tuple(steps[: i + 1]), c_0)
            if found is None:
                return None
            node = found[0].tables[i][-1]
        if step.H is None:
            H = tuple(to_digits(h, digits, upward=1) for h in found[0].H[i])
            steps[i] = step = replace(step, H=H)
        if given.c is None and step.c > 0.0:
            growth = spare * power_growth(node.p, node.D, given.N)
            # Exact measurement adds nothing to the power term, whatever c is.
            allowed = c_0 / growth if growth > 0.0 else step.c
            steps[i] = step = replace(step, c=to_digits(min(step.c, allowed), digits, upward=-1))
        if given.gamma is None:
            gamma = _enough(judge, steps, i, c_0, digits)
            if gamma is None:
                return None
            steps[i] = replace(step, gamma=gamma)
    gains = tuple(
        Theorem1Gain(
            gamma=step.gamma,
            H=step.H or (0.0,),
            H_star=(step.H or (0.0,))[0] if step.H_star is None else step.H_star,
            c=step.c,
            N=step.N,
        )
        for step in steps
    )
    found_all = judge.evaluate(gains, tuple(step.p or 0.0 for step in steps), c_0)
    if found_all is None or not judge.accepts(found_all):
        return None
    # p_i may equal its formula exactly; every other inequality keeps its room.
    others = [lack(d.lhs, d.rhs) for d in found_all.demands if d.name != "T1.p"]
    if problem.limit is not None:
        others.append(lack(problem.limit, found_all.bounds.U))
    return found_all if max(others) <= -problem.margin / 2 else None


def _enough(
    judge: Theorem1Judge, steps: list[Step1[float]], i: int, c_0: float, digits: int
) -> float | None:
    """Raise gamma_i until its inequality has the margin, with the next step's room as found."""
    margin = judge.problem.margin
    gamma = to_digits(steps[i].gamma, digits)
    for _ in range(60):
        trial = [*steps[:i], replace(steps[i], gamma=gamma), *steps[i + 1 : i + 2]]
        found = judge.chain(tuple(trial), c_0)
        if found is None:
            return None
        short = max(
            (
                d.rhs * (1.0 + margin) / d.lhs if d.lhs > 0.0 else math.inf
                for d in found[1]
                if d.step == i and d.name in ("T1.gamma", "T1'.gamma")
            ),
            default=0.0,
        )
        if short <= 1.0:
            return gamma
        if not math.isfinite(short) or short > 1.5:
            return None
        raised = to_digits(gamma * short, digits, upward=1)
        if raised <= gamma:
            raised = to_digits(gamma * (1 + 10.0**-digits), digits, upward=1)
        gamma = raised
    return None
