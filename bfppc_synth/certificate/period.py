"""The largest sample period at which the checker still proves the inequalities of a design."""

from __future__ import annotations

import copy
import math
from dataclasses import replace
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
