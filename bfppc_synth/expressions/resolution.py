"""What a measurement can tell apart: delta_0 of each quantizer, exact where the file is."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

from bfppc_synth.model.spec import QuantizerKind

if TYPE_CHECKING:
    from bfppc_synth.model.expression import Constant
    from bfppc_synth.model.spec import QuantizerSpec


def upper_bound(constant: Constant | None) -> Fraction:
    """Return a rational that is not below the constant: the constant itself where rational.

    An absent constant is 0. An irrational one is known to some fifty digits before it is
    rounded to binary64, so the next binary64 lies above it.
    """
    if constant is None:
        return Fraction(0)
    if constant.exact is not None:
        return constant.exact
    return Fraction(math.nextafter(constant.approximate, math.inf))


def lower_bound(constant: Constant | None) -> Fraction:
    """Return a rational that is not above the constant (see ``upper_bound``)."""
    if constant is None:
        return Fraction(0)
    if constant.exact is not None:
        return constant.exact
    return Fraction(math.nextafter(constant.approximate, -math.inf))


def quantization(quantizer: QuantizerSpec) -> Fraction:
    """Bound |q(x) - x| over all x [unit of x].

    References
    ----------
    The bounds of the quantizers are proved on the page of measurement in the manual; the
    logarithmic one has its widest cell at the threshold.
    """
    half_step = upper_bound(quantizer.step) / 2
    match quantizer.kind:
        case QuantizerKind.NONE:
            return Fraction(0)
        case QuantizerKind.UNIFORM:
            return max(half_step, upper_bound(quantizer.dead_zone))
        case QuantizerKind.HYSTERESIS_UNIFORM:
            return half_step + upper_bound(quantizer.hysteresis)
        case QuantizerKind.LOGARITHMIC_UNIFORM:
            widest = upper_bound(quantizer.density) * upper_bound(quantizer.threshold)
            return max(upper_bound(quantizer.minimum), widest, half_step)


def resolution(quantizer: QuantizerSpec, noise: Constant) -> Fraction:
    """Bound delta_0 = |measured x - x|: quantization plus noise [unit of x].

    Exact for rational data, else rounded up.

    References
    ----------
    docs/theory.md section 0.
    """
    return quantization(quantizer) + upper_bound(noise)
