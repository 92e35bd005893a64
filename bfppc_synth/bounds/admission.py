"""Refuse what no design could mend, at its place: bounds that break down, a reference."""

from __future__ import annotations

import itertools
from contextlib import suppress
from typing import TYPE_CHECKING

from bfppc_synth.bounds.derivative import NOT_ENCLOSED_FIX, derivative
from bfppc_synth.errors import EnvelopeError, Mistake, PlantFileError
from bfppc_synth.expressions.evaluate import evaluate_float
from bfppc_synth.expressions.partial import partial_parts
from bfppc_synth.expressions.symbolic import to_sympy
from bfppc_synth.majorants.envelope import compile_envelope, envelope
from bfppc_synth.majorants.targets import FloatArithmetic
from bfppc_synth.model.spec import CenterKind, ReferenceKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    import sympy as sp

    from bfppc_synth.model.bounds import CenterBounds, Majorants
    from bfppc_synth.model.expression import Expression
    from bfppc_synth.model.plant import Channel, Plant

    Box = dict[sp.Symbol, tuple[float, float]]

_TERM_FIX = "declare a bound without it"
# Where a declared bound of the reference is held against its value: 20 s closely, then wider.
_TIMES = (*(k / 64 for k in range(1281)), *(20.0 * 1.02**k for k in range(1, 300)))
# Where every part of a reference must be defined: as long as the controller runs [s].
_PIECES = tuple(itertools.pairwise((0.0, *(2.0**k for k in range(20)), 1e6)))


def admit(plant: Plant, majorants: Majorants, center: CenterBounds) -> None:
    """Evaluate every bound on the smallest reachable box.

    x_1 stays within p_1 of the center in every design; for i >= 2 only the center itself is
    taken, so nothing that some design could have is refused.

    Parameters
    ----------
    plant, majorants, center
        The plant, what bounds it, and the range of the center.

    Raises
    ------
    PlantFileError
        A pole, another domain error, no positive g_m, or a declared bound of the reference
        that its own value exceeds, with its place.

    References
    ----------
    docs/theory.md sections 1 and 6.
    """
    arithmetic = FloatArithmetic()
    accuracy = plant.spec.performance.accuracy
    reach = 0.0 if accuracy is None else accuracy.approximate
    base: Box = {
        symbol: (arithmetic.number(lower), arithmetic.number(upper))
        for symbol, (lower, upper) in zip(plant.parameters, plant.ranges, strict=True)
    }
    mistakes = [*_exceeded(plant), *_reference_parts(plant)]
    for i, (channel, bound) in enumerate(zip(plant.channels, majorants.channels, strict=True)):
        wide = reach if i == 0 else 0.0
        base[channel.state] = (center.r_lower[i] - wide, center.r_upper[i] + wide)
        root = f"dynamics.{channel.state.name}"
        broken = False
        for key, expression in _entries(channel):
            written: Expression | None = getattr(plant.spec.dynamics[i], key)
            try:
                envelope(expression, base, arithmetic)
                for part in _parts(plant, written):
                    envelope(part, base, arithmetic)
            except EnvelopeError as error:
                mistakes.append(_mistake(plant, f"{root}.{key}", str(error), error.fix))
                broken = True
        if not broken:
            mistakes.extend(_authority(plant, i, bound.g_min, base, arithmetic))
    if mistakes:
        raise PlantFileError(plant.spec.path, plant.spec.source, tuple(mistakes))


def misplaced_term(plant: Plant, error: EnvelopeError) -> PlantFileError:
    """Give the error of a term that has no rule its place among the dynamics.

    Parameters
    ----------
    plant : Plant
        The plant.
    error : EnvelopeError
        What the majorants raised.

    Returns
    -------
    PlantFileError
        At the first term that raises the same, else at the dynamics.
    """
    for channel in plant.channels:
        root = f"dynamics.{channel.state.name}"
        if error.subexpression == channel.state.name:
            return _refusal(plant, root, error)
        for key, expression in _entries(channel):
            try:
                compile_envelope(expression)
            except EnvelopeError as own:
                if str(own) == str(error):
                    return _refusal(plant, f"{root}.{key}", error)
    return _refusal(plant, "dynamics", error)


def refused_reference(plant: Plant, error: EnvelopeError) -> PlantFileError:
    """Give the error of a reference that has no enclosure its place."""
    return _refusal(plant, "reference", error)


def require_reference(plant: Plant, failures: tuple[str, ...]) -> None:
    """Refuse a reference that the bounds enclose and the certificate's checker does not.

    Raises
    ------
    PlantFileError
        At the reference, with the checker's own reason.
    """
    for failure in failures:
        if failure.startswith("the reference cannot be enclosed"):
            error = EnvelopeError(failure, subexpression="", fix=NOT_ENCLOSED_FIX)
            raise refused_reference(plant, error)


def refused(plant: Plant, path: str, message: str, fix: str) -> PlantFileError:
    """Give a mistake its place in the plant file."""
    mistake = _mistake(plant, path, message, fix)
    return PlantFileError(plant.spec.path, plant.spec.source, (mistake,))


