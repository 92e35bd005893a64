"""Which T_s of center nominal a funnel leaves to the search."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.bounds.funnel import keeps_funnel, longest_transition
from bfppc_synth.bounds.nominal.funnel import transition_room
from bfppc_synth.errors import NoDesignError
from bfppc_synth.expressions.evaluate import evaluate_float

if TYPE_CHECKING:
    from bfppc_synth.model.plant import Plant

_OCTAVES = 24


def longest_kept(plant: Plant, most: float) -> float:
    """Search the longest T_s, up to ``most``, whose transition stays in the funnel.

    Parameters
    ----------
    plant : Plant
        Its funnel admits the starts; without a funnel every T_s will do.
    most : float
        What the search of T_s begins with [s].

    Returns
    -------
    float
        T_s [s].

    Raises
    ------
    NoDesignError
        If no T_s down to 1e-7 of ``most`` keeps the funnel: with the nearest miss.

    References
    ----------
    docs/theory.md section 4, "A funnel may be asked for".
    """
    funnel, accuracy = plant.funnel, plant.spec.performance.accuracy
    if funnel is None or accuracy is None or keeps_funnel(plant, most):
        return most
    longest = longest_transition(plant, most)
    if longest is not None:
        return longest
    needed = accuracy.approximate
    tried = [most * 0.5**k for k in range(_OCTAVES)]
    rooms = [(transition_room(plant, at, needed), at) for at in tried]
    room, at = max(rooms, key=lambda pair: pair[0].lower)
    # Over so short a time no input would do: what a transition of usual length lacks counts too.
    usual, length = max(rooms[:9], key=lambda pair: pair[0].lower)
    height = evaluate_float(funnel, {plant.time: room.when})
    raise NoDesignError(
        f"no certified design for {plant.spec.path}: no transition from {tried[-1]:.2g} to"
        f" {most:g} s stays in performance.funnel\n"
        f"  the nearest miss: with T_s = {at:.3g} s, |b(t)| + accuracy is"
        f" {height - room.reached + needed:.7g} at t = {room.when:.3g} s, and the funnel"
        f" {height:.7g}\n"
        f"  would suffice (any one): a funnel higher by {1.01 * (needed - usual.lower):.3g}"
        f" (T_s = {length:.3g} s) | starts that move towards the reference"
    )
