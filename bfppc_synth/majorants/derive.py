"""The majorants of a plant: what bounds each channel, and how it reads (docs/theory.md 1)."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.majorants.envelope import compile_envelope, envelope, magnitude
from bfppc_synth.majorants.targets import SympyArithmetic
from bfppc_synth.model.bounds import ChannelMajorants, Majorants

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.majorants.arithmetic import Arithmetic
    from bfppc_synth.model.plant import Channel, Plant

T = TypeVar("T")


def parameter_intervals(plant: Plant, arithmetic: Arithmetic[T]) -> dict[sp.Symbol, tuple[T, T]]:
    """Return every parameter's range as the base of an envelope.

    Parameters
    ----------
    plant : Plant
        Its ``ranges`` are constant expressions (pi/60, 100/7).
    arithmetic : Arithmetic[T]
        What the end points are made of.

    Returns
    -------
    dict[sp.Symbol, tuple[T, T]]
        (lower, upper) per parameter [unit of the parameter].

    References
    ----------
    docs/theory.md section 1: interval-valued plant parameters enter as constants [l, u].
    """
    intervals: dict[sp.Symbol, tuple[T, T]] = {}
    for symbol, (lower, upper) in zip(plant.parameters, plant.ranges, strict=True):
        low, high = (envelope(end, {}, arithmetic) for end in (lower, upper))
        intervals[symbol] = (low[0], high[1])
    return intervals


def derive_majorants(plant: Plant) -> Majorants:
    """Choose what bounds each channel, and write the majorants over |x_j| <= z_j.

    A declared bound replaces the function it bounds; it need not be monotone itself, since it
    goes through the same envelope.

    Parameters
    ----------
    plant : Plant
        Checked plant; unknown f or g have declared bounds.

    Returns
    -------
    Majorants
        f_i*, g_i*, g_{m,i} and the disturbance bound as expressions in states and parameters,
        with formulas in z1..zn to show. A formula is infinite where no majorant over symmetric
        boxes exists (a pole at 0 that the reachable box avoids).

    Raises
    ------
    EnvelopeError
        If a subexpression has no rule, or a channel has neither function nor bound.

    References
    ----------
    docs/theory.md section 1; the paper's Definition 1 and Remark 1.
    """
    magnitudes = tuple(
        sp.Symbol(f"z{i + 1}", real=True, nonnegative=True) for i in range(plant.order)
    )
    arithmetic = SympyArithmetic()
    base = parameter_intervals(plant, arithmetic)
    for state, z in zip(plant.states, magnitudes, strict=True):
        base[state] = (-z, z)
    channels = tuple(_channel_majorants(channel, base) for channel in plant.channels)
    return Majorants(channels=channels, magnitudes=magnitudes)


def _channel_majorants(
    channel: Channel, base: Mapping[sp.Symbol, tuple[sp.Expr, sp.Expr]]
) -> ChannelMajorants:
    f_star = _declared(channel, "f_bound", channel.f_bound, channel.f)
    g_star = _declared(channel, "g_bound", channel.g_bound, channel.g)
    g_min = _declared(channel, "g_min", channel.g_min, channel.g)
    compile_envelope(channel.disturbance)
    return ChannelMajorants(
        f_star=f_star,
        g_star=g_star,
        g_min=g_min,
        disturbance=channel.disturbance,
        f_text=_upper_text(f_star, base),
        g_text=_upper_text(g_star, base),
        g_min_text=_lower_text(g_min, base),
    )


def _declared(
    channel: Channel, key: str, bound: sp.Expr | None, function: sp.Expr | None
) -> sp.Expr:
    expression = function if bound is None else bound
    if expression is None:
        name = channel.state.name
        raise EnvelopeError(
            f"dynamics.{name} has neither {key[0]} nor {key}: nothing bounds it",
            subexpression=name,
            fix=f"give {key}",
        )
    # What has no rule is refused here; what only leaves its domain on symmetric boxes is not.
    compile_envelope(expression)
    return expression


def _upper_text(expression: sp.Expr, base: Mapping[sp.Symbol, tuple[sp.Expr, sp.Expr]]) -> sp.Expr:
    arithmetic = SympyArithmetic()
    try:
        return magnitude(envelope(expression, base, arithmetic), arithmetic)
    except EnvelopeError:
        return sp.oo


def _lower_text(expression: sp.Expr, base: Mapping[sp.Symbol, tuple[sp.Expr, sp.Expr]]) -> sp.Expr:
    try:
        return envelope(expression, base, SympyArithmetic())[0]
    except EnvelopeError:
        return -sp.oo
