"""Prescribed performance control of Bechlioulis and Rovithakis: shrinking funnels, no model."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bfppc_synth.simulation.baselines.method import Method, Tunable

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bfppc_synth.simulation.baselines.arrays import Array
    from bfppc_synth.simulation.baselines.path import Path

#: Least final width of the further funnels: as narrow as the search likes, or all wide.
_NARROW_STATES, _WIDE_STATES = 0.1, 3.0

#: Final width of the wide funnel over the accuracy, and over the resolution of x_1.
_WIDE = (4.0, 8.0)


class FunnelLaw:
    """alpha_i = -k_i ln((1 + xi_i)/(1 - xi_i)), xi_i = (x_i - alpha_{i-1}) / rho_i(t).

    rho_i = (rho_i(0) - rho_i(inf)) e^{-l t} + rho_i(inf), alpha_0 = y_d. As the method asks,
    rho_i(0) exceeds the first error: it is twice that plus rho_i(inf).

    References
    ----------
    C. P. Bechlioulis, G. A. Rovithakis, "A low-complexity global approximation-free control
    scheme with prescribed performance for unknown pure feedback systems", Automatica 50(4),
    2014; docs/theory.md section 11.
    """

    def __init__(
        self,
        path: Path,
        times: Array,
        gains: Sequence[Any],
        finals: Sequence[Any],
        rate: Array,
        *,
        margin: float,
    ) -> None:
        self._path, self._times = path, times
        self._gains, self._finals, self._rate = gains, finals, rate
        # rho_1(0) - rho_1(inf) over |e_1(0)|: 1 begins in the envelope, 2 as its authors do.
        self._margins = (margin, *(2.0,) * (len(gains) - 1))
        self._extra: list[Array] = []

    def command(self, k: int, measured: Sequence[Array]) -> Array:
        """Return u at sample k; NaN or infinite once an error has reached its funnel."""
        decay = np.exp(-self._rate * self._times[k])
        above: Any = self._path.y_d[k][:, None]
        for i, (state, gain, final) in enumerate(
            zip(measured, self._gains, self._finals, strict=True)
        ):
            error = state - above
            if k == 0:
                self._extra.append(self._margins[i] * np.abs(error))
            share = error / (self._extra[i] * decay + final)
            above = -gain * np.log((1.0 + share) / (1.0 - share))
        command: Array = above
        return command


def funnel(order: int, accuracy: float) -> Method:
    """Make the method for n states with the envelope for its first funnel."""
    return _method(
        order,
        key="bechlioulis-rovithakis",
        title="Bechlioulis-Rovithakis PPC, funnel as narrow as the envelope",
        final=accuracy,
        margin=1.0,
        least=_NARROW_STATES,
    )


def wide_funnel(order: int, accuracy: float, resolution: float) -> Method:
    """Make the method with funnels that a quantizer does not jump over."""
    return _method(
        order,
        key="bechlioulis-rovithakis-wide",
        title="Bechlioulis-Rovithakis PPC, wide funnels",
        final=max(_WIDE[0] * accuracy, _WIDE[1] * resolution),
        margin=2.0,
        least=_WIDE_STATES,
    )


def _method(
    order: int, *, key: str, title: str, final: float, margin: float, least: float
) -> Method:
    tunables = (
        *(Tunable(name=f"k_{i}", lower=1e-2, upper=1e3) for i in range(1, order + 1)),
        *(Tunable(name=f"rho_{i}", lower=least, upper=1e3) for i in range(2, order + 1)),
        Tunable(name="l", lower=0.2, upper=20.0),
    )

    def build(path: Path, times: Array, chosen: Mapping[str, Array]) -> FunnelLaw:
        gains = [chosen[f"k_{i}"] for i in range(1, order + 1)]
        finals = [final, *(chosen[f"rho_{i}"] for i in range(2, order + 1))]
        return FunnelLaw(path, times, gains, finals, chosen["l"], margin=margin)

    return Method(
        key=key,
        title=title,
        source="C. P. Bechlioulis, G. A. Rovithakis, Automatica 50(4), 2014",
        fixed=f"final width of the first funnel {final:g}",
        tunables=tunables,
        build=build,
    )