def _refusal(plant: Plant, path: str, error: EnvelopeError) -> PlantFileError:
    fix = error.fix or (NOT_ENCLOSED_FIX if path == "reference" else _TERM_FIX)
    return refused(plant, path, str(error), fix)


def _entries(channel: Channel) -> tuple[tuple[str, sp.Expr], ...]:
    entries = (
        ("f_bound", channel.f_bound),
        ("f", channel.f),
        ("g_bound", channel.g_bound),
        ("g", channel.g),
        ("g_min", channel.g_min),
        ("disturbance", channel.disturbance),
    )
    return tuple((key, expression) for key, expression in entries if expression is not None)


def _parts(plant: Plant, written: Expression | None) -> Iterable[sp.Expr]:
    """Translate each part that may be undefined: sympy drops those that a 0 multiplies."""
    if written is None:
        return
    symbols = {symbol.name: symbol for symbol in (*plant.states, *plant.parameters, plant.time)}
    for part in partial_parts(written.tree):
        yield to_sympy(part, symbols)


def _reference_parts(plant: Plant) -> list[Mistake]:
    """Want each part of the reference defined while the controller runs."""
    reference = plant.spec.reference
    if plant.reference is None:
        return []
    path = "reference.value" if reference.kind is ReferenceKind.DECLARED else "reference"
    arithmetic = FloatArithmetic()
    try:
        for part, piece in itertools.product(_parts(plant, reference.expression), _PIECES):
            try:
                envelope(part, {plant.time: piece}, arithmetic)
            except EnvelopeError as error:
                # An overflow has no subexpression: the checker decides what it means.
                if error.subexpression:
                    message = f"for t from {piece[0]:.6g} to {piece[1]:.6g} s, {error}"
                    return [_mistake(plant, path, message, "keep it defined for 0 <= t <= 1e6 s")]
    except EnvelopeError as error:
        return [_mistake(plant, path, str(error), error.fix)]
    return []


def _exceeded(plant: Plant) -> list[Mistake]:
    """Hold declared bounds of the reference against its value: a witness, never a proof."""
    reference = plant.spec.reference
    if reference.kind is not ReferenceKind.DECLARED or plant.reference is None:
        return []
    mistakes = []
    signals = [("bound", "y_d", plant.reference)]
    # Where the value may jump its rate stays what the file declares.
    with suppress(EnvelopeError):
        signals.append(("rate", "dy_d/dt", derivative(plant.reference, plant.time)))
    for (key, name, signal), bound in zip(signals, reference.bounds, strict=False):
        try:
            sizes = [(abs(evaluate_float(signal, {plant.time: t})), t) for t in _TIMES]
        except EnvelopeError:
            continue
        size, when = max(sizes)
        if size > bound.approximate * (1.0 + 1e-9):
            message = f"{bound.text} is below |{name}| = {size:.6g} at t = {when:.6g}"
            mistakes.append(_mistake(plant, f"reference.{key}", message, "declare a larger bound"))
    return mistakes


def _authority(
    plant: Plant,
    index: int,
    g_min: sp.Expr,
    base: Box,
    arithmetic: FloatArithmetic,
) -> list[Mistake]:
    channel = plant.channels[index]
    lower, upper = envelope(g_min, base, arithmetic)
    if lower > 0.0:
        return []
    name = channel.state.name
    ahead = plant.states[index + 1].name if index + 1 < plant.order else "u"
    box = ", ".join(
        f"{state.name} in [{base[state][0]:.6g}, {base[state][1]:.6g}]"
        for state in plant.states[: index + 1]
    )
    key = "g_min" if channel.g_min is not None else "g"
    path = f"dynamics.{name}.{key}"
    if upper < 0.0:
        message = (
            f"it lies between {lower:.6g} and {upper:.6g} for {box}: the input must enter with a"
            " positive sign"
        )
        return [_mistake(plant, path, message, f"replace {ahead} by its negative")]
    message = (
        f"its lower bound is {lower:.6g} (upper {upper:.6g}) for {box}, the smallest box that any"
        " design has: without a positive lower bound there is no authority"
    )
    fix = f"narrow initial, reference or accuracy so that g of {name} stays positive"
    if plant.spec.synthesis.center is CenterKind.PERFORMANCE and channel.g is not None:
        fix += ", or use `center: nominal`, which follows the model"
    return [_mistake(plant, path, message, fix)]


def _mistake(plant: Plant, path: str, message: str, fix: str) -> Mistake:
    place = plant.spec.place(path)
    lines = plant.spec.source.splitlines()
    line = lines[place.line - 1] if place.line <= len(lines) else ""
    rest = line[place.column - 1 :].split("#")[0].rstrip(" ,}\t")
    return Mistake(
        path=path,
        line=place.line,
        column=place.column,
        length=max(1, len(rest.split(", ")[0])),
        message=message,
        fix=fix,
    )
