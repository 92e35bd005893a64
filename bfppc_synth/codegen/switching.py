"""The constants and tests of a law in stages (docs/theory.md section 8)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.model.law import NamedConstant, Range
from bfppc_synth.model.spec import Form
from bfppc_synth.model.stages import Handover

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.law import Law


def reanchors(design: Design) -> bool:
    """Whether a switch makes a new center; the paper's printed text only changes gains."""
    synthesis = design.spec.synthesis
    sound = synthesis.form is Form.SOUND
    return bool(design.stages) and sound and synthesis.handover is Handover.REANCHOR


def stage_prefix(number: int) -> str:
    """Return what the names of a free stage's constants begin with; it counts from 1."""
    return f"stage{number}_"


def stage_constants(design: Design) -> tuple[NamedConstant, ...]:
    """List gains and half-widths of the free stages, in the order and form of the last one's."""
    constants: list[NamedConstant] = []
    for number, stage in enumerate(design.stages, start=1):
        name = stage_prefix(number)
        for i, (shape, p) in enumerate(zip(stage.gains, stage.omega, strict=True), start=1):
            bent, curved = shape.M != 0.0, shape.c != 0.0
            constants += [
                NamedConstant(name=f"{name}k_{i}", value=shape.k, used=shape.k != 0.0),
                NamedConstant(name=f"{name}M_{i}", value=shape.M, used=bent),
                NamedConstant(name=f"{name}epsilon_{i}", value=shape.epsilon, used=bent),
                NamedConstant(name=f"{name}c_{i}", value=shape.c, used=curved),
                NamedConstant(name=f"{name}N_{i}", value=shape.N, used=False),
                NamedConstant(name=f"{name}p_{i}", value=p),
            ]
    return tuple(constants)


def stage_limits(design: Design) -> tuple[NamedConstant, ...]:
    """List p^_{i,m} + eta_{i,m}: no measured error is above it when stage m is left."""
    return tuple(
        NamedConstant(
            name=f"{stage_prefix(number)}limit_{i}", value=math.nextafter(limit, math.inf)
        )
        for number, stage in enumerate(design.stages, start=1)
        if _expects(design, number)
        for i, limit in enumerate(stage.measured_limits, start=1)
    )


def _expects(design: Design, number: int) -> bool:
    """Whether a switch out of a stage says where the errors are.

    Without a new center one sample may pass over several stages: of a stage that was never in
    force nothing is known.
    """
    return design.spec.synthesis.form is Form.SOUND and (number == 1 or reanchors(design))


def monitor_ranges(design: Design, number: int) -> tuple[Range, ...]:
    """Say what keeps the law in a free stage: (75) with measured errors."""
    return tuple(
        Range(variable=f"e_{i}", upper=f"{stage_prefix(number)}p_{i}")
        for i in range(1, design.spec.order + 1)
    )


def handover_ranges(design: Design, number: int) -> tuple[Range, ...]:
    """Say where the measured errors are at a switch while every assumption is true."""
    if not _expects(design, number):
        return ()
    return tuple(
        Range(variable=f"e_{i}", upper=f"{stage_prefix(number)}limit_{i}")
        for i in range(1, design.spec.order + 1)
    )


def largest_state(design: Design, index: int) -> float:
    """Largest |x_i| of any stage; ``index`` is i - 1."""
    return max(design.bounds.X[index], *(0.0, *(s.bounds.X[index] for s in design.stages)))


def center_arguments(law: Law) -> tuple[tuple[str, str], ...]:
    """Pair what the center of a reanchored law reads with what a step passes for it."""
    switching = law.switching
    numbers = range(1, 1 + (0 if switching is None else switching.anchors))
    own = [("elapsed", "elapsed")]
    own += [(f"since_{number}", f"elapsed - switched_{number}") for number in numbers]
    if law.center.latched:
        own.append(("since", "elapsed - renewed"))
    own += [(name, name) for name in ("y_d", "offset")]
    own += [(f"anchor_{number}", f"anchor_{number}") for number in numbers]
    return (*own, *((name, name) for name in law.center.latched))
