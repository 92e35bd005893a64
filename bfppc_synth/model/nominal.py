"""The part of the plant that center nominal follows (docs/theory.md section 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import sympy as sp


@dataclass(frozen=True, slots=True, kw_only=True)
class NominalModel:
    """f^_i, g^_i with every parameter at its nominal value, and what f^ leaves out.

    ``f``, ``g`` are smooth expressions in x_1..x_i and exact numbers; ``left_out`` are the
    additive terms of f_i, parameters kept, that lack the regularity of docs/theory.md section
    4 and so stay in W_i; ``transition`` is T_s [s], the binary64 number that the generated
    code contains.
    """

    states: tuple[sp.Symbol, ...]
    f: tuple[sp.Expr, ...]
    g: tuple[sp.Expr, ...]
    left_out: tuple[tuple[sp.Expr, ...], ...]
    transition: float

    @property
    def order(self) -> int:
        """Number of states n."""
        return len(self.states)


@dataclass(frozen=True, slots=True, kw_only=True)
class NominalSplit:
    """What the certified peak input and each W_i of a nominal design consist of.

    U = ``feedforward`` (sup |v|) + ``tube`` (phi_n(p_n + eta_n)) + ``actuator_error`` [unit of
    u]; ``disturbance`` lists the terms of each W_i (source, size) [unit of x_i per s], whose
    sum it is; ``parameters`` what each uncertain parameter alone adds to the model error,
    whose joint supremum is at most their sum.
    """

    feedforward: float
    tube: float
    actuator_error: float
    disturbance: tuple[tuple[tuple[str, float], ...], ...]
    parameters: tuple[tuple[tuple[str, float], ...], ...]
