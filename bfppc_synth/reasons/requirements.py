"""What a plant file asks for, as quantities that one number relaxes; written back as YAML."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.gains.rounding import to_digits
from bfppc_synth.model.spec import CenterKind, Method, QuantizerKind, RhoKind
from bfppc_synth.spec.changing import Edit

if TYPE_CHECKING:
    from bfppc_synth.model.expression import Constant
    from bfppc_synth.model.spec import PlantSpec, QuantizerSpec

#: A factor on what the file says; its edits, rounded to the side that asks for less.
Change = Callable[[float], tuple[Edit, ...]]

_DIGITS = 3
# How far a larger value is looked for: beyond, the file would be about another machine.
_FAR = (1.2, 2.0, 6.0, 30.0, 1000.0)
_NEAR = tuple(1.0 / factor for factor in _FAR)


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement:
    """One thing that could be asked for less.

    ``path`` names it in the file, ``given`` is its text there; ``factors`` are tried in turn,
    from near to far, and ``extreme`` is the most that can be given up (0 where the quantity may
    vanish), None where there is no such end.
    """

    path: str
    given: str
    change: Change
    factors: tuple[float, ...]
    extreme: float | None = None

    def written(self, factor: float) -> str:
        """Return the value that this factor leads to, as it stands in the file."""
        return ", ".join(f"{edit.path} {edit.text}" for edit in self.change(factor))


def number(value: float, upward: int, digits: int = _DIGITS) -> str:
    """Write a number in few digits, rounded up (1), down (-1) or to nearest (0)."""
    return f"{to_digits(value, digits, upward=upward):.10g}"


def requirements_of(spec: PlantSpec, start: float = 0.0) -> tuple[Requirement, ...]:
    """List everything that this file asks for and that could be asked for less.

    Parameters
    ----------
    spec : PlantSpec
        A plant file without a design.
    start : float
        y_d(0): where the first state starts without an error [unit of y].

    Returns
    -------
    tuple[Requirement, ...]
        In the order of the file; what the chosen method and center do not read is left out.
    """
    nominal = spec.synthesis.center is CenterKind.NOMINAL
    found: list[Requirement | None] = [_plain(spec, "performance.accuracy", "larger")]
    found += [_transition(spec), _slower_transition(spec)] if nominal else [_rho(spec)]
    found += [_funnel(spec), *_starts(spec, start), _offset(spec), _disturbances(spec), _parameters(spec)]
    if spec.synthesis.method is not Method.THEOREM2:
        found += [_quantizers(spec), _noise(spec)]
    found += [_plain(spec, path, "smaller") for path in _TIMES]
    found.append(_plain(spec, "actuator.error", "smaller"))
    return tuple(requirement for requirement in found if requirement is not None)


_TIMES = ("sampling.period", "sampling.delay")


def _constant(spec: PlantSpec, path: str) -> Constant | None:
    section, _, key = path.partition(".")
    found: Constant | None = getattr(getattr(spec, section), key)
    return found


def _plain(spec: PlantSpec, path: str, easier: str) -> Requirement | None:
    constant = _constant(spec, path)
    if constant is None or constant.approximate == 0.0:
        return None
    larger = easier == "larger"

    def change(factor: float) -> tuple[Edit, ...]:
        text = number(constant.approximate * factor, 1 if larger else -1)
        return (Edit(path=path, text=text),)

    factors, extreme = (_FAR, None) if larger else (_NEAR, 0.0)
    return Requirement(
        path=path, given=constant.text, change=change, factors=factors, extreme=extreme
    )


def _transition(spec: PlantSpec) -> Requirement | None:
    return _plain(spec, "performance.transition", "larger")


def _slower_transition(spec: PlantSpec) -> Requirement | None:
    """A short transition costs feedforward, a long one starts late: both ways are tried."""
    found = _plain(spec, "performance.transition", "smaller")
    if found is None:
        return None
    return Requirement(path=found.path, given=found.given, change=found.change, factors=_NEAR)


def _rho(spec: PlantSpec) -> Requirement | None:
    """Slower performance functions: one factor for all of them."""
    if spec.synthesis.method is Method.THEOREM3:
        # Its stages are fixed gains for one rho.
        return None
    spread = [state for state in spec.states if spec.gives(f"performance.rho.{state}")]
    written: list[tuple[str, str, float, int]] = []
    for state, rho in zip(spec.states, spec.performance.rho, strict=True):
        root = f"performance.rho.{state}" if spread else "performance.rho"
        cosine = rho.kind is RhoKind.COSINE
        constant = rho.t_s if cosine else rho.rate
        if constant is not None:
            key, side = ("t_s", 1) if cosine else ("rate", -1)
            written.append((f"{root}.{key}", constant.text, constant.approximate, side))
        if not spread:
            break
    if not written:
        return None
    if not spec.gives("performance.rho"):

        def fresh(factor: float) -> tuple[Edit, ...]:
            text = f"{{kind: cosine, t_s: {number(factor, 1)}}}"
            return (Edit(path="performance.rho", text=text),)

        return Requirement(
            path="performance.rho", given="{kind: cosine, t_s: 1}", change=fresh, factors=_FAR
        )

    def change(factor: float) -> tuple[Edit, ...]:
        return tuple(
            Edit(path=path, text=number(value * factor**side, side))
            for path, _, value, side in written
        )

    path = written[0][0] if len(written) == 1 else "performance.rho"
    return Requirement(
        path=path, given=", ".join(text for _, text, _, _ in written), change=change, factors=_FAR
    )


def _funnel(spec: PlantSpec) -> Requirement | None:
    funnel = spec.performance.funnel
    if funnel is None:
        return None

    def change(factor: float) -> tuple[Edit, ...]:
        return (
            Edit(path="performance.funnel", text=f'"{number(factor, 1)}*({funnel.text})"'),
        )

    return Requirement(
        path="performance.funnel", given=funnel.text, change=change, factors=_FAR[:3]
    )


def _starts(spec: PlantSpec, start: float) -> tuple[Requirement | None, ...]:
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
        path="initial", given=given, change=narrowed, factors=_NEAR, extreme=0.0
    )
    towards = Requirement(
        path="initial", given=given, change=moved, factors=_NEAR, extreme=0.0
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
    low, high = number(edge[0], 1, digits), number(edge[1], -1, digits)
    if float(low) >= float(high):
        return number((edge[0] + edge[1]) / 2.0, 0, digits)
    return f"[{low}, {high}]"


def _offset(spec: PlantSpec) -> Requirement | None:
    constant = spec.offset
    if constant is None or constant.approximate == 0.0:
        return None

    def change(factor: float) -> tuple[Edit, ...]:
        return (Edit(path="initial.offset", text=number(constant.approximate * factor, -1)),)

    return Requirement(
        path="initial.offset", given=constant.text, change=change, factors=_NEAR, extreme=0.0
    )


def _disturbances(spec: PlantSpec) -> Requirement | None:
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
    return Requirement(path=path, given=given, change=change, factors=_NEAR, extreme=0.0)


def _parameters(spec: PlantSpec) -> Requirement | None:
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
    return Requirement(path=path, given=given, change=change, factors=_NEAR, extreme=0.0)


_LENGTHS = ("step", "dead_zone", "hysteresis", "minimum", "threshold")


def _quantizers(spec: PlantSpec) -> Requirement | None:
    """Finer quantizers: one factor on every length of every quantizer."""
    root = "measurement.quantizer"
    spread = any(spec.gives(f"{root}.{state}") for state in spec.states)
    found = [
        (f"{root}.{state}" if spread else root, quantizer)
        for state, quantizer in zip(spec.states, spec.measurement.quantizers, strict=True)
    ]
    coarse = [
        (path, quantizer)
        for path, quantizer in (found if spread else found[:1])
        if quantizer.kind is not QuantizerKind.NONE
    ]
    if not coarse:
        return None

    def change(factor: float) -> tuple[Edit, ...]:
        return tuple(
            Edit(path=f"{path}.{key}", text=text)
            for path, quantizer in coarse
            for key, text in _finer(quantizer, factor)
        )

    lengths = [key for _, quantizer in coarse for key, _ in _finer(quantizer, 1.0)]
    path = f"{coarse[0][0]}.step" if lengths == ["step"] else root
    given = ", ".join(
        f"{key} {getattr(quantizer, key).text}"
        for _, quantizer in coarse
        for key, _ in _finer(quantizer, 1.0)
    )
    if lengths == ["step"]:
        given = given.removeprefix("step ")
    return Requirement(
        path=path, given=given, change=change, factors=(*_NEAR, 1e-6), extreme=1e-9
    )


def _finer(quantizer: QuantizerSpec, factor: float) -> tuple[tuple[str, str], ...]:
    out: dict[str, str] = {}
    for key in _LENGTHS:
        constant: Constant | None = getattr(quantizer, key)
        if constant is not None:
            out[key] = number(constant.approximate * factor, -1)
    if "hysteresis" in out:
        # Rounded down each on its own, the hysteresis could come out above half the step.
        half = float(out["step"]) / 2.0
        out["hysteresis"] = number(min(float(out["hysteresis"]), half), -1, 4)
    return tuple(out.items())


def _noise(spec: PlantSpec) -> Requirement | None:
    """Less noise: one factor for all states."""
    root = "measurement.noise"
    spread = any(spec.gives(f"{root}.{state}") for state in spec.states)
    found = [
        (f"{root}.{state}" if spread else root, constant)
        for state, constant in zip(spec.states, spec.measurement.noise, strict=True)
    ]
    loud = [
        (path, constant)
        for path, constant in (found if spread else found[:1])
        if constant.approximate > 0.0
    ]
    if not loud:
        return None

    def change(factor: float) -> tuple[Edit, ...]:
        return tuple(
            Edit(path=path, text=number(constant.approximate * factor, -1))
            for path, constant in loud
        )

    path = loud[0][0] if len(loud) == 1 else root
    given = ", ".join(constant.text for _, constant in loud)
    return Requirement(path=path, given=given, change=change, factors=_NEAR, extreme=0.0)


def relative_change(factor: float) -> float:
    """Return by how much a factor changes a value, the same for a half and for twice."""
    return math.inf if factor <= 0.0 else abs(math.log(factor))
