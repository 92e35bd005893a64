"""Theorem 1's center rho x_i(0): by the true starts, or by measured ones as the paper prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.bounds.latch import resolutions
from bfppc_synth.bounds.performance import rho_floor, rho_rate
from bfppc_synth.bounds.rounding import above, below
from bfppc_synth.expressions.resolution import lower_bound, upper_bound
from bfppc_synth.model.bounds import CenterBounds

if TYPE_CHECKING:
    from fractions import Fraction

    from bfppc_synth.model.spec import PlantSpec


def noise_bounds(spec: PlantSpec) -> tuple[float, ...]:
    """delta_{M,i} = 2 delta_{0,i}: the error of x_i and that of its latched start.

    References
    ----------
    The paper's ``delta_M >= (1 + rho) delta_0``; docs/theory.md section 7.
    """
    return tuple(above(2 * delta) for delta in resolutions(spec))


def rho_slope(spec: PlantSpec) -> Fraction:
    """Bound rho_M on |drho| [1/s]; a declared ``rate_bound`` is taken where there is one."""
    rho = spec.performance.rho[0]
    return rho_rate(rho) if rho.rate_bound is None else upper_bound(rho.rate_bound)


def true_start_center(spec: PlantSpec) -> CenterBounds:
    """Bound rho x_i(0) over the declared starts: the errors of Theorem 1 are made of them.

    Parameters
    ----------
    spec : PlantSpec
        A plant file with reference 0 and one rho.

    Returns
    -------
    CenterBounds
        Range of rho x_i(0) [unit of x_i] over all t, |drho x_i(0)|, |x_{i+1}(0)|.

    References
    ----------
    docs/theory.md section 7; the paper's (11)-(12).
    """
    rho = spec.performance.rho[0]
    floor, slope = rho_floor(rho), rho_rate(rho)
    ranges, rates = [], []
    for interval in spec.initial:
        low, high = lower_bound(interval.lower), upper_bound(interval.upper)
        ranges.append((below(min(low, floor * low)), above(max(high, floor * high))))
        rates.append(above(slope * max(-low, high)))
    return _center(ranges, rates)


def printed_start_center(spec: PlantSpec, margins: tuple[Fraction, ...]) -> CenterBounds:
    """Bound the starts as the paper does, |x_i(0)| + margin, symmetric about 0.

    Its text has |q(x_i(0))| + delta_0 (21)-(25), its Example 1 |q(x_i(0))| + 2 delta_0
    (85)-(86), which also covers a start that is only declared.
    """
    slope = rho_slope(spec)
    sizes = [
        max(-lower_bound(interval.lower), upper_bound(interval.upper)) + margin
        for interval, margin in zip(spec.initial, margins, strict=True)
    ]
    ranges = [(-above(size), above(size)) for size in sizes]
    return _center(ranges, [above(slope * size) for size in sizes])


def printed_margins(spec: PlantSpec) -> tuple[Fraction, ...]:
    """2 delta_{0,i} on every declared start."""
    return tuple(2 * delta for delta in resolutions(spec))


def _center(ranges: list[tuple[float, float]], rates: list[float]) -> CenterBounds:
    return CenterBounds(
        r_lower=tuple(low for low, _ in ranges),
        r_upper=tuple(high for _, high in ranges),
        rate=tuple(rates),
        feed=(*(max(-low, high) for low, high in ranges[1:]), 0.0),
        v=0.0,
        v_rate=0.0,
        v_start=0.0,
    )
