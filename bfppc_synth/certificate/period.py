"""The largest sample period at which the checker still proves the inequalities of a design."""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from enum import Enum, auto
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import alternatives, holds

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.certificate.checker import Design, Obligations

# What is tried of an estimate made in binary64: the checker's bounds are a little wider.
_SHARES = (1.0, 0.99, 0.97, 0.94, 0.9, 0.8, 0.6, 0.3)
_DIGITS = 3


class OtherDelay(Enum):
    """What delays a command besides the communication step."""

    DECLARED = auto()
    NONE = auto()


def proved_period(
    plant_document: Mapping[str, Any], design_document: Mapping[str, Any], estimate: float
) -> float:
    """Step down from an estimate to what is proved.

    Parameters
    ----------
    plant_document : Mapping[str, Any]
        Content of plant.json.
    design_document : Mapping[str, Any]
        ``design`` of a proved certificate.json.
    estimate : float
        A period [s] from floats.

    Returns
    -------
    float
        A period [s], to three digits, at which every inequality of the same gains holds; 0 where
        none of those tried is proved.

    References
    ----------
    docs/theory.md section 3: (U2) and (U2') are all that a period enters.
    """
    design = checker.read_design(dict(design_document))
    found = design.obligations(plant_document)
    for share in _SHARES:
        period = _rounded_down(share * estimate)
        if period > 0.0 and _holds(plant_document, design, found, period):
            return period
    return 0.0


def proved_step(
    plant_document: Mapping[str, Any],
    design_document: Mapping[str, Any],
    estimate: float,
    *,
    late: int,
    other: OtherDelay = OtherDelay.DECLARED,
) -> float:
    """Find a communication step at which the certificate covers a co-simulation.

    A sample is taken every step H, and its command acts ``late`` steps later: period H, and a
    delay of ``late`` H on top of any other one.

    Parameters
    ----------
    plant_document, design_document
        As in ``proved_period``.
    estimate : float
        A period [s] without that delay, such as ``proved_period`` gives.
    late : int
        Steps of delay, 0 or 1.
    other : OtherDelay
        What else delays the command.

    Returns
    -------
    float
        H [s], to three digits, at which every inequality of the same gains holds; 0 where none
        of those tried is proved, and for every method but unified: the others are continuous,
        or have stages that are watched for the declared timing.

    References
    ----------
    docs/theory.md section 3, Timing: a command acts within tau of its sample.
    """
    design = checker.read_design(dict(design_document))
    found = design.obligations(plant_document)
    if found.problem.method != "unified":
        return 0.0
    declared = checker.to_doubles(found.problem.delay)[1]
    spare = 0.0
    if other is OtherDelay.NONE:
        spare, declared = declared, 0.0
    for share in _SHARES:
        # (U2) reads h + tau, which is then (1 + late) H and the other delay.
        step = _rounded_down(share * (estimate + spare) / (1 + late))
        if step <= 0.0:
            continue
        delay = math.nextafter(late * step + declared, math.inf) if late else declared
        if _covers(plant_document, design, found, (step, delay)):
            return step
    return 0.0


def _covers(
    plant_document: Mapping[str, Any],
    design: Design,
    found: Obligations,
    timing: tuple[float, float],
) -> bool:
    """Whether the same gains hold at another period and delay [s]."""
    document = copy.deepcopy(dict(plant_document))
    period, delay = timing
    own = checker.to_doubles(found.problem.period)[1]
    if design.arithmetic.single and period < own:
        # The code runs as long as its own period allows; of h and tau (U2) reads only the sum.
        if found.problem.center == "performance":
            delay = max(0.0, math.nextafter(period + delay - own, math.inf))
        period = own
    if design.chosen is not None and design.chosen[0] == "period":
        design = replace(design, chosen=("period", period))
    document["plant"]["sampling"] = {"period": repr(period), "delay": repr(delay)}
    try:
        again = design.obligations(document)
    except checker.Refusal:
        return False
    # What was proved point by point, and the clamp, must be what this timing needs too.
    peak = again.enclosures["U"][1]
    kept = again.box == found.box and peak <= Fraction(design.u_max) * checker.ONE
    kept = kept and again.problem.latest >= found.problem.latest
    return kept and all(map(holds, alternatives(again)))


def _holds(
    plant_document: Mapping[str, Any], design: Design, found: Obligations, period: float
) -> bool:
    try:
        again = _at(plant_document, design, found, period)
    except checker.Refusal:
        return False
    return all(map(holds, alternatives(again)))


def _at(
    plant_document: Mapping[str, Any], design: Design, found: Obligations, period: float
) -> Obligations:
    if found.problem.method == "unified" and not design.arithmetic.single:
        tight = None
        if design.tight is not None:
            loads, rate = design.tight
            tight = checker.Tight(tuple(map(Fraction, loads)), Fraction(rate))
        return checker.at_period(found, tight, Fraction(period))
    # Free stages have tubes that depend on the period, and a binary32 clock counts by it.
    document = copy.deepcopy(dict(plant_document))
    sampling = document["plant"].setdefault("sampling", {})
    sampling["period"] = repr(period)
    if design.chosen is not None and design.chosen[0] == "period":
        design = replace(design, chosen=("period", period))
    return design.obligations(document)


def _rounded_down(period: float) -> float:
    if not 0.0 < period < math.inf:
        return 0.0
    unit = 10.0 ** (math.floor(math.log10(period)) + 1 - _DIGITS)
    return float(f"{math.floor(period / unit * (1.0 + 1e-12)) * unit:.{_DIGITS - 1}e}")
