"""The runs that all methods meet: plants, starts, references, noise; run k is always the same."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.simulation.baselines.arrays import make_measure
from bfppc_synth.simulation.baselines.path import make_path
from bfppc_synth.simulation.baselines.plant import compile_rates, has_bounds
from bfppc_synth.simulation.plant import modelled
from bfppc_synth.simulation.references import first_references, initial_box, sine

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.simulation.baselines.arrays import Array, Measure
    from bfppc_synth.simulation.baselines.path import Path
    from bfppc_synth.simulation.baselines.plant import Rates
    from bfppc_synth.simulation.references import Sine

#: How often a plant that changes may change in a run.
EPOCHS = 40

#: Share of the fastest sampling that the design's own law needs to be a stable loop.
_PER_STEP = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Clock:
    """The samples t_k = k h, k = 0..count; every hold is ``substeps`` plant steps.

    ``source`` says where h comes from, ``covered`` whether the certificate speaks about it.
    """

    period: float
    substeps: int
    delay: float
    count: int
    source: str
    covered: bool

    @property
    def times(self) -> Array:
        """The samples [s], shape (count + 1,)."""
        return np.arange(self.count + 1, dtype=np.float64) * self.period


@dataclass(frozen=True, slots=True, kw_only=True)
class Cases:
    """Runs 0..R-1 of one plant.

    ``start`` is x(0), shape (n, R, 1); ``arguments`` are those of ``compile_rates`` and the
    actuator error, shape (epochs, count, R); ``free`` marks the runs that take the declared
    bounds for the truth, (R, 1); ``noise`` is added to the measurement, (K+1, n, R), all zeros
    of one row where there is none; ``references`` are supplied at run time or None. Run 0 is
    the nominal one.
    """

    design: Design
    clock: Clock
    rates: Rates
    path: Path
    start: Array
    arguments: Array
    free: Array
    noise: Array
    references: tuple[Sine | None, ...]

    @property
    def runs(self) -> int:
        """Number of runs R."""
        return int(self.start.shape[1])

    def measures(self) -> list[Measure]:
        """Make the quantizers, their memory at its start."""
        return [make_measure(item) for item in self.design.spec.measurement.quantizers]


def make_clock(design: Design, horizon: float) -> Clock:
    """Choose the samples that all methods share.

    Parameters
    ----------
    design : Design
        ``sampling.period``; where it is 0, ``simulation.period``, or less where the design's
        own law, held for so long, would be no stable loop.
    horizon : float
        Length of the runs [s].

    Returns
    -------
    Clock
        Divided as ``simulation.period`` divides it.
    """
    spec = design.spec
    period, step = spec.sampling.period.approximate, spec.simulation.period
    source = "sampling.period"
    if period <= 0.0:
        steepest = design.bounds.slope * max(design.bounds.G[-1], 1e-300)
        period, source = step, "simulation.period"
        if period * steepest > _PER_STEP:
            period, source = _two_digits(_PER_STEP / steepest), "slope of the design's law"
    return Clock(
        period=period,
        substeps=max(1, math.ceil(period / step - 1e-9)),
        delay=spec.sampling.delay.approximate,
        count=max(1, math.ceil(horizon / period - 1e-9)),
        source=source,
        covered=period <= design.largest_certified_period,
    )


def simulated_plant(design: Design) -> Plant:
    """Return the plant as its certificate takes it: center nominal has formulas for the truth."""
    return design.plant if design.nominal is None else modelled(design.plant)


def open_choices(design: Design) -> bool:
    """Whether two runs of this plant may differ at all."""
    spec, plant = design.spec, simulated_plant(design)
    ranges = any(lower != upper for lower, upper in plant.ranges)
    disturbed = any(channel.disturbance != 0 for channel in plant.channels)
    starts = any(lower < upper for lower, upper in initial_box(spec))
    noisy = any(bound.approximate > 0.0 for bound in spec.measurement.noise)
    loose = ranges or disturbed or starts or noisy or has_bounds(plant)
    return loose or plant.reference is None or spec.actuator.error.approximate > 0.0


def make_cases(design: Design, clock: Clock, *, seed: int, stream: int, runs: int) -> Cases:
    """Draw the runs.

    Parameters
    ----------
    design : Design
        Plant, performance, bounds.
    clock : Clock
        The samples.
    seed, stream : int
        Run k is drawn from (seed, stream, k) and from nothing else.
    runs : int
        How many; one where nothing is left open.

    Returns
    -------
    Cases
        Run 0 has the middle of everything; odd runs change their plant at random times, even
        ones keep it; where bounds are declared, two of three runs take them for the truth.
    """
    spec, plant, order = design.spec, simulated_plant(design), design.plant.order
    count = runs if open_choices(design) else 1
    ranges = [
        (evaluate(lower, {}, FLOAT_FUNCTIONS), evaluate(upper, {}, FLOAT_FUNCTIONS))
        for lower, upper in plant.ranges
    ]
    sizes = [*ranges, *[(-1.0, 1.0)] * (2 * order), *[(0.0, 1.0)] * order]
    error = spec.actuator.error.approximate
    sizes.append((-error, error))
    low, high = (np.array([pair[side] for pair in sizes]) for side in (0, 1))
    box = np.array(initial_box(spec))
    loud = np.array([bound.approximate for bound in spec.measurement.noise])
    arguments = np.empty((EPOCHS, len(sizes), count))
    start, noise = np.empty((order, count)), np.zeros((1, order, count))
    if loud.any():
        noise = np.empty((clock.count + 1, order, count))
    free, references = np.zeros(count, dtype=bool), []
    for run in range(count):
        generator = np.random.default_rng([seed, stream, run])
        # Drawn whatever they are used for, so that no choice shifts another.
        places = generator.random((EPOCHS, len(sizes)))
        corner, where = generator.random() < 0.5, generator.random(order)
        turn, begun = generator.random(2)
        if loud.any() and run:
            signs = generator.random((clock.count + 1, order)) < 0.5
            noise[:, :, run] = np.where(signs, -loud, loud)
        elif run == 0:
            noise[:, :, run] = 0.0
        if run == 0:
            places, where = places * 0.0 + 0.5, where * 0.0 + 0.5
        elif corner:
            places, where = np.round(places), np.round(where)
        if run % 2 == 0:
            places[:] = places[0]
        arguments[:, :, run] = low + places * (high - low)
        start[:, run] = box[:, 0] + where * (box[:, 1] - box[:, 0])
        free[run] = has_bounds(plant) and run % 3 != 0
        references.append(_reference(design, start[0, run], run, begun, turn))
    measured = [
        measure(start[i]) + noise[0, i]
        for i, measure in enumerate(make_measure(item) for item in spec.measurement.quantizers)
    ]
    starts = [
        (
            tuple(float(column[run]) for column in measured),
            tuple(float(value) for value in start[:, run]),
        )
        for run in range(count)
    ]
    return Cases(
        design=design,
        clock=clock,
        rates=compile_rates(plant),
        path=make_path(design, clock.times, starts, references),
        start=start[:, :, np.newaxis],
        arguments=arguments,
        free=free[:, np.newaxis],
        noise=noise,
        references=tuple(references),
    )


def _reference(design: Design, x_1: float, run: int, begun: float, turn: float) -> Sine | None:
    """Draw the reference of a run; the nominal one begins as near to 0 as it may."""
    if design.plant.reference is not None:
        return None
    lower, upper = first_references(design.spec, float(x_1))
    if run == 0:
        return sine(design.spec, min(max(0.0, lower), upper), 1.0)
    return sine(design.spec, lower + float(begun) * (upper - lower), 1.0 if turn < 0.5 else -1.0)


def _two_digits(value: float) -> float:
    """Round down to two digits: a period that a reader can type."""
    scale = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.floor(value / scale + 1e-9) * scale:.2g}")
