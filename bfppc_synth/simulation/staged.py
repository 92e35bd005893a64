"""Errors of a law in stages: every switch begins a new center or a new set of gains.

Which stage is in force is the controller's decision; where its center begins is computed here
again, from the measured states, and not read from the controller.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.model.spec import Form
from bfppc_synth.model.stages import Handover
from bfppc_synth.simulation.tracking import Tracking, feedback, performance_function

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.simulation.tracking import Start

# Rows and switches count their times differently; a row this close to a switch is behind it.
_SLACK = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class _Epoch:
    """One stage under way: since when [s], its gains, and what its center is made of.

    ``moves`` are (time, anchor) of every switch so far; ``begun`` and ``starts`` are the time
    and the states that r_2..r_n fade from.
    """

    stage: int
    since: float
    shapes: tuple[Gain, ...]
    moves: tuple[tuple[float, float], ...]
    begun: float
    starts: tuple[float, ...]


class StagedTracking(Tracking):
    """Errors e_{i,m} of the stage m in force at each moment (docs/theory.md section 8).

    Parameters
    ----------
    design : Design
        Its ``stages`` come before its ``gains``.
    start : Start
        As for ``Tracking``.
    """

    def __init__(self, design: Design, start: Start) -> None:
        super().__init__(design, start)
        synthesis = design.spec.synthesis
        self._reanchors = synthesis.handover is Handover.REANCHOR and synthesis.form is Form.SOUND
        self._laws = (*(stage.gains for stage in design.stages), design.gains)
        self._functions = [performance_function(rho) for rho in self._rhos]
        self._epochs = [
            _Epoch(
                stage=1,
                since=-math.inf,
                shapes=self._laws[0],
                moves=(),
                begun=0.0,
                starts=tuple(self._scales[1:]),
            )
        ]

    @property
    def stage(self) -> int:
        """Stage in force, from 1."""
        return self._epochs[-1].stage

    def switch(self, stage: int, t: float, measured: Sequence[float], y_d: float) -> None:
        """Learn that the law went on to a stage at the sample of time t [s]."""
        before = self._epochs[-1]
        moves, begun, starts = before.moves, before.begun, before.starts
        if self._reanchors:
            moves = (*moves, (t, measured[0] - y_d - self._first(before, t)))
            begun, starts = t, tuple(measured[1:])
        self._epochs.append(
            _Epoch(
                stage=stage,
                since=t - _SLACK,
                shapes=self._laws[stage - 1],
                moves=moves,
                begun=begun,
                starts=starts,
            )
        )

    def stages(self, t: Sequence[float]) -> list[int]:
        """Return the stage in force at each of the times [s]."""
        return [self._at(s).stage for s in t]

    def center(self, t: Sequence[float], y_d: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return r_1..r_n at the times t [s] after the first sample, shape (N, n)."""
        import numpy as np

        rows = [self._center(self._at(s), s) for s in t]
        r = np.array(rows).reshape(len(rows), self.order)
        r[:, 0] += y_d
        return r

    def errors(
        self, t: Sequence[float], x: NDArray[np.float64], r: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the errors of the stage in force, shape (N, n)."""
        import numpy as np

        result = np.empty_like(x)
        stages = np.array(self.stages(t))
        for epoch in self._epochs:
            rows = stages == epoch.stage
            carried = np.zeros(int(rows.sum()))
            for i, shape in enumerate(epoch.shapes):
                result[rows, i] = x[rows, i] - r[rows, i] + carried
                carried = feedback(shape, result[rows, i], np.tanh, shape.k)
        return result

    def now(self, t: float, x: Sequence[float], y_d: float) -> list[float]:
        """Return the errors of the stage in force at one moment t [s]."""
        epoch = self._at(t)
        result: list[float] = []
        carried = -y_d
        for state, r, shape in zip(x, self._center(epoch, t), epoch.shapes, strict=True):
            result.append(state - r + carried)
            carried = feedback(shape, result[-1], math.tanh, shape.k)
        return result

    def command(self, t: float, x: Sequence[float], y_d: float) -> float:
        """Return what the law of the stage in force commands, whatever a monitor says."""
        shape = self._at(t).shapes[-1]
        return -feedback(shape, self.now(t, x, y_d)[-1], math.tanh, shape.k)

    def middle(self, t: float, y_d: float) -> list[float]:
        """Return r_1..r_n of the last stage begun."""
        r = self._center(self._epochs[-1], t)
        r[0] += y_d
        return r

    def law(self, t: float) -> tuple[Gain, ...]:
        """Return the gains of the last stage begun."""
        del t
        return self._epochs[-1].shapes

    def _at(self, t: float) -> _Epoch:
        return next(epoch for epoch in reversed(self._epochs) if t >= epoch.since)

    def _first(self, epoch: _Epoch, t: float) -> float:
        """r_1 - y_d."""
        rho = self._functions[0]
        return self._scales[0] * rho(t) + sum(
            anchor * rho(max(0.0, t - at)) for at, anchor in epoch.moves
        )

    def _center(self, epoch: _Epoch, t: float) -> list[float]:
        """r_1 - y_d, r_2, .., r_n."""
        since = max(0.0, t - epoch.begun)
        others: list[float] = [
            rho(since) * start for rho, start in zip(self._functions[1:], epoch.starts, strict=True)
        ]
        return [self._first(epoch, t), *others]


def stage_widths(design: Design) -> tuple[tuple[float, ...], ...]:
    """List what |e_{i,m}| stays below in every stage m: p^_{i,m}, and p_{i,K} in the last."""
    return (*(stage.widened for stage in design.stages), design.omega)


class Rollback:
    """A controller whose last step can be taken back: a step's end is searched by trials.

    Parameters
    ----------
    controller : object
        A generated controller; all it remembers is in its ``__slots__``.
    """

    def __init__(self, controller: object) -> None:
        self._controller = controller
        self._names: tuple[str, ...] = getattr(type(controller), "__slots__", ())
        self._kept: list[object] = []
        self.command = 0.0
        self._step: Callable[..., float] = getattr(controller, "step")  # noqa: B009
        self.keep()

    @property
    def stage(self) -> int:
        """Stage of the law that has just been applied."""
        return int(getattr(self._controller, "stage"))  # noqa: B009

    def keep(self) -> None:
        """Make what the controller remembers now the point to which trials return."""
        self._kept = [getattr(self._controller, name) for name in self._names]

    def trial(self, t: float, x: Sequence[float], y_d: float | Sequence[float] | None) -> float:
        """Take the step from the kept point, whatever was tried before; keep its command."""
        for name, value in zip(self._names, self._kept, strict=True):
            setattr(self._controller, name, value)
        self.command = self._step(t, x, y_d)
        return self.command
