"""What a step of every method costs, against the number of states n."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.simulation.baselines.backstepping import backstepping, symbolic_law
from bfppc_synth.simulation.baselines.barrier import barrier, shaped
from bfppc_synth.simulation.baselines.funnel import funnel
from bfppc_synth.simulation.baselines.method import count_operations
from bfppc_synth.simulation.baselines.plant import nominal_fields
from bfppc_synth.simulation.baselines.surface import surface

if TYPE_CHECKING:
    from bfppc_synth.model.plant import Plant

#: The family dx_i = x_1 x_i^2 + x_{i+1} goes this far.
LARGEST_FAMILY = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """Operations of one step for the first n channels of a plant, by the key of the method.

    None where the method has no law. ``expanded`` are those of backstepping with no
    subexpression shared, as it comes from the differentiation.
    """

    order: int
    operations: dict[str, int | None]
    expanded: int | None


def family(plant: Plant, order: int) -> Plant:
    """Return dx_i = x_1 x_i^2 + x_{i+1}, u for x_{n+1}: a plant for every n."""
    states = tuple(sp.Symbol(f"x{i}", real=True) for i in range(1, order + 1))
    channel = replace(
        plant.channels[0], f_bound=None, g_bound=None, g_min=None, g=sp.S.One, disturbance=sp.S.Zero
    )
    channels = tuple(replace(channel, state=x, f=states[0] * x**2) for x in states)
    return replace(plant, states=states, channels=channels, parameters=(), ranges=())


def costs(plant: Plant) -> tuple[Cost, ...]:
    """Count for the first 1, 2, .., n channels: each is a strict-feedback plant itself.

    Parameters
    ----------
    plant : Plant
        Of order n.

    Returns
    -------
    tuple[Cost, ...]
        One a number of channels; the path r_1 and its derivatives are given in all of them.
    """
    return tuple(
        _cost(replace(plant, states=plant.states[:n], channels=plant.channels[:n]))
        for n in range(1, plant.order + 1)
    )


def family_costs(plant: Plant) -> tuple[Cost, ...]:
    """Count for ``family``, n = 1 to 5."""
    return tuple(_cost(family(plant, n)) for n in range(1, LARGEST_FAMILY + 1))


def _cost(plant: Plant) -> Cost:
    n = plant.order
    methods = (
        shaped(n),
        barrier(n, 1.0),
        funnel(n, 1.0),
        surface(plant, 1e-3),
        backstepping(plant),
    )
    fields = nominal_fields(plant)
    expanded = None
    if methods[-1].build is not None and not isinstance(fields, str):
        expanded = int(sp.count_ops(symbolic_law(plant, fields)[0]))
    return Cost(
        order=n,
        operations={method.key: count_operations(method, n) for method in methods},
        expanded=expanded,
    )
