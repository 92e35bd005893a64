"""Implicit steps of a law in stages: the moment of a switch is found within a step.

A continuous monitor leaves its stage exactly where |ê_i| = p_{i,m}. A step that ended far
behind that point would hand over from a place that no continuous measurement allows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bfppc_synth.simulation.implicit import Solver
    from bfppc_synth.simulation.plant import Truth
    from bfppc_synth.simulation.staged import Rollback, StagedTracking
    from bfppc_synth.simulation.stepping import Action

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
    as y_d at a time [s], ``y_d`` the reference itself.
    """

    solve: Solver
    truth: Truth
    tracking: StagedTracking
    back: Rollback
    passed: Callable[[float], float | None]
    y_d: Callable[[float], float]
    enough: float
    close: float
    peak: float

    def advance(self, now: float, h: float, point: Point, action: Action) -> Point:
        """Take one step of length h [s] from time ``now``, through every switch in it.

        Where a step ends in the next stage it is halved, for that stage's command must not
        have acted before; only a step too short to matter is taken across a switch.
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
                self.tracking.switch(self.back.stage, now, point.measured, self.y_d(now))
            if now >= end:
                return point

    def _attempt(self, now: float, end: float, point: Point, action: Action) -> Point:
        length = end - now
        pairs = self.truth.coefficients(now, *point.x, *action.arguments)
        x, measured, u, _ = self.solve(
            self.back.trial,
            end,
            length,
            self.enough * length,
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
        return Point(x=_floats(x), measured=_floats(measured), u=u)


def _floats(values: Sequence[float]) -> tuple[float, ...]:
    return tuple(values)
