"""load_i and rate of one design, with the points where they are reached (docs/theory.md 9)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.bounds.interval_arrays import Interval
from bfppc_synth.bounds.tight.center import CenterTable
from bfppc_synth.bounds.tight.fields import Field, FieldFunctions
from bfppc_synth.bounds.tight.law import FieldLaw
from bfppc_synth.bounds.tight.residual import Center, Residual
from bfppc_synth.bounds.tight.search import Effort, Extremum, maximize
from bfppc_synth.bounds.tight.spans import nominal_spans, performance_spans

if TYPE_CHECKING:
    import sympy as sp

    from bfppc_synth.bounds.tight.center import Span
    from bfppc_synth.model.bounds import CenterBounds, SignalBounds
    from bfppc_synth.model.nominal import NominalModel
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.shapes import Shape


@dataclass(frozen=True, slots=True, kw_only=True)
class Worst:
    """A point near a supremum, in shares of the tube so that it moves with it.

    ``errors`` are e_j / p_j; ``parameters`` the values of the ranged ones, by symbol.
    """

    side: float
    r: tuple[float, ...]
    rates: tuple[float, ...]
    errors: tuple[float, ...]
    parameters: tuple[tuple[sp.Symbol, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Supremum:
    """Enclosure of a load or of the rate, and worst points."""

    lower: float
    upper: float
    points: tuple[Worst, ...]
    cuts: int


class TightSearch:
    """Searches the suprema of the true residual for any gains of one plant and center.

    Parameters
    ----------
    plant : Plant
        The plant.
    spans : tuple[Span, ...]
        Times and starts.

    References
    ----------
    docs/theory.md section 9.
    """

    def __init__(self, plant: Plant, spans: tuple[Span, ...], model: NominalModel | None) -> None:
        self.plant = plant
        self.residual = Residual[Field](plant, model, FieldFunctions())
        self._tables = tuple(CenterTable(span, plant.order) for span in spans)
        self._fixed = {
            symbol: _point(0.5 * (lower + upper))
            for symbol, (lower, upper) in self.residual.ranges.items()
        }

    def load(
        self,
        index: int,
        shapes: tuple[Shape, ...],
        half_widths: tuple[float, ...],
        effort: Effort,
    ) -> Supremum:
        """Bound load_i, i = ``index`` + 1; reads phi_1..phi_{i-1} and p_1..p_{i+1}."""
        ahead = half_widths[index + 1] if index + 1 < len(half_widths) else 0.0
        symbols = self.residual.parameters(index)
        edge, law = half_widths[index], FieldLaw(shapes)

        def objective(center: Center[Field], free: list[Field], side: Field) -> Field:
            facet = Field(Interval(edge * side.value.lower, edge * side.value.upper), None)
            errors = [*free[:index], facet]
            parameters = self._fixed | dict(zip(symbols, free[index:], strict=True))
            return self.residual.load(index, law, center, errors, parameters, side)

        found = maximize(
            self._tables,
            self._box(half_widths[:index], symbols),
            objective,
            offset=ahead,
            effort=effort,
        )
        return _supremum(found, half_widths, index, symbols, facet=True)

    def rate(
        self, shapes: tuple[Shape, ...], half_widths: tuple[float, ...], effort: Effort
    ) -> Supremum:
        """Bound sup |R_n| over Omega."""
        order = self.plant.order
        symbols, law = self.residual.parameters(order - 1), FieldLaw(shapes)

        def objective(center: Center[Field], free: list[Field], side: Field) -> Field:
            parameters = self._fixed | dict(zip(symbols, free[order:], strict=True))
            return self.residual.rate(law, center, free[:order], parameters, side)

        found = maximize(
            self._tables,
            self._box(half_widths, symbols),
            objective,
            offset=0.0,
            effort=effort,
        )
        return _supremum(found, half_widths, order, symbols, facet=False)

    def _box(
        self, half_widths: tuple[float, ...], symbols: tuple[sp.Symbol, ...]
    ) -> tuple[np.ndarray, np.ndarray]:
        edges = [self.residual.ranges[symbol] for symbol in symbols]
        lower = [-p for p in half_widths] + [low for low, _ in edges]
        upper = [*half_widths, *(high for _, high in edges)]
        return np.array(lower, dtype=float), np.array(upper, dtype=float)


def tight_search(
    plant: Plant,
    signals: SignalBounds,
    center: CenterBounds,
    model: NominalModel | None,
) -> TightSearch:
    """Prepare the search for center nominal (``model`` is there) or performance.

    Raises
    ------
    EnvelopeError
        If the center has no enclosure.
    """
    if model is None:
        return TightSearch(plant, performance_spans(plant, signals, center), None)
    return TightSearch(plant, nominal_spans(plant, model), model)


def _supremum(
    found: Extremum,
    half_widths: tuple[float, ...],
    errors: int,
    symbols: tuple[sp.Symbol, ...],
    *,
    facet: bool,
) -> Supremum:
    points = []
    for peak in found.peaks:
        shares = [e / p for e, p in zip(peak.free[:errors], half_widths, strict=False)]
        if facet:
            shares.append(peak.side)
        points.append(
            Worst(
                side=peak.side,
                r=peak.r,
                rates=peak.rates,
                errors=tuple(shares),
                parameters=tuple(zip(symbols, peak.free[errors:], strict=True)),
            )
        )
    return Supremum(lower=found.lower, upper=found.upper, points=tuple(points), cuts=found.cuts)


def _point(value: float) -> Field:
    at = np.array(value)
    return Field(Interval(at, at), None)
