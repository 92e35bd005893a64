"""The center nominal at given times and starts, in intervals that carry partial derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.bounds.dual_arrays import Dual, DualFunctions, constant
from bfppc_synth.bounds.interval_arrays import Interval, IntervalFunctions, interval
from bfppc_synth.bounds.latch import reference_expression, resolutions, starts
from bfppc_synth.bounds.nominal.cells import Span
from bfppc_synth.bounds.nominal.model import smooth_part
from bfppc_synth.bounds.rounding import above, below
from bfppc_synth.expressions.evaluate import evaluate
from bfppc_synth.expressions.nominal import center_series, start_series, transition_series
from bfppc_synth.expressions.resolution import upper_bound
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.model.spec import ReferenceKind

if TYPE_CHECKING:
    from bfppc_synth.bounds.nominal.cells import Cells
    from bfppc_synth.expressions.series import Series
    from bfppc_synth.model.nominal import NominalModel
    from bfppc_synth.model.plant import Plant

AHEAD = sp.Symbol("r_ahead", real=True)
"""Stands for r_{i+1} in f_i + g_i r_{i+1}."""

_BASE = IntervalFunctions()


def known_part(plant: Plant, index: int) -> sp.Expr:
    """Return f_i + g_i r_{i+1} without what the residual counts in full, parameters kept."""
    channel = plant.channels[index]
    known = smooth_part(channel.f)
    return known if channel.g is None else known + channel.g * AHEAD


class Follower:
    """Evaluates r_1..r_n, v and what depends on them, one batch of cells at a time.

    Parameters
    ----------
    plant : Plant
        Reference, starts and parameter ranges.
    model : NominalModel
        f^, g^, T_s.

    Attributes
    ----------
    starts : list[Interval]
        Starts that may be latched: the declared box widened by the resolution.
    wide : list[int]
        States whose start is not one number: these are coordinates.
    runtime : bool
        Whether only bounds of the reference's derivatives are known.

    References
    ----------
    docs/theory.md section 4.
    """

    def __init__(self, plant: Plant, model: NominalModel) -> None:
        self._plant, self._model = plant, model
        self.runtime = plant.spec.reference.kind is ReferenceKind.RUNTIME
        self.reference = reference_expression(plant)
        # One coefficient beyond v: dv is wanted too.
        self._length = model.order + 2
        self.starts = [interval(below(s.lower), above(s.upper)) for s in starts(plant.spec)]
        self.wide = [j for j, s in enumerate(self.starts) if float(s.lower) < float(s.upper)]
        self._parameters = {
            symbol: Interval(_BASE.number(lower).lower, _BASE.number(upper).upper)
            for symbol, (lower, upper) in zip(plant.parameters, plant.ranges, strict=True)
        }

    def coordinates(self, cells: Cells) -> list[Interval]:
        """Return the starts that are coordinates of a batch, after those of its cells."""
        return [self.starts[j] for j in self.wide] if cells.span is Span.TRANSITION else []

    def at(self, expression: sp.Expr, index: int, r: list[Dual], count: int) -> Dual:
        """Evaluate an expression of channel ``index`` along the center."""
        values = {
            symbol: constant(edge, count)
            for symbol, edge in self._parameters.items()
            if symbol in expression.free_symbols
        }
        values |= dict(zip(self._plant.states[: index + 1], r, strict=False))
        values[AHEAD] = r[index + 1]
        return evaluate(expression, values, DualFunctions(count))

    def series(self, cells: Cells, at: list[Dual]) -> list[Series[Dual]]:
        """Series of r_1..r_n, v at given coordinates: those of the cells, then of the starts."""
        count = len(at[0].partials) if at else 0
        functions = DualFunctions(count)
        taylor = TaylorFunctions(functions, self._length)
        transition: Series[Dual] = ()
        here = at[: len(cells.symbols)]
        if cells.span is Span.TRANSITION:
            duration = constant(interval(self._model.transition, self._model.transition), count)
            begin = [constant(start, count) for start in self.starts]
            for j, value in zip(self.wide, at[len(here) :], strict=True):
                begin[j] = value
            transition = transition_series(
                functions,
                self._departure(tuple(begin), functions, count),
                here[0],
                duration,
                length=self._length,
            )
            here = [functions.mul(duration, here[0])]
        if self.runtime:
            reference = self._declared(count, self._length)
        else:
            values = {
                symbol: (value, functions.number(speed))
                for symbol, value, speed in zip(cells.symbols, here, cells.speeds, strict=True)
            }
            reference = evaluate(cells.reference, values, taylor)
            rest = tuple(
                constant(_BASE.div(interval(*bounds), _BASE.number(sp.factorial(k))), count)
                for k, bounds in enumerate(cells.rest[: self._length])
            )
            reference = taylor.add(reference, rest) if rest else reference
        center, v = center_series(
            self._model, functions, reference, transition, length=self._length
        )
        return [*center, v]

    def _departure(
        self, begin: tuple[Dual, ...], functions: DualFunctions, count: int
    ) -> tuple[Dual, ...]:
        """b^(j)(0) / j!, j < n: what the start has beyond the reference."""
        order = self._model.order
        taylor = TaylorFunctions(functions, order)
        if self.runtime:
            reference = self._declared(count, order)
        else:
            zero, one = functions.number(sp.S.Zero), functions.number(sp.S.One)
            reference = evaluate(self.reference, {self._plant.time: (zero, one)}, taylor)
        started = start_series(self._model, functions, begin)
        found = taylor.sub(started, reference)
        offset = self._plant.spec.offset
        if self.runtime and offset is not None:
            size = above(upper_bound(offset) + resolutions(self._plant.spec)[0])
            found = (constant(interval(-size, size), count), *found[1:])
        zero = functions.number(sp.S.Zero)
        return (*found, *(zero for _ in range(order - len(found))))

    def _declared(self, count: int, length: int) -> Series[Dual]:
        """Enclose a reference of which only |y_d^(k)| <= Y_k is known."""
        sizes = [above(upper_bound(bound)) for bound in self._plant.spec.reference.bounds]
        return tuple(
            constant(_BASE.div(interval(-size, size), _BASE.number(sp.factorial(k))), count)
            for k, size in enumerate(sizes[:length])
        )
