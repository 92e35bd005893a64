"""Drawn runs: plants, starts and adversaries within exactly what the certificate assumes.

A ``Draw`` is all that a run is free to choose, as numbers; ``Drawn`` plays it in Python, and the
compiled loop plays the same numbers in C. Both take every random number from one generator in
one order, so that they make the same run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING

from bfppc_synth.simulation.references import Sine
from bfppc_synth.simulation.stepping import Action

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.plant import Dynamics
    from bfppc_synth.simulation.references import Derivatives, Reference
    from bfppc_synth.simulation.scheme import Scheme
    from bfppc_synth.simulation.tracking import Tracking

#: Corners of the parameter box that a greedy adversary compares at each decision.
CORNERS = 4

_MASK = (1 << 64) - 1


class Manner(IntEnum):
    """How a drawn adversary behaves; the values are those of the C loop."""

    PLAN = 0
    SWITCHING = 1
    GREEDY = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """What a plan does until the time ``until`` [s]: as in ``Action``."""

    until: float
    arguments: tuple[float, ...]
    noise: tuple[float, ...]
    error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """Everything that one run chooses.

    ``start`` is x(0); ``wave`` the run-time reference, None where it is compiled in;
    ``bounded`` takes the declared bounds for the truth instead of the model; ``corners`` draws
    extremes only; ``target`` is the error that a greedy adversary pushes, -1 the one nearest
    to its facet; ``dwell`` the mean time between decisions [s]; ``late`` lets every command
    act as late as allowed; ``jitter`` samples irregularly; ``seed`` feeds the decisions.
    """

    manner: Manner
    start: tuple[float, ...]
    wave: Sine | None
    bounded: bool
    corners: bool
    target: int
    dwell: float
    late: bool
    jitter: bool
    seed: int
    plan: tuple[Segment, ...] = ()


class Generator:
    """Splitmix64: 64 bits of state, the same numbers in any language."""

    __slots__ = ("_state",)

    def __init__(self, seed: int) -> None:
        self._state = seed & _MASK

    def uniform(self) -> float:
        """Return a number in [0, 1)."""
        self._state = (self._state + 0x9E3779B97F4A7C15) & _MASK
        z = self._state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
        return ((z ^ (z >> 31)) >> 11) * 2.0**-53


class Drawn:
    """A drawn run as a ``Nature`` of the Python loop.

    Parameters
    ----------
    design : Design
        Bounds, noise, tube.
    dynamics : Dynamics
        The plant as functions.
    scheme : Scheme
        The time axis; on a finer one, plans switch at the same times.
    draw : Draw
        What is chosen.
    """

    def __init__(self, design: Design, dynamics: Dynamics, scheme: Scheme, draw: Draw) -> None:
        self.kind = draw.manner.name.lower()
        self.start = draw.start
        bounds = dynamics.bounds
        self.truth = bounds if draw.bounded and bounds is not None else dynamics.model
        self.y_d: Reference
        self.derivatives: Derivatives | None = None
        if dynamics.reference is not None:
            self.y_d = dynamics.reference
        else:
            wave = draw.wave or Sine(
                amplitude=0.0, frequency=0.0, phase=0.0, order=design.spec.order
            )
            self.y_d, self.derivatives = wave, wave.derivatives
        self._draw = draw
        self._scheme = scheme
        self._ranges, self._order = dynamics.ranges, dynamics.order
        self._random = Generator(draw.seed)
        self._tracking: Tracking | None = None
        self._widths = design.omega
        self._scales = rate_scales(design)
        self._noise = tuple(bound.approximate for bound in design.spec.measurement.noise)
        self._error = design.spec.actuator.error.approximate
        self._dwell = draw.dwell / scheme.step
        self._segment = 0

    def begin(self, tracking: Tracking) -> None:
        """Learn where the errors are."""
        self._tracking = tracking

    def lag(self) -> float:
        """Return the age at which the next command acts [s]."""
        if self._draw.late or self._random.uniform() < 0.5:
            return self._scheme.delay
        return self._random.uniform() * self._scheme.delay

    def gap(self, substeps: int) -> int:
        """Return how many plant steps the next sample is away."""
        if not self._draw.jitter:
            return substeps
        return min(1 + math.floor(self._random.uniform() * substeps), substeps)

    def act(self, k: int, t: float, x: Sequence[float]) -> Action:
        """Decide at plant step k, time t [s], states x."""
        manner = self._draw.manner
        if manner is Manner.PLAN:
            return self._planned(k)
        if manner is Manner.SWITCHING:
            return self._switched(k)
        return self._greedy(k, t, x)

    def _planned(self, k: int) -> Action:
        plan = self._draw.plan
        while self._segment + 1 < len(plan) and k >= self._until(self._segment):
            self._segment += 1
        segment = plan[self._segment]
        return Action(
            arguments=segment.arguments,
            noise=segment.noise,
            error=segment.error,
            until=self._until(self._segment),
        )

    def _until(self, index: int) -> float:
        if index + 1 >= len(self._draw.plan):
            return math.inf
        return steps_until(self._draw.plan[index].until, self._scheme.step)

    def _switched(self, k: int) -> Action:
        n = self._order
        parameters = [self._pick(*ends) for ends in self._ranges]
        shares = [self._pick(-1.0, 1.0) for _ in range(2 * n)]
        gains = [self._pick(0.0, 1.0) for _ in range(n)]
        noise = tuple(self._pick(-bound, bound) for bound in self._noise)
        error = self._pick(-self._error, self._error)
        return Action(
            arguments=(*parameters, *shares, *gains),
            noise=noise,
            error=error,
            until=self._next(k),
        )

    def _greedy(self, k: int, t: float, x: Sequence[float]) -> Action:
        n, sign = self._order, self._direction(t, x)
        gains = [1.0 if sign * above > 0.0 else 0.0 for above in x[1:]]
        gains.append(0.0 if self._random.uniform() < 0.5 else 1.0)
        rest = (*(sign,) * (2 * n), *gains)
        best: tuple[float, ...] = rest
        if self._ranges:
            most = -math.inf
            for corner in range(CORNERS):
                trial = (*(self._corner(*ends) for ends in self._ranges), *rest)
                rate = self._rate(t, x, trial, sign)
                if corner == 0 or rate > most:
                    best, most = trial, rate
        return Action(
            arguments=best,
            noise=tuple(-sign * bound for bound in self._noise),
            error=sign * self._error,
            until=self._next(k),
        )

    def _direction(self, t: float, x: Sequence[float]) -> float:
        """Choose where to push: outward at the watched error."""
        if self._tracking is None:
            return -1.0 if self._random.uniform() < 0.5 else 1.0
        errors, _ = self._tracking.exact(t, x, self.y_d(t))
        watched = self._draw.target
        if watched < 0:
            watched = 0
            for i in range(1, self._order):
                near = abs(errors[i]) / self._widths[i]
                if near > abs(errors[watched]) / self._widths[watched]:
                    watched = i
        return math.copysign(1.0, errors[watched])

    def _rate(
        self, t: float, x: Sequence[float], arguments: tuple[float, ...], sign: float
    ) -> float:
        """Rate how fast the states move in the direction, u apart, as shares of D_i."""
        pairs = self.truth.coefficients(t, *x, *arguments)
        total = 0.0
        for i in range(self._order):
            above = x[i + 1] if i + 1 < self._order else 0.0
            total = total + sign * (pairs[2 * i] + pairs[2 * i + 1] * above) / self._scales[i]
        return total

    def _pick(self, lower: float, upper: float) -> float:
        share = self._random.uniform()
        if self._draw.corners:
            return lower if share < 0.5 else upper
        return lower + share * (upper - lower)

    def _corner(self, lower: float, upper: float) -> float:
        return lower if self._random.uniform() < 0.5 else upper

    def _next(self, k: int) -> float:
        """Draw the plant step of the next decision."""
        return k + 1.0 + math.floor(-math.log(1.0 - self._random.uniform()) * self._dwell)


def rate_scales(design: Design) -> tuple[float, ...]:
    """Say what one unit of each state's rate is worth to a greedy adversary: its D_i."""
    return tuple(rate if rate > 0.0 else 1.0 for rate in design.bounds.D)


def steps_until(time: float, step: float) -> float:
    """Return the first plant step at or behind a time [s]."""
    return float(math.ceil(time / step))
