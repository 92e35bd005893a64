"""W_i, maj g_i* and g_{m,i} of center performance, for any number type."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.majorants.envelope import envelope, magnitude
from bfppc_synth.majorants.targets import FloatArithmetic

if TYPE_CHECKING:
    from collections.abc import Callable

    import sympy as sp

    from bfppc_synth.majorants.arithmetic import Arithmetic
    from bfppc_synth.model.bounds import CenterBounds, Majorants
    from bfppc_synth.model.plant import Plant

T = TypeVar("T")


class Placement(Protocol[T]):
    """Turns r_j in [lower, upper] and xi_j into the end points of the range of x_j."""

    def __call__(self, index: int, lower: float, upper: float, xi: T) -> tuple[T, T]:
        """Return the end points."""


class PerformanceResidual(Generic[T]):
    """The paper's residual: everything that the plant does counts as a disturbance.

    Parameters
    ----------
    plant, majorants, center
        The plant, the expressions that bound it, and the range of the center.
    arithmetic : Arithmetic[T]
        End-point arithmetic of the envelopes.
    place : Placement[T]
        Range of x_j from the center's range and xi_j.
    constant : callable
        A float as a T.

    References
    ----------
    docs/theory.md section 2, the row `performance` of the table.
    """

    def __init__(
        self,
        plant: Plant,
        majorants: Majorants,
        center: CenterBounds,
        *,
        arithmetic: Arithmetic[T],
        place: Placement[T],
        constant: Callable[[float], T],
    ) -> None:
        self._plant = plant
        self._majorants = majorants
        self._center = center
        self._arithmetic = arithmetic
        self._place = place
        self._constant = constant
        self._parameters: dict[sp.Symbol, tuple[T, T]] = {
            symbol: (arithmetic.number(lower), arithmetic.number(upper))
            for symbol, (lower, upper) in zip(plant.parameters, plant.ranges, strict=True)
        }

    def _base(self, xi: tuple[T, ...]) -> dict[sp.Symbol, tuple[T, T]]:
        base = dict(self._parameters)
        for j, reach in enumerate(xi):
            lower, upper = self._center.r_lower[j], self._center.r_upper[j]
            base[self._plant.states[j]] = self._place(j, lower, upper, reach)
        return base

    def disturbance(self, index: int, xi: tuple[T, ...]) -> T:
        """W_i = maj f_i* + maj disturbance_i + sup|dr_i| [unit of x_i per s]."""
        channel, arithmetic = self._majorants.channels[index], self._arithmetic
        base = self._base(xi)
        force = magnitude(envelope(channel.f_star, base, arithmetic), arithmetic)
        total = arithmetic.add(force, self._constant(self._center.rate[index]))
        if channel.disturbance != 0:
            more = magnitude(envelope(channel.disturbance, base, arithmetic), arithmetic)
            total = arithmetic.add(total, more)
        return total

    def gain_upper(self, index: int, xi: tuple[T, ...]) -> T:
        """Maj g_i* over the reachable box."""
        expression = self._majorants.channels[index].g_star
        return magnitude(envelope(expression, self._base(xi), self._arithmetic), self._arithmetic)

    def gain_lower(self, index: int, xi: tuple[T, ...]) -> T:
        """g_{m,i}: the lower envelope over the reachable box, or the declared number."""
        expression = self._majorants.channels[index].g_min
        return envelope(expression, self._base(xi), self._arithmetic)[0]


def float_residual(
    plant: Plant, majorants: Majorants, center: CenterBounds
) -> PerformanceResidual[float]:
    """Build the residual in plain floats."""

    def place(index: int, lower: float, upper: float, xi: float) -> tuple[float, float]:
        del index
        return lower - xi, upper + xi

    return PerformanceResidual(
        plant,
        majorants,
        center,
        arithmetic=FloatArithmetic(),
        place=place,
        constant=FloatNumbers().number,
    )
