"""What an objective asks of the rest of the file, and what it makes of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from bfppc_synth.model.spec import Form, Method, Objective, QuantizerKind
from bfppc_synth.spec import build

if TYPE_CHECKING:
    from bfppc_synth.model.spec import SynthesisSpec
    from bfppc_synth.spec.notebook import Notebook

INVERSE: Final = (Objective.ACCURACY, Objective.PERIOD, Objective.RESOLUTION)
"""Objectives that set a requirement of the file instead of weighing designs for all of them."""

_PATH: Final = "synthesis.objective"


def sought(synthesis: SynthesisSpec) -> Objective | None:
    """Return the requirement that the objective leaves to the search, if it is an inverse one."""
    return next((word for word, _ in synthesis.objective if word in INVERSE), None)


def check_objective(book: Notebook, states: tuple[str, ...], synthesis: SynthesisSpec) -> None:
    """Note weights that say nothing, and an inverse objective without what it needs."""
    _check_weights(book, synthesis)
    words = [word for word, _ in synthesis.objective if word in INVERSE]
    weightless = book.has(f"{_PATH}.{Objective.ACCURACY}") and Objective.ACCURACY not in words
    if weightless and book.has("performance") and not book.has("performance.accuracy"):
        book.blame_path(
            "performance",
            "the key accuracy is missing: its weight is 0, so it is not searched for",
            "add `accuracy:`, p_1, or give it a weight",
        )
    if not words:
        return
    word = words[0]
    path = f"{_PATH}.{word}" if book.has(f"{_PATH}.{word}") else _PATH
    if len(words) > 1:
        book.blame_path(
            f"{_PATH}.{words[1]}",
            f"{word} and {words[1]}: one requirement can be searched for, given all others",
            f"keep one of them, and give the other a value ({_value_of(words[1])})",
        )
    if synthesis.form is Form.PRINTED:
        book.blame_path(
            path,
            f"objective {word} ends in a certified design, and form printed is never certified",
            "use `form: sound`, or objective balanced",
        )
    if word is Objective.ACCURACY and not book.has("actuator.limit"):
        book.blame_path(
            path,
            "there is no smallest accuracy without actuator.limit: a larger input always buys a"
            " smaller one",
            "add `actuator: {limit: ..}`, the largest |u|",
        )
    if word is Objective.PERIOD and synthesis.method in (Method.THEOREM1, Method.THEOREM2):
        book.blame_path(
            path,
            f"{synthesis.method} is proved for continuous measurement: there is no period to find",
            "use `method: unified`",
        )
    quantizers = build.build_measurement(book, states).quantizers
    if word is Objective.RESOLUTION and all(q.kind is QuantizerKind.NONE for q in quantizers):
        book.blame_path(
            path,
            "no state has a quantizer: there is no step to find a factor for",
            "add `measurement: {quantizer: {kind: uniform, step: ..}}`",
        )


def _value_of(word: Objective) -> str:
    return {
        Objective.ACCURACY: "performance.accuracy",
        Objective.PERIOD: "sampling.period",
    }.get(word, "measurement.quantizer")


def _check_weights(book: Notebook, synthesis: SynthesisSpec) -> None:
    if not book.is_mapping(_PATH):
        return
    if book.has(f"{_PATH}.{Objective.BALANCED}"):
        book.blame_path(
            f"{_PATH}.{Objective.BALANCED}",
            "balanced is itself a pair of weights",
            "write peak-input: 1 and slope: 1",
        )
    elif not synthesis.objective:
        book.blame_path(_PATH, "no weight is above 0", "give peak-input or slope a weight")


def objective_notes(book: Notebook, synthesis: SynthesisSpec) -> tuple[str, ...]:
    """Say what a number of the file means where the objective searches for another one."""
    word = sought(synthesis)
    if word is Objective.ACCURACY and book.has("performance.accuracy"):
        return ("performance.accuracy is an upper limit with objective accuracy",)
    if word is Objective.PERIOD and book.has("sampling.period"):
        return ("sampling.period is a lower limit with objective period",)
    if word is Objective.RESOLUTION:
        return ("measurement.quantizer gives proportions with objective resolution",)
    return ()
