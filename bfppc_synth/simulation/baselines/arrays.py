"""Expressions and quantizers over numpy arrays: many closed loops at once, one an entry."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bfppc_synth.errors import ShapeError
from bfppc_synth.expressions.evaluate import evaluate
from bfppc_synth.model.spec import QuantizerKind
from bfppc_synth.simulation.loading import load_text
from bfppc_synth.simulation.statements import Statements

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from typing import Literal

    import sympy as sp
    from numpy.typing import NDArray

    from bfppc_synth.model.expression import Constant
    from bfppc_synth.model.spec import QuantizerSpec

    Array = NDArray[np.float64]
    # Measured value of one state in every loop; one with memory keeps a level a loop.
    Measure = Callable[[Array], Array]

_IMPORTS = (
    "from numpy import abs, arcsinh as asinh, arctan as atan, copysign, cos, cosh, exp, log,"
    " maximum, minimum, nan, power as pow, sign, sin, sinh, sqrt, tan, tanh, where"
)


class ArrayStatements(Statements):
    """Statements whose names are arrays; outside of a domain an entry is NaN."""

    def div(self, a: str, b: str) -> str:
        """Write a / b; a pole is infinite or NaN, which ends the loop that meets it."""
        return self._name(f"{a} / {b}")

    def sqrt(self, a: str) -> str:
        """Write the square root."""
        return self._name(f"sqrt({a})")

    def root_power(self, a: str, p: int, q: int) -> str:
        """Write a**(p/q), odd roots of negative numbers as docs/theory.md section 1 has them."""
        if q % 2 == 0:
            return self._name(f"pow({a}, {p / q!r})")
        return super().root_power(a, p, q)

    def sign(self, a: str) -> str:
        """Write -1, 0 or 1."""
        return self._name(f"sign({a})")

    def log(self, a: str) -> str:
        """Write the natural logarithm."""
        return self._name(f"log({a})")

    def minimum(self, a: str, b: str) -> str:
        """Write the smaller one."""
        return self._name(f"minimum({a}, {b})")

    def maximum(self, a: str, b: str) -> str:
        """Write the larger one."""
        return self._name(f"maximum({a}, {b})")

    def select(
        self, relation: Literal["<", "<="], left: str, right: str, then: str, otherwise: str
    ) -> str:
        """Write ``then`` where the relation holds, else ``otherwise``."""
        return self._name(f"where({left} {relation} {right}, {then}, {otherwise})")


def array_function(
    arguments: Sequence[str], out: ArrayStatements, results: Sequence[str]
) -> Callable[..., tuple[Any, ...]]:
    """Load statements as a function of arrays.

    Parameters
    ----------
    arguments : sequence of str
        Names that the statements use.
    out : ArrayStatements
        The statements.
    results : sequence of str
        What to return.

    Returns
    -------
    callable
        A constant result is a float, every other one an array.
    """
    body = [*out.lines, f"return ({', '.join(results)},)"]
    text = "\n    ".join([f"def function({', '.join(arguments)}):", *body])
    module = load_text(f"{_IMPORTS}\n\n{text}", name="array_function", origin="<array function>")
    function: Callable[..., tuple[Any, ...]] = module.function
    return function


def compile_arrays(
    expressions: Sequence[sp.Expr], arguments: Mapping[sp.Symbol, str]
) -> Callable[..., tuple[Any, ...]]:
    """Write expressions as one function of arrays, equal parts computed once.

    Raises
    ------
    EnvelopeError
        If a part has no rule, as the derivative of a jump.
    """
    out = ArrayStatements()
    results = [evaluate(expression, dict(arguments), out) for expression in expressions]
    return array_function(tuple(arguments.values()), out, results)


def make_measure(spec: QuantizerSpec) -> Measure:
    """Make the quantizer of one state for arrays: the same levels as ``make_quantizer``.

    References
    ----------
    docs/theory.md section 3; SPEC section 1, ``measurement.quantizer``.
    """
    if spec.kind is QuantizerKind.UNIFORM:
        step = _number(spec.step)
        if spec.dead_zone is None:
            return lambda x: step * np.floor(x / step + 0.5)
        return _dead_zone(step, _number(spec.dead_zone))
    if spec.kind is QuantizerKind.HYSTERESIS_UNIFORM:
        return _Hysteresis(_number(spec.step), _number(spec.hysteresis))
    if spec.kind is QuantizerKind.LOGARITHMIC_UNIFORM:
        return _logarithmic(spec)
    return lambda x: x


def _dead_zone(step: float, dead_zone: float) -> Measure:
    def measure(x: Array) -> Array:
        size = np.abs(x)
        cell = np.floor((size - dead_zone) / step)
        level = np.copysign(dead_zone + step * (cell + 0.5), x)
        return np.where((size < dead_zone) | (x == 0.0), 0.0, level)

    return measure


class _Hysteresis:
    """Levels that move only beyond their cell by the hysteresis; all begin at 0."""

    def __init__(self, step: float, hysteresis: float) -> None:
        self._step, self._hysteresis = step, hysteresis
        self._level: Array | float = 0.0

    def __call__(self, x: Array) -> Array:
        """Move every level until x lies inside its cell, then read it."""
        step, hysteresis = self._step, self._hysteresis
        # The least level with x below its upper threshold, and the greatest above its lower one.
        up = np.floor((x - hysteresis) / step - 0.5) + 1.0
        down = np.ceil((x + hysteresis) / step + 0.5) - 1.0
        self._level = np.minimum(np.maximum(self._level, up), down)
        return step * self._level


def _logarithmic(spec: QuantizerSpec) -> Measure:
    minimum, density = _number(spec.minimum), _number(spec.density)
    threshold, step = _number(spec.threshold), _number(spec.step)
    ratio = (1.0 + density) / (1.0 - density)

    def measure(x: Array) -> Array:
        size = np.abs(x)
        inner = np.clip(size, minimum, threshold)
        count = np.maximum(np.ceil(np.log(inner / minimum) / math.log(ratio)) - 1.0, 0.0)
        edge = minimum * ratio**count
        # The logarithm may land one cell off: the cell is (edge, edge * ratio].
        edge = np.where(inner > edge * ratio, edge * ratio, edge)
        edge = np.where((inner <= edge) & (count > 0.0), edge / ratio, edge)
        fine = np.where(size <= minimum, 0.0, edge * (1.0 + density))
        coarse = threshold + step * (np.floor((size - threshold) / step) + 0.5)
        return np.copysign(np.where(size >= threshold, coarse, fine), x)

    return measure


def _number(constant: Constant | None) -> float:
    if constant is None:
        raise ShapeError("measurement.quantizer: a key that its kind needs is missing")
    return constant.approximate
