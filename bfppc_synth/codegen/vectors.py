"""Golden vectors: samples, what controller.py answers, and how far another libm may be off.

The samples stand around the nominal run, as random ones would hardly ever be inside the tubes.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

from bfppc_synth.codegen.c import c_literal
from bfppc_synth.codegen.provenance import banner
from bfppc_synth.codegen.running import Meter, error_of
from bfppc_synth.model.vectors import Answer, ReferencePoint, Vectors
from bfppc_synth.resources import template_environment

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import ModuleType

    from bfppc_synth.model.law import Law, Provenance
    from bfppc_synth.model.vectors import Sample

PATH: Final = "c/test/vectors.h"
_FUNCTIONS: Final = (
    *("sqrt", "exp", "log", "sin", "cos", "tan", "tanh", "sinh", "cosh", "atan", "asinh", "pow"),
)
#: Names that controller.py gives to functions of the math module.
_NAMES: Final = {"power": "pow"}


def answer(law: Law, module: ModuleType, samples: Sequence[Sample]) -> Vectors:
    """Let the generated Python controller answer samples.

    Parameters
    ----------
    law : Law
        What ``module`` was printed from.
    module : ModuleType
        The text of controller.py, loaded for this purpose only: its functions are replaced.
    samples : Sequence[Sample]
        As ``make_samples`` gives them.

    Returns
    -------
    Vectors
        Samples whose branches another libm could take the other way are left out.
    """
    smallest = math.ldexp(1.0, -149 if law.arithmetic.single else -1074)
    meter = Meter(unit=math.ldexp(1.0, -law.arithmetic.bits), smallest=smallest)
    if not law.arithmetic.portable:
        _follow(module, meter)
    kept, left_out = list(samples), True
    rows: list[Answer] = []
    # Without a sample the ones after it may be answered otherwise, so all are asked again.
    while left_out:
        rows, doubtful = _asked(law, module, meter, kept)
        left_out = bool(doubtful)
        kept = [sample for k, sample in enumerate(kept) if k not in doubtful]
    return Vectors(rows=tuple(rows), points=_points(law, module, meter, kept))


def _follow(module: ModuleType, meter: Meter) -> None:
    """Put functions that pass errors on in the place of a controller's own."""
    names = vars(module)
    followed = {name: meter.function(getattr(math, name)) for name in _FUNCTIONS}
    for name, value in sorted(names.items()):
        if callable(value) and value is getattr(math, _NAMES.get(name, name), None):
            names[name] = followed[_NAMES.get(name, name)]
    # What answers as C does where Python raises calls them by this name.
    names["math"] = SimpleNamespace(**{**vars(math), **followed})
    if "single" in names:
        names["single"] = meter.rounding(names["single"])


def _asked(
    law: Law, module: ModuleType, meter: Meter, samples: Sequence[Sample]
) -> tuple[list[Answer], set[int]]:
    controller = module.Controller()
    rows: list[Answer] = []
    doubtful: set[int] = set()
    for k, sample in enumerate(samples):
        if sample.reset:
            controller.reset()
        meter.doubtful = False
        number = float if law.arithmetic.portable else meter.number
        y_d: Any = tuple(map(number, sample.y_d))
        u = controller.step(
            number(sample.t),
            tuple(map(number, sample.x)),
            y_d if law.derivatives else y_d[0],
        )
        error = error_of(u)
        # A sample with a reset stays: what follows it would belong to another run.
        if (meter.doubtful or not math.isfinite(error)) and not sample.reset:
            doubtful.add(k)
        rows.append(
            Answer(sample=sample, u=float(u), status=int(controller.status), tolerance=2.0 * error)
        )
    return rows, doubtful


def _points(
    law: Law, module: ModuleType, meter: Meter, samples: Sequence[Sample]
) -> tuple[ReferencePoint, ...]:
    """Evaluate the compiled-in reference at the times of the first replay."""
    if law.reference is None:
        return ()
    times = sorted({sample.t for sample in samples if 0.0 <= sample.t < 1000.0})
    number = float if law.arithmetic.portable else meter.number
    values = [(t, module.reference(number(t))) for t in times]
    return tuple(
        ReferencePoint(t=t, value=float(value), tolerance=2.0 * error_of(value))
        for t, value in values
    )


def render_vectors(law: Law, provenance: Provenance, vectors: Vectors) -> str:
    """Print vectors as the C header c/test/vectors.h.

    Parameters
    ----------
    law : Law
        The controller.
    provenance : Provenance
        What the head of the file says.
    vectors : Vectors
        As ``answer`` gives them.

    Returns
    -------
    str
        Text of the header; inputs as shortest decimals.
    """
    literal = c_literal(law)
    template = template_environment().get_template("c/test/vectors.h.jinja")
    return template.render(
        name=law.name,
        banner=banner(provenance),
        width=len(law.reference_ranges),
        rows=[_row(row, literal) for row in vectors.rows],
        points=[
            f"{{{literal(p.t)}, {literal(p.value)}, {_bound(p.tolerance)}}}" for p in vectors.points
        ],
    )


def _row(row: Answer, literal: Callable[[float], str]) -> str:
    sample = row.sample
    numbers = [
        str(int(sample.reset)),
        str(row.status),
        literal(sample.t),
        f"{{{', '.join(map(literal, sample.x))}}}",
        f"{{{', '.join(map(literal, sample.y_d))}}}",
        literal(row.u),
        _bound(row.tolerance),
    ]
    return f"{{{', '.join(numbers)}}}"


def _bound(tolerance: float) -> str:
    """Write a tolerance with few digits, rounded up."""
    return f"{tolerance * 1.001:.3e}"
