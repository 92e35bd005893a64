"""What the theorems take for granted, held against the plant file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy as sp

from bfppc_synth.audit.records import Assumption, Standing
from bfppc_synth.audit.remedies import c_0_path
from bfppc_synth.audit.scanning import (
    Gap,
    parameter_ranges,
    violation_beyond,
    violation_in,
    zero_beyond,
)
from bfppc_synth.audit.variants import C_0
from bfppc_synth.bounds.latch import resolutions
from bfppc_synth.bounds.performance import rho_rate
from bfppc_synth.expressions.resolution import upper_bound
from bfppc_synth.model.spec import Anchor, Method

if TYPE_CHECKING:
    from bfppc_synth.audit.inequalities import Evaluated
    from bfppc_synth.audit.records import Candidate
    from bfppc_synth.audit.scanning import Box
    from bfppc_synth.model.certificate import Certificate
    from bfppc_synth.model.plant import Channel, Plant
    from bfppc_synth.model.spec import PlantSpec


@dataclass(frozen=True, slots=True, kw_only=True)
class _Claim:
    """A declared bound of channel i, from 1: its key, its words, the gap that it asks for."""

    key: str
    words: str
    gap: Gap


def assumptions(
    spec: PlantSpec,
    candidate: Candidate,
    forms: tuple[Evaluated, ...],
    certificate: Certificate | None,
) -> tuple[Assumption, ...]:
    """Hold every assumption against the file.

    Parameters
    ----------
    spec : PlantSpec
        The audited file.
    candidate : Candidate
        Its numbers.
    forms : tuple[Evaluated, ...]
        The forms that could be evaluated, the sound one last: their reachable boxes are looked
        at.
    certificate : Certificate or None
        What the separate checker says of the sound form.

    Returns
    -------
    tuple[Assumption, ...]
        First what the method asks of accuracy and c_0, then the bounds of the plant.

    References
    ----------
    The paper's Assumptions 1, 3, 4 and (14); docs/theory.md sections 6, 7 and 10.
    """
    out = [_accuracy(spec, candidate)]
    if spec.synthesis.method is Method.THEOREM1:
        out.append(_c_0(spec, candidate))
    out += _rates(spec)
    for form in forms[:1]:
        plant = form.judge.plant
        for number, channel in enumerate(plant.channels, start=1):
            for claim in _claims(channel, number):
                out.append(_bound(spec, plant, number, claim, forms, certificate))
    return tuple(out)


def _accuracy(spec: PlantSpec, candidate: Candidate) -> Assumption:
    """Hold the tube against what the measurement can tell apart."""
    doubled = spec.synthesis.anchor is Anchor.EXACT
    delta = float(resolutions(spec)[0]) * (2.0 if doubled else 1.0)
    name = "delta_M = 2 delta_0" if doubled else "delta_0"
    p = candidate.half_widths[0]
    return Assumption(
        id="accuracy",
        path="performance.accuracy",
        statement=f"accuracy > {name}",
        standing=Standing.HOLDS if p > delta else Standing.FAILS,
        detail=f"{p:.6g} > {delta:.6g}",
        local=False,
    )


def _c_0(spec: PlantSpec, candidate: Candidate) -> Assumption:
    c_0, path = candidate.c_0 or 0.0, c_0_path(spec)
    detail = f"c_0 = {c_0:.6g}"
    if path != C_0:
        p = candidate.half_widths[1]
        detail += f", what p_2 = {p:.6g} and its epsilon leave for it by (14)"
    return Assumption(
        id="c_0",
        path=path,
        statement="c_0 > 0, as (14) and (39) take it",
        standing=Standing.HOLDS if c_0 > 0.0 else Standing.FAILS,
        detail=detail,
        local=False,
    )


def _rates(spec: PlantSpec) -> list[Assumption]:
    """Put a declared rho_{M,0} beside the true one; a smaller one is no plant file."""
    out = {}
    for state, rho in zip(spec.states, spec.performance.rho, strict=True):
        if rho.rate_bound is None or rho in out:
            continue
        true, declared = float(rho_rate(rho)), float(upper_bound(rho.rate_bound))
        out[rho] = Assumption(
            id=f"rate_bound[{state}]",
            path="performance.rho.rate_bound",
            statement="rate_bound >= sup |drho|",
            standing=Standing.HOLDS if declared >= true else Standing.FAILS,
            detail=f"{declared:.6g} >= {true:.6g}; the sound form takes {true:.6g}",
            local=False,
        )
    return list(out.values())


def _claims(channel: Channel, number: int) -> list[_Claim]:
    out = []
    if channel.f is not None and channel.f_bound is not None:
        gap = Gap(upper=channel.f_bound, lower=sp.Abs(channel.f))
        out.append(_Claim(key="f_bound", words=f"|f_{number}| <= f_{number}*", gap=gap))
    if channel.g is not None and channel.g_min is not None:
        gap = Gap(upper=channel.g, lower=channel.g_min)
        words = f"g_{number} >= g_m = {channel.g_min}"
        out.append(_Claim(key="g_min", words=words, gap=gap))
    if channel.g is not None and channel.g_bound is not None:
        gap = Gap(upper=channel.g_bound, lower=channel.g)
        words = f"g_{number} <= g_{number}* = {channel.g_bound}"
        out.append(_Claim(key="g_bound", words=words, gap=gap))
    if channel.g is not None and channel.g_min is None and channel.g.free_symbols:
        gap = Gap(upper=channel.g, lower=sp.S.Zero)
        out.append(_Claim(key="g", words=f"g_{number} > 0", gap=gap))
    return out


def _bound(
    spec: PlantSpec,
    plant: Plant,
    number: int,
    claim: _Claim,
    forms: tuple[Evaluated, ...],
    certificate: Certificate | None,
) -> Assumption:
    state = spec.states[number - 1]
    name = f"{claim.key}[{state}]"
    boxes = [_reachable(form, plant, number) for form in forms]
    largest = _hull(boxes)
    where = _where(claim, largest, plant)
    witness = violation_in(claim.gap, largest)
    proved = _of_checker(name, certificate)
    standing, detail = Standing.UNBROKEN, where
    if witness is not None:
        place = ", ".join(f"{symbol.name} = {value:.6g}" for symbol, value in witness.items())
        standing, detail = Standing.FAILS, f"at {place}, {where}"
    elif proved is not None:
        # The checker speaks of the sound form's box, the last one here; the other may be wider.
        standing, detail = proved, _where(claim, boxes[-1], plant)
        if detail != where:
            detail += f"; no violation met {where}"
    further = _beyond(claim, largest, plant.states[:number])
    if further and standing is not Standing.FAILS:
        assumption = 1 if spec.synthesis.method is Method.THEOREM1 else 3
        detail += f"; Assumption {assumption} holds only locally (on Omega): {further}"
    return Assumption(
        id=name,
        path=f"dynamics.{state}.{claim.key}",
        statement=claim.words,
        standing=standing,
        detail=detail,
        local=bool(further),
    )


def _hull(boxes: list[Box]) -> Box:
    return {
        symbol: (min(box[symbol][0] for box in boxes), max(box[symbol][1] for box in boxes))
        for symbol in boxes[0]
    }


def _where(claim: _Claim, box: Box, plant: Plant) -> str:
    """Say how far the states of a bound reach."""
    symbols = claim.gap.upper.free_symbols | claim.gap.lower.free_symbols
    reach = [
        f"|{symbol.name}| <= {max(map(abs, ends)):.4g}"
        for symbol, ends in box.items()
        if symbol in plant.states and symbol in symbols
    ]
    return f"on {', '.join(reach)}" if reach else "everywhere"


def _of_checker(name: str, certificate: Certificate | None) -> Standing | None:
    """Ask what the separate checker says of the sound form's box."""
    found = () if certificate is None else certificate.assumption_checks
    for entry in found:
        if entry.id == name:
            return Standing.PROVED if entry.holds else Standing.UNDECIDED
    return None


def _reachable(form: Evaluated, plant: Plant, count: int) -> Box:
    """|x_j - r_j| <= xi_j, j <= i, for every r_j of the form's center, and the parameters."""
    center, bounds = form.judge.center, form.judged.bounds
    box = parameter_ranges(plant)
    for j in range(count):
        xi = bounds.xi[j]
        box[plant.states[j]] = (center.r_lower[j] - xi, center.r_upper[j] + xi)
    return box


def _beyond(claim: _Claim, box: Box, states: tuple[sp.Symbol, ...]) -> str:
    """Where the bound fails outside the box, and where g comes down to 0; empty if nowhere."""
    found = violation_beyond(claim.gap, box, states)
    parts = []
    if claim.key in ("g_min", "g"):
        zero = zero_beyond(claim.gap.upper, box, states)
        if zero is not None:
            name = claim.words.split(" ", maxsplit=1)[0]
            parts.append(f"{name} is 0 at {zero.state} = {zero.value:.4g}")
    if found is not None:
        parts.append(f"it fails from {found.state} = {found.value:.4g} on")
    return ", ".join(parts)
