"""What stands for the parts of a signal on [T, infinity): each knows its range and its limit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from bfppc_synth.bounds.natural import Range, natural

if TYPE_CHECKING:
    from collections.abc import Mapping

    import sympy as sp

# Rounding of exp and of its argument (below 745 wherever the result is not 0).
_LOOSE = 1.0 + 1e-12


class Quantity(Protocol):
    """A symbol of the tail form."""

    @property
    def limit(self) -> Range:
        """Range in the limit of large t."""

    @property
    def positive(self) -> bool | None:
        """Whether it is above 0 at every finite t; None if it is not known."""

    def after(self, start: float, box: Mapping[sp.Symbol, Range]) -> Range | None:
        """Range for all t >= ``start``; None if it is too early to say.

        ``box`` has the ranges of the symbols that were introduced before this one.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class Inverse:
    """s = 1/t."""

    limit: Range = (0.0, 0.0)
    positive: bool = True

    def after(self, start: float, box: Mapping[sp.Symbol, Range]) -> Range | None:
        """[0, 1/start]."""
        del box
        return 0.0, math.nextafter(1.0 / start, math.inf)


@dataclass(frozen=True, slots=True, kw_only=True)
class Swing:
    """A sine or cosine of which nothing else is known."""

    wave: sp.Expr
    limit: Range = (-1.0, 1.0)
    positive: None = None

    def after(self, start: float, box: Mapping[sp.Symbol, Range]) -> Range | None:
        """[-1, 1]."""
        del start, box
        return self.limit


@dataclass(frozen=True, slots=True, kw_only=True)
class Decay:
    """exp(form t**power), form < 0 from some time on."""

    power: sp.Rational
    form: sp.Expr
    limit: Range = (0.0, 0.0)
    positive: bool = True

    def rate(self, box: Mapping[sp.Symbol, Range]) -> float:
        """Lower bound on -form; positive when it is late enough."""
        return -natural(self.form, box)[1] / _LOOSE

    def after(self, start: float, box: Mapping[sp.Symbol, Range]) -> Range | None:
        """Exp falls with t once the form is negative throughout."""
        rate = self.rate(box)
        if rate <= 0.0:
            return None
        return 0.0, math.exp(-rate * start ** float(self.power)) * _LOOSE


@dataclass(frozen=True, slots=True, kw_only=True)
class Product:
    """t**power times decays, each to a positive power."""

    power: sp.Rational
    factors: tuple[tuple[Decay, float], ...]
    limit: Range = (0.0, 0.0)
    positive: bool = True

    def after(self, start: float, box: Mapping[sp.Symbol, Range]) -> Range | None:
        """Bound by t**m exp(-sum b t**k), which falls as soon as sum b k t**k >= m."""
        exponent, fall = float(self.power) * math.log(start), 0.0
        for decay, count in self.factors:
            rate = decay.rate(box)
            if rate <= 0.0:
                return None
            drop = count * rate * start ** float(decay.power)
            exponent -= drop
            fall += drop * float(decay.power)
        if fall < float(self.power) * _LOOSE:
            return None
        return 0.0, math.exp(exponent) * _LOOSE


@dataclass(frozen=True, slots=True, kw_only=True)
class Saturation:
    """tanh or atan of form t**power, form > 0 from some time on; ``most`` is the limit."""

    function: Any
    power: sp.Rational
    form: sp.Expr
    most: float
    positive: bool = True

    @property
    def limit(self) -> Range:
        """The value at infinity."""
        return self.most, self.most

    def after(self, start: float, box: Mapping[sp.Symbol, Range]) -> Range | None:
        """From the value at the least argument to the limit."""
        least = natural(self.form, box)[0] / _LOOSE * start ** float(self.power)
        if least <= 0.0:
            return None
        value = math.tanh(least) if self.most == 1.0 else math.atan(least)
        return value / _LOOSE, math.nextafter(self.most, math.inf)
