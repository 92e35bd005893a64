"""Dynamic surface control: backstepping whose derivatives are those of first-order filters."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.simulation.baselines.arrays import compile_arrays
from bfppc_synth.simulation.baselines.method import Method, Tunable
from bfppc_synth.simulation.baselines.plant import nominal_fields

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Any

    import sympy as sp

    from bfppc_synth.model.plant import Plant
    from bfppc_synth.simulation.baselines.arrays import Array
    from bfppc_synth.simulation.baselines.path import Path


class SurfaceLaw:
    """S_i = x_i - z_i, z_1 = r_1, v_{i+1} = (-f_i - k_i S_i + dz_i) / g_i, u = v_{n+1}.

    tau_i dz_i = v_i - z_i, z_i(0) = v_i(0) for i >= 2: between samples v_i is held, so the
    filter's step is exact.

    References
    ----------
    D. Swaroop, J. K. Hedrick, P. P. Yip, J. C. Gerdes, "Dynamic surface control for a class of
    nonlinear systems", IEEE Transactions on Automatic Control 45(10), 2000.
    """

    def __init__(
        self,
        path: Path,
        times: Array,
        fields: Sequence[Callable[..., tuple[Any, ...]]],
        gains: Sequence[Array],
        constants: Sequence[Array],
    ) -> None:
        self._path, self._fields, self._gains = path, fields, gains
        self._constants = constants
        # What a filter keeps of its distance in one hold: known before the loop runs.
        self._kept = [np.exp(-(times[1] - times[0]) / constant) for constant in constants]
        self._filters: list[Array] = []

    def command(self, k: int, measured: Sequence[Array]) -> Array:
        """Return u at sample k."""
        aim: Any = self._path.derivatives[0, k][:, None]
        rate: Any = self._path.derivatives[1, k][:, None]
        wanted: Any = aim
        for i, (state, gain, field) in enumerate(
            zip(measured, self._gains, self._fields, strict=True)
        ):
            if i:
                if k == 0:
                    self._filters.append(wanted)
                aim = self._filters[i - 1]
                gap = wanted - aim
                rate = gap / self._constants[i - 1]
                # The next sample finds the filter where the held input has brought it.
                self._filters[i - 1] = wanted - gap * self._kept[i - 1]
            force, reach = field(*measured[: i + 1])
            wanted = ((rate - force) - gain * (state - aim)) / reach
        command: Array = wanted
        return command


def surface(plant: Plant, period: float, missing: str = "") -> Method:
    """Make the method for a plant, with the nominal f and g, sampled every ``period`` [s].

    ``missing`` says why the path has no derivative, if it has none.
    """
    order, fields = plant.order, nominal_fields(plant)
    tunables = (
        *(Tunable(name=f"k_{i}", lower=1e-1, upper=1e3) for i in range(1, order + 1)),
        *(Tunable(name=f"tau_{i}", lower=period, upper=1e3 * period) for i in range(2, order + 1)),
    )
    method = Method(
        key="dynamic-surface",
        title="dynamic surface control",
        source="D. Swaroop et al., IEEE Transactions on Automatic Control 45(10), 2000",
        fixed="f and g of the nominal plant, filters started at their inputs",
        tunables=tunables,
        build=None,
        missing=fields if isinstance(fields, str) else missing,
    )
    if isinstance(fields, str) or missing:
        return method
    compiled = [
        _field(plant, i, force, gain)
        for i, (force, gain) in enumerate(zip(*fields, strict=True), start=1)
    ]

    def build(path: Path, times: Array, chosen: Mapping[str, Array]) -> SurfaceLaw:
        gains = [chosen[f"k_{i}"] for i in range(1, order + 1)]
        constants = [chosen[f"tau_{i}"] for i in range(2, order + 1)]
        return SurfaceLaw(path, times, compiled, gains, constants)

    return replace(method, build=build)


def _field(
    plant: Plant, count: int, force: sp.Expr, gain: sp.Expr
) -> Callable[..., tuple[Any, ...]]:
    """Compile f_i and g_i, functions of x_1..x_i."""
    names = {state: f"x{j}" for j, state in enumerate(plant.states[:count], start=1)}
    return compile_arrays((force, gain), names)
