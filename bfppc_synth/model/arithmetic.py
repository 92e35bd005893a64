"""The real numbers that a controller computes with, and where its functions come from."""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction


class Real(StrEnum):
    """The type of every number of the generated code."""

    DOUBLE = "double"
    FLOAT = "float"


class Mathematics(StrEnum):
    """Where tanh, sin, cos and exp come from: the platform, or the generated file itself."""

    LIBM = "libm"
    PORTABLE = "portable"


@dataclass(frozen=True, slots=True, kw_only=True)
class Arithmetic:
    """How the generated code computes; the certificate is about it."""

    real: Real = Real.DOUBLE
    mathematics: Mathematics = Mathematics.LIBM

    @property
    def single(self) -> bool:
        """Whether numbers are binary32."""
        return self.real is Real.FLOAT

    @property
    def portable(self) -> bool:
        """Whether functions are part of the generated code."""
        return self.mathematics is Mathematics.PORTABLE

    @property
    def bits(self) -> int:
        """Bits of the significand: one rounding is at most 2**-bits of its result."""
        return 24 if self.single else 53

    @property
    def largest(self) -> float:
        """The largest finite number."""
        return float.fromhex("0x1.fffffep+127") if self.single else math.ldexp(2 - 2**-52, 1023)

    def nearest(self, value: float) -> float:
        """Round to the numbers of the code."""
        return nearest_single(value) if self.single else value

    def above(self, value: float) -> float:
        """Round up to the numbers of the code."""
        near = self.nearest(value)
        return near if near >= value else self.next_above(near)

    def below(self, value: float) -> float:
        """Round down to the numbers of the code."""
        return 0.0 - self.above(-value)

    def next_above(self, value: float) -> float:
        """Return the next larger number of the code."""
        if not self.single:
            return math.nextafter(value, math.inf)
        # One unit in the last place; below a power of two from underneath, half of it.
        _, exponent = math.frexp(value) if value else (0.0, -149)
        step = math.ldexp(1.0, max(exponent - 24, -149))
        found = nearest_single(value + step)
        between = nearest_single(value + 0.5 * step)
        return between if between > value else found

    def literal(self, value: float) -> str:
        """Write the shortest decimal that reads back to a number of the code, without suffix.

        In binary32 it is nearer than a quarter of a unit in the last place, so that no reader
        that rounds twice can come to another number.
        """
        if not self.single or value == 0.0 or not math.isfinite(value):
            return repr(value)
        _, exponent = math.frexp(value)
        quarter = Fraction(2) ** (exponent - 26)
        for digits in range(17):
            text = repr(float(f"{value:.{digits}e}"))
            if abs(Fraction(text) - Fraction(value)) < quarter:
                return text
        return repr(value)


DEFAULT = Arithmetic()


def nearest_single(value: float) -> float:
    """Round to binary32; beyond its range to infinity."""
    try:
        return float(struct.unpack("f", struct.pack("f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)
