"""The plant's motion over arrays: n states of many loops, one step of the RK4 method."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.expressions.evaluate import evaluate
from bfppc_synth.simulation.baselines.arrays import ArrayStatements, array_function

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import sympy as sp

    from bfppc_synth.model.plant import Channel, Plant
    from bfppc_synth.simulation.baselines.arrays import Array

    # (t, states, u, arguments, which loops take the declared bounds for the truth) -> dx
    Rates = Callable[[float, Sequence[Array], Array, Sequence[Array], Array], list[Array]]


def has_bounds(plant: Plant) -> bool:
    """Whether the file declares a bound that allows more than its model."""
    bounds = [(c.f_bound, c.g_bound, c.g_min) for c in plant.channels]
    return any(bound is not None for triple in bounds for bound in triple)


def compile_rates(plant: Plant) -> Rates:
    """Write dx_i = f_i + g_i x_{i+1} + d_i as a function of arrays.

    Parameters
    ----------
    plant : Plant
        Channels with f or f_bound, g or g_min and g_bound.

    Returns
    -------
    callable
        The arguments are those of ``simulation.plant.Dynamics``: parameters, shares of the
        disturbance bounds, shares of f_bound, places of g between its bounds.

    References
    ----------
    docs/theory.md section 2 (what center performance takes as truth).
    """
    order = plant.order
    states = [f"x{i}" for i in range(1, order + 1)]
    arguments = [f"a{j}" for j in range(1, len(plant.parameters) + 1)]
    arguments += [f"{kind}{i}" for kind in "wbm" for i in range(1, order + 1)]
    head = ["t", *states, "u", *arguments]
    functions = []
    for writer in (_model, _bounded):
        out = ArrayStatements()
        values = dict(zip(plant.states, states, strict=True))
        values |= {symbol: f"a{j}" for j, symbol in enumerate(plant.parameters, start=1)}
        results = []
        for i, (channel, above) in enumerate(
            zip(plant.channels, [*states[1:], "u"], strict=True), start=1
        ):
            force, gain = writer(channel, i, values, out)
            if channel.disturbance != 0:
                pushed = out.mul(f"w{i}", evaluate(channel.disturbance, values, out))
                force = out.add(force, pushed)
            results.append(out.add(force, out.mul(gain, above)))
        functions.append(array_function(head, out, results))
    model, bounded = functions
    declared = has_bounds(plant)

    def rates(
        t: float, x: Sequence[Array], u: Array, arguments: Sequence[Array], free: Array
    ) -> list[Array]:
        found = model(t, *x, u, *arguments)
        if not declared or not free.any():
            return list(found)
        others = bounded(t, *x, u, *arguments)
        return [np.where(free, a, b) for a, b in zip(others, found, strict=True)]

    return rates


def advance(
    rates: Rates,
    t: float,
    h: float,
    x: Sequence[Array],
    u: Array,
    arguments: Sequence[Array],
    free: Array,
) -> list[Array]:
    """Take one classical Runge-Kutta step of length h [s] with u held."""
    half = 0.5 * h
    k1 = rates(t, x, u, arguments, free)
    k2 = rates(t + half, [a + half * b for a, b in zip(x, k1, strict=True)], u, arguments, free)
    k3 = rates(t + half, [a + half * b for a, b in zip(x, k2, strict=True)], u, arguments, free)
    k4 = rates(t + h, [a + h * b for a, b in zip(x, k3, strict=True)], u, arguments, free)
    slopes = zip(x, k1, k2, k3, k4, strict=True)
    return [a + h / 6.0 * (b + 2.0 * (c + d) + e) for a, b, c, d, e in slopes]


def nominal_fields(plant: Plant) -> tuple[tuple[sp.Expr, ...], tuple[sp.Expr, ...]] | str:
    """Return f_i and g_i at the middle of every parameter's range, or why there are none.

    A method that cancels the plant needs them; a bound is no model.
    """
    middle = {
        symbol: (lower + upper) / 2
        for symbol, (lower, upper) in zip(plant.parameters, plant.ranges, strict=True)
    }
    forces, gains = [], []
    for channel in plant.channels:
        if channel.f is None:
            return f"f of {channel.state} is known by its bound alone, and cannot be cancelled"
        if channel.g is None:
            return f"g of {channel.state} is known between bounds alone, and cannot be cancelled"
        forces.append(channel.f.xreplace(middle))
        gains.append(channel.g.xreplace(middle))
    return tuple(forces), tuple(gains)


def _model(
    channel: Channel, number: int, values: dict[sp.Symbol, str], out: ArrayStatements
) -> tuple[str, str]:
    """Write f and g as the file has them, what it has no formula for within its bounds."""
    if channel.f is not None:
        force = evaluate(channel.f, values, out)
    else:
        force = out.mul(evaluate(channel.f_bound, values, out), out.sin(f"(t + {number}.0)"))
    if channel.g is not None:
        return force, evaluate(channel.g, values, out)
    return force, _between(channel, number, values, out)


def _bounded(
    channel: Channel, number: int, values: dict[sp.Symbol, str], out: ArrayStatements
) -> tuple[str, str]:
    """Write f and g as anything that their declared bounds allow."""
    if channel.f_bound is not None:
        force = out.mul(f"b{number}", evaluate(channel.f_bound, values, out))
    else:
        force = evaluate(channel.f, values, out)
    return force, _between(channel, number, values, out)


def _between(
    channel: Channel, number: int, values: dict[sp.Symbol, str], out: ArrayStatements
) -> str:
    lower = channel.g if channel.g_min is None else channel.g_min
    upper = channel.g if channel.g_bound is None else channel.g_bound
    if lower is None or upper is None:
        return out.number_text(1.0)
    low = evaluate(lower, values, out)
    if lower == upper:
        return low
    return out.add(low, out.mul(f"m{number}", out.sub(evaluate(upper, values, out), low)))
