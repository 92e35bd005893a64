"""The numbers of a design as certificate.json writes them, and what the checker says of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bfppc_synth.certificate import checker
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.shapes import Theorem1Gain

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.chosen import Chosen
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.stages import Stage
    from bfppc_synth.model.tight import TightBounds


def design_document(
    shapes: tuple[Gain, ...],
    half_widths: tuple[float, ...],
    c_0: float | None,
    stages: tuple[Stage, ...],
    transition: float | None,
    arithmetic: Arithmetic,
    tight: TightBounds | None = None,
    chosen: Chosen | None = None,
) -> dict[str, Any]:
    """Write the numbers that the controller contains, and those that only the proof has.

    Parameters
    ----------
    shapes, half_widths, c_0, stages, transition, arithmetic, tight, chosen
        As of ``certificate.produce.produce_certificate``.

    Returns
    -------
    dict[str, Any]
        ``design`` of certificate.json, without U_MAX.
    """
    design: dict[str, Any] = {
        "p": _hex(half_widths),
        "gains": [_gain(shape) for shape in shapes],
    }
    if c_0 is not None:
        design["c_0"] = float(c_0).hex()
    if stages:
        design["stages"] = [
            {
                "p": _hex(stage.omega),
                "gains": [_gain(shape) for shape in stage.gains],
                "widened": _hex(stage.widened),
            }
            for stage in stages
        ]
    if transition is not None:
        design["T_s"] = float(transition).hex()
    if tight is not None:
        design["tight"] = {"load": _hex(tight.load), "rate": float(tight.rate).hex()}
    if chosen is not None:
        value = float(chosen.value).hex()
        design["chosen"] = {"objective": str(chosen.objective), "value": value}
    if arithmetic != DEFAULT:
        # Absent means binary64 and the functions of the libm.
        design |= {"real": arithmetic.real.value, "math": arithmetic.mathematics.value}
    return design


def rounding_errors(
    plant_document: Mapping[str, Any],
    shapes: tuple[Gain, ...],
    half_widths: tuple[float, ...],
    *,
    stages: tuple[Stage, ...] = (),
    transition: float | None = None,
    arithmetic: Arithmetic = DEFAULT,
    chosen: Chosen | None = None,
) -> tuple[float, ...]:
    """Ask the checker what the law loses by rounding.

    Parameters
    ----------
    plant_document, shapes, half_widths, stages, transition, arithmetic, chosen
        As of ``produce_certificate``.

    Returns
    -------
    tuple[float, ...]
        Upper bounds on the rounding of each measured error, then of u [units of the states, of
        u]; the largest of all stages. Empty where the checker cannot bound it.
    """
    design = design_document(
        shapes, half_widths, None, stages, transition, arithmetic, chosen=chosen
    )
    try:
        read = checker.read_design({**design, "U_MAX": (0.0).hex()})
        laws = read.obligations(plant_document).laws
    except checker.Refusal:
        return ()
    columns = zip(*(law.rounding for law in laws), strict=True)
    return tuple(checker.to_doubles((0, max(column)))[1] for column in columns)


def _gain(gain: Gain) -> dict[str, Any]:
    if isinstance(gain, Theorem1Gain):
        return {
            "gamma": float(gain.gamma).hex(),
            "H": _hex(gain.H),
            "c": float(gain.c).hex(),
            "N": gain.N,
        }
    numbers = {"k": gain.k, "M": gain.M, "epsilon": gain.epsilon, "c": gain.c}
    return {**{key: float(value).hex() for key, value in numbers.items()}, "N": gain.N}


def _hex(values: tuple[float, ...]) -> list[str]:
    return [float(value).hex() for value in values]
