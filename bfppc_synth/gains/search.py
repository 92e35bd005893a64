"""From a problem to a rounded candidate: starts, solves, rounding, and the best of them."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.bounds.chain import chain_input, evaluate_chain
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.gains.evaluation import Evaluation, Judge
from bfppc_synth.gains.geometric import is_geometric
from bfppc_synth.gains.problem import Kind, Slot, assemble, patterns, slots
from bfppc_synth.gains.rounding import round_candidate
from bfppc_synth.gains.solve import Program
from bfppc_synth.gains.units import per_rate
from bfppc_synth.model.shapes import Shape

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.shapes import Terms

# Ratio of p_{i+1} to the load of step i in the starts: from a narrow to a wide inner tube.
STARTS = (0.3, 0.05, 1.5, 0.005)
# Tried where those lead nowhere: least ratio of p_{i+1} to how fast the center moves. A step
# whose load is 0 says nothing about p_{i+1}, and too narrow a tube drowns in the noise.
PACES = (0.3, 0.03)
DIGITS = (4, 6, 9)
# Two starts that agree this well end the multi-start.
AGREEMENT = 1e-3
# Below this bend a tanh is linear to 0.3 percent.
NEARLY_LINEAR = 0.1


def search(
    problem: DesignProblem,
    progress: Callable[[str], None],
    *,
    resume: Evaluation | None = None,
    starts: tuple[float, ...] = STARTS,
) -> Evaluation | None:
    """Find the best rounded candidate.

    Parameters
    ----------
    problem : DesignProblem
        What is fixed, free and wanted.
    progress : callable
        Receives one sentence per solve.
    resume : Evaluation, optional
        What a similar problem found: the only start where it leads anywhere.
    starts : tuple[float, ...]
        Ratios of p_{i+1} to the load of step i, tried where that leads nowhere.

    Returns
    -------
    Evaluation or None
        A candidate that keeps every inequality in floats with room for the checker, or None.

    References
    ----------
    docs/theory.md section 5.
    """
    judge = Judge(problem)
    choices = [patterns(gains) for gains in problem.gains]
    first = tuple(choice[0] for choice in choices)
    second = tuple(choice[-1] for choice in choices)
    if not slots(problem, first):
        shapes, widths = fixed_design(problem)
        return judge.best(shapes, widths)
    best: Evaluation | None = None
    for pattern in dict.fromkeys((first, second)):
        found = [
            _solve(judge, pattern, alternative, progress, resume, starts)
            for alternative in alternatives(problem)
        ]
        for candidate in found:
            if candidate is not None and (best is None or candidate.cost < best.cost):
                best = candidate
        if best is not None:
            # Either form may have the least cost: a bound below both is one below their least.
            bounds = [None if candidate is None else candidate.lower for candidate in found]
            known = [bound for bound in bounds if bound is not None]
            if len(known) < len(bounds):
                return replace(best, lower=None)
            kept, free = (min(column) for column in zip(*known, strict=True))
            return replace(best, lower=(kept, free))
    return best


def alternatives(problem: DesignProblem) -> tuple[str, ...]:
    """Name the forms of the last inequality that are worth a search."""
    names = problem.theorem.alternatives()
    return names if problem.conditions.hold > 0.0 else names[:1]


def fixed_design(problem: DesignProblem) -> tuple[tuple[Shape, ...], tuple[float, ...]]:
    """Return the gains and half-widths of a file that fixes all of them."""
    shapes = tuple(
        Shape(k=g.k or 0.0, M=g.M or 0.0, epsilon=g.epsilon or 1.0, c=g.c or 0.0, N=g.N)
        for g in problem.gains
    )
    rest = tuple(p for p in problem.half_widths[1:] if p is not None)
    return shapes, (problem.accuracy, *rest)


def _solve(
    judge: Judge,
    pattern: tuple[Terms, ...],
    alternative: str,
    progress: Callable[[str], None],
    resume: Evaluation | None,
    ratios: tuple[float, ...],
) -> Evaluation | None:
    problem = judge.problem
    free = slots(problem, pattern)
    program = Program(problem, free, alternative)
    best: Evaluation | None = None
    costs: list[float] = []
    bounds: list[tuple[float, float]] = []
    geometric = is_geometric(problem, free, alternative)
    resumed = None if resume is None else _resumed(resume, free)
    solution = None if resumed is None else program.solve(*resumed)
    if solution is not None:
        best = _rounded(judge, solution, alternative)
        if best is not None:
            return best
    starts = (
        *((ratio, 0.0) for ratio in ratios),
        *((r, pace) for r in ratios[:1] for pace in PACES),
    )
    for number, (ratio, pace) in enumerate(starts, start=1):
        if pace > 0.0 and best is not None:
            break
        progress(f"solving the gain inequalities ({alternative}), start {number}")
        started = begin(judge, free, ratio, pace)
        if started is None:
            continue
        values, inner = started
        solution = program.solve(values, inner)
        if solution is None:
            continue
        if geometric:
            bounds.append(program.lower_bounds())
        candidate = _rounded(judge, solution, alternative)
        if candidate is None:
            continue
        costs.append(candidate.cost)
        agrees = best is not None and abs(candidate.cost - best.cost) <= AGREEMENT * max(
            1.0, abs(best.cost)
        )
        if best is None or candidate.cost < best.cost:
            best = candidate
        if agrees:
            break
    if best is None:
        return None
    return replace(best, starts=tuple(costs), lower=max(bounds) if bounds else None)


def continued(problem: DesignProblem, known: Evaluation) -> Evaluation | None:
    """Solve from a design of a similar problem, without rounding; None where that breaks down.

    Parameters
    ----------
    problem : DesignProblem
        As free as the other one.
    known : Evaluation
        Where to start; its form of the last inequality is kept.

    Returns
    -------
    Evaluation or None
        An estimate: its ``shortfall`` says whether the inequalities hold.
    """
    judge = Judge(problem)
    free = slots(problem, tuple(patterns(gains)[0] for gains in problem.gains))
    start = _resumed(known, free) if free else None
    if start is None:
        return None
    values = Program(problem, free, known.alternative).solve(*start)
    if values is None:
        return None
    generic, widths = assemble(problem, values, judge.numbers)
    shapes = tuple(Shape(k=s.k, M=s.M, epsilon=s.epsilon, c=s.c, N=s.N) for s in generic)
    return judge.evaluate(shapes, widths, known.alternative)


def _rounded(judge: Judge, solution: Mapping[Slot, float], alternative: str) -> Evaluation | None:
    for values in (linearized(judge.problem, solution), dict(solution)):
        for digits in DIGITS:
            found = round_candidate(judge, values, alternative, digits)
            if found is not None:
                return found
    return None


def linearized(problem: DesignProblem, solution: Mapping[Slot, float]) -> dict[Slot, float]:
    """Replace each tanh that has become linear by the linear term, where that is free."""
    values = dict(solution)
    for slot, level in solution.items():
        bend = Slot(kind=Kind.BEND, step=slot.step)
        if slot.kind is not Kind.TANH or solution[bend] > NEARLY_LINEAR:
            continue
        if problem.gains[slot.step].k is None:
            del values[slot], values[bend]
            values[Slot(kind=Kind.LINEAR, step=slot.step)] = level
    return values


def _resumed(known: Evaluation, free: tuple[Slot, ...]) -> tuple[dict[Slot, float], float] | None:
    """Start where another problem's search ended; None where a free term is 0 there."""
    values: dict[Slot, float] = {}
    for slot in free:
        shape, p = known.shapes[slot.step], known.half_widths[slot.step]
        # A tanh that was replaced by the linear term is resumed as one that hardly bends.
        bent = shape.M > 0.0
        bend = shape.M * p / shape.epsilon if bent else NEARLY_LINEAR
        values[slot] = {
            Kind.WIDTH: p,
            Kind.LINEAR: shape.k * p,
            Kind.TANH: shape.M * math.tanh(bend) if bent else shape.k * p,
            Kind.BEND: bend,
            Kind.HEIGHT: shape.M,
            Kind.POWER: shape.c * p**shape.N,
        }[slot.kind]
    if not all(value > 0.0 for value in values.values()):
        return None
    return values, 0.7 * known.half_widths[-1]


