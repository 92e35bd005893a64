"""The road of `bounds: tight`: search, claims, proof, and wider claims where that was too thin."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bfppc_synth.bounds.funnel import require_signals
from bfppc_synth.bounds.tight.bounds import tight_search
from bfppc_synth.errors import EnvelopeError, Mistake, PlantFileError
from bfppc_synth.gains.diagnose import no_design
from bfppc_synth.gains.evaluation import Evaluation, Judge
from bfppc_synth.gains.problem import Weights, is_free
from bfppc_synth.gains.search import search
from bfppc_synth.gains.tight import repaired, search_tight
from bfppc_synth.gains.tight_repair import Candidate, Widening
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.tight import Termwise, TightBounds
from bfppc_synth.synthesis.proof import proved

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from bfppc_synth.bounds.tight.bounds import TightSearch
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.bounds import SignalBounds
    from bfppc_synth.model.certificate import Certificate

# A claim that the checker leaves undecided grows by these factors, in turn.
_WIDER = (1.002, 1.01, 1.05, math.inf)
_ATTEMPTS = 8
# Weights of the slope beside the peak input; the second buys up to 1 % of it for a steeper law.
_SIDE, _SMALLER_SIDE, _STEEPER = 0.01, 1e-3, 1.01
# What the limit keeps for the checker's wider enclosures.
_LEFT = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Tightened:
    """A design by tight bounds, what termwise bounds say beside it, and the proof."""

    problem: DesignProblem
    evaluation: Evaluation
    termwise: Termwise
    certificate: Certificate


def synthesize_tight(
    problem: DesignProblem,
    signals: SignalBounds,
    margins: tuple[float, ...],
    progress: Callable[[str], None],
) -> Tightened:
    """Find gains by tight bounds and prove them; writes nothing.

    Parameters
    ----------
    problem : DesignProblem
        Of method unified, either center.
    signals : SignalBounds
        The reference, for center performance.
    margins : tuple[float, ...]
        Relative room of the inequalities, one after the other where the checker wants more.
    progress : callable
        Receives one sentence per stage.

    Returns
    -------
    Tightened
        With its certificate, whatever it says.

    Raises
    ------
    NoDesignError
        No gains were found, or none within the actuator limit.
    PlantFileError
        The center has no enclosure over cells of time and starts.

    References
    ----------
    docs/theory.md section 9.
    """
    finder, free = finder_of(problem, signals), is_free(problem)
    plain = search(problem, progress)
    try:
        found = search_tight(problem, finder, plain if free else None, progress)
        least = None
        if found is None and problem.limit is not None:
            cheap = _unlimited(problem, finder, progress, _SIDE)
            least = None if cheap is None else cheap.evaluation
            found = None if least is None else search_tight(problem, finder, least, progress)
            if found is None and least is not None:
                found = _squeezed(problem, finder, least, progress)
    except EnvelopeError as error:
        raise _not_enclosed(problem, error) from error
    if found is None:
        raise no_design(problem, free=free, least=least)
    alone = plain is not None and Judge(problem).accepts(plain)
    peak = plain.bounds.U if plain is not None and alone else None
    widening, best = Widening.none(problem.order), found
    left = list(margins[1:])
    for attempt in range(1, _ATTEMPTS + 1):
        progress("proving")
        certificate = proved(problem, best.evaluation)
        require_signals(problem.plant, certificate.failures)
        if certificate.verdict is Verdict.CERTIFIED:
            break
        if any(not entry.holds for entry in certificate.assumption_checks):
            break
        wider = _widened(widening, best, problem, certificate)
        # What is returned is what was proved last.
        if attempt == _ATTEMPTS or (wider is None and (not left or not free)):
            break
        if wider is None:
            problem = replace(problem, margin=left.pop(0))
            progress("a margin was too thin: rounding again")
        else:
            widening = wider
            progress("a tight claim was too thin: widening it")
        again = repaired(problem, finder, best, widening)
        if again is None:
            break
        best = again
    return Tightened(
        problem=problem,
        evaluation=best.evaluation,
        termwise=replace(best.termwise, U=peak),
        certificate=certificate,
    )


def _unlimited(
    problem: DesignProblem, finder: TightSearch, progress: Callable[[str], None], side: float
) -> Candidate | None:
    """Search the least peak input without the limit: a start within it, or what to tell."""
    free = replace(problem, limit=None, weights=Weights(peak_input=1.0, slope=side))
    return search_tight(free, finder, search(free, progress), progress)


def _squeezed(
    problem: DesignProblem,
    finder: TightSearch,
    least: Evaluation,
    progress: Callable[[str], None],
) -> Candidate | None:
    """Search a steeper law where the limit is hardly below the least peak input."""
    limit = problem.limit
    if limit is None or _STEEPER * limit < least.bounds.U:
        return None
    found = _unlimited(problem, finder, progress, _SMALLER_SIDE)
    keeps = found is not None and limit >= found.evaluation.bounds.U * (1.0 + _LEFT)
    return found if keeps else None


def finder_of(problem: DesignProblem, signals: SignalBounds) -> TightSearch:
    """Prepare the search for the suprema of a problem's residual."""
    model = None if problem.nominal is None else problem.nominal.model
    return tight_search(problem.plant, signals, problem.center, model)


