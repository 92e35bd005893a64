"""What an inverse objective has chosen, in report.json and on the page."""

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
