"""The C text of one design's loop: generated controller, plant, quantizers, adversaries."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.model.spec import Anchor, Form, QuantizerKind, RhoKind
from bfppc_synth.model.stages import Handover
from bfppc_synth.resources import template_environment
from bfppc_synth.simulation.compiled.translate import PRELUDE, Function, translate
from bfppc_synth.simulation.drawing import SEGMENTS
from bfppc_synth.simulation.drawn import CORNERS, rate_scales
from bfppc_synth.simulation.exact import judging_text
from bfppc_synth.simulation.plant import modelled, plant_text
from bfppc_synth.simulation.recorder import DIVERGED

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.spec import QuantizerSpec, RhoSpec

#: The file that is compiled; it includes the others.
MAIN = "loop.c"


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """C files (name, text), and what their records measure; sent to where it is compiled."""

    files: tuple[tuple[str, str], ...]
    order: int
    parameters: int
    stages: int

    @property
    def arguments(self) -> int:
        """Numbers that nature passes to the plant."""
        return self.parameters + 3 * self.order


def write_source(design: Design, header: str, controller: str) -> Source:
    """Write the loop of one design.

    Parameters
    ----------
    design : Design
        Plant, gains, bounds.
    header, controller : str
        Texts of the generated NAME.h and NAME.c.

    Returns
    -------
    Source
        Equal designs give equal texts.

    Raises
    ------
    ResourceError
        If the installation has no templates.
    """
    name, order = design.spec.name, design.plant.order
    plant = design.plant if design.nominal is None else modelled(design.plant)
    functions = {item.name: item for item in translate(plant_text(plant))}
    functions |= {item.name: item for item in translate(judging_text(design))}
    ranges = [
        (evaluate(low, {}, FLOAT_FUNCTIONS), evaluate(high, {}, FLOAT_FUNCTIONS))
        for low, high in plant.ranges
    ]
    waves = design.plant.reference is None
    rhos = list(dict.fromkeys(design.spec.performance.rho))
    synthesis, measurement = design.spec.synthesis, design.spec.measurement
    gains = (*(stage.gains for stage in design.stages), design.gains)
    context: dict[str, object] = {
        "name": name,
        "order": order,
        "parameters": len(ranges),
        "arguments": len(ranges) + 3 * order,
        "segments": SEGMENTS,
        "stages": len(gains),
        "diverged": repr(DIVERGED),
        "plant": "\n".join((PRELUDE, *(item.text for item in functions.values()))),
        "rhos": [_rho(rho) for rho in rhos],
        "rho_of": [rhos.index(rho) for rho in design.spec.performance.rho],
        "widths": _listed(design.omega),
        "sizes": _listed(design.bounds.X),
        "latched": synthesis.anchor is Anchor.LATCHED,
        "nominal": _nominal(design, functions),
        "laws": [[_shape(shape) for shape in law] for law in gains],
        "staged": bool(design.stages),
        "reanchors": synthesis.handover is Handover.REANCHOR and synthesis.form is Form.SOUND,
        "waves": waves,
        "derivatives": waves and design.nominal is not None,
        "compiled_reference": not waves,
        "funnel": "funnel" in functions,
        "lows": _listed((*(low for low, _ in ranges), 0.0)),
        "highs": _listed((*(high for _, high in ranges), 0.0)),
        "noise": _listed([bound.approximate for bound in measurement.noise]),
        "error": repr(design.spec.actuator.error.approximate),
        "scales": _listed(rate_scales(design)),
        "corners": CORNERS,
        "quantizers": [_quantizer(item) for item in measurement.quantizers],
        "quantized": any(item.kind is not QuantizerKind.NONE for item in measurement.quantizers),
        **_calls(functions, order),
    }
    text = template_environment().get_template("simulation/loop.c.jinja").render(context)
    files = ((f"{name}.h", header), (f"{name}.c", controller), (MAIN, text))
    return Source(files=files, order=order, parameters=len(ranges), stages=len(gains))


def _listed(values: Sequence[float]) -> str:
    return ", ".join(repr(float(value)) for value in values)


def _calls(functions: Mapping[str, Function], order: int) -> dict[str, dict[str, str]]:
    """Write the calls of the plant's functions on the arrays that the loop has."""
    states = [f"x[{index}]" for index in range(order)]
    absent = {"model": "", "bounds": ""}
    found = {"coefficients": dict(absent), "advances": dict(absent)}
    for truth in ("model", "bounds"):
        coefficients = functions.get(f"coefficients_{truth}")
        if coefficients is None:
            continue
        count = len(coefficients.parameters) - 1 - order
        arguments = [f"a[{index}]" for index in range(count)]
        passed = ", ".join(("t", *states, *arguments, "pairs", "bad"))
        found["coefficients"][truth] = f"Sim_coefficients_{truth}({passed});"
        passed = ", ".join(("t", "h", *states, "u", *arguments, "to", "bad"))
        found["advances"][truth] = f"Sim_advance_{truth}({passed});"
    return found


def _nominal(design: Design, functions: Mapping[str, Function]) -> dict[str, str] | None:
    if design.nominal is None:
        return None
    order = design.nominal.order
    weights = [f"run->center.weights[{index}]" for index in range(order)]
    measured = [f"measured[{index}]" for index in range(order)]
    signals = len(functions["course"].parameters) - 2 - order
    course = [f"y[{index}]" for index in range(signals)]
    latched = course[: len(functions["latch"].parameters) - order]
    return {
        "transition": repr(design.nominal.transition),
        "passed": ", ".join((*weights, *course)),
        "latched": ", ".join((*measured, *latched)),
    }


def _rho(spec: RhoSpec) -> str:
    """Write ``tracking.performance_function`` in C."""
    if spec.kind is RhoKind.COSINE:
        t_s = 1.0 if spec.t_s is None else spec.t_s.approximate
        return f"(t < {math.pi * t_s!r}) ? (0.5 * (1.0 + cos(t / {t_s!r}))) : 0.0"
    rate = 1.0 if spec.rate is None else spec.rate.approximate
    floor = 0.0 if spec.floor is None else spec.floor.approximate
    return f"({1.0 - floor!r}) * exp(({-rate!r}) * t) + {floor!r}"


def _shape(shape: Gain) -> dict[str, object]:
    """Lay out a step of the law; an empty text is a term that is not there."""
    scheduled = None
    if isinstance(shape, Theorem1Gain):
        coefficients = [repr(value) for value in reversed(shape.H)]
        scheduled = {"gamma": repr(shape.gamma), "coefficients": coefficients}
    return {
        "k": repr(shape.k),
        "M": repr(shape.M) if shape.M != 0.0 else "",
        "epsilon": repr(shape.epsilon),
        "c": repr(shape.c) if shape.c != 0.0 else "",
        "N": repr(float(shape.N)),
        "scheduled": scheduled,
    }


def _quantizer(spec: QuantizerSpec) -> dict[str, str]:
    keys = ("step", "dead_zone", "hysteresis", "minimum", "density", "threshold")
    given = {key: getattr(spec, key) for key in keys}
    found = {key: repr(value.approximate) for key, value in given.items() if value is not None}
    kind: str = spec.kind.value
    if spec.kind is QuantizerKind.UNIFORM and spec.dead_zone is not None:
        kind = "dead-zone"
    if spec.density is not None:
        density = spec.density.approximate
        found["ratio"] = repr((1.0 + density) / (1.0 - density))
    return {"kind": kind, **found}
