"""Round a candidate to few digits in the safe direction, step by step down the chain."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.gains.problem import Kind, Slot, assemble
from bfppc_synth.model.shapes import Shape

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.gains.evaluation import Evaluation, Judge


def to_digits(value: float, digits: int, *, upward: int = 0) -> float:
    """Round to significant digits; ``upward`` 1 rounds up, -1 down, 0 to nearest."""
    if value == 0.0 or not math.isfinite(value):
        return value
    unit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits)
    scaled = value / unit
    whole = (math.floor(scaled), round(scaled), math.ceil(scaled))[upward + 1]
    return float(f"{whole * unit:.{digits - 1}e}")


def round_candidate(
    judge: Judge, values: Mapping[Slot, float], alternative: str, digits: int
) -> Evaluation | None:
    """Round a candidate and repair each step's inequality before the next one is judged.

    Parameters
    ----------
    judge : Judge
        The problem and its float chain.
    values : Mapping[Slot, float]
        The free variables as the search found them.
    alternative : str
        Which form of the last inequality the candidate was made for.
    digits : int
        Significant digits of every free number.

    Returns
    -------
    Evaluation or None
        A design that keeps the problem's margin in every inequality, or None.
    """
    margin = judge.problem.margin
    generic, widths = assemble(judge.problem, values, judge.numbers)
    kinds = {slot for slot in values if slot.kind is not Kind.WIDTH}
    half_widths = tuple(
        to_digits(p, digits) if Slot(kind=Kind.WIDTH, step=i) in values else p
        for i, p in enumerate(widths)
    )
    shapes = tuple(
        rounded(Shape(k=s.k, M=s.M, epsilon=s.epsilon, c=s.c, N=s.N), kinds, i, digits)
        for i, s in enumerate(generic)
    )
    for step in range(len(shapes)):
        for _ in range(60):
            found = judge.evaluate(shapes, half_widths, alternative)
            if found is None:
                return None
            lack = max(
                (
                    d.rhs * (1.0 + margin) / d.lhs if d.lhs > 0.0 else math.inf
                    for d in found.demands
                    if d.step == step and d.name in ("U1", "U2", "U2'", "T2")
                ),
                default=0.0,
            )
            if lack <= 1.0:
                break
            if not math.isfinite(lack) or lack > 1.5:
                return None
            raised = grown(shapes[step], kinds, step, lack, digits)
            if raised == shapes[step]:
                return None
            shapes = (*shapes[:step], raised, *shapes[step + 1 :])
    found = judge.evaluate(shapes, half_widths, alternative)
    return found if found is not None and found.holds(margin / 2) else None


def rounded(shape: Shape, kinds: set[Slot], step: int, digits: int) -> Shape:
    """Round the free gains of one step to significant digits, to nearest."""

    def free(*wanted: Kind) -> bool:
        return any(Slot(kind=kind, step=step) in kinds for kind in wanted)

    if free(Kind.LINEAR):
        shape = replace(shape, k=to_digits(shape.k, digits))
    if free(Kind.TANH, Kind.HEIGHT):
        shape = replace(shape, M=to_digits(shape.M, digits))
    if free(Kind.BEND):
        shape = replace(shape, epsilon=to_digits(shape.epsilon, digits))
    if free(Kind.POWER):
        shape = replace(shape, c=to_digits(shape.c, digits))
    return shape


def grown(shape: Shape, kinds: set[Slot], step: int, factor: float, digits: int) -> Shape:
    """Raise phi_i(p_i) by about ``factor`` with the gains that are free; unchanged if none is."""

    def free(kind: Kind) -> bool:
        return Slot(kind=kind, step=step) in kinds

    def up(value: float) -> float:
        raised = to_digits(value * factor, digits, upward=1)
        return (
            raised if raised > value else to_digits(value * (1 + 10.0**-digits), digits, upward=1)
        )

    if free(Kind.LINEAR):
        return replace(shape, k=up(shape.k))
    if free(Kind.TANH):
        # M and epsilon grow together: the bend M p / epsilon stays.
        raised = up(shape.M)
        return replace(shape, M=raised, epsilon=to_digits(shape.epsilon * raised / shape.M, digits))
    if free(Kind.HEIGHT):
        return replace(shape, M=up(shape.M))
    if free(Kind.BEND):
        return replace(shape, epsilon=to_digits(shape.epsilon / factor, digits, upward=-1))
    if free(Kind.POWER):
        return replace(shape, c=up(shape.c))
    return shape


def scaled(shape: Shape, kinds: set[Slot], step: int, factor: float, digits: int) -> Shape:
    """Multiply the free term of a shape; the bend of a free tanh stays."""

    def free(kind: Kind) -> bool:
        return Slot(kind=kind, step=step) in kinds

    def up(value: float) -> float:
        return to_digits(value * factor, digits, upward=1)

    if free(Kind.LINEAR):
        return replace(shape, k=up(shape.k))
    if free(Kind.TANH):
        M = up(shape.M)
        return replace(shape, M=M, epsilon=to_digits(shape.epsilon * M / shape.M, digits))
    if free(Kind.HEIGHT):
        return replace(shape, M=up(shape.M))
    if free(Kind.BEND):
        return replace(shape, epsilon=to_digits(shape.epsilon / factor, digits, upward=-1))
    if free(Kind.POWER):
        return replace(shape, c=up(shape.c))
    return shape
