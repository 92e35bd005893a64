"""Adversaries: plants, disturbances and sensors that use all that the certificate assumes.

Center performance takes the bounds as the truth: |f_i| <= f_i*, g_{m,i} <= g_i <= g_i*
pointwise, parameters anywhere in their ranges at any speed (docs/theory.md section 2). Center
nominal takes f and g for the truth where the file has them, parameters as before. So a run
inside the tube is evidence, and one outside refutes the design.
"""

from __future__ import annotations

import math
import random
from enum import StrEnum
from typing import TYPE_CHECKING

from bfppc_synth.simulation.references import first_references, initial_box, sine
from bfppc_synth.simulation.stepping import Action

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.plant import Dynamics
    from bfppc_synth.simulation.references import Derivatives, Reference
    from bfppc_synth.simulation.scheme import Scheme
    from bfppc_synth.simulation.tracking import Tracking

#: Corners of the parameter box that a pushing adversary compares at each decision.
_CORNERS = 4


class Strategy(StrEnum):
    """How signs are chosen."""

    STEADY = "steady push"
    FIRST = "pushes e_1 outward"
    TOGETHER = "push that turns at random times"
    LAST = "pushes e_n outward"
    SWITCHING = "independent switching"
    NEAREST = "pushes the error nearest to its bound outward"


#: Those that look where the errors are, and decide often.
_WATCHING = frozenset({Strategy.FIRST, Strategy.LAST, Strategy.NEAREST})


