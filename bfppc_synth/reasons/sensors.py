"""What is measured: quantizers and noise."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.model.spec import QuantizerKind
from bfppc_synth.reasons.facts import fact
from bfppc_synth.reasons.requirement import BOUGHT, NEAR, Requirement, number
from bfppc_synth.spec.edits import Edit

if TYPE_CHECKING:
    from bfppc_synth.model.expression import Constant
    from bfppc_synth.model.spec import PlantSpec, QuantizerSpec

_LENGTHS = ("step", "dead_zone", "hysteresis", "minimum", "threshold")


def quantizers(spec: PlantSpec) -> Requirement | None:
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
        path=path,
        given=given,
        change=change,
        factors=(*NEAR, 1e-6),
        extreme=1e-9,
        weight=BOUGHT,
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


def noise(spec: PlantSpec) -> Requirement | None:
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
    return fact(path, given, change, BOUGHT)