def restored_tight(
    document: Mapping[str, Any],
) -> tuple[TightBounds | None, Termwise | None]:
    """Read tight bounds, and the termwise ones beside them, back from report.json."""
    if "tight" not in document:
        return None, None
    entry = document["tight"]
    tight = TightBounds(load=tuple(map(float, entry["load"])), rate=float(entry["rate"]))
    loads = (math.inf if load is None else float(load) for load in entry["termwise_load"])
    rate, peak = entry["termwise_rate"], entry["termwise_U"]
    return tight, Termwise(
        load=tuple(loads), rate=math.inf if rate is None else float(rate), U=peak
    )


def _widened(
    widening: Widening, best: Candidate, problem: DesignProblem, certificate: Certificate
) -> Widening | None:
    """Take the next factor for each tight claim that is not proved; None where all are."""
    states, feed = problem.plant.spec.states, problem.center.feed
    open_ids = {entry.id for entry in certificate.inequalities if not entry.holds}
    tight = best.evaluation.tight
    loads, rate, changed = list(widening.load), widening.rate, False
    for index, state in enumerate(states):
        if f"tight[{state}]" in open_ids and tight is not None and loads[index] < math.inf:
            loads[index] = _following(loads[index], tight.load[index], best.termwise.load[index])
            changed = True
    if f"tight.rate[{states[-1]}]" in open_ids and tight is not None and rate < math.inf:
        rate, changed = _following(rate, tight.rate, best.termwise.rate), True
    if not changed:
        return None
    return Widening(load=tuple(loads), rate=rate, excess=_excess(best, states, feed, certificate))


def _following(factor: float, claim: float, termwise: float) -> float:
    """Return the next factor; what is at the termwise bound already has no other."""
    if claim >= termwise:
        return math.inf
    return next(wider for wider in _WIDER if wider > factor)


def _excess(
    best: Candidate, states: tuple[str, ...], feed: tuple[float, ...], certificate: Certificate
) -> tuple[float, ...]:
    """Divide the checker's termwise loads by those of the search; nothing where it has none."""
    enclosures = json.loads(certificate.document or "{}").get("enclosures", {})
    found = []
    for index, state in enumerate(states):
        ends = [enclosures.get(f"{name}[{state}]") for name in ("D", "g_min")]
        if None in ends:
            return ()
        most, least = float.fromhex(ends[0][1]), float.fromhex(ends[1][0])
        ahead = feed[index] if index + 1 < len(states) else 0.0
        own = best.termwise.load[index]
        if least <= 0.0 or not 0.0 < own < math.inf:
            return ()
        found.append(max(1.0, (most / least + ahead) / own))
    return tuple(found)


def _not_enclosed(problem: DesignProblem, error: EnvelopeError) -> PlantFileError:
    spec, path = problem.plant.spec, "synthesis.bounds"
    place = spec.place(path)
    mistake = Mistake(
        path=path,
        line=place.line,
        column=place.column,
        length=1,
        message=f"tight bounds find no enclosure of the center: {error}",
        fix="narrow initial, or use `bounds: termwise`",
    )
    return PlantFileError(spec.path, spec.source, (mistake,))