class Adversary:
    """One seeded adversary; run k does not depend on how many others there are.

    Parameters
    ----------
    design : Design
        Plant file and bounds.
    dynamics : Dynamics
        The plant as functions.
    scheme : Scheme
        The time axis; the same run on a finer one switches at the same times.
    seed, run : int
        Seed of the plant file and number of the run.
    """

    def __init__(
        self, design: Design, dynamics: Dynamics, scheme: Scheme, *, seed: int, run: int
    ) -> None:
        self._random = random.Random(f"{seed}/{run}")  # noqa: S311 -- reproducible, no secret
        self._dynamics = dynamics
        self._scheme = scheme
        self._tracking: Tracking | None = None
        # Center nominal leaves little to push against: there every facet is tried.
        strategies = tuple(Strategy) if design.nominal is not None else tuple(Strategy)[:-1]
        self._widths = design.omega
        self._strategy = strategies[run % len(strategies)]
        # Of every four rounds of strategies, two take the declared bounds for the truth and
        # two start at corners of the initial box.
        turn = run // len(strategies)
        bounded = dynamics.bounds is not None and turn % 2 == 0
        self.truth = dynamics.bounds if bounded and dynamics.bounds else dynamics.model
        corner = turn // 2 % 2 == 0
        self._draw = self._corner if corner else self._random.uniform
        self.start = tuple(self._draw(*ends) for ends in initial_box(design.spec))
        self.kind = "; ".join(
            (
                self._strategy,
                "within the declared bounds" if bounded else "model",
                "corner" if corner else "random point",
            )
        )
        self.y_d: Reference
        self.derivatives: Derivatives | None = None
        if dynamics.reference is not None:
            self.y_d = dynamics.reference
        else:
            first = self._random.uniform(*first_references(design.spec, self.start[0]))
            supplied = sine(design.spec, first, self._sign())
            self.y_d, self.derivatives = supplied, supplied.derivatives
        self._noise = tuple(bound.approximate for bound in design.spec.measurement.noise)
        self._error = design.spec.actuator.error.approximate
        self._uncertain = any(lower < upper for lower, upper in dynamics.ranges)
        self._scales = tuple(rate if rate > 0.0 else 1.0 for rate in design.bounds.D)
        # Mean time between two decisions: a thousandth of the horizon where the errors are
        # watched, from a two-thousandth to a fifth where they are not.
        self._dwell = design.spec.simulation.horizon * 10.0 ** self._random.uniform(-3.3, -0.7)
        if self._strategy in _WATCHING:
            self._dwell = design.spec.simulation.horizon / 1000.0
        self._direction = self._sign()
        self._last_gain = self._random.choice((0.0, 1.0))

    def begin(self, tracking: Tracking) -> None:
        """Learn where the errors are."""
        self._tracking = tracking

    def lag(self) -> float:
        """Let half of the commands act as late as allowed, the others at any time before."""
        late = self._scheme.delay
        return late if self._random.random() < 0.5 else self._random.uniform(0.0, late)

    def act(self, k: int, t: float, x: Sequence[float]) -> Action:
        """Choose signs, parameters and noise at plant step k, time t [s], states x."""
        if self._strategy is Strategy.SWITCHING:
            return self._scatter(self._next(k))
        if self._strategy is Strategy.TOGETHER:
            self._direction = -self._direction
        elif self._strategy in _WATCHING and self._tracking is not None:
            error = self._watched(self._tracking.now(t, x, self.y_d(t)))
            self._direction = math.copysign(1.0, error)
        until = math.inf if self._strategy is Strategy.STEADY else self._next(k)
        return self._push(t, x, until)

    def _watched(self, errors: Sequence[float]) -> float:
        """Pick the error that the strategy pushes."""
        if self._strategy is Strategy.NEAREST:
            shares = zip(errors, self._widths, strict=True)
            return max(shares, key=lambda pair: abs(pair[0]) / pair[1])[0]
        return errors[0 if self._strategy is Strategy.FIRST else -1]

    def _push(self, t: float, x: Sequence[float], until: float) -> Action:
        """Move every channel in one direction: each e_i is driven by the e_{i+1} above it."""
        sign, order = self._direction, self._dynamics.order
        # More gain where the next state pushes the same way, less where it holds back.
        gains = [1.0 if sign * above > 0.0 else 0.0 for above in x[1:]]
        rest = (*(sign,) * (2 * order), *gains, self._last_gain)
        ranges = self._dynamics.ranges
        corners = [tuple(self._corner(*ends) for ends in ranges) for _ in range(_CORNERS)]
        best = max(corners, key=lambda parameters: self._gain(t, x, (*parameters, *rest)))
        return Action(
            arguments=(*best, *rest),
            noise=tuple(-sign * bound for bound in self._noise),
            error=sign * self._error,
            until=until,
        )

    def _gain(self, t: float, x: Sequence[float], arguments: tuple[float, ...]) -> float:
        """Rate how fast the states move in the direction, u apart, as shares of D_i."""
        if not self._uncertain:
            return 0.0
        try:
            pairs = self.truth.coefficients(t, *x, *arguments)
        except OverflowError:
            return math.inf
        forces, gains, above = pairs[::2], pairs[1::2], (*x[1:], 0.0)
        rates = (f + g * y for f, g, y in zip(forces, gains, above, strict=True))
        return self._direction * sum(a / b for a, b in zip(rates, self._scales, strict=True))

    def _scatter(self, until: float) -> Action:
        """Choose every sign by itself."""
        order = self._dynamics.order
        parameters = [self._draw(*ends) for ends in self._dynamics.ranges]
        shares = [self._sign() for _ in range(2 * order)]
        gains = [self._random.choice((0.0, 1.0)) for _ in range(order)]
        return Action(
            arguments=(*parameters, *shares, *gains),
            noise=tuple(self._sign() * bound for bound in self._noise),
            error=self._sign() * self._error,
            until=until,
        )

    def _corner(self, lower: float, upper: float) -> float:
        return self._random.choice((lower, upper))

    def _sign(self) -> float:
        return self._random.choice((-1.0, 1.0))

    def _next(self, k: int) -> int:
        """Draw the plant step of the next decision."""
        return k + max(1, round(self._random.expovariate(1.0 / self._dwell) / self._scheme.step))
