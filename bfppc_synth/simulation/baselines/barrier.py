"""The logarithmic barrier law (80)-(81), and the shapes (54)-(55), on the paper's errors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bfppc_synth.simulation.baselines.method import Method, Tunable

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bfppc_synth.simulation.baselines.arrays import Array
    from bfppc_synth.simulation.baselines.path import Path


class CascadeLaw:
    """Errors e_1 = x_1 - r_1, e_i = x_i - rho_i x_i(0) - alpha_{i-1}; alpha_i = -shape_i(e_i).

    Parameters
    ----------
    path : Path
        r_1 and rho_2..rho_n.

    References
    ----------
    The paper's (50)-(51); docs/theory.md section 2.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._starts: list[Array] = []

    def shape(self, i: int, error: Array) -> Array:
        """Return the feedback of step i, from 0, on its error."""
        raise NotImplementedError

    def command(self, k: int, measured: Sequence[Array]) -> Array:
        """Return u at sample k."""
        if k == 0:
            self._starts = [state.copy() for state in measured]
        path = self._path
        error = measured[0] - path.derivatives[0, k][:, None]
        above = self.shape(0, error)
        for i, state in enumerate(measured[1:], start=1):
            error = (state - path.fade[k, i - 1] * self._starts[i]) + above
            above = self.shape(i, error)
        return -above


class BarrierLaw(CascadeLaw):
    """alpha_i = -k_i ln((1 + e_i/w_i) / (1 - e_i/w_i)); u the last one.

    Parameters
    ----------
    path : Path
        As for ``CascadeLaw``.
    gains, widths : sequence of n
        k_i [unit of x_{i+1}] and w_i [unit of x_i].

    References
    ----------
    The paper's (80)-(81); docs/theory.md section 11.
    """

    def __init__(self, path: Path, gains: Sequence[Any], widths: Sequence[Any]) -> None:
        super().__init__(path)
        self._gains, self._widths = gains, widths

    def shape(self, i: int, error: Array) -> Array:
        """NaN or infinite once the error has reached its width."""
        share = error / self._widths[i]
        value: Array = self._gains[i] * np.log((1.0 + share) / (1.0 - share))
        return value


class LinearLaw(BarrierLaw):
    """alpha_i = -2 k_i e_i / w_i: the small-signal slope of (80)-(81), by (82)-(83)."""

    def shape(self, i: int, error: Array) -> Array:
        """Have a value everywhere."""
        value: Array = (2.0 * self._gains[i]) * (error / self._widths[i])
        return value


class ShapeLaw(CascadeLaw):
    """The shapes k e + M tanh(M e/epsilon) + c e^3 of (54)-(55), all terms present."""

    def __init__(self, path: Path, chosen: Mapping[str, Array], order: int) -> None:
        super().__init__(path)
        names = ("k", "M", "epsilon", "c")
        self._rows = [tuple(chosen[f"{name}_{i + 1}"] for name in names) for i in range(order)]

    def shape(self, i: int, error: Array) -> Array:
        """Have a value everywhere."""
        k, M, epsilon, c = self._rows[i]
        value: Array = (k * error + M * np.tanh((M / epsilon) * error)) + c * (
            error * error * error
        )
        return value


def barrier(order: int, accuracy: float) -> Method:
    """Make the method for n states: width of e_1 the accuracy, everything else searched."""
    first = accuracy
    tunables = (
        *(Tunable(name=f"k_{i}", lower=1e-2, upper=1e3) for i in range(1, order + 1)),
        *(Tunable(name=f"w_{i}", lower=1e-1, upper=1e3) for i in range(2, order + 1)),
    )

    def build(path: Path, times: Array, chosen: Mapping[str, Array]) -> BarrierLaw:
        del times
        gains = [chosen[f"k_{i}"] for i in range(1, order + 1)]
        widths = [first, *(chosen[f"w_{i}"] for i in range(2, order + 1))]
        return BarrierLaw(path, gains, widths)

    return Method(
        key="ln-barrier",
        title="ln-barrier PPC",
        source="the paper's (80)-(81) with its errors and constant widths",
        fixed=f"w_1 = {first:g}, the accuracy",
        tunables=tunables,
        build=build,
    )


def shaped(order: int) -> Method:
    """Make the law of this tool with every term of its shapes, to count its operations."""
    names = [f"{name}_{i}" for i in range(1, order + 1) for name in ("k", "M", "epsilon", "c")]

    def build(path: Path, times: Array, chosen: Mapping[str, Array]) -> ShapeLaw:
        del times
        return ShapeLaw(path, chosen, order)

    return Method(
        key="bfppc",
        title="barrier-free PPC",
        source="the paper's (54)-(55)",
        fixed="N = 3",
        tunables=tuple(Tunable(name=name, lower=1.0, upper=1.0) for name in names),
        build=build,
    )
