"""What method theorem3 asks of its stages, where no bound has to be computed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.expressions.resolution import upper_bound
from bfppc_synth.model.spec import Method

if TYPE_CHECKING:
    from bfppc_synth.model.spec import GainSpec, SynthesisSpec
    from bfppc_synth.spec.notebook import Notebook

_PATH = "synthesis.stages"


def check_stages(book: Notebook, states: tuple[str, ...], synthesis: SynthesisSpec) -> None:
    """Note what is missing of the free stages: every one of their numbers is the file's."""
    if synthesis.method is not Method.THEOREM3:
        return
    if not synthesis.stages:
        where = _PATH if book.has(_PATH) else "synthesis.method"
        book.blame_path(
            where,
            "theorem3 switches from free stages to a certified one, and there is no free stage",
            "give at least one [{p: {..}, gains: {..}}], or use `method: unified`",
        )
    for number, stage in enumerate(synthesis.stages):
        for state, gain in zip(states, stage.gains, strict=True):
            path = f"{_PATH}.{number}.gains.{state}"
            if book.has(path):
                _check_gain(book, path, gain)


def _check_gain(book: Notebook, path: str, gain: GainSpec) -> None:
    terms = (gain.k, gain.M, gain.c)
    if not any(term is not None and upper_bound(term) > 0 for term in terms):
        book.blame_path(
            path, "k, M and c are all 0: this stage has no feedback here", "give one of them"
        )
    elif gain.M is not None and upper_bound(gain.M) > 0 and gain.epsilon is None:
        book.blame_path(
            path,
            f"M is {gain.M.text} and there is no epsilon: tanh(M e / epsilon) has no scale",
            "add `epsilon:`, or leave M out",
        )


def unused_stages(book: Notebook, synthesis: SynthesisSpec) -> tuple[str, ...]:
    """Name the keys of theorem3 that another method reads but does not use."""
    if synthesis.method is Method.THEOREM3:
        return ()
    return tuple(
        f"synthesis.{key} is not used with method {synthesis.method}"
        for key in ("stages", "handover")
        if book.has(f"synthesis.{key}")
    )
