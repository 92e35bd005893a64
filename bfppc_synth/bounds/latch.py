"""What the center is anchored to: the starts and the offset that the controller latches."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.bounds.derivative import NOT_ENCLOSED_FIX
from bfppc_synth.bounds.rounding import above, below
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.resolution import lower_bound, resolution, upper_bound
from bfppc_synth.model.spec import Anchor, ReferenceKind

if TYPE_CHECKING:
    from bfppc_synth.bounds.natural import Range
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.spec import PlantSpec

_DIGITS = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Exact bounds on the start that the center of one state is anchored to."""

    lower: Fraction
    upper: Fraction

    @property
    def size(self) -> Fraction:
        """Largest magnitude."""
        return max(-self.lower, self.upper)


def resolutions(spec: PlantSpec) -> tuple[Fraction, ...]:
    """delta_{0,1}..delta_{0,n}, quantization plus noise [unit of x_i]."""
    measurement = spec.measurement
    return tuple(map(resolution, measurement.quantizers, measurement.noise))


def starts(spec: PlantSpec) -> tuple[Start, ...]:
    """Collect the starts x_i(0) that the center may be anchored to: the declared box.

    The latched anchor takes the measured start, which lies up to delta_{0,i} outside the
    declared range.

    References
    ----------
    docs/theory.md section 3, "Anchoring".
    """
    latched = spec.synthesis.anchor is Anchor.LATCHED
    found = []
    for interval, delta in zip(spec.initial, resolutions(spec), strict=True):
        wide = delta if latched else Fraction(0)
        found.append(
            Start(
                lower=lower_bound(interval.lower) - wide, upper=upper_bound(interval.upper) + wide
            )
        )
    return tuple(found)


def reference_expression(plant: Plant) -> sp.Expr:
    """y_d as an expression in t; 0 where the file has none."""
    return sp.S.Zero if plant.reference is None else plant.reference


def offset_range(plant: Plant) -> Range:
    """Range of a = x_1(0) - y_d(0), with x_1(0) measured for the latched anchor."""
    spec = plant.spec
    start = starts(spec)[0]
    if spec.reference.kind is not ReferenceKind.RUNTIME:
        lower, upper = value_at_zero(reference_expression(plant), plant.time)
        return below(start.lower - upper), above(start.upper - lower)
    if spec.offset is None:
        size = upper_bound(spec.reference.bounds[0])
        return below(start.lower - size), above(start.upper + size)
    wide = resolutions(spec)[0] if spec.synthesis.anchor is Anchor.LATCHED else Fraction(0)
    size = upper_bound(spec.offset) + wide
    return below(-size), above(size)


def value_at_zero(reference: sp.Expr, time: sp.Symbol) -> tuple[Fraction, Fraction]:
    """Enclose y_d(0) [unit of y], exactly where it is rational.

    Raises
    ------
    EnvelopeError
        If the reference has no finite value there.
    """
    value = reference.subs(time, 0)
    if value.is_Rational:
        exact = Fraction(int(value.p), int(value.q))
        return exact, exact
    near = sp.N(value, _DIGITS)
    if not (near.is_Float and near.is_finite):
        raise EnvelopeError(
            f"the reference {reference} has no value at t = 0",
            subexpression=str(reference),
            fix=NOT_ENCLOSED_FIX,
        )
    exact = Fraction(str(near))
    # Half of the digits are kept in reserve, so that a value of exactly 0 is enclosed too.
    wide = (1 + abs(exact)) / 10 ** (_DIGITS // 2)
    return exact - wide, exact + wide
