"""The chain of bounds on traced CasADi expressions; the solver hands its module over."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bfppc_synth.gains.traced import Traced, TracedArithmetic

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.bounds.chain import Residual

GRID = 32


class TracedNumbers:
    """Functions of the chain on CasADi expressions; ``casadi`` is the module."""

    def __init__(self, casadi: Any) -> None:
        self._casadi = casadi

    def number(self, value: float) -> Any:
        """Return a constant."""
        return self._casadi.SX(value)

    def tanh(self, value: Any) -> Any:
        """Return the hyperbolic tangent."""
        return self._casadi.tanh(value)

    def sqrt(self, value: Any) -> Any:
        """Return the square root."""
        return self._casadi.sqrt(value)

    def minimum(self, left: Any, right: Any) -> Any:
        """Return the smaller of two."""
        return self._casadi.fmin(left, right)

    def maximum(self, left: Any, right: Any) -> Any:
        """Return the larger of two."""
        return self._casadi.fmax(left, right)

    def supremum(self, function: Callable[[Any], Any]) -> Any:
        """Return the largest value on a grid of [0, 1], an estimate that only guides."""
        best = function(self._casadi.SX(0.0))
        for j in range(1, GRID + 1):
            best = self._casadi.fmax(best, function(self._casadi.SX(j / GRID)))
        return best

    def record(self, symbol: str, index: int, value: Any) -> Any:
        """Name nothing: the value itself."""
        del symbol, index
        return value


class TracedResidual:
    """W_i, maj g_i*, g_{m,i} as CasADi expressions of xi; ``casadi`` is the module."""

    def __init__(
        self,
        casadi: Any,
        build: Callable[..., Residual[Traced]],
        accuracy: float,
        order: int,
    ) -> None:
        self.arithmetic = TracedArithmetic(casadi)
        smallest = [accuracy] + [0.0] * (order - 1)

        def place(index: int, lower: float, upper: float, xi: Traced) -> tuple[Traced, Traced]:
            low = Traced(lower - xi.sx, lower - smallest[index], -1 if lower <= 0.0 else 0)
            return low, Traced(upper + xi.sx, upper + smallest[index], 1 if upper >= 0.0 else 0)

        self._inner = build(
            arithmetic=self.arithmetic, place=place, constant=self.arithmetic.constant
        )

    def _lift(self, xi: tuple[Any, ...]) -> tuple[Traced, ...]:
        return tuple(Traced(value, 0.0, 1) for value in xi)

    def disturbance(self, index: int, xi: tuple[Any, ...]) -> Any:
        """Bound what acts on step ``index``, up to g_i."""
        return self._inner.disturbance(index, self._lift(xi)).sx

    def gain_upper(self, index: int, xi: tuple[Any, ...]) -> Any:
        """Bound g_i from above."""
        return self._inner.gain_upper(index, self._lift(xi)).sx

    def gain_lower(self, index: int, xi: tuple[Any, ...]) -> Any:
        """Bound g_i from below; the search keeps it positive."""
        value = self._inner.gain_lower(index, self._lift(xi))
        self.arithmetic.keep_positive(value)
        return value.sx
