"""What an objective has chosen and how good that is, in report.json and on the page."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.model.spec import Objective
from bfppc_synth.report.numbers import finite

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design

_SENTENCES = {
    Objective.ACCURACY: "The accuracy #chosen/value# is the smallest that was found within"
    " `actuator.limit`; the plant file leaves it to the objective.",
    Objective.PERIOD: "The sample period #chosen/value# s is the largest that was found; the plant"
    " file leaves it to the objective.",
    Objective.RESOLUTION: "The quantizers are #chosen/value# times as coarse as the plant file"
    " writes them, the largest such factor that was found: its steps are proportions.",
}


def choice_entry(design: Design) -> dict[str, object]:
    """Lay out the value that an inverse objective has set: an empty table for other objectives.

    What is certified is the design with this value; that there is no better one is an estimate.
    """
    chosen = design.spec.chosen
    if chosen is None:
        return {}
    return {"chosen": {"objective": str(chosen.objective), "value": finite(chosen.value)}}


def choice_sentences(design: Design) -> tuple[str, ...]:
    """Say which number of the page is no requirement but an answer."""
    chosen = design.spec.chosen
    return () if chosen is None else (_SENTENCES[chosen.objective],)


def optimality_entry(design: Design) -> dict[str, object]:
    """Lay out what the search knows of its optimum: estimates, an empty table for none.

    ``kind`` is "geometric program" where a local optimum is global, with the ``gap`` that its
    dual bound leaves; else "multi-start". Gap and spread are shares of the cost.
    """
    known = design.optimality
    if known is None:
        return {}
    return {
        "optimality": {
            "kind": "multi-start" if known.gap is None else "geometric program",
            "gap": None if known.gap is None else finite(known.gap),
            "gap_without_margins": None
            if known.gap_without_margins is None
            else finite(known.gap_without_margins),
            "spread": finite(known.spread),
            "starts": known.starts,
        }
    }


def optimality_sentences(design: Design) -> tuple[str, ...]:
    """Say whether the optimum is the only one, and otherwise how far the starts agree."""
    known = design.optimality
    if known is None:
        return ()
    if known.gap is not None:
        sentence = (
            "Among laws with these terms the search is a geometric program: its optimum is global."
            " By the dual bound no such law that keeps the margins of the search costs less than"
            " this one by more than a share of #optimality/gap#, and none at all by more than"
            " #optimality/gap_without_margins# (estimates, the rounding of the gains included)."
        )
    else:
        sentence = (
            "Nothing says that the optimum is global: #optimality/starts# starts of the search led"
            " to a design, and their costs differ by a share of #optimality/spread# (an estimate)."
        )
    return (sentence,)
