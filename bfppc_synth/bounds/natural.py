"""The natural interval extension in plain floats, and what its rounding may amount to."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from bfppc_synth.majorants.envelope import envelope
from bfppc_synth.majorants.targets import FloatArithmetic

if TYPE_CHECKING:
    from collections.abc import Mapping

    import sympy as sp

Range: TypeAlias = tuple[float, float]

# The envelope is evaluated in plain floats. Each value is widened by this share of the sum of its
# terms' magnitudes, which covers thousands of roundings in any term, and the cancellation of terms.
ROUNDING = 1e-12
ARGUMENT_ROUNDING = 2e-15

_FLOATS = FloatArithmetic()


def natural(expression: sp.Expr, box: Mapping[sp.Symbol, Range]) -> Range:
    """Natural interval extension in plain floats; EnvelopeError where it has no value."""
    return envelope(expression, box, _FLOATS)


class Sum(NamedTuple):
    """Range of a sum in plain floats, and the sum of its terms' magnitudes."""

    lower: float
    upper: float
    size: float

    def widened(self) -> Range:
        """Include the rounding."""
        return self.lower - ROUNDING * self.size, self.upper + ROUNDING * self.size


def range_of_sum(terms: tuple[sp.Expr, ...], base: Mapping[sp.Symbol, Range]) -> Sum:
    """Add up the natural interval extensions of the terms."""
    lower = upper = size = 0.0
    for term in terms:
        low, up = natural(term, base)
        lower, upper, size = lower + low, upper + up, size + max(abs(low), abs(up))
    return Sum(lower, upper, size)
