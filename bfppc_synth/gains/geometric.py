"""Whether a design problem is a geometric program: then one optimum is the only one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.bounds.chain import chain_input, evaluate_chain
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.gains.curvature import (
    MONOMIAL,
    OTHER,
    Curvature,
    Curved,
    CurvedArithmetic,
    CurvedNumbers,
    curved,
)
from bfppc_synth.gains.problem import Kind, assemble

if TYPE_CHECKING:
    from bfppc_synth.gains.problem import DesignProblem, Slot


def is_geometric(problem: DesignProblem, free: tuple[Slot, ...], alternative: str) -> bool:
    """Tell whether every constraint is `monomial >= convex` and the cost is convex, in logs.

    Parameters
    ----------
    problem : DesignProblem
        With termwise bounds.
    free : tuple[Slot, ...]
        The unknowns of one pattern.
    alternative : str
        The form of the last inequality.

    Returns
    -------
    bool
        True only if a local optimum of this pattern and form is its global one; False where
        the structure does not show it.

    References
    ----------
    docs/theory.md section 5.
    """
    if any(slot.kind in (Kind.TANH, Kind.BEND, Kind.HEIGHT) for slot in free):
        return False
    numbers, arithmetic = CurvedNumbers(), CurvedArithmetic()
    shapes, widths = assemble(problem, dict.fromkeys(free, MONOMIAL), numbers)
    start = chain_input(shapes, widths, problem.center, problem.conditions, numbers)

    def place(index: int, lower: float, upper: float, xi: Curved) -> tuple[Curved, Curved]:
        del index
        # An end that may be on either side of 0 has no sign.
        low = -(curved(-lower) + xi) if lower <= 0.0 else OTHER
        return low, (curved(upper) + xi if upper >= 0.0 else OTHER)

    try:
        residual = problem.residual(arithmetic=arithmetic, place=place, constant=curved)
        bounds = evaluate_chain(start, residual, numbers, problem.theorem.rules)
        inner = None if problem.exact or alternative == "T2" else MONOMIAL
        demands = problem.theorem.demands(alternative, start, bounds, numbers, inner)
    except EnvelopeError:
        return False
    sides = all(
        demand.lhs.sign > 0
        and demand.lhs.kind in (Curvature.CONSTANT, Curvature.MONOMIAL)
        and _is_convex(demand.rhs)
        for demand in demands
    )
    return sides and not arithmetic.asked and _is_convex(bounds.U) and _is_convex(bounds.slope)


def _is_convex(value: Curved) -> bool:
    zero = value.kind is Curvature.ZERO
    return zero or (value.kind is not Curvature.OTHER and value.sign > 0)
