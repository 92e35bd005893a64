"""The table of what a design asks of actuator, sensors and computer, in sentences for ``prose``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.model.spec import QuantizerKind

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.model.design import Design


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement:
    """A row of the table of requirements: three sentences, and the unit as the user wrote it."""

    what: str
    value: str
    unit: str
    meaning: str


def requirements(design: Design, document: Mapping[str, object]) -> tuple[Requirement, ...]:
    """List what the design asks of actuator, sensors and computer.

    Parameters
    ----------
    design : Design
        Order, quantizers, units.
    document : Mapping[str, object]
        report.json; what a step costs is left out where it does not say so.

    Returns
    -------
    tuple[Requirement, ...]
        Rows in the order of the signal: actuator, sensors, computer.
    """
    spec = design.spec
    limit = "no limit is declared in the plant file"
    if spec.actuator.limit is not None:
        limit = "the plant file allows #actuator/limit#"
    unit = dict(spec.units).get("u", "")
    rows = [
        Requirement(
            what="Actuator: peak input $U$",
            value="#bounds/U#",
            unit=unit,
            meaning=f"largest magnitude that the law can ask for; {limit}",
        ),
        Requirement(
            what="Actuator: error",
            value="#actuator/error#",
            unit=unit,
            meaning=r"largest difference $\delta_u$ between commanded and applied input that is "
            "covered",
        ),
        Requirement(
            what="Slope of the law",
            value="#bounds/slope#",
            unit="",
            meaning="largest derivative of the command by the last error: it multiplies what "
            "noise the last error carries",
        ),
    ]
    for index, (state, quantizer) in enumerate(
        zip(spec.states, spec.measurement.quantizers, strict=True)
    ):
        kind = "exact measurement was declared"
        if design.conditions.delta[index] > 0.0:
            kind = "quantizer and noise together"
        if quantizer.kind is not QuantizerKind.NONE:
            kind += f" ({quantizer.kind} quantizer)"
        rows.append(
            Requirement(
                what=f"Sensor of `{state}`: error $\\delta_{{0,{index + 1}}}$",
                value=f"#measurement/delta/{index}#",
                unit=dict(spec.units).get(state, ""),
                meaning=f"largest measurement error that is covered; {kind}",
            )
        )
        if quantizer.step is not None:
            rows.append(_converter(state, index))
    return (*rows, *_timing(design), *_digits(document))


def _converter(state: str, index: int) -> Requirement:
    path = f"measurement/adc/{index}"
    return Requirement(
        what=f"Converter of `{state}`",
        value=f"#{path}/bits#",
        unit="bits",
        meaning=rf"for cells of width #{path}/step# over the range $\pm X_{{{index + 1}}}$ = "
        f"#{path}/range#, which the state never leaves; one level more where 0 is a level",
    )


def _timing(design: Design) -> tuple[Requirement, ...]:
    numbers = "binary32" if design.arithmetic.single else "binary64"
    continuous = "0 means that the certificate is about a continuous law"
    period = continuous if design.conditions.hold == 0.0 else "jitter and lost samples included"
    return (
        Requirement(
            what="Computer: sample period $h$",
            value="#sampling/period#",
            unit="s",
            meaning=f"longest time between two samples that is covered; {period}",
        ),
        Requirement(
            what=r"Computer: delay $\tau$",
            value="#sampling/delay#",
            unit="s",
            meaning="longest time from a sample to its command that is covered",
        ),
        Requirement(
            what="Computer: largest certified period",
            value="#sampling/largest_certified_period#",
            unit="s",
            meaning="with these gains the inequalities still hold up to this period "
            "(a lower bound; 0 where none is certified)",
        ),
        Requirement(
            what="Computer: longest run",
            value="#sampling/longest_run#",
            unit="s",
            meaning=f"after this time the clock is too coarse in {numbers} and the code holds its "
            "command (status BAD_TIME): call `reset` before",
        ),
    )


def _digits(document: Mapping[str, object]) -> tuple[Requirement, ...]:
    if "code" not in document:
        return ()
    return (
        Requirement(
            what="Computer: digits lost",
            value="#code/digits_lost#",
            unit="",
            meaning="decimal digits that a relative error of the first state gains on its way to "
            "the command: what the arithmetic must have to spare",
        ),
    )
