"""What is kept of a run: maxima over every step, and the rows that a report shows."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bfppc_synth.simulation.tracking import Tracking

    # (x, what was measured, u, status of the controller) of one plant step
    Row = tuple[Sequence[float], Sequence[float], float, int]

#: A state beyond this many times what the tube allows, or this number if that is more, has left
#: every tube; the run ends there.
DIVERGED = 1e12

#: Rows are judged in batches: large enough for numpy, small enough to end a lost run soon.
BATCH = 2048


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Kept rows of a run; shapes (N,) and (N, n)."""

    t: NDArray[np.float64]
    x: NDArray[np.float64]
    q: NDArray[np.float64]
    e: NDArray[np.float64]
    r: NDArray[np.float64]
    u: NDArray[np.float64]
    y_d: NDArray[np.float64]
    status: NDArray[np.int64]
    stage: NDArray[np.int64]


class Recorder:
    """Collects the rows of one run, one a plant step.

    Parameters
    ----------
    step : float
        Time between rows [s].
    tracking : Tracking
        Where the errors come from.
    y_d : callable
        The reference of the time since the first sample.
    stride : int
        Keep every ``stride``-th row; 0 keeps none, only the maxima.
    funnel : callable, optional
        Bound on |y - y_d| at times (N,), or None.
    sizes : sequence of float
        Bounds X_i of the states in the tube [unit of x_i]; none for states of about 1.
    """

    def __init__(
        self,
        step: float,
        tracking: Tracking,
        y_d: Callable[[float], float],
        *,
        stride: int,
        funnel: Callable[[NDArray[np.float64]], NDArray[np.float64] | None] = lambda _t: None,
        sizes: Sequence[float] = (),
    ) -> None:
        self.rows: list[Row] = []
        self.peaks: dict[int, list[float]] = {}
        self.peak_u = 0.0
        self._step = step
        self._tracking = tracking
        self._y_d = y_d
        self._stride = stride
        self._funnel = funnel
        self._farthest = [DIVERGED * max(1.0, size) for size in sizes] or [DIVERGED]
        self.funnel_share: float | None = None
        self._count = 0
        self._kept: list[Table] = []

    @property
    def stage(self) -> int:
        """Last stage reached, 1 where there is one only."""
        return max(self.peaks, default=1)

    @property
    def peak_e(self) -> list[float]:
        """Largest |e_i| in the last stage reached."""
        return self.peaks.get(self.stage, [0.0] * self._tracking.order)

    def meet(self, stage: int, errors: Sequence[float]) -> None:
        """Count errors of a stage that no row shows: those at the moment of a switch."""
        known = self.peaks.get(stage, [0.0] * self._tracking.order)
        self.peaks[stage] = [max(a, abs(b)) for a, b in zip(known, errors, strict=True)]

    def flush(self) -> bool:
        """Judge the rows collected so far; False when the run has diverged in them."""
        import numpy as np

        rows, self.rows = self.rows, []
        if not rows:
            return True
        x = np.array([row[0] for row in rows])
        u = np.array([row[2] for row in rows])
        good = (np.abs(x) <= np.array(self._farthest)).all(axis=1) & np.isfinite(u)
        alive = bool(good.all())
        length = len(rows) if alive else int(np.argmin(good))
        if length == 0:
            return alive
        t = [(self._count + k) * self._step for k in range(length)]
        y_d = np.array([self._y_d(s) for s in t])
        x, u = x[:length], u[:length]
        with np.errstate(over="ignore", invalid="ignore"):
            r = self._tracking.center(t, y_d)
            e = self._tracking.errors(t, x, r)
        # A number stands for infinity: reports are JSON, and it exceeds every half-width.
        e = np.nan_to_num(e, nan=sys.float_info.max)
        stage = np.array(self._tracking.stages(t))
        for number in sorted(set(stage.tolist())):
            self.meet(number, abs(e[stage == number]).max(axis=0).tolist())
        self.peak_u = max(self.peak_u, float(abs(u).max()))
        edge = self._funnel(np.array(t))
        if edge is not None:
            share = np.nan_to_num(abs(x[:, 0] - y_d) / edge, nan=sys.float_info.max).max()
            self.funnel_share = max(self.funnel_share or 0.0, float(share))
        if self._stride:
            first = -self._count % self._stride
            pick = slice(first, length, self._stride)
            self._kept.append(
                Table(
                    t=np.array(t)[pick],
                    x=x[pick],
                    q=np.array([row[1] for row in rows[pick]]),
                    e=e[pick],
                    r=r[pick],
                    u=u[pick],
                    y_d=y_d[pick],
                    status=np.array([int(row[3]) for row in rows[pick]]),
                    stage=stage[pick],
                )
            )
        self._count += length
        return alive

    def table(self) -> Table:
        """Return the kept rows in one piece."""
        import numpy as np

        def join(column: str) -> NDArray[np.float64]:
            return np.concatenate([getattr(part, column) for part in self._kept])

        return Table(
            t=join("t"),
            x=join("x"),
            q=join("q"),
            e=join("e"),
            r=join("r"),
            u=join("u"),
            y_d=join("y_d"),
            status=np.concatenate([part.status for part in self._kept]),
            stage=np.concatenate([part.stage for part in self._kept]),
        )
