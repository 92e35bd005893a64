"""One simulated run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray


#: A run is held against bounds that the certificate rounds outward; what the plant's own
#: integration rounds is far below this share of them.
ROUNDING = 1e-9


def within(values: Sequence[float], bounds: Sequence[float]) -> bool:
    """Whether every value keeps its bound, up to a relative 1e-9; NaN does not."""
    pairs = zip(values, bounds, strict=True)
    return all(value <= bound * (1.0 + ROUNDING) for value, bound in pairs)


@dataclass(frozen=True, slots=True, kw_only=True)
class StagePeaks:
    """Largest |e_{i,m}| of a stage m that a run was in, and what they must stay below."""

    stage: int
    max_abs_e: tuple[float, ...]
    half_widths: tuple[float, ...]

    @property
    def within_bounds(self) -> bool:
        """Whether every error stayed in its tube."""
        return within(self.max_abs_e, self.half_widths)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """Arrays of one run: t (N,) [s], x, q, e (N, n), u, y_d (N,); r (N, n) is the center.

    ``status`` is the controller's at each row. ``peak_e``, ``peak_u`` are the largest |e_i|
    and |u| over every step, also those that are no row. ``complete`` is false where the run
    diverged before its horizon. ``stage`` is the one in force at each row (theorem3, else
    None) and ``stages`` what each one came to; ``peak_e`` and ``half_widths`` are then those
    of the last one reached. ``funnel_share`` is the largest share of the funnel that
    |y - y_d| took, None where the file has none.
    """

    t: NDArray[np.float64]
    x: NDArray[np.float64]
    q: NDArray[np.float64]
    e: NDArray[np.float64]
    r: NDArray[np.float64]
    u: NDArray[np.float64]
    y_d: NDArray[np.float64]
    half_widths: tuple[float, ...]
    u_max: float
    status: tuple[int, ...]
    peak_e: tuple[float, ...] | None = None
    peak_u: float = 0.0
    complete: bool = True
    stage: NDArray[np.int64] | None = None
    stages: tuple[StagePeaks, ...] = ()
    funnel_share: float | None = None

    @property
    def max_abs_e(self) -> tuple[float, ...]:
        """Largest |e_i| of each error over the run, in stages over the last one reached."""
        if self.stages:
            return self.stages[-1].max_abs_e
        rows = tuple(float(value) for value in abs(self.e).max(axis=0))
        if self.peak_e is None:
            return rows
        return tuple(max(pair) for pair in zip(rows, self.peak_e, strict=True))

    @property
    def max_abs_u(self) -> float:
        """Largest |u| over the run."""
        return max(float(abs(self.u).max()), self.peak_u)

    @property
    def within_bounds(self) -> bool:
        """Whether the run ended at its horizon with every |e_i| <= p_i and |u| <= U_max.

        Where there is a funnel, it was not left either.
        """
        inside = within(self.max_abs_e, self.half_widths)
        inside = inside and within((self.funnel_share or 0.0,), (1.0,))
        inside = inside and all(stage.within_bounds for stage in self.stages)
        return self.complete and inside and within((self.max_abs_u,), (self.u_max,))

    def plot(self) -> Figure:
        """Draw output, errors and input; nothing is shown or written."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(8.0, 8.0), layout="constrained")
        top, middle, bottom = figure.subplots(3, 1, sharex=True)
        top.plot(self.t, self.x[:, 0], label="y = x_1")
        top.plot(self.t, self.y_d, label="y_d", linestyle="--")
        for index, width in enumerate(self.half_widths):
            middle.plot(self.t, self.e[:, index] / width, label=f"e_{index + 1} / p_{index + 1}")
        bottom.plot(self.t, self.u, label="u")
        for axes, text in ((top, "output"), (middle, "errors"), (bottom, "input")):
            axes.set_ylabel(text)
            axes.legend(loc="upper right")
        bottom.set_xlabel("t [s]")
        return figure


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSummary:
    """What one adversarial run came to; ``start`` is x(0), ``kind`` says who the adversary was.

    ``stages`` are those that a law in stages went through, else empty; ``max_abs_e`` is that
    of the last one. ``funnel_share`` as in ``Trajectory``.
    """

    run: int
    kind: str
    start: tuple[float, ...]
    max_abs_e: tuple[float, ...]
    max_abs_u: float
    within_bounds: bool
    stages: tuple[StagePeaks, ...] = ()
    funnel_share: float | None = None
