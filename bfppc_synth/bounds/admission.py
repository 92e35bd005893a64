"""Refuse a plant whose bounds break down on the smallest box that any design has."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.errors import EnvelopeError, Mistake, PlantFileError
from bfppc_synth.majorants.envelope import envelope
from bfppc_synth.majorants.targets import FloatArithmetic

if TYPE_CHECKING:
    import sympy as sp

    from bfppc_synth.model.bounds import CenterBounds, Majorants
    from bfppc_synth.model.plant import Plant


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
        A pole, another domain error, or no positive g_m, with its place.

    References
    ----------
    docs/theory.md sections 1 and 6.
    """
    arithmetic = FloatArithmetic()
    accuracy = plant.spec.performance.accuracy
    reach = 0.0 if accuracy is None else accuracy.approximate
    base: dict[sp.Symbol, tuple[float, float]] = {
        symbol: (arithmetic.number(lower), arithmetic.number(upper))
        for symbol, (lower, upper) in zip(plant.parameters, plant.ranges, strict=True)
    }
    mistakes: list[Mistake] = []
    for i, (channel, bound) in enumerate(zip(plant.channels, majorants.channels, strict=True)):
        wide = reach if i == 0 else 0.0
        base[channel.state] = (center.r_lower[i] - wide, center.r_upper[i] + wide)
        root = f"dynamics.{channel.state.name}"
        entries = [
            (f"{root}.f_bound", channel.f_bound),
            (f"{root}.f", channel.f),
            (f"{root}.g_bound", channel.g_bound),
            (f"{root}.g", channel.g),
            (f"{root}.g_min", channel.g_min),
            (f"{root}.disturbance", channel.disturbance),
        ]
        broken = False
        for path, expression in entries:
            if expression is None:
                continue
            try:
                envelope(expression, base, arithmetic)
            except EnvelopeError as error:
                mistakes.append(_mistake(plant, path, str(error), error.fix))
                broken = True
        if not broken:
            mistakes.extend(_authority(plant, i, bound.g_min, base, arithmetic))
    if mistakes:
        raise PlantFileError(plant.spec.path, plant.spec.source, tuple(mistakes))


def _authority(
    plant: Plant,
    index: int,
    g_min: sp.Expr,
    base: dict[sp.Symbol, tuple[float, float]],
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
