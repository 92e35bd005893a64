"""Why the search found nothing: which inequality presses, and what its terms are.

Cheap and an estimate: what would suffice instead is the business of the room ``reasons``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from bfppc_synth.errors import BfppcError, NoDesignError, NotCertifiedError
from bfppc_synth.gains.elastic import judged, nearest_miss
from bfppc_synth.gains.problem import DesignProblem, FixedGains, Weights
from bfppc_synth.gains.search import search
from bfppc_synth.gains.solve import LIMIT
from bfppc_synth.gains.terms import explained

if TYPE_CHECKING:
    from bfppc_synth.gains.elastic import Miss
    from bfppc_synth.gains.evaluation import Evaluation

# What takes less than this share of a sum does not drive it.
_WORTH_NAMING = 0.1
_MOST_DRIVERS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Driver:
    """A term and its share of a whole; ``because`` says where it comes from, or is empty."""

    term: str
    whole: str
    share: float
    because: str = ""

    def sentence(self) -> str:
        """Say it."""
        because = f" ({self.because})" if self.because else ""
        if self.share > 1.0:
            return f"{self.term} is {self.share:.3g} times {self.whole}{because}"
        return f"{self.term} takes {self.share:.0%} of {self.whole}{because}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """What is wrong, in a sentence; the inequalities that press, with shares; their terms.

    ``least_input`` is the least peak input [unit of u] where only the limit is in the way;
    ``log_factor`` by which factor (its log) the nearest gains miss, None if no start kept the
    bounds finite.
    """

    headline: str
    pressing: tuple[tuple[str, float], ...] = ()
    drivers: tuple[Driver, ...] = ()
    log_factor: float | None = None
    least_input: float | None = None

    def sentence(self) -> str:
        """Say what is wrong and what drives it."""
        lines = [self.headline]
        if self.pressing:
            named = ", ".join(f"{name} ({share:.0%})" for name, share in self.pressing)
            lines.append(f"  what binds: {named}")
        if self.drivers:
            named = "; ".join(driver.sentence() for driver in self.drivers)
            lines.append(f"  what drives it: {named}")
        return "\n".join(lines)


class NoGainsError(NoDesignError):
    """The search found nothing; what would suffice can still be looked for.

    ``problem`` is None with a method that has another one than DesignProblem.
    """

    def __init__(self, problem: DesignProblem | None, diagnosis: Diagnosis) -> None:
        self.problem = problem
        self.diagnosis = diagnosis
        super().__init__(diagnosis.sentence())


def no_design(problem: DesignProblem, *, free: bool, least: Evaluation | None = None) -> BfppcError:
    """Say why the search found nothing.

    Parameters
    ----------
    problem : DesignProblem
        The problem without a solution.
    free : bool
        Whether anything was left to the search.
    least : Evaluation, optional
        The least peak input without the limit, where other bounds than termwise know it.

    Returns
    -------
    BfppcError
        NoGainsError (exit 3) where something was free, else NotCertifiedError (exit 4).
    """
    if not free:
        return NotCertifiedError(
            f"no certified design for {problem.plant.spec.path}: with these gains a bound breaks"
            " down on the reachable box (a pole, another domain error, or no positive g_m)"
        )
    return NoGainsError(problem, diagnose(problem, least))


def diagnose(problem: DesignProblem, least: Evaluation | None = None) -> Diagnosis:
    """Find what presses: the limit alone, what the file fixes, or the inequalities themselves.

    Parameters
    ----------
    problem : DesignProblem
        The problem without a solution.
    least : Evaluation, optional
        The least peak input without the limit, where it is known.

    References
    ----------
    docs/theory.md section 5, the elastic problem.
    """
    start = f"no certified design for {problem.plant.spec.path}:"
    miss = nearest_miss(problem)
    if problem.limit is not None:
        unlimited = replace(problem, limit=None)
        least = least or _least_input(unlimited)
        if least is not None:
            said = (
                f"{start} the least peak input found is {least.bounds.U:.4g}, above"
                f" actuator.limit {problem.limit:.6g}"
            )
            return Diagnosis(
                headline=said,
                pressing=_pressing(problem, miss),
                drivers=_drivers(problem, least, problem.order - 1),
                log_factor=math.log(least.bounds.U / problem.limit),
                least_input=least.bounds.U,
            )
        problem, miss = unlimited, nearest_miss(unlimited)
    if released(problem) != problem:
        found = _least_input(released(problem))
        if found is not None:
            start += (
                " the gains or p that synthesis fixes leave none; without them there is one (peak"
                f" input {found.bounds.U:.3g}):"
            )
    if miss is None:
        return Diagnosis(
            headline=f"{start} wherever the search starts, a bound breaks down on the reachable"
            " box (a pole, another domain error, no positive g_m, or an overflow)",
        )
    pressing = _pressing(problem, miss)
    worst = pressing[0][0] if pressing else "an inequality"
    lacking = math.expm1(min(max(miss.log_factor, 0.0), 100.0))
    lack = (
        f"miss {worst} by {lacking:.2g} times"
        if lacking > 1.0
        else f"miss {worst} by {lacking:.1%}"
    )
    if miss.holds:
        lack = f"have too little room in {worst} to be rounded"
    nearest = judged(problem, miss)
    states = problem.plant.spec.states
    step = next((i for i, state in enumerate(states) if worst.endswith(f"[{state}]")), 0)
    drivers = () if nearest is None else _drivers(problem, nearest, step)
    return Diagnosis(
        headline=f"{start} no gains were found, the nearest ones {lack}",
        pressing=pressing,
        drivers=drivers,
        log_factor=miss.log_factor,
    )


def released(problem: DesignProblem) -> DesignProblem:
    """Free every gain and half-width; the powers N stay."""
    free = tuple(
        FixedGains(k=None, M=None, epsilon=None, c=None, N=gains.N) for gains in problem.gains
    )
    return replace(problem, gains=free, half_widths=(None,) * problem.order)


def _least_input(problem: DesignProblem) -> Evaluation | None:
    miss = nearest_miss(problem)
    if miss is None or not miss.holds:
        return None
    weights = Weights(peak_input=1.0, slope=0.01)
    return search(replace(problem, weights=weights), lambda _message: None)


def _pressing(problem: DesignProblem, miss: Miss | None) -> tuple[tuple[str, float], ...]:
    """Name what presses, the hardest first; the parts of one inequality count together."""
    if miss is None:
        return ()
    states = problem.plant.spec.states
    shares: dict[str, float] = {}
    for (name, step), pressure in miss.pressures:
        limited = name == LIMIT
        label = "actuator.limit" if limited else f"{name.split('.')[0]}[{states[step]}]"
        shares[label] = shares.get(label, 0.0) + pressure
    total = sum(shares.values())
    if not 0.0 < total < math.inf:
        return ()
    ordered = sorted(shares.items(), key=lambda pair: -pair[1])
    return tuple((name, value / total) for name, value in ordered if value / total > _WORTH_NAMING)


def _drivers(problem: DesignProblem, found: Evaluation, step: int) -> tuple[Driver, ...]:
    """Name the largest terms of F_i* and, at the last step, what takes the tube."""
    bounds, widths = found.bounds, found.half_widths
    out: list[Driver] = []
    if step == problem.order - 1 and widths[-1] > 0.0:
        tube = f"p_{step + 1}, the tube of {problem.plant.spec.states[step]}"
        measured = Driver(term="measurement (eta)", whole=tube, share=bounds.eta[-1] / widths[-1])
        held = Driver(
            term="timing ((h + tau) V)",
            whole=tube,
            share=problem.conditions.hold * bounds.V / widths[-1],
        )
        out += [part for part in (held, measured) if part.share > _WORTH_NAMING]
    for term, share in explained(problem, found, step):
        if share > _WORTH_NAMING:
            because = _because(term, found)
            whole = f"F_{step + 1}*"
            out.append(Driver(term=term, whole=whole, share=share, because=because))
    out.sort(key=lambda driver: -driver.share)
    return tuple(out[:_MOST_DRIVERS])


def _because(term: str, found: Evaluation) -> str:
    if not term.startswith("|d alpha_"):
        return ""
    i = int(term.removeprefix("|d alpha_").removesuffix("|"))
    origin = "accuracy" if i == 1 else f"p_{i}"
    slope, width = found.bounds.L[i - 1], found.half_widths[i - 1]
    return f"slope of phi_{i} = {slope:.3g}, from {origin} {width:.3g}"
