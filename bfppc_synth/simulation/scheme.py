"""How time passes in a simulation: sampled, or in steps implicit in x_n (SPEC section 1)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING

from bfppc_synth.model.spec import Form, QuantizerKind

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design


#: Implicit steps longer than this many crossing times prove nothing about the certified loop; a
#: run outside its bounds is repeated with steps a quarter as long before it counts.
_COARSEST = 4.0


class Stepping(Enum):
    """The two ways to close the loop."""

    SAMPLED = auto()
    IMPLICIT = auto()


class Coverage(Enum):
    """Whether the certificate speaks about what is simulated."""

    COVERED = auto()
    NOT_COVERED = auto()


@dataclass(frozen=True, slots=True, kw_only=True)
class Scheme:
    """The time axis of a run.

    ``sample`` is the time between two commands [s], divided into ``substeps`` equal plant
    steps (1 when implicit); ``delay`` is the largest age at which a command starts to act [s].
    """

    stepping: Stepping
    sample: float
    substeps: int
    delay: float
    coverage: Coverage

    @property
    def step(self) -> float:
        """Length of a plant step [s]."""
        return self.sample / self.substeps

    def samples(self, horizon: float) -> int:
        """Count the samples that reach the horizon [s], at least one."""
        return max(1, math.ceil(horizon / self.sample - 1e-9))

    def finer(self, factor: int) -> Scheme:
        """Divide every plant step; a sampled controller keeps its samples."""
        if self.stepping is Stepping.SAMPLED:
            sample, substeps = self.sample, self.substeps * factor
        else:
            sample, substeps = self.sample / factor, 1
        return Scheme(
            stepping=self.stepping,
            sample=sample,
            substeps=substeps,
            delay=self.delay,
            coverage=self.coverage,
        )


def choose_scheme(design: Design) -> Scheme:
    """Choose the time axis that the plant file asks for.

    Parameters
    ----------
    design : Design
        Its spec's ``sampling``, ``simulation.period`` and quantizers are read.

    Returns
    -------
    Scheme
        Sampled at exactly ``sampling.period`` where that is positive. Else implicit; or,
        with a quantizer or a delay of at least one step, sampled every ``simulation.period``.
        Not covered where ``simulation.period`` is too long for what the certificate says.

    References
    ----------
    docs/theory.md section 3, Timing.
    """
    spec = design.spec
    period, delay = spec.sampling.period.approximate, spec.sampling.delay.approximate
    step = spec.simulation.period
    coverage = Coverage.COVERED
    if spec.synthesis.form is not Form.SOUND:
        coverage = Coverage.NOT_COVERED
    stepping, sample, substeps = Stepping.SAMPLED, step, 1
    if period > 0.0:
        sample, substeps = period, max(1, math.ceil(period / step - 1e-9))
    elif delay >= step:
        # Only the age of a command, h + tau, enters the theorem: a hold of one step with
        # delays up to tau minus that step is among what tau alone allows.
        delay -= step
    elif any(item.kind is not QuantizerKind.NONE for item in spec.measurement.quantizers):
        if step > design.largest_certified_period:
            coverage = Coverage.NOT_COVERED
    else:
        # No delay at all is among the delays below one step.
        stepping, delay = Stepping.IMPLICIT, 0.0
        if step > _COARSEST * _shortest_time(design):
            coverage = Coverage.NOT_COVERED
    return Scheme(
        stepping=stepping, sample=sample, substeps=substeps, delay=delay, coverage=coverage
    )


def _shortest_time(design: Design) -> float:
    """Time [s] in which what the plant and the center do alone could cross the tube.

    That part of a step is explicit, so a longer step is not the certified loop. What a nominal
    center and its model do together is exact, and no part of W_i.
    """
    bounds = design.bounds
    times = [xi / W for xi, W in zip(bounds.xi, bounds.W, strict=True) if W > 0.0]
    if design.nominal is not None:
        # A polynomial of degree 2n+1 takes some ten steps to be followed.
        times.append(design.nominal.transition / (10.0 * _COARSEST))
    return min(times, default=math.inf)
