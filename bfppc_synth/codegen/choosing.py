"""Which samples the golden vectors hold: a run, states moved about in it, what is turned away."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.model.vectors import Sample

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from types import ModuleType

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.law import Law


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
    found.append(first)
    for k, sample in enumerate(rest):
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
