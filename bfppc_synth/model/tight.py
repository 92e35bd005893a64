"""What `bounds: tight` puts in place of the chain's termwise loads."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class TightBounds:
    """Suprema of the true residual over the facets and over Omega (docs/theory.md section 9).

    With R_i = d_i + phi_{i-1}'(e_{i-1}) de_{i-1}, made of true states on Omega:
    ``load[i - 1]`` is at least sup s R_i / g_i over both facets e_i = s p_i, so that
    F_i* = load_i + p_{i+1} (nothing is added for i = n; r_{i+1} stands in R_i);
    ``rate`` is at least sup |R_n| over all of Omega: D_n in V_n and in (U2').
    """

    load: tuple[float, ...]
    rate: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Termwise:
    """What termwise bounds say beside tight ones.

    ``load`` is D_i / g_{m,i} + s_{i+1} and ``rate`` D_n of the same gains; ``U`` the certified
    peak input of the best design by termwise bounds, None where they find none.
    """

    load: tuple[float, ...]
    rate: float
    U: float | None