def begin(
    judge: Judge, free: tuple[Slot, ...], ratio: float, pace: float
) -> tuple[dict[Slot, float], float] | None:
    """Start down the chain: p_{i+1} a share of step i's load, phi_i(p_i) above F_i*.

    None where a bound is not finite there.
    """
    problem, kinds, units = judge.problem, set(free), per_rate(judge.problem)
    values: dict[Slot, float] = {}
    shapes: list[Shape] = []
    widths: list[float] = [problem.accuracy]
    for step, gains in enumerate(problem.gains):
        trial = Shape(k=1.0, M=0.0, epsilon=1.0, c=0.0, N=gains.N)
        try:
            load, eta = _load(judge, (*shapes, trial), tuple(widths))
        except (EnvelopeError, OverflowError, ZeroDivisionError):
            return None
        if not math.isfinite(load):
            return None
        ahead = 0.0
        if step + 1 < problem.order:
            slot = Slot(kind=Kind.WIDTH, step=step + 1)
            fixed = problem.half_widths[step + 1]
            noise = problem.conditions.delta[step + 1] + 2.0 * load / widths[-1] * eta
            least = units[step] * max(1e-3 * widths[-1], pace * problem.center.rate[step])
            wide = max(ratio * load, 3.0 * noise, least)
            widths.append(wide if fixed is None else fixed)
            if slot in kinds:
                values[slot] = wide
            ahead = widths[-1] + problem.center.feed[step]
        level = 1.3 * (load + ahead) + 1e-3 * widths[step] * units[step]
        shapes.append(Shape(k=level / widths[step], M=0.0, epsilon=1.0, c=0.0, N=gains.N))
        for kind in (Kind.LINEAR, Kind.TANH, Kind.POWER, Kind.HEIGHT):
            if Slot(kind=kind, step=step) in kinds:
                values[Slot(kind=kind, step=step)] = level
        if Slot(kind=Kind.BEND, step=step) in kinds:
            values[Slot(kind=Kind.BEND, step=step)] = 0.7
    return values, 0.7 * widths[-1]


def _load(
    judge: Judge, shapes: tuple[Shape, ...], widths: tuple[float, ...]
) -> tuple[float, float]:
    """D_i / g_{m,i} and eta_i of the last step of a shortened chain."""
    problem, count = judge.problem, len(shapes)
    center = replace(
        problem.center,
        r_lower=problem.center.r_lower[:count],
        r_upper=problem.center.r_upper[:count],
        feed=problem.center.feed[:count],
    )
    conditions = replace(problem.conditions, delta=problem.conditions.delta[:count])
    start = chain_input(
        tuple(shape.generic for shape in shapes), widths, center, conditions, judge.numbers
    )
    bounds = evaluate_chain(start, judge.residual, judge.numbers, problem.theorem.rules)
    if bounds.g_min[-1] <= 0.0:
        return math.inf, math.inf
    return bounds.D[-1] / bounds.g_min[-1], bounds.eta[-1]
