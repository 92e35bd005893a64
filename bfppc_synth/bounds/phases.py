"""Phases that stand for the t of sin(a t + b) when t runs over all large times."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import sympy as sp

if TYPE_CHECKING:
    from bfppc_synth.bounds.natural import Range

# Each class is one more dimension of the search; beyond this every sine ranges over [-1, 1].
MOST_CLASSES = 3


def split_frequency(argument: sp.Expr, time: sp.Symbol) -> tuple[sp.Expr, sp.Expr]:
    """Write an argument as a t + rest, with a constant a (0 if it has no such term)."""
    frequency, rest = [], []
    for term in sp.Add.make_args(sp.expand(argument)):
        coefficient, power = term.as_coeff_exponent(time)
        if power == 1 and not coefficient.free_symbols:
            frequency.append(coefficient)
        else:
            rest.append(term)
    return sp.Add(*frequency), sp.Add(*rest)


class Phases:
    """One phase in [0, 2 pi] for every class of commensurate frequencies.

    Within a class all frequencies are integer multiples of a base frequency w, and w t mod
    2 pi runs over the whole circle: nothing is lost. Phases of different classes are
    independent, which is exact too: by Kronecker's theorem the orbit is dense in the torus.

    Parameters
    ----------
    expression : sympy.Expr
        Whose sines and cosines are to be replaced.
    time : sympy.Symbol
        t [s].
    """

    def __init__(self, expression: sp.Expr, time: sp.Symbol) -> None:
        frequencies = {
            split_frequency(oscillation.args[0], time)[0]
            for oscillation in expression.atoms(sp.sin, sp.cos)
        }
        classes: list[list[tuple[sp.Expr, sp.Rational]]] = []
        for frequency in sorted(frequencies - {sp.S.Zero}, key=str):
            for members in classes:
                # An undetected rational ratio costs tightness only, never soundness.
                ratio = sp.radsimp(sp.cancel(frequency / members[0][0]))
                if ratio.is_Rational:
                    members.append((frequency, ratio))
                    break
            else:
                classes.append([(frequency, sp.S.One)])
        self._phases: dict[sp.Expr, sp.Expr] = {}
        self.ranges: dict[sp.Symbol, Range] = {}
        self.originals: dict[sp.Symbol, sp.Expr] = {}
        if len(classes) <= MOST_CLASSES:
            for index, members in enumerate(classes):
                self._add_class(sp.Symbol(f"theta{index}", real=True), members, time)

    def _add_class(
        self, symbol: sp.Symbol, members: list[tuple[sp.Expr, sp.Rational]], time: sp.Symbol
    ) -> None:
        common = sp.Rational(
            math.gcd(*(int(abs(ratio.p)) for _, ratio in members)),
            math.lcm(*(int(ratio.q) for _, ratio in members)),
        )
        self.ranges[symbol] = (0.0, math.nextafter(2.0 * math.pi, math.inf))
        self.originals[symbol] = members[0][0] * common * time
        for frequency, ratio in members:
            self._phases[frequency] = ratio / common * symbol

    def phase(self, frequency: sp.Expr) -> sp.Expr | None:
        """Return what stands for ``frequency`` * t; None where there are too many classes."""
        return self._phases.get(frequency)
