"""The true residual of one step on cells of Omega, times, starts and parameters.

docs/theory.md section 9: R_i = d_i + phi_{i-1}'(e_{i-1}) de_{i-1} with de_{i-1} the derivative
itself, so that damping and signs count.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

import sympy as sp

from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, Functions, evaluate

if TYPE_CHECKING:
    from bfppc_synth.model.nominal import NominalModel
    from bfppc_synth.model.plant import Plant

T = TypeVar("T")


class Law(Protocol[T]):
    """The feedback shapes in one number type; ``step`` counts from 0."""

    def value(self, step: int, e: T) -> T:
        """Return phi(e)."""

    def rate(self, step: int, e: T) -> T:
        """Return phi'(e)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Center(Generic[T]):
    """r_1..r_n, v and dr_1..dr_n, at one and the same time."""

    r: list[T]
    rates: list[T]


@dataclass(frozen=True, slots=True, kw_only=True)
class Force:
    """What channel i is to the tight bounds.

    ``f`` enters with its sign (None: nothing is known of it), ``unknown`` bounds what enters
    with any sign; g lies in [``g_lower``, ``g_upper``], one expression where it is known.
    """

    f: sp.Expr | None
    unknown: tuple[sp.Expr, ...]
    g_lower: sp.Expr
    g_upper: sp.Expr
    followed: tuple[sp.Expr, sp.Expr] | None


def forces(plant: Plant, model: NominalModel | None) -> tuple[Force, ...]:
    """Say what is taken for the truth, channel by channel.

    Center performance knows f and g by their declared bounds where there are some; center
    nominal knows what the file has, and bounds the rest.

    References
    ----------
    docs/theory.md sections 2, 4 and 9.
    """
    nominal = model is not None
    found = []
    for i, channel in enumerate(plant.channels):
        known = channel.f if nominal else None
        unknown = [] if channel.disturbance == 0 else [channel.disturbance]
        # All that center performance knows of f is f*: as declared, else |f| itself.
        bound = channel.f if channel.f_bound is None else channel.f_bound
        if known is None and bound is not None and bound != 0:
            unknown.append(bound if channel.f_bound is not None else sp.Abs(bound))
        lower, upper = channel.g_min, channel.g_bound
        if channel.g is not None:
            lower = channel.g if nominal or lower is None else lower
            upper = channel.g if nominal or upper is None else upper
        found.append(
            Force(
                f=None if known == 0 else known,
                unknown=tuple(unknown),
                g_lower=sp.S.One if lower is None else lower,
                g_upper=sp.S.One if upper is None else upper,
                followed=None if model is None else (model.f[i], model.g[i]),
            )
        )
    return tuple(found)


