"""What is known of a nominal center before any gain is chosen (docs/theory.md section 4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
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
