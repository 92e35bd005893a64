"""Which part of the plant center nominal follows (docs/theory.md section 4)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.model.nominal import NominalModel

if TYPE_CHECKING:
    from bfppc_synth.model.plant import Channel, Plant

_ROUGH = (sp.Abs, sp.sign, sp.Min, sp.Max, sp.Piecewise)


def nominal_model(plant: Plant, transition: float) -> NominalModel:
    """Take f^, g^ from the plant file: nominal parameters, smooth terms only.

    Parameters
    ----------
    plant : Plant
        Its f, g, ranges and disturbance are the truth; an f known only by f_bound has f^ = 0,
        a g known only between g_min and g_bound has their mean as g^.
    transition : float
        T_s [s], at most what binary64 holds of it.

    Returns
    -------
    NominalModel
        With the terms that f^ leaves out.

    Raises
    ------
    EnvelopeError
        If a g lacks the regularity that the center needs.

    References
    ----------
    docs/theory.md section 4, "Regularity".
    """
    values = nominal_parameters(plant)
    f, g, left_out = [], [], []
    for channel in plant.channels:
        smooth, rough = _split(channel.f)
        f.append(smooth.xreplace(values))
        left_out.append(rough)
        g.append(smooth_gain(plant, channel).xreplace(values))
    return NominalModel(
        states=plant.states,
        f=tuple(f),
        g=tuple(g),
        left_out=tuple(left_out),
        transition=transition,
    )


def nominal_parameters(plant: Plant) -> dict[sp.Symbol, sp.Expr]:
    """Middle of every parameter's range: exact where rational, else a binary64 number."""
    values = {}
    for symbol, (lower, upper) in zip(plant.parameters, plant.ranges, strict=True):
        middle = lower if lower == upper else (lower + upper) / 2
        if not middle.is_Rational:
            # Any number near the middle will do: what the range adds is counted from it.
            middle = sp.Rational(float(middle))
        values[symbol] = middle
    return values


def is_smooth(expression: sp.Expr) -> bool:
    """Whether an expression has as many derivatives as the center may need."""
    if expression.has(*_ROUGH):
        return False
    return not any(
        power.exp.is_Rational and power.exp.q % 2 == 1 and power.exp.q > 1
        for power in expression.atoms(sp.Pow)
    )


def smooth_part(f: sp.Expr | None) -> sp.Expr:
    """Return f without the terms that f^ leaves out, parameters kept."""
    return _split(f)[0]


def _split(f: sp.Expr | None) -> tuple[sp.Expr, tuple[sp.Expr, ...]]:
    """Split f into its smooth part and the additive terms that lack the regularity."""
    if f is None:
        return sp.S.Zero, ()
    if is_smooth(f):
        return f, ()
    # Multiplied out, so that a (x + abs(x)) keeps its smooth half.
    terms = sp.Add.make_args(sp.expand_mul(f))
    rough = tuple(term for term in terms if not is_smooth(term))
    return sp.Add(*(term for term in terms if is_smooth(term))), rough


def sided_arguments(plant: Plant, index: int) -> tuple[sp.Expr, ...]:
    """Collect what must stay above 0 along the center, for abs() in g to be smooth there.

    Each is the argument of an abs in g, times the sign that it has at the middle start.
    """
    g = plant.channels[index].g
    if g is None:
        return ()
    return tuple(
        _side(plant, absolute.args[0]) * absolute.args[0]
        for absolute in sorted(g.atoms(sp.Abs), key=str)
    )


def _side(plant: Plant, argument: sp.Expr) -> int:
    """Sign of an expression at nominal parameters in the middle of the initial box."""
    values = dict(nominal_parameters(plant))
    for state, start in zip(plant.states, plant.spec.initial, strict=True):
        middle = (start.lower.approximate + start.upper.approximate) / 2.0
        values[state] = sp.Rational(middle)
    return -1 if argument.xreplace(values).evalf() < 0 else 1


def smooth_gain(plant: Plant, channel: Channel) -> sp.Expr:
    """Return what g^ is made of: g, its abs() resolved, or the mean of its bounds.

    Raises
    ------
    EnvelopeError
        If it lacks the regularity that the center needs.
    """
    g = channel.g
    if g is None and channel.g_min is not None and channel.g_bound is not None:
        # The reader requires both bounds where g is absent.
        g = (channel.g_min + channel.g_bound) / 2
    if g is not None:
        # g^ is a choice: abs(w) is w as long as w is positive along the center, which the
        # bounds of the center check.
        sided = {a: _side(plant, a.args[0]) * a.args[0] for a in g.atoms(sp.Abs)}
        g = g.xreplace(sided)
    if g is not None and is_smooth(g):
        return g
    raise EnvelopeError(
        f"{g} has a kink, a jump or an odd root, and center nominal divides by"
        " its derivatives along the center",
        subexpression=str(g),
        fix="write g without it, or use center performance",
    )
