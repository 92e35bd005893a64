"""The funnel of a plant file against the file's own numbers (SPEC section 1).

A funnel that the starts, the accuracy and rho (or T_s) contradict is a mistake of the file: it
is refused at ``performance.funnel`` before any search.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.bounds.admission import refused, require_reference
from bfppc_synth.bounds.latch import offset_range, resolutions
from bfppc_synth.bounds.nominal.funnel import Room, transition_room
from bfppc_synth.bounds.performance import rho_end, rho_expression
from bfppc_synth.bounds.rounding import above
from bfppc_synth.bounds.signal_range import range_from, range_on
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import evaluate_float
from bfppc_synth.model.spec import Anchor, CenterKind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.errors import PlantFileError
    from bfppc_synth.model.plant import Plant

PATH = "performance.funnel"
# What the file writes as equal is equal: the checker allows one unit in the last place.
EQUAL = 1e-12
_UNBOUNDED_FIX = (
    "write a funnel that settles: constants, exp(-a*t), fractions in t that have a limit, Max and"
    " Min of these"
)
_TIMES = (*(k / 64 for k in range(1281)), *(20.0 * 1.02**k for k in range(1, 550)))


def require_funnel(plant: Plant) -> None:
    """Refuse a funnel that center performance's own numbers contradict.

    The output stays within rho_1 (a_0 + delta_0) + p_1 of y_d, whatever the gains are.

    Parameters
    ----------
    plant : Plant
        With an accuracy; without a funnel nothing is asked.

    Raises
    ------
    PlantFileError
        With both numbers, the time, and a funnel that would do.

    References
    ----------
    SPEC section 1; docs/theory.md sections 2 and 3.
    """
    if plant.funnel is None:
        return
    _require_width(plant)
    time, rho, most = plant.time, plant.spec.performance.rho[0], largest_offset(plant)
    joint = plant.funnel - sp.Rational(most) * rho_expression(rho, time)
    end = rho_end(rho)
    try:
        if math.isinf(end):
            lower = range_from(joint, time, 0.0, {})[0]
        else:
            lower = range_on(joint, time, (0.0, end), {})[0]
    except EnvelopeError as error:
        raise _without_bound(plant, error) from error
    reached, when = _least(joint, time, [t for t in _TIMES if t <= end])
    needed = _accuracy(plant)
    if reached >= needed - EQUAL * (most + needed):
        # What no sample shows the checker decides.
        return
    promised = _value(plant, when) - reached + needed
    what = (
        f"rho_1 (a_0 + delta_0) + accuracy, which is {promised:.6g} there (a_0 + delta_0 ="
        f" {most:.6g})"
    )
    raise _too_narrow(
        plant, Room(lower=lower, reached=reached, when=when), what, "choose a faster rho"
    )


def require_nominal_funnel(plant: Plant, transition: float | None) -> None:
    """Refuse a funnel that center nominal's start, accuracy and, where given, T_s contradict.

    Parameters
    ----------
    plant : Plant
        With an accuracy; without a funnel nothing is asked.
    transition : float, optional
        T_s [s] of the file. Where it is free, only what no T_s could mend is refused.

    Raises
    ------
    PlantFileError
        With both numbers, the time, and a funnel or T_s that would do.

    References
    ----------
    docs/theory.md section 4, "A funnel may be asked for".
    """
    if plant.funnel is None:
        return
    _require_width(plant)
    needed, most = _accuracy(plant), largest_offset(plant)
    first = _value(plant, 0.0) - most
    if first < needed - EQUAL * (most + needed):
        what = (
            f"|b(0)| + accuracy = {most + needed:.6g}: so far may the start be from the reference"
        )
        room = Room(lower=first, reached=first, when=0.0)
        raise _too_narrow(plant, room, what, "narrow initial")
    if transition is None:
        return
    room = transition_room(plant, transition, needed)
    if room.reached >= needed - EQUAL * (most + needed):
        return
    promised = _value(plant, room.when) - room.reached + needed
    what = f"|b(t)| + accuracy, which is {promised:.6g} there with T_s = {transition:g} s"
    kept = longest_transition(plant, transition)
    raise _too_narrow(plant, room, what, "" if kept is None else f"`transition: {kept:g}`")


def keeps_funnel(plant: Plant, transition: float) -> bool:
    """Whether the transition of this T_s [s] is known to stay in the funnel."""
    needed = _accuracy(plant)
    size = needed + largest_offset(plant)
    return transition_room(plant, transition, needed).lower >= needed - EQUAL * size


def longest_transition(plant: Plant, most: float) -> float | None:
    """Search a T_s [s] below ``most`` that keeps the funnel, long rather than short.

    Returns
    -------
    float or None
        Three digits, rounded down; None where none of 24 octaves below ``most`` keeps it.
    """
    found = most
    for _ in range(24):
        found *= 0.5
        if keeps_funnel(plant, found):
            break
    else:
        return None
    low, high = found, 2.0 * found
    for _ in range(9):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if keeps_funnel(plant, middle) else (low, middle)
    rounded = float(_digits(low, -1))
    return rounded if keeps_funnel(plant, rounded) else found


def largest_offset(plant: Plant) -> float:
    """a_0 + delta_0: the largest |x_1(0) - y_d(0)| that may be measured [unit of y]."""
    lower, upper = offset_range(plant)
    latched = plant.spec.synthesis.anchor is Anchor.LATCHED
    wide = Fraction(0) if latched else resolutions(plant.spec)[0]
    return above(Fraction(max(-lower, upper)) + wide)


def require_signals(plant: Plant, failures: tuple[str, ...]) -> None:
    """Refuse a reference or a funnel that the bounds let pass and the checker does not.

    Where the search chooses what the funnel has to leave room for, it is no mistake of the file.

    Raises
    ------
    PlantFileError
        With the checker's own reason.
    """
    require_reference(plant, failures)
    synthesis = plant.spec.synthesis
    nominal = synthesis.center is CenterKind.NOMINAL
    if nominal and plant.spec.performance.transition is None:
        return
    for failure in failures:
        if failure.startswith(("funnel: ", "the funnel cannot be enclosed")):
            raise refused(plant, PATH, failure, "choose a wider or a simpler funnel")


def _accuracy(plant: Plant) -> float:
    accuracy = plant.spec.performance.accuracy
    if accuracy is None:
        raise LookupError("accuracy")
    return accuracy.approximate


def _require_width(plant: Plant) -> None:
    """Refuse a funnel that is narrower than the tube, which p_1 is, at any time."""
    funnel, time, needed = plant.funnel, plant.time, _accuracy(plant)
    if funnel is None:
        return
    try:
        range_from(funnel, time, 0.0, {})
    except EnvelopeError as error:
        raise _without_bound(plant, error) from error
    reached, when = _least(funnel, time, _TIMES)
    if reached >= needed * (1.0 - EQUAL):
        return
    lowered = ""
    if reached > above(resolutions(plant.spec)[0]):
        lowered = f", or choose an accuracy of at most {_digits(reached, -1)}"
    raise refused(
        plant,
        PATH,
        f"it is {reached:.6g} at t = {when:.6g} s, below the accuracy {needed:.6g}: the tube of"
        " the output does not fit into it",
        f"keep it at or above {needed:.6g}{lowered}",
    )


def _least(expression: sp.Expr, time: sp.Symbol, times: Sequence[float]) -> tuple[float, float]:
    """Sample an expression where it is low: (value, t)."""
    values = [(evaluate_float(expression, {time: t}), t) for t in times]
    best = min(values)
    at = times.index(best[1])
    near = times[max(at - 1, 0)], times[min(at + 1, len(times) - 1)]
    finer = [near[0] + (near[1] - near[0]) * k / 200 for k in range(201)]
    return min(best, *((evaluate_float(expression, {time: t}), t) for t in finer))


def _too_narrow(plant: Plant, room: Room, what: str, advice: str) -> PlantFileError:
    """Say what the funnel is, what it had to be, and by how much it is too low.

    ``room`` is what the funnel has beside r_1 - y_d.
    """
    needed = _accuracy(plant)
    funnel = _value(plant, room.when)
    worst = min(room.lower, room.reached)
    options = [f"raise it by {_digits(needed - worst, 1)}"]
    if worst > above(resolutions(plant.spec)[0]):
        options.append(f"choose an accuracy of at most {_digits(worst, -1)}")
    return refused(
        plant,
        PATH,
        f"it is {funnel:.6g} at t = {room.when:.6g} s, below {what}",
        ", or ".join([*options, advice] if advice else options),
    )


def _value(plant: Plant, time: float) -> float:
    if plant.funnel is None:
        raise LookupError("funnel")
    return evaluate_float(plant.funnel, {plant.time: time})


def _digits(value: float, side: int) -> str:
    """Round a positive number to three digits, up (side 1) or down (-1)."""
    step = Fraction(10) ** (math.floor(math.log10(value)) - 2)
    count = math.ceil(Fraction(value) / step) if side > 0 else math.floor(Fraction(value) / step)
    return f"{float(count * step):.3g}"


def _without_bound(plant: Plant, error: EnvelopeError) -> PlantFileError:
    return refused(plant, PATH, f"it has no bound for all t >= 0: {error}", _UNBOUNDED_FIX)