class Residual(Generic[T]):
    """Evaluates s R_i / g_i on a facet, and s R_n on Omega.

    Parameters
    ----------
    plant : Plant
        The plant.
    model : NominalModel, optional
        What center nominal follows; None with center performance.
    functions : Functions[T]
        The number type: fields of cells in the search, CasADi in the program.

    References
    ----------
    docs/theory.md section 9.
    """

    def __init__(self, plant: Plant, model: NominalModel | None, functions: Functions[T]) -> None:
        self._plant = plant
        self.forces = forces(plant, model)
        self._functions = functions
        self.ranges = {
            symbol: (
                evaluate(lower, {}, FLOAT_FUNCTIONS),
                evaluate(upper, {}, FLOAT_FUNCTIONS),
            )
            for symbol, (lower, upper) in zip(plant.parameters, plant.ranges, strict=True)
        }

    def parameters(self, index: int) -> tuple[sp.Symbol, ...]:
        """List the ranged parameters that channels up to ``index`` (from 0) read."""
        read: set[sp.Symbol] = set()
        for force in self.forces[: index + 1]:
            parts = (force.f, *force.unknown, force.g_lower, force.g_upper)
            read |= {s for part in parts if part is not None for s in part.free_symbols}
        ranged = (s for s in self._plant.parameters if self.ranges[s][0] < self.ranges[s][1])
        return tuple(symbol for symbol in ranged if symbol in read)

    def load(
        self,
        index: int,
        law: Law[T],
        center: Center[T],
        errors: list[T],
        parameters: dict[sp.Symbol, T],
        side: T,
    ) -> T:
        """S R_i / g_i for step ``index`` (from 0), everything unknown at its worst.

        ``errors`` are e_1..e_i, ``side`` is s.
        """
        signed, any_sign, (low, high) = self._driven(index, law, center, errors, parameters, None)
        at, ahead = self._functions, center.r[index + 1]
        force = self.forces[index]
        if low is high and force.followed is not None:
            # (g - g^) r_{i+1} is small where g r_{i+1} and g^ r_{i+1} apart are not.
            signed = at.add(signed, self._mismatch(force, low, center, index))
        total = at.mul(side, signed)
        if any_sign is not None:
            total = at.add(total, any_sign)
        share = at.div(total, low)
        if low is high and force.followed is not None:
            return share
        if high is not low:
            share = at.maximum(share, at.div(total, high))
        return at.add(share, at.mul(side, ahead))

    def rate(
        self,
        law: Law[T],
        center: Center[T],
        errors: list[T],
        parameters: dict[sp.Symbol, T],
        side: T,
    ) -> T:
        """S R_n, everything unknown at its worst."""
        index, at = self._plant.order - 1, self._functions
        none = at.number(sp.S.Zero)
        signed, any_sign, _ = self._driven(index, law, center, errors, parameters, none)
        total = at.mul(side, signed)
        return total if any_sign is None else at.add(total, any_sign)

    def _driven(
        self,
        index: int,
        law: Law[T],
        center: Center[T],
        errors: list[T],
        parameters: dict[sp.Symbol, T],
        last: T | None,
    ) -> tuple[T, T | None, tuple[T, T]]:
        """R_i: its part of known sign, the bound of the other; and g_i.

        ``last`` is what x_{i+1} has beyond r_{i+1}; None leaves g_i r_{i+1} out.
        """
        at, values = self._functions, dict(parameters)
        signed: T | None = None
        any_sign: T | None = None
        away: T | None = None
        state = at.add(center.r[0], errors[0])
        for j, force in enumerate(self.forces[: index + 1]):
            values[self._plant.states[j]] = state
            low = high = evaluate(force.g_lower, values, at)
            if force.g_upper != force.g_lower:
                high = evaluate(force.g_upper, values, at)
            away = last
            if j < index:
                away = at.sub(errors[j + 1], law.value(j, errors[j]))
                state = at.add(center.r[j + 1], away)
            own, other = self._own(force, values, center, j, (low, high), away)
            if signed is not None:
                steep = law.rate(j - 1, errors[j - 1])
                own = at.add(own, at.mul(steep, signed))
                if any_sign is not None:
                    other = self._joined(other, at.mul(steep, any_sign))
            signed, any_sign = own, other
        if signed is None:
            raise IndexError(index)
        return signed, any_sign, (low, high)

    def _own(
        self,
        force: Force,
        values: dict[sp.Symbol, T],
        center: Center[T],
        j: int,
        g: tuple[T, T],
        away: T | None,
    ) -> tuple[T, T | None]:
        """f_j - dr_j + g_j (r_{j+1} + away), without the last term where away is None."""
        at = self._functions
        own = None if force.f is None else evaluate(force.f, values, at)
        other: T | None = None
        for part in force.unknown:
            other = self._joined(other, at.absolute(evaluate(part, values, at)))
        known = g[0] is g[1]
        if force.followed is None:
            own = at.neg(center.rates[j]) if own is None else at.sub(own, center.rates[j])
        else:
            model_f, model_g = force.followed
            along = dict(zip(self._plant.states, center.r[: j + 1], strict=False))
            if model_f != 0:
                followed = evaluate(model_f, along, at)
                own = at.neg(followed) if own is None else at.sub(own, followed)
            if own is None:
                own = at.number(sp.S.Zero)
            if known and away is not None:
                moved = at.mul(g[0], away)
                return at.add(at.add(own, moved), self._mismatch(force, g[0], center, j)), other
            if not known:
                carried = at.mul(evaluate(model_g, along, at), center.r[j + 1])
                own = at.sub(own, carried)
        if away is not None:
            moved, unsure = self._carried(g, at.add(center.r[j + 1], away))
            own, other = at.add(own, moved), self._joined(other, unsure)
        return own, other

    def _mismatch(self, force: Force, g: T, center: Center[T], j: int) -> T:
        """(g_j - g^_j) r_{j+1}."""
        at = self._functions
        same = force.followed is not None and force.followed[1] == force.g_lower
        if force.followed is None or (same and not force.g_lower.free_symbols):
            return at.number(sp.S.Zero)
        along = dict(zip(self._plant.states, center.r[: j + 1], strict=False))
        followed = evaluate(force.followed[1], along, at)
        return at.mul(at.sub(g, followed), center.r[j + 1])

    def _carried(self, g: tuple[T, T], ahead: T) -> tuple[T, T | None]:
        """G x as its middle and what its range adds at most."""
        at, (low, high) = self._functions, g
        if low is high:
            return at.mul(low, ahead), None
        half = at.number(sp.S.Half)
        middle, radius = (at.mul(half, part) for part in (at.add(low, high), at.sub(high, low)))
        return at.mul(middle, ahead), at.mul(radius, at.absolute(ahead))

    def _joined(self, a: T | None, b: T | None) -> T | None:
        if a is None or b is None:
            return b if a is None else a
        return self._functions.add(a, b)
