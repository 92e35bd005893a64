"""W_i, maj g_i* and g_{m,i} of center nominal, for any number type (docs/theory.md section 4)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, TypeVar

import sympy as sp

from bfppc_synth.bounds.derivative import derivative
from bfppc_synth.bounds.nominal.following import AHEAD, known_part
from bfppc_synth.majorants.derive import parameter_intervals
from bfppc_synth.majorants.envelope import envelope, magnitude

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.bounds.nominal.center import NominalCenter
    from bfppc_synth.bounds.residual import Placement
    from bfppc_synth.majorants.arithmetic import Arithmetic
    from bfppc_synth.model.plant import Plant

T = TypeVar("T")

MODEL_ERROR = "model error along the center"
LEFT_OUT = "terms left out of the model"
UNKNOWN = "what is known by a bound only"
DISTURBANCE = "disturbance"


class NominalResidual(Generic[T]):
    """The residual around a center that the nominal plant follows: model error and deviation.

    Parameters
    ----------
    plant, nominal
        The plant, and its center with the model error along it.
    arithmetic : Arithmetic[T]
        End-point arithmetic of the envelopes.
    place : Placement[T]
        Range of x_j from the center's range and xi_j.
    constant : callable
        A float as a T.

    References
    ----------
    docs/theory.md section 4, the bound of W_i: by the mean value theorem on the segment from
    r to x, which stays in the reachable box, for every parameter in its range.
    """

    def __init__(
        self,
        plant: Plant,
        nominal: NominalCenter,
        *,
        arithmetic: Arithmetic[T],
        place: Placement[T],
        constant: Callable[[float], T],
    ) -> None:
        self._plant = plant
        self._nominal = nominal
        self._arithmetic = arithmetic
        self._place = place
        self._constant = constant
        self._parameters = parameter_intervals(plant, arithmetic)
        self._slopes = tuple(deviation_slopes(plant, i) for i in range(plant.order))

    def _base(self, xi: tuple[T, ...]) -> dict[sp.Symbol, tuple[T, T]]:
        base = dict(self._parameters)
        center = self._nominal.center
        for j, reach in enumerate(xi):
            base[self._plant.states[j]] = self._place(
                j, center.r_lower[j], center.r_upper[j], reach
            )
        lower, upper = self._nominal.ahead[len(xi) - 1]
        base[AHEAD] = (self._constant(lower), self._constant(upper))
        return base

    def terms(self, index: int, xi: tuple[T, ...]) -> tuple[tuple[str, T], ...]:
        """Return the terms of W_i by their source, in a fixed order; a term that is 0 is absent.

        References
        ----------
        docs/theory.md section 4. A deviation counts |d(f_i + g_i r_{i+1})/dx_j| xi_j, the
        derivative as one expression, so that signs may cancel.
        """
        arithmetic, base = self._arithmetic, self._base(xi)
        channel, nominal = self._plant.channels[index], self._nominal
        found: list[tuple[str, T]] = []
        if nominal.parameter_errors[index]:
            found.append((MODEL_ERROR, self._constant(nominal.model_error[index])))
        for state, slope, reach in zip(self._plant.states, self._slopes[index], xi, strict=False):
            if slope != 0:
                steep = magnitude(envelope(slope, base, arithmetic), arithmetic)
                found.append((f"deviation of {state.name}", arithmetic.mul(steep, reach)))
        left_out = nominal.model.left_out[index]
        if left_out:
            size = magnitude(envelope(sp.Add(*left_out), base, arithmetic), arithmetic)
            found.append((LEFT_OUT, size))
        if channel.f is None and channel.f_bound is not None:
            size = magnitude(envelope(channel.f_bound, base, arithmetic), arithmetic)
            found.append((UNKNOWN, size))
        if channel.g is None:
            found.append((f"{UNKNOWN}: g", self._unknown_gain(index, base)))
        if channel.disturbance != 0:
            size = magnitude(envelope(channel.disturbance, base, arithmetic), arithmetic)
            found.append((DISTURBANCE, size))
        return tuple(found)

    def disturbance(self, index: int, xi: tuple[T, ...]) -> T:
        """W_i, the sum of its terms [unit of x_i per s]."""
        total: T | None = None
        for _, term in self.terms(index, xi):
            total = term if total is None else self._arithmetic.add(total, term)
        return self._constant(0.0) if total is None else total

    def gain_upper(self, index: int, xi: tuple[T, ...]) -> T:
        """Maj g_i* over the reachable box."""
        channel = self._plant.channels[index]
        expression = channel.g_bound if channel.g is None else channel.g
        return magnitude(envelope(expression, self._base(xi), self._arithmetic), self._arithmetic)

    def gain_lower(self, index: int, xi: tuple[T, ...]) -> T:
        """g_{m,i}: the lower envelope over the reachable box."""
        channel = self._plant.channels[index]
        expression = channel.g_min if channel.g is None else channel.g
        return envelope(expression, self._base(xi), self._arithmetic)[0]

    def _unknown_gain(self, index: int, base: dict[sp.Symbol, tuple[T, T]]) -> T:
        """Bound |g_i(x) - g^_i(r)| |r_{i+1}| where g_i lies anywhere between its bounds."""
        arithmetic, channel = self._arithmetic, self._plant.channels[index]
        lower, upper = (self._constant(end) for end in self._nominal.authority[index])
        least = envelope(channel.g_min, base, arithmetic)[0]
        largest = envelope(channel.g_bound, base, arithmetic)[1]
        gap = arithmetic.maximum(
            arithmetic.add(largest, arithmetic.neg(lower)),
            arithmetic.add(upper, arithmetic.neg(least)),
        )
        low, high = self._nominal.ahead[index]
        return arithmetic.mul(gap, self._constant(max(-low, high)))


def deviation_slopes(plant: Plant, index: int) -> tuple[sp.Expr, ...]:
    """Differentiate f_i + g_i r_{i+1} by x_1..x_i, without what the residual counts in full."""
    known = known_part(plant, index)
    return tuple(derivative(known, state) for state in plant.states[: index + 1])
