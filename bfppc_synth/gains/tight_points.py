"""The residual at finitely many worst points, as expressions in gains and half-widths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bfppc_synth.bounds.feedback import feedback, steepness
from bfppc_synth.bounds.tight.residual import Center, Residual
from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate

if TYPE_CHECKING:
    import sympy as sp

    from bfppc_synth.bounds.feedback import Numbers
    from bfppc_synth.bounds.tight.bounds import Worst
    from bfppc_synth.expressions.evaluate import Functions
    from bfppc_synth.expressions.flatten import Relation
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.shapes import GenericShape

# Keeps the slope of a root finite at 0.
_OFF = 1e-30


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """Worst points found so far: of each facet, and of the rate (empty where it is not asked).

    ``scales`` are the sizes of load_1..load_n and of the rate, at least that of F_i*.
    """

    facets: tuple[tuple[Worst, ...], ...]
    rate: tuple[Worst, ...]
    scales: tuple[float, ...]

    def joined(self, other: Points) -> Points:
        """Return the points of both."""
        pairs = zip(self.facets, other.facets, strict=True)
        return Points(
            facets=tuple(_union(a, b) for a, b in pairs),
            rate=_union(self.rate, other.rate),
            scales=other.scales,
        )


def _union(a: tuple[Worst, ...], b: tuple[Worst, ...]) -> tuple[Worst, ...]:
    return tuple(dict.fromkeys((*a, *b)))


class SymbolicFunctions:
    """``expressions.evaluate.Functions`` of CasADi expressions.

    ``module`` is the CasADi module, handed in by its one importer.
    """

    def __init__(self, module: Any) -> None:
        self._ca = module
        self.exp, self.log, self.sqrt = module.exp, module.log, module.sqrt
        self.sin, self.cos, self.tan = module.sin, module.cos, module.tan
        self.sinh, self.cosh, self.tanh = module.sinh, module.cosh, module.tanh
        self.atan, self.asinh = module.atan, module.asinh
        self.absolute, self.sign = module.fabs, module.sign
        self.minimum, self.maximum = module.fmin, module.fmax

    def number(self, value: sp.Expr) -> Any:
        """Return a constant."""
        return self._ca.SX(evaluate(value, {}, FLOAT_FUNCTIONS))

    def add(self, a: Any, b: Any) -> Any:
        """Return a + b."""
        return a + b

    def sub(self, a: Any, b: Any) -> Any:
        """Return a - b."""
        return a - b

    def mul(self, a: Any, b: Any) -> Any:
        """Return a * b."""
        return a * b

    def div(self, a: Any, b: Any) -> Any:
        """Return a / b."""
        return a / b

    def neg(self, a: Any) -> Any:
        """Return -a."""
        return -a

    def power(self, a: Any, exponent: int) -> Any:
        """Return a**exponent."""
        return a**exponent

    def root_power(self, a: Any, p: int, q: int) -> Any:
        """Return a**(p/q), odd roots as docs/theory.md section 1 has them."""
        size = (self._ca.fabs(a) + _OFF) ** (p / q)
        return self._ca.sign(a) * size if p % 2 and q % 2 else size

    def select(self, relation: Relation, left: Any, right: Any, then: Any, otherwise: Any) -> Any:
        """Return one of two branches."""
        chosen = left < right if relation == "<" else left <= right
        return self._ca.if_else(chosen, then, otherwise)


class _SymbolicLaw:
    """The shapes as they are being searched."""

    def __init__(self, shapes: tuple[GenericShape[Any], ...], numbers: Numbers[Any]) -> None:
        self._shapes, self._numbers = shapes, numbers

    def value(self, step: int, e: Any) -> Any:
        return feedback(self._shapes[step], e, self._numbers)

    def rate(self, step: int, e: Any) -> Any:
        return steepness(self._shapes[step], e, self._numbers)


class PointLoads:
    """s R_i / g_i and s R_n at the points, for shapes and half-widths that are searched."""

    def __init__(
        self,
        problem: DesignProblem,
        shapes: tuple[GenericShape[Any], ...],
        half_widths: tuple[Any, ...],
        numbers: Numbers[Any],
        module: Any,
    ) -> None:
        model = None if problem.nominal is None else problem.nominal.model
        functions: Functions[Any] = SymbolicFunctions(module)
        self._residual: Residual[Any] = Residual(problem.plant, model, functions)
        self._law = _SymbolicLaw(shapes, numbers)
        self._widths, self._module = half_widths, module
        self._fixed = {
            symbol: module.SX(0.5 * (low + high))
            for symbol, (low, high) in self._residual.ranges.items()
        }

    def load(self, step: int, point: Worst) -> Any:
        """S R_i / g_i, i = ``step`` + 1."""
        center, errors, parameters = self._at(point)
        side = self._module.SX(point.side)
        return self._residual.load(step, self._law, center, errors, parameters, side)

    def rate(self, point: Worst) -> Any:
        """S R_n."""
        center, errors, parameters = self._at(point)
        side = self._module.SX(point.side)
        return self._residual.rate(self._law, center, errors, parameters, side)

    def _at(self, point: Worst) -> tuple[Center[Any], list[Any], dict[sp.Symbol, Any]]:
        number = self._module.SX
        center = Center(r=[number(r) for r in point.r], rates=[number(r) for r in point.rates])
        errors = [share * p for share, p in zip(point.errors, self._widths, strict=False)]
        own = {symbol: number(value) for symbol, value in point.parameters}
        return center, errors, self._fixed | own
