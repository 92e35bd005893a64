"""Implicit steps of a law in stages: the moment of a switch is found within a step.

A continuous monitor leaves its stage exactly where |ê_i| = p_{i,m}. A step that ended far
behind that point would hand over from a place that no continuous measurement allows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bfppc_synth.simulation.implicit import Solver
    from bfppc_synth.simulation.plant import Truth
    from bfppc_synth.simulation.staged import Rollback, StagedTracking
    from bfppc_synth.simulation.stepping import Action

    # Time [s] -> what the controller gets as y_d: with center nominal, derivatives too.
    Passed = Callable[[float], float | Sequence[float] | None]

# Halvings of a step: what is left of it moves no error by more than p^ exceeds p.
_HALVINGS = 30


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """The loop at one moment: states, what was measured of them, the command in force."""

    x: tuple[float, ...]
    measured: tuple[float, ...]
    u: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossing:
    """What a step of a staged law needs besides the step itself.

    ``enough`` is the residual's rate and ``close`` the distance at which a step's equation
    counts as solved [unit of x_n per s, unit of x_n]; ``passed`` is what the controller gets
    as y_d at a time [s], ``y_d`` the reference itself; ``meet`` counts errors of a stage.
    """

    solve: Solver
    truth: Truth
    tracking: StagedTracking
    back: Rollback
    passed: Passed
    y_d: Callable[[float], float]
    meet: Callable[[int, Sequence[float]], None]
    enough: float
    close: float
    peak: float

    def advance(self, now: float, h: float, point: Point, action: Action) -> Point:
        """Take one step of length h [s] from time ``now``, through every switch in it.

        Where a step ends outside its stage it is halved; only a step too short to matter is
        taken across the edge.
        """
        end, length, shortest = now + h, h, h * 2.0**-_HALVINGS
        while True:
            last = now + length >= end
            reached = self._attempt(now, end if last else now + length, point, action)
            switched = self.back.stage != self.tracking.stage
            if switched and length > shortest:
                length *= 0.5
                continue
            self.back.keep()
            now, point = (end if last else now + length), reached
            length = h if switched else 2.0 * length
            if switched:
                self._switch(now, point)
            if now >= end:
                return point

    def _switch(self, t: float, point: Point) -> None:
        """Go on to the next stage, and count the errors just before and just behind."""
        y_d = self.y_d(t)
        self.meet(self.tracking.stage, self.tracking.now(t, point.x, y_d))
        self.tracking.switch(self.back.stage, t, point.measured, y_d)
        self.meet(self.tracking.stage, self.tracking.now(t, point.x, y_d))

    def _attempt(self, now: float, end: float, point: Point, action: Action) -> Point:
        length = end - now
        pairs = self.truth.coefficients(now, *point.x, *action.arguments)
        x, measured, _, _ = self.solve(
            self._unswitched,
            end,
            length,
            # Below the last digits of x_n no residual can get, however short the step.
            max(self.enough * length, 8.0 * math.ulp(abs(point.x[-1]))),
            self.close,
            self.peak,
            1.0,
            point.u,
            action.error,
            self.passed(end),
            *point.x,
            *pairs,
            *action.noise,
        )
        return Point(x=tuple(x), measured=tuple(measured), u=self.back.command)

    def _unswitched(
        self, t: float, measured: Sequence[float], y_d: float | Sequence[float] | None
    ) -> float:
        """Return the command of the stage that the step begins in.

        The next stage's law would make the equation of the step jump: its root might then lie
        on the monitor's edge, where no stage is ever left.
        """
        command = self.back.trial(t, measured, y_d)
        if self.back.stage == self.tracking.stage:
            return command
        return self.tracking.command(t, measured, self.y_d(t))
