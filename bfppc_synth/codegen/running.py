"""Numbers that carry a bound on their own rounding, for the tolerances of the golden vectors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Self

if TYPE_CHECKING:
    from collections.abc import Callable

#: A library function is within 4 units in the last place, 8 roundings of its result.
_FUNCTION_ROUNDINGS: Final = 8.0
#: The bounds are themselves computed in binary64.
_ROOM: Final = 1.0 + 2.0**-40


@dataclass(slots=True)
class Meter:
    """What a chain of operations shares: its rounding, and whether a comparison was close.

    ``unit`` is the unit roundoff, ``smallest`` the smallest positive number.

    ``doubtful`` becomes true where another arithmetic may have taken the other branch.
    """

    unit: float
    smallest: float = 2.0**-1074
    doubtful: bool = False

    def number(self, value: float) -> Running:
        """Take an input without error."""
        return Running(value, 0.0, self)

    def function(self, plain: Callable[..., float]) -> Callable[..., float]:
        """Let a function of the math module pass errors on."""

        def followed(*arguments: float) -> float:
            value = plain(*map(float, arguments))
            first, error = float(arguments[0]), error_of(arguments[0])
            if plain in (math.sin, math.cos):
                spread = error
            else:
                # Monotone or convex in its first argument: the ends of an interval say enough.
                try:
                    ends = (
                        plain(end, *map(float, arguments[1:]))
                        for end in (first - error, first + error)
                    )
                    spread = max(abs(end - value) for end in ends)
                except (ValueError, OverflowError):
                    spread = math.inf
            own = self.unit * abs(value) + self.smallest
            return Running(value, spread + _FUNCTION_ROUNDINGS * own, self)

        return followed

    def rounding(self, plain: Callable[[float], float]) -> Callable[[float], float]:
        """Let a rounding pass errors on; every operation has counted its own already."""

        def followed(value: float) -> float:
            rounded = plain(float(value))
            moved = 2.0 * self.unit * abs(rounded) if isinstance(value, Running) else 0.0
            return Running(rounded, error_of(value) + moved, self)

        return followed


def error_of(value: float) -> float:
    """Return the bound that a number carries; plain numbers are exact."""
    return value.error if isinstance(value, Running) else 0.0


class Running(float):
    """A binary64 number with a first-order bound on what rounding has done to it."""

    __slots__ = ("error", "meter")
    error: float
    meter: Meter

    def __new__(cls, value: float, error: float, meter: Meter) -> Self:
        """Attach an error; a NaN among errors counts as infinite."""
        made = super().__new__(cls, value)
        made.error = math.inf if math.isnan(error) else error * _ROOM
        made.meter = meter
        return made

    def _rounded(self, value: float, error: float) -> Running:
        own = self.meter.unit * abs(value) + self.meter.smallest
        return Running(value, error + own, self.meter)

    def __add__(self, other: float) -> Running:
        """Add; so do the errors."""
        return self._rounded(float(self) + float(other), self.error + error_of(other))

    __radd__ = __add__

    def __sub__(self, other: float) -> Running:
        """Subtract; errors add."""
        return self._rounded(float(self) - float(other), self.error + error_of(other))

    def __rsub__(self, other: float) -> Running:
        """Subtract from a plain number."""
        return self._rounded(float(other) - float(self), self.error)

    def __mul__(self, other: float) -> Running:
        """Multiply: |a| e_b + |b| e_a + e_a e_b."""
        a, b, mine, its = abs(float(self)), abs(float(other)), self.error, error_of(other)
        return self._rounded(float(self) * float(other), a * its + b * mine + mine * its)

    __rmul__ = __mul__

    def __truediv__(self, other: float) -> Running:
        """Divide by a number that is away from 0."""
        return self._quotient(float(self), self.error, float(other), error_of(other))

    def __rtruediv__(self, other: float) -> Running:
        """Divide a plain number."""
        return self._quotient(float(other), 0.0, float(self), self.error)

    def _quotient(self, a: float, above: float, b: float, below: float) -> Running:
        value, room = a / b, abs(b) - below
        return self._rounded(value, (above + abs(value) * below) / room if room > 0.0 else math.inf)

    def __neg__(self) -> Running:
        """Change the sign, which rounds nothing."""
        return Running(-float(self), self.error, self.meter)

    def __abs__(self) -> Running:
        """Drop the sign, which rounds nothing."""
        return Running(abs(float(self)), self.error, self.meter)

    def _judged(self, other: float) -> float:
        """Note a comparison that the errors could turn round."""
        errors = self.error + error_of(other)
        difference = float(self) - float(other)
        if errors > 0.0 and not abs(difference) > errors:
            self.meter.doubtful = True
        return float(other)

    def __lt__(self, other: float) -> bool:
        """Compare, noting doubt."""
        return float(self) < self._judged(other)

    def __le__(self, other: float) -> bool:
        """Compare, noting doubt."""
        return float(self) <= self._judged(other)

    def __gt__(self, other: float) -> bool:
        """Compare, noting doubt."""
        return float(self) > self._judged(other)

    def __ge__(self, other: float) -> bool:
        """Compare, noting doubt."""
        return float(self) >= self._judged(other)
