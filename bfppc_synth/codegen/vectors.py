"""Golden vectors: samples, what controller.py answers, and how far another libm may be off.

The samples stand around the nominal run, as random ones would hardly ever be inside the tubes.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

from bfppc_synth.codegen.c import c_literal
from bfppc_synth.codegen.provenance import banner
from bfppc_synth.codegen.running import Meter, error_of
from bfppc_synth.model.vectors import Answer, ReferencePoint, Sample, Vectors
from bfppc_synth.resources import template_environment

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from types import ModuleType

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.law import Law, Provenance

PATH: Final = "c/test/vectors.h"
_FUNCTIONS: Final = (
    *("sqrt", "exp", "log", "sin", "cos", "tan", "tanh", "sinh", "cosh", "atan", "asinh", "pow"),
)
#: Names that controller.py gives to functions of the math module.
_NAMES: Final = {"power": "pow"}


def make_samples(law: Law, run: Sequence[Sample]) -> tuple[Sample, ...]:
    """Choose what is replayed: a run, states moved about in it, and samples to be turned away.

    Parameters
    ----------
    law : Law
        Its screening limits say where samples are turned away.
    run : Sequence[Sample]
        A run from its first sample on, times from 0 [s]; it is replayed three times.

    Returns
    -------
    tuple[Sample, ...]
        Each replay begins with a reset; the first sample is the run's own.
    """
    limits = {constant.name: float(constant.value) for constant in law.limits}
    reach = [limits[test.upper] for test in law.inputs]
    first, *rest = (_short(sample) for sample in run)
    # The start itself may lie on the border of the initial set.
    first = replace(first, x=run[0].x, reset=True)
    plain = [first, *rest]
    found = list(plain)
    for k, sample in enumerate(plain):
        found += _moved(sample, k, reach)
    # A sample is turned away before anything is latched, and then the run begins elsewhere.
    odd = replace(first, x=(2.0 * reach[0], *first.x[1:]))
    late = [replace(sample, t=sample.t + 1000.0, reset=False) for sample in plain[1:]]
    found.append(odd)
    for k, sample in enumerate(late):
        found.append(sample)
        found += _turned_away(sample, k, reach, limits[law.reference_ranges[0].upper])
    return tuple(_given(sample, law.arithmetic) for sample in found)


def _given(sample: Sample, arithmetic: Arithmetic) -> Sample:
    """Round to what a caller of the C code can pass."""
    nearest = arithmetic.nearest
    return replace(
        sample,
        t=nearest(sample.t),
        x=tuple(map(nearest, sample.x)),
        y_d=tuple(map(nearest, sample.y_d)),
    )


def through_switches(module: ModuleType, run: Sequence[Sample]) -> tuple[Sample, ...]:
    """Add the samples at which a law in stages goes on, as far as bisection finds them.

    A law that sees its switch late finds errors beyond what the handover allows, and would say
    OUTSIDE ever after.

    Parameters
    ----------
    module : ModuleType
        The generated Python controller.
    run : Sequence[Sample]
        A run with a y_d that is one number, times from 0 [s].

    Returns
    -------
    tuple[Sample, ...]
        The run, with one sample more before each that is in a later stage than the last.
    """
    found = [run[0]]
    for sample in map(_short, run[1:]):
        stage, left = _stage(module, found), found[-1]
        while _stage(module, [*found, sample]) > stage:
            low, high = 0.0, 1.0
            for _ in range(60):
                middle = 0.5 * (low + high)
                later = _stage(module, [*found, _between(left, sample, middle)]) > stage
                low, high = (low, middle) if later else (middle, high)
            left = _between(left, sample, high)
            found.append(left)
            stage = _stage(module, found)
        found.append(sample)
    return tuple(found)


def _stage(module: ModuleType, samples: Sequence[Sample]) -> int:
    controller = module.Controller()
    for sample in samples:
        controller.step(sample.t, sample.x, sample.y_d[0])
    return int(controller.stage)


def _between(a: Sample, b: Sample, share: float) -> Sample:
    def mixed(left: float, right: float) -> float:
        return _nine(left + share * (right - left))

    return Sample(
        t=mixed(a.t, b.t),
        x=tuple(map(mixed, a.x, b.x)),
        y_d=tuple(map(mixed, a.y_d, b.y_d)),
    )


def _short(sample: Sample) -> Sample:
    """Round to nine digits: a simulation's last digits differ between processors."""
    return replace(
        sample,
        t=_nine(sample.t),
        x=tuple(map(_nine, sample.x)),
        y_d=tuple(map(_nine, sample.y_d)),
        reset=False,
    )


def _nine(value: float) -> float:
    return float(f"{value:.9g}")


def _moved(sample: Sample, k: int, reach: Sequence[float]) -> Iterator[Sample]:
    """Give the sample again with one state moved, nearer or farther as k says."""
    i = k % len(reach)
    step = math.ldexp(reach[i], -(k % 17)) * (-1.0) ** k
    value = sample.x[i] + step
    if abs(value) > reach[i]:
        value = sample.x[i] - step
    yield replace(sample, x=(*sample.x[:i], _nine(value), *sample.x[i + 1 :]))


def _turned_away(sample: Sample, k: int, reach: Sequence[float], y_d: float) -> Iterator[Sample]:
    """Give a sample that breaks one of the rules, a different one for each k."""
    if k % 12 == 3:
        yield replace(sample, x=(*sample.x[:-1], -1.5 * reach[-1]))
    elif k % 12 == 6:
        yield replace(sample, t=sample.t - 2000.0)
    elif k % 12 == 9:
        yield replace(sample, y_d=(1.5 * y_d, *sample.y_d[1:]))
    elif k % 12 == 11:
        yield replace(sample, t=sample.t + 2e6)


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
    meter = Meter(unit=math.ldexp(1.0, -law.arithmetic.bits))
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
