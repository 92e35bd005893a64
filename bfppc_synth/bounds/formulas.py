"""The chain as formulas: the same code, run on symbols."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.bounds.chain import ChainInput, ChainRules, Loads, evaluate_chain
from bfppc_synth.bounds.numbers import SymbolNumbers
from bfppc_synth.model.shapes import GenericShape, Terms
from bfppc_synth.model.spec import BoundsKind, CenterKind

if TYPE_CHECKING:
    from bfppc_synth.model.shapes import Gain


# A root or a minimum of more operations than this gets a letter of its own.
LARGEST = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class ChainFormula:
    """One line of the chain: LaTeX of the constant, of its definition, and where it is found.

    ``field`` is the name in report.json's ``bounds`` and ``index`` its 0-based position there
    (None for a scalar). ``parts`` are abbreviations (symbol, definition) that ``definition``
    uses, each before those that it uses itself.
    """

    symbol: str
    definition: str
    field: str
    index: int | None
    parts: tuple[tuple[str, str], ...] = ()


class _SymbolResidual:
    """W_i, maj g_i*, g_{m,i} as named symbols."""

    def __init__(self, center: CenterKind) -> None:
        self._center = center

    def disturbance(self, index: int, xi: tuple[sp.Expr, ...]) -> sp.Expr:
        del xi
        i = index + 1
        if self._center is CenterKind.NOMINAL:
            return _positive(rf"\sup\left|w_{{{i}}}\right|")
        drift, unknown = (
            _positive(rf"\overline{{f}}_{{{i}}}"),
            _positive(rf"\overline{{d}}_{{{i}}}"),
        )
        return drift + unknown + _positive(rf"\sup\left|\dot{{r}}_{{{i}}}\right|")

    def gain_upper(self, index: int, xi: tuple[sp.Expr, ...]) -> sp.Expr:
        del xi
        return _positive(rf"\overline{{g}}_{{{index + 1}}}")

    def gain_lower(self, index: int, xi: tuple[sp.Expr, ...]) -> sp.Expr:
        del xi
        return _positive(rf"\underline{{g}}_{{{index + 1}}}")


class _Recorder(SymbolNumbers):
    """Names every constant and remembers where report.json keeps it, and what it abbreviates."""

    def __init__(self) -> None:
        super().__init__()
        self.places: list[tuple[str, int]] = []
        self.parts: list[tuple[tuple[str, str], ...]] = []
        self._open: list[tuple[sp.Symbol, sp.Expr]] = []
        self._count = 0

    def sqrt(self, value: sp.Expr) -> sp.Expr:
        return self._short(super().sqrt(value))

    def minimum(self, left: sp.Expr, right: sp.Expr) -> sp.Expr:
        return self._short(super().minimum(left, right))

    def _short(self, value: sp.Expr) -> sp.Expr:
        """Abbreviate what would make its line too wide to be read."""
        if value.count_ops() <= LARGEST:
            return value
        self._count += 1
        name = _positive(rf"\vartheta_{{{self._count}}}")
        self._open.append((name, value))
        return name

    def record(self, symbol: str, index: int, value: sp.Expr) -> sp.Symbol:
        self.places.append((symbol, index))
        # The last one is used by the definition itself, the first one by those after it.
        used = reversed(self._open)
        self.parts.append(tuple((sp.latex(name), sp.latex(part)) for name, part in used))
        self._open.clear()
        return super().record(symbol, index, value)


def _positive(name: str) -> sp.Symbol:
    return sp.Symbol(name, positive=True)


def chain_formulas(
    shapes: tuple[Gain, ...],
    rules: ChainRules,
    center: CenterKind = CenterKind.PERFORMANCE,
    bounds: BoundsKind = BoundsKind.TERMWISE,
) -> tuple[ChainFormula, ...]:
    """Write out the chain for shapes with these terms.

    Parameters
    ----------
    shapes : tuple[Gain, ...]
        phi_1..phi_n; a term with gain 0 is left out.
    rules : ChainRules
        The forms that the design was made with.
    center : CenterKind
        Nominal: s_i = 0, W_i is the supremum of the residual, and v is fed forward.
    bounds : BoundsKind
        Tight: F_i* and D_n are made of suprema of the residual.

    Returns
    -------
    tuple[ChainFormula, ...]
        In the order of evaluation, X_1 first and U last.

    References
    ----------
    docs/theory.md sections 2 to 4.
    """
    order, numbers = len(shapes), _Recorder()
    zero, nominal = sp.Integer(0), center is CenterKind.NOMINAL
    start: ChainInput[sp.Expr] = ChainInput(
        shapes=tuple(_symbolic(shape, i + 1) for i, shape in enumerate(shapes)),
        half_widths=tuple(_positive(f"p_{{{i + 1}}}") for i in range(order)),
        r_bound=tuple(_positive(rf"\sup\left|r_{{{i + 1}}}\right|") for i in range(order)),
        feed=tuple(
            zero if nominal or i + 1 == order else _positive(f"s_{{{i + 2}}}") for i in range(order)
        ),
        v=_positive(r"\sup\left|v\right|") if nominal else zero,
        v_rate=_positive(r"\sup\left|\dot{v}\right|") if nominal else zero,
        v_start=_positive("v_{0}") if nominal else zero,
        delta=tuple(_positive(rf"\delta_{{0,{i + 1}}}") for i in range(order)),
        hold=_positive(r"\left(h+\tau\right)"),
        delay=_positive(r"{\tau}"),
        actuator_error=_positive(r"\delta_{u}"),
    )
    loads = None
    if bounds is BoundsKind.TIGHT:
        loads = Loads(
            load=tuple(_positive(load_symbol(i)) for i in range(order)),
            rate=_positive(rf"\sup\left|R_{{{order}}}\right|"),
        )
    evaluate_chain(start, _SymbolResidual(center), numbers, rules, loads)
    scalars = {"zeta", "V", "U", "delta_v"}
    return tuple(
        ChainFormula(
            symbol=sp.latex(symbol),
            definition=sp.latex(definition),
            field=field,
            index=None if field in scalars else index,
            parts=parts,
        )
        for (symbol, definition), (field, index), parts in zip(
            numbers.definitions, numbers.places, numbers.parts, strict=True
        )
        if field != "delta_v" or nominal
    )


def load_symbol(index: int) -> str:
    """Write load_i, i = ``index`` + 1, in LaTeX."""
    return rf"\ell_{{{index + 1}}}"


def _symbolic(shape: Gain, i: int) -> GenericShape[sp.Expr]:
    terms = shape.generic.terms
    zero = sp.Integer(0)
    return GenericShape(
        k=_positive(f"k_{{{i}}}") if Terms.LINEAR in terms else zero,
        M=_positive(f"M_{{{i}}}") if Terms.TANH in terms else zero,
        epsilon=_positive(rf"\varepsilon_{{{i}}}"),
        c=_positive(f"c_{{{i}}}") if Terms.POWER in terms else zero,
        N=shape.N,
        terms=terms,
    )
