"""A bounded form of a signal for all t >= T, however large (docs/theory.md section 2).

Every t inside sin and cos becomes a phase, every other t becomes 1/s with s in [0, 1/T], and
what decays or saturates becomes a symbol that ranges from its value at T to its limit.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.bounds.derivative import NOT_ENCLOSED_FIX
from bfppc_synth.bounds.natural import Range, natural
from bfppc_synth.bounds.phases import Phases, split_frequency
from bfppc_synth.bounds.quantities import Decay, Inverse, Product, Quantity, Saturation, Swing
from bfppc_synth.errors import EnvelopeError

if TYPE_CHECKING:
    from collections.abc import Mapping

_LIMITS = {sp.tanh: 1.0, sp.atan: math.pi / 2}


class Tail:
    """An expression in t rewritten for t >= T.

    Parameters
    ----------
    expression : sympy.Expr
        In ``time`` and the symbols of ``constants``.
    time : sympy.Symbol
        t [s].
    constants : Mapping[sympy.Symbol, Range]
        Ranges of the other symbols.

    Attributes
    ----------
    form : sympy.Expr
        The expression in phases and quantities.
    is_periodic : bool
        Whether the form holds for every t, as it contains phases only.

    Raises
    ------
    EnvelopeError
        If a part of the expression has no limit and is neither periodic nor bounded.
    """

    def __init__(
        self, expression: sp.Expr, time: sp.Symbol, constants: Mapping[sp.Symbol, Range]
    ) -> None:
        self._time = time
        self._constants = dict(constants)
        self._inverse = sp.Symbol("s", positive=True)
        self._phases = Phases(expression, time)
        self._quantities: dict[sp.Symbol, Quantity] = {self._inverse: Inverse()}
        self._known: dict[Quantity, sp.Symbol] = {}
        self._originals: dict[sp.Symbol, sp.Expr] = {self._inverse: 1 / time}
        self._originals |= self._phases.originals
        self._conditions: list[sp.Expr] = []
        rewritten = self._rewrite(expression)
        self.form = self._settle(rewritten)
        # Asked before the form is settled, which may cancel (t - 1)/(t - 1) and its pole.
        self.is_periodic = not (
            self._conditions or rewritten.free_symbols & self._quantities.keys()
        )

    @property
    def narrow(self) -> frozenset[sp.Symbol]:
        """Symbols whose range shrinks to a point as T grows; only phases are not among them."""
        return frozenset(self._quantities)

    def box(self, start: float) -> dict[sp.Symbol, Range] | None:
        """Range of every symbol for t >= ``start`` > 0; None if ``start`` is too early for it."""
        box = self._constants | self._phases.ranges
        for symbol, quantity in self._quantities.items():
            found = quantity.after(start, box)
            if found is None:
                return None
            box[symbol] = found
        for condition in self._conditions:
            if natural(condition, box)[0] < 0.0:
                return None
        return self._used(box)

    def limit_box(self) -> dict[sp.Symbol, Range]:
        """Range of every symbol in the limit of large t."""
        return self._used(self._limit())

    def _limit(self) -> dict[sp.Symbol, Range]:
        limits = {symbol: quantity.limit for symbol, quantity in self._quantities.items()}
        return self._constants | self._phases.ranges | limits

    def _used(self, box: Mapping[sp.Symbol, Range]) -> dict[sp.Symbol, Range]:
        return {symbol: box[symbol] for symbol in sorted(self.form.free_symbols, key=str)}

    def _refusal(self, expression: sp.Expr, what: str) -> EnvelopeError:
        # The user knows t, not the symbols that stand for what he wrote.
        shown = expression
        for symbol, original in reversed(self._originals.items()):
            shown = shown.subs(symbol, original)
        return EnvelopeError(f"{shown} {what}", subexpression=str(shown), fix=NOT_ENCLOSED_FIX)

    def _symbol(self, original: sp.Expr, quantity: Quantity) -> sp.Symbol:
        """Symbol for a part of the signal; the same quantity has the same symbol."""
        if quantity not in self._known:
            symbol = sp.Symbol(f"h{len(self._known)}", real=True, positive=quantity.positive)
            self._known[quantity] = symbol
            self._quantities[symbol] = quantity
            self._originals[symbol] = original
        return self._known[quantity]

    def _rewrite(self, expression: sp.Expr) -> sp.Expr:
        if self._time not in expression.free_symbols:
            return expression
        if expression == self._time:
            return 1 / self._inverse
        if isinstance(expression, sp.Add | sp.Mul):
            return expression.func(*(self._rewrite(part) for part in expression.args))
        if isinstance(expression, sp.sin | sp.cos):
            return self._oscillation(expression)
        if isinstance(expression, sp.Max | sp.Min):
            return self._extremum(expression)
        inner = expression.args[0]
        if isinstance(expression, sp.Pow):
            power = expression.args[1]
            if power.is_Integer:
                return self._rewrite(inner) ** power
            growth, form = self._grade(self._rewrite(inner))
            return self._inverse ** (-growth * power) * form**power
        if not isinstance(expression, sp.Function) or len(expression.args) != 1:
            raise self._refusal(expression, "has no enclosure")
        growth, form = self._grade(self._rewrite(inner))
        if isinstance(expression, sp.sign):
            return sp.sign(form)
        if isinstance(expression, sp.Abs):
            return self._inverse**-growth * sp.Abs(form)
        if growth == 0:
            return expression.func(form)
        if isinstance(expression, sp.exp):
            side = self._direction(form)
            falling = Decay(power=growth, form=-side * form)
            return self._symbol(expression**-side, falling) ** -side
        if isinstance(expression, sp.sinh | sp.cosh):
            return self._rewrite(expression.rewrite(sp.exp))
        if expression.func in _LIMITS:
            # Both functions are odd: an argument that grows upward is enough.
            side = self._direction(form)
            most = _LIMITS[expression.func]
            rising = Saturation(function=expression.func, power=growth, form=side * form, most=most)
            return side * self._symbol(side * expression, rising)
        raise self._refusal(expression, "has no limit as t grows")

    def _oscillation(self, expression: sp.Expr) -> sp.Expr:
        # Where the argument has no phase, any value of the sine may stand beside any value of
        # the rest; sine and cosine of one argument are then taken as independent.
        swing = Swing(wave=expression)
        frequency, rest = split_frequency(expression.args[0], self._time)
        try:
            shift = self._settle(self._rewrite(rest))
        except EnvelopeError:
            return self._symbol(expression, swing)
        if frequency == 0:
            return expression.func(shift)
        phase = self._phases.phase(frequency)
        if phase is None:
            return self._symbol(expression, swing)
        return expression.func(phase + shift)

    def _extremum(self, expression: sp.Expr) -> sp.Expr:
        kept, dropped = [], []
        side = 1 if isinstance(expression, sp.Min) else -1
        for part in expression.args:
            growth, form = self._grade(self._rewrite(part))
            if growth == 0:
                kept.append(form)
            elif self._direction(form) == side:
                dropped.append((growth, form))
            else:
                raise self._refusal(expression, "is not bounded")
        if not kept:
            raise self._refusal(expression, "is not bounded")
        selected = expression.func(*kept)
        # A branch that grows away from the others is never selected after some time.
        self._conditions += [
            side * (form - self._inverse**growth * selected) for growth, form in dropped
        ]
        return selected

    def _direction(self, form: sp.Expr) -> int:
        lower, upper = natural(form, self._limit())
        if lower > 0.0:
            return 1
        if upper < 0.0:
            return -1
        raise self._refusal(form, "does not settle on a sign as t grows")

    def _settle(self, expression: sp.Expr) -> sp.Expr:
        growth, form = self._grade(expression)
        if growth != 0:
            raise self._refusal(expression, "is not bounded as t grows")
        return form

    def _grade(self, expression: sp.Expr) -> tuple[sp.Rational, sp.Expr]:
        """Write an expression as t**growth times a form without poles at s = 0."""
        settled, growing = [], []
        for term in sp.Add.make_args(expression):
            growth, form = self._grade_together(term)
            if growth == 0:
                settled.append(form)
            else:
                growing.append(term)
        # Terms that grow may cancel each other: only these share a denominator.
        growth, form = self._grade_together(sp.Add(*growing))
        return growth, sp.Add(form, *(self._inverse**growth * other for other in settled))

    def _grade_together(self, expression: sp.Expr) -> tuple[sp.Rational, sp.Expr]:
        decays = {symbol for symbol, kind in self._quantities.items() if isinstance(kind, Decay)}
        if not any(
            power.base in decays | {self._inverse} and power.exp.is_negative
            for power in expression.atoms(sp.Pow)
        ):
            return sp.S.Zero, expression
        above, below = sp.fraction(sp.together(expression))
        # Factors that the user wrote keep the enclosure tight ((t - 7)**2 is never negative);
        # only where growing terms may cancel is everything multiplied out.
        kept = self._cleared(above, below, decays)
        if kept is not None and kept[0] == 0 and self._has_limit(kept[1]):
            return kept
        cleared = self._cleared(sp.expand(above), sp.expand(below), decays)
        if cleared is None:
            raise self._refusal(expression, "is not bounded as t grows")
        return cleared

    def _has_limit(self, form: sp.Expr) -> bool:
        try:
            natural(form, self._limit())
        except EnvelopeError:
            return False
        return True

    def _cleared(
        self, above: sp.Expr, below: sp.Expr, decays: set[sp.Symbol]
    ) -> tuple[sp.Rational, sp.Expr] | None:
        """Divide both by the power of s that leaves the denominator a constant term."""
        numerator, denominator = self._monomials(above, decays), self._monomials(below, decays)
        lowest = [power for _, power, fading in denominator if not fading]
        if not lowest:
            return None
        shift = min(lowest)
        growth = max([shift - power for _, power, fading in numerator if not fading] + [sp.S.Zero])
        return growth, self._sum(numerator, growth - shift) / self._sum(denominator, -shift)

    def _monomials(
        self, expression: sp.Expr, decays: set[sp.Symbol]
    ) -> list[tuple[sp.Expr, sp.Rational, tuple[tuple[sp.Symbol, sp.Rational], ...]]]:
        """(coefficient, power of s, powers of decaying symbols) of every term."""
        found = []
        for term in sp.Add.make_args(expression):
            powers = dict(term.as_powers_dict())
            power = powers.pop(self._inverse, sp.S.Zero)
            fading = tuple(
                (symbol, powers.pop(symbol))
                for symbol in sorted(decays, key=str)
                if symbol in powers
            )
            coefficient = sp.Mul(*(base**exponent for base, exponent in powers.items()))
            found.append((coefficient, power, fading))
        return found

    def _sum(
        self,
        monomials: list[tuple[sp.Expr, sp.Rational, tuple[tuple[sp.Symbol, sp.Rational], ...]]],
        shift: sp.Rational,
    ) -> sp.Expr:
        terms = []
        for coefficient, power, fading in monomials:
            rest = power + shift
            if rest >= 0:
                factor = self._inverse**rest * sp.Mul(*(symbol**b for symbol, b in fading))
            else:
                factor = self._product(-rest, fading)
            terms.append(coefficient * factor)
        return sp.Add(*terms)

    def _product(
        self, power: sp.Rational, fading: tuple[tuple[sp.Symbol, sp.Rational], ...]
    ) -> sp.Symbol:
        decays = []
        for symbol, count in fading:
            decay = self._quantities[symbol]
            if isinstance(decay, Decay):
                decays.append((decay, float(count)))
        original = self._time**power * sp.Mul(*(symbol**count for symbol, count in fading))
        return self._symbol(original, Product(power=power, factors=tuple(decays)))
