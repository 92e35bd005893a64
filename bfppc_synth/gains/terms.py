"""What each F_i* consists of: the terms and their shares."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bfppc_synth.model.bounds import CenterBounds, ChainBounds


def binding_terms(
    bounds: ChainBounds[float],
    half_widths: tuple[float, ...],
    center: CenterBounds,
    step: int,
) -> tuple[tuple[str, float], ...]:
    """Split F_i* into its terms, the largest first.

    Parameters
    ----------
    bounds, half_widths, center
        The chain, p_1..p_n and the center of one design.
    step : int
        0-based step i - 1.

    Returns
    -------
    tuple[tuple[str, float], ...]
        (term, share of F_i*); the shares sum to 1.

    References
    ----------
    docs/theory.md section 2, the divided form of F_i*.
    """
    i, g = step + 1, bounds.g_min[step]
    rate = center.rate[step]
    parts = [
        (f"f_{i}* and disturbance", (bounds.W[step] - rate) / g),
        (f"sup|dr_{i}|", rate / g),
    ]
    if step > 0:
        parts.append((f"|d alpha_{i - 1}|", bounds.B[step - 1] / g))
    if i < len(half_widths):
        parts.append((f"p_{i + 1}", half_widths[step + 1]))
        parts.append((f"sup|r_{i + 1}|", center.feed[step]))
    total = sum(value for _, value in parts)
    if total <= 0.0:
        return ()
    shares = [(name, value / total) for name, value in parts if value > 0.0]
    return tuple(sorted(shares, key=lambda part: -part[1]))
