"""Classical backstepping: every virtual control differentiated exactly, by sympy."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.simulation.baselines.arrays import compile_arrays
from bfppc_synth.simulation.baselines.method import Method, Tunable
from bfppc_synth.simulation.baselines.plant import nominal_fields

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Any

    from bfppc_synth.model.plant import Plant
    from bfppc_synth.simulation.baselines.arrays import Array
    from bfppc_synth.simulation.baselines.path import Path

#: Its expressions grow exponentially with n; beyond this sympy takes minutes to write them.
LARGEST_ORDER = 5


class BacksteppingLaw:
    """u of a compiled expression in the states and r_1, dr_1, .., r_1^(n)."""

    def __init__(
        self,
        path: Path,
        law: Callable[..., tuple[Any, ...]],
        gains: Sequence[Array],
    ) -> None:
        self._path, self._law, self._gains = path, law, gains

    def command(self, k: int, measured: Sequence[Array]) -> Array:
        """Return u at sample k."""
        jets = [row[k][:, None] for row in self._path.derivatives]
        (u,) = self._law(*measured, *jets, *self._gains)
        command: Array = u
        return command


def symbolic_law(
    plant: Plant, fields: tuple[Sequence[sp.Expr], Sequence[sp.Expr]]
) -> tuple[sp.Expr, tuple[sp.Symbol, ...], tuple[sp.Symbol, ...]]:
    """Write u by backstepping.

    alpha_i = (-f_i - k_i z_i - g_{i-1} z_{i-1} + d alpha_{i-1}) / g_i, z_i = x_i - alpha_{i-1},
    alpha_0 = r_1, u = alpha_n: sum z_i^2 / 2 then falls at the rate sum k_i z_i^2.

    Returns
    -------
    tuple
        u, the symbols of r_1^(0)..r_1^(n), the symbols of k_1..k_n.

    References
    ----------
    M. Krstic, I. Kanellakopoulos, P. Kokotovic, "Nonlinear and Adaptive Control Design", Wiley,
    1995; docs/theory.md section 11.
    """
    order, states = plant.order, plant.states
    jets = tuple(sp.Symbol(f"jet_{j}", real=True) for j in range(order + 1))
    gains = tuple(sp.Symbol(f"gain_{i}", positive=True) for i in range(1, order + 1))
    forces, reaches = fields
    motion = [
        f + g * above for f, g, above in zip(forces, reaches, [*states[1:], sp.S.Zero], strict=True)
    ]
    above, rate, carried = jets[0], jets[1], sp.S.Zero
    for i, (force, reach, gain) in enumerate(zip(forces, reaches, gains, strict=True)):
        error = states[i] - above
        above = (rate - force - gain * error - carried) / reach
        carried = reach * error
        if i + 1 < order:
            along = [sp.diff(above, states[j]) * motion[j] for j in range(i + 1)]
            along += [sp.diff(above, jets[j]) * jets[j + 1] for j in range(i + 2)]
            rate = sp.Add(*along)
    return above, jets, gains


def backstepping(plant: Plant, missing: str = "") -> Method:
    """Make the method for a plant, with the nominal f and g; ``missing`` is that of the path."""
    order, fields = plant.order, nominal_fields(plant)
    tunables = tuple(Tunable(name=f"k_{i}", lower=1e-1, upper=1e3) for i in range(1, order + 1))
    reason = fields if isinstance(fields, str) else missing
    if order > LARGEST_ORDER:
        reason = f"its expressions for n = {order} are too large to write"
    method = Method(
        key="backstepping",
        title="backstepping with exact derivatives",
        source="M. Krstic, I. Kanellakopoulos, P. Kokotovic, Wiley, 1995",
        fixed="f and g of the nominal plant",
        tunables=tunables,
        build=None,
        missing=reason,
    )
    if isinstance(fields, str) or reason:
        return method
    law, jets, gains = symbolic_law(plant, fields)
    names = [*plant.states, *jets, *gains]
    try:
        compiled = compile_arrays((law,), {name: f"v_{j}" for j, name in enumerate(names)})
    except EnvelopeError as error:
        where = error.subexpression
        return replace(method, missing=f"a virtual control has no derivative everywhere ({where})")

    def build(path: Path, times: Array, chosen: Mapping[str, Array]) -> BacksteppingLaw:
        del times
        return BacksteppingLaw(path, compiled, [chosen[item.name] for item in tunables])

    return replace(method, build=build)
