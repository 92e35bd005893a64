"""The plant in sympy: what the majorants, the bounds and the code generation read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy as sp

    from bfppc_synth.model.spec import PlantSpec


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """dx_i = f + g x_{i+1} + d_i with the bounds that the file gives; absent ones are None.

    g is 1 where the file has neither g nor a bound of it; None where it is unknown
    between g_min and g_bound. disturbance is an expression >= |d_i| (default 0).
    """

    state: sp.Symbol
    f: sp.Expr | None
    g: sp.Expr | None
    f_bound: sp.Expr | None
    g_bound: sp.Expr | None
    g_min: sp.Expr | None
    disturbance: sp.Expr


@dataclass(frozen=True, slots=True, kw_only=True)
class Plant:
    """A strict-feedback plant (49).

    ``ranges`` are constant sympy expressions (lower, upper) per parameter; ``reference`` is
    an expression in ``time``, None when it is supplied at run time. All symbols are real.
    """

    spec: PlantSpec
    time: sp.Symbol
    states: tuple[sp.Symbol, ...]
    parameters: tuple[sp.Symbol, ...]
    ranges: tuple[tuple[sp.Expr, sp.Expr], ...]
    channels: tuple[Channel, ...]
    reference: sp.Expr | None
    funnel: sp.Expr | None

    @property
    def order(self) -> int:
        """Number of states n."""
        return len(self.states)
