"""What is known of a nominal center before any gain is chosen (docs/theory.md section 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.nominal import AlongCenterError

if TYPE_CHECKING:
    from collections.abc import Sequence

    import sympy as sp

    from bfppc_synth.model.bounds import CenterBounds
    from bfppc_synth.model.nominal import NominalModel


@dataclass(frozen=True, slots=True, kw_only=True)
class NominalCenter:
    """What the residual of center nominal and the report read.

    ``center`` bounds r_i, dr_i, v, dv; ``ahead`` encloses r_2..r_n, v, one per channel;
    ``model_error`` is the supremum of |f_i(r; th) - f^_i(r) + (g_i(r; th) - g^_i(r)) r_{i+1}|
    over t, starts and parameters, without left-out terms [unit of x_i per s];
    ``parameter_errors`` what each uncertain parameter alone adds; ``authority`` encloses
    g^_i(r).
    """

    model: NominalModel
    center: CenterBounds
    ahead: tuple[tuple[float, float], ...]
    model_error: tuple[float, ...]
    parameter_errors: tuple[tuple[tuple[str, float], ...], ...]
    authority: tuple[tuple[float, float], ...]


LARGEST: Final = 1e100
"""No signal is larger: its square is far from the end of binary64, and no plant is so large."""


def overflow(message: str) -> EnvelopeError:
    """Say that numbers become too large along the center."""
    fix = "narrow initial or the reference, choose a longer transition, or use other units"
    return EnvelopeError(message, subexpression="", fix=fix)


def require_sizes(ranges: Sequence[tuple[float, float]], states: Sequence[sp.Symbol]) -> None:
    """Refuse a center that leaves the range of binary64.

    Parameters
    ----------
    ranges : Sequence[tuple[float, float]]
        Of r_1..r_n and v.
    states : Sequence[sympy.Symbol]
        x_1..x_n.

    Raises
    ------
    AlongCenterError
        At the reference, or at f of the state before the one that becomes too large.
    """
    names = [*(state.name for state in states), "u"]
    for i, (low, high) in enumerate(ranges):
        # Also what is no number fails this comparison.
        if max(-low, high) <= LARGEST:
            continue
        error = overflow(
            f"along the center {names[i]} would reach {max(-low, high):.3g}: beyond {LARGEST:g},"
            " powers leave the range of binary64"
        )
        raise AlongCenterError(error, index=max(i - 1, 0), key="f" if i else "reference")
