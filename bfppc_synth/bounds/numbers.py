"""The chain's numbers as floats and as named sympy symbols."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    import sympy as sp

GRID = 64
# How each constant of the chain is written; i stands for its step.
_LATEX = {
    "xi": r"\xi_{i}",
    "X": "X_{i}",
    "A": "A_{i}",
    "L": "L_{i}",
    "W": "W_{i}",
    "G": "G_{i}",
    "g_min": "g_{m,i}",
    "D": "D_{i}",
    "B": "B_{i}",
    "eta": r"\eta_{i}",
    "Lambda": r"\Lambda_{i}",
    "F_star": "F^*_{i}",
    "zeta": r"\zeta",
    "V": "V",
    "U": "U",
    "delta_v": r"\delta_{v}",
}
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


class FloatNumbers:
    """Plain binary64: an estimate; the rigorous value is the separate checker's."""

    def number(self, value: float) -> float:
        """Return the value."""
        return float(value)

    def tanh(self, value: float) -> float:
        """Return the hyperbolic tangent."""
        return math.tanh(value)

    def sqrt(self, value: float) -> float:
        """Return the square root."""
        return math.sqrt(value)

    def minimum(self, left: float, right: float) -> float:
        """Return the smaller of two."""
        return min(left, right)

    def maximum(self, left: float, right: float) -> float:
        """Return the larger of two."""
        return max(left, right)

    def record(self, symbol: str, index: int, value: float) -> float:
        """Return the value itself."""
        del symbol, index
        return value

    def supremum(self, function: Callable[[float], float]) -> float:
        """Search [0, 1]: a grid, then golden section around its best point."""
        best = max(range(GRID + 1), key=lambda j: function(j / GRID))
        left, right = max(0.0, (best - 1) / GRID), min(1.0, (best + 1) / GRID)
        found = function(best / GRID)
        for _ in range(60):
            inner = right - _GOLDEN * (right - left)
            outer = left + _GOLDEN * (right - left)
            low, high = function(inner), function(outer)
            found = max(found, low, high)
            if low < high:
                left = inner
            else:
                right = outer
        return found


class SymbolNumbers:
    """Sympy expressions in which every recorded constant becomes a symbol of its own.

    ``definitions`` collects (symbol, defining expression) in the order of the chain.
    """

    def __init__(self) -> None:
        self.definitions: list[tuple[sp.Symbol, sp.Expr]] = []

    def number(self, value: float) -> sp.Expr:
        """Return an exact sympy number."""
        import sympy as sp

        return sp.nsimplify(value, rational=True)

    def tanh(self, value: sp.Expr) -> sp.Expr:
        """Return the hyperbolic tangent."""
        import sympy as sp

        return sp.tanh(value)

    def sqrt(self, value: sp.Expr) -> sp.Expr:
        """Return the square root."""
        import sympy as sp

        return sp.sqrt(value)

    def minimum(self, left: sp.Expr, right: sp.Expr) -> sp.Expr:
        """Return the smaller of two."""
        import sympy as sp

        return sp.Min(left, right)

    def maximum(self, left: sp.Expr, right: sp.Expr) -> sp.Expr:
        """Return the larger of two."""
        import sympy as sp

        return sp.Max(left, right)

    def supremum(self, function: Callable[[sp.Expr], sp.Expr]) -> sp.Expr:
        """Leave a formal supremum over sigma in [0, 1] standing for the reader."""
        import sympy as sp

        sigma = sp.Symbol("sigma", nonnegative=True)
        return sp.Function(r"\sup_{0 \le \sigma \le 1}")(function(sigma))

    def record(self, symbol: str, index: int, value: sp.Expr) -> sp.Symbol:
        """Give the value a name and remember its definition."""
        import sympy as sp

        named = sp.Symbol(
            _LATEX[symbol].replace("{i}", f"{{{index + 1}}}").replace(",i}", f",{index + 1}}}"),
            positive=True,
        )
        self.definitions.append((named, value))
        return named
