"""What is so: where the plant starts, what disturbs it, how well it is known."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.reasons.requirement import FACT, NEAR, Change, Requirement, number
from bfppc_synth.spec.edits import Edit

if TYPE_CHECKING:
    from bfppc_synth.model.spec import PlantSpec


def starts(spec: PlantSpec, start: float) -> tuple[Requirement | None, ...]:
    """Narrow the box of starts around its middle; else move it towards 0 error at the start."""
    edges = [(edge.lower.approximate, edge.upper.approximate) for edge in spec.initial]
    wide = [a < b for a, b in edges]
    ends = [start, *(0.0 for _ in edges[1:])]
    given = ", ".join(
        f"{state}: {_range(edge, 0)}" for state, edge in zip(spec.states, edges, strict=True)
    )

    def narrowed(factor: float) -> tuple[Edit, ...]:
        return tuple(
            Edit(path=f"initial.{state}", text=_range(_shrunk(edge, sum(edge) / 2.0, factor), 4))
            for state, edge, has_width in zip(spec.states, edges, wide, strict=True)
            if has_width
        )

    def moved(factor: float) -> tuple[Edit, ...]:
        return tuple(
            Edit(path=f"initial.{state}", text=_range(_shrunk(edge, at, factor), 4))
            for state, edge, at in zip(spec.states, edges, ends, strict=True)
            if edge != (at, at)
        )

    box = Requirement(
        path="initial", given=given, change=narrowed, factors=NEAR, extreme=0.0, weight=FACT
    )
    towards = Requirement(
        path="initial", given=given, change=moved, factors=NEAR, extreme=0.0, weight=FACT
    )
    return (box if any(wide) else None, towards if [(at, at) for at in ends] != edges else None)


def _shrunk(edge: tuple[float, float], towards: float, factor: float) -> tuple[float, float]:
    lower, upper = edge
    return towards + factor * (lower - towards), towards + factor * (upper - towards)


def _range(edge: tuple[float, float], digits: int) -> str:
    """Write a range, rounded inwards; 0 digits for as many as there are."""
    if digits == 0:
        lower, upper = (f"{value:.10g}" for value in edge)
        return lower if lower == upper else f"[{lower}, {upper}]"
    width, size = edge[1] - edge[0], max(map(abs, edge))
    if 0.0 < width < size:
        # A narrow range far from 0 keeps its shape.
        digits = min(12, digits + math.floor(math.log10(size / width)))
    low, high = number(edge[0], 1, digits), number(edge[1], -1, digits)
    if edge[0] == edge[1]:
        return number(edge[0], 0, digits)
    if float(low) >= float(high):
        return number((edge[0] + edge[1]) / 2.0, 0, 10)
    return f"[{low}, {high}]"


def offset(spec: PlantSpec) -> Requirement | None:
    """Start nearer to a reference that is supplied at run time."""
    constant = spec.offset
    if constant is None or constant.approximate == 0.0:
        return None

    def change(factor: float) -> tuple[Edit, ...]:
        return (Edit(path="initial.offset", text=number(constant.approximate * factor, -1)),)

    return Requirement(
        path="initial.offset",
        given=constant.text,
        change=change,
        factors=NEAR,
        extreme=0.0,
        weight=FACT,
    )


def disturbances(spec: PlantSpec) -> Requirement | None:
    """Weaker disturbances: one factor for all of them."""
    pushed = [
        (f"dynamics.{channel.state}.disturbance", channel.disturbance)
        for channel in spec.dynamics
        if channel.disturbance is not None and channel.disturbance.text.strip() != "0"
    ]
    if not pushed:
        return None

    def change(factor: float) -> tuple[Edit, ...]:
        edits = []
        for path, expression in pushed:
            try:
                text = number(float(expression.text) * factor, -1)
            except ValueError:
                text = f'"{number(factor, -1)}*({expression.text})"'
            edits.append(Edit(path=path, text=text))
        return tuple(edits)

    path = pushed[0][0] if len(pushed) == 1 else "dynamics.*.disturbance"
    given = ", ".join(expression.text for _, expression in pushed)
    return fact(path, given, change)


def fact(path: str, given: str, change: Change, weight: float = FACT) -> Requirement:
    """Make a requirement of something that may shrink to nothing."""
    return Requirement(
        path=path, given=given, change=change, factors=NEAR, extreme=0.0, weight=weight
    )


def parameters(spec: PlantSpec) -> Requirement | None:
    """Better known parameters: every range narrowed around its middle."""
    ranges = [
        (item.name, (item.range.lower.approximate, item.range.upper.approximate))
        for item in spec.parameters
        if item.range.lower.approximate < item.range.upper.approximate
    ]
    if not ranges:
        return None

    def change(factor: float) -> tuple[Edit, ...]:
        return tuple(
            Edit(path=f"parameters.{name}", text=_range(_shrunk(edge, sum(edge) / 2.0, factor), 6))
            for name, edge in ranges
        )

    given = ", ".join(f"{name}: {_range(edge, 0)}" for name, edge in ranges)
    path = f"parameters.{ranges[0][0]}" if len(ranges) == 1 else "parameters"
    return fact(path, given, change)
