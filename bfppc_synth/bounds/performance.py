"""The paper's performance functions (52)-(53): their bounds and their expressions."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.bounds.rounding import above
from bfppc_synth.expressions.resolution import lower_bound, upper_bound
from bfppc_synth.expressions.symbolic import to_sympy
from bfppc_synth.model.spec import RhoKind

if TYPE_CHECKING:
    from bfppc_synth.model.expression import Constant
    from bfppc_synth.model.spec import RhoSpec


def rho_floor(rho: RhoSpec) -> Fraction:
    """Lower end inf rho that the bounds may use: 0 for (52), the floor of (53)."""
    return Fraction(0) if rho.kind is RhoKind.COSINE else lower_bound(rho.floor)


def rho_rate(rho: RhoSpec) -> Fraction:
    """Bound |drho| [1/s]: 1/(2 t_s) for (52), (1 - floor) rate for (53)."""
    if rho.kind is RhoKind.COSINE:
        return 1 / (2 * lower_bound(rho.t_s))
    return (1 - lower_bound(rho.floor)) * upper_bound(rho.rate)


def rho_expression(rho: RhoSpec, time: sp.Symbol) -> sp.Expr:
    """Rho as a function of t, up to ``rho_end``."""
    if rho.kind is RhoKind.COSINE:
        return (1 + sp.cos(time / _exact(rho.t_s))) / 2
    floor = _exact(rho.floor)
    return floor + (1 - floor) * sp.exp(-_exact(rho.rate) * time)


def rho_end(rho: RhoSpec) -> float:
    """Time [s] from which rho is exactly 0, rounded up; infinity for (53)."""
    if rho.kind is RhoKind.EXPONENTIAL:
        return math.inf
    return math.nextafter(math.pi * above(upper_bound(rho.t_s)), math.inf)


def _exact(constant: Constant | None) -> sp.Expr:
    return sp.S.Zero if constant is None else to_sympy(constant.tree, {})
