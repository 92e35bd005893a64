"""The answer in the user's words, and as the object of ``--json``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.errors import NoDesignError

if TYPE_CHECKING:
    from bfppc_synth.gains.diagnose import Diagnosis
    from bfppc_synth.reasons.suggestions import Suggestion


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """Everything that was found out about a plant file without a design.

    ``suggestions`` each suffice alone, the least change first; ``useless`` do not help alone;
    ``untried`` were left out for time; ``common`` relaxes everything at once.
    """

    diagnosis: Diagnosis
    suggestions: tuple[Suggestion, ...]
    useless: tuple[str, ...]
    untried: tuple[str, ...]
    common: Suggestion | None


def refusal(answer: Answer) -> NoDesignError:
    """Say why there is no design and what to change, the least change first."""
    lines = [answer.diagnosis.sentence()]
    ways = answer.suggestions
    if ways:
        named = " | ".join(f"{way.written} (U = {way.U:.4g})" for way in ways)
        lines.append(f"  would suffice (any one, certified): {named}")
    if answer.useless:
        lines.append(f"  no value helps alone: {', '.join(answer.useless)}")
    if answer.untried:
        lines.append(f"  not tried, for lack of time: {', '.join(answer.untried)}")
    if ways:
        best = ways[0]
        lines.append(f"  fix: {best.written}{_instead(best)}, the least change of these")
    elif answer.common is not None:
        together = answer.common
        lines.append(f"  would suffice together (certified, U = {together.U:.4g})")
        lines.append(f"  fix: {together.written}")
    else:
        lines.append(
            "  fix: a smaller initial set, a slower performance function, or tighter bounds on the"
            " plant, together with a larger accuracy"
        )
    return NoDesignError("\n".join(lines), details=_details(answer))


def _instead(way: Suggestion) -> str:
    return f" instead of {way.given}" if len(way.given) <= 24 else ""


def _details(answer: Answer) -> dict[str, object]:
    diagnosis = answer.diagnosis
    factor = diagnosis.log_factor
    requirement = answer.suggestions[0].path if answer.suggestions else None
    if diagnosis.least_input is not None:
        requirement = "actuator.limit"
    inequality = diagnosis.pressing[0][0] if diagnosis.pressing else None
    return {
        "binding": {
            "requirement": requirement,
            "inequality": inequality,
            "log_factor": factor if factor is not None and math.isfinite(factor) else None,
            "pressing": [{"id": name, "share": share} for name, share in diagnosis.pressing],
        },
        "drivers": [
            {"term": one.term, "of": one.whole, "share": one.share, "because": one.because}
            for one in diagnosis.drivers
        ],
        "suggestions": [way.document() for way in answer.suggestions],
        "together": None if answer.common is None else answer.common.document(),
        "no_help": list(answer.useless),
        "untried": list(answer.untried),
    }
