"""The true errors e_i around the latched center (docs/theory.md sections 2 and 3)."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.model.spec import Anchor, RhoKind

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.spec import RhoSpec

T = TypeVar("T", float, "NDArray[np.float64]")


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """What the run begins with: true states, measured states, y_d(0)."""

    true: tuple[float, ...]
    measured: tuple[float, ...]
    reference: float


class Tracking:
    """Errors e_1 = x_1 - r_1, e_i = x_i - r_i + phi_{i-1}(e_{i-1}) of one run.

    Parameters
    ----------
    design : Design
        Gains, performance functions, anchor.
    start : Start
        The center starts from the measured states (anchor latched) or the true ones (exact).
    """

    def __init__(self, design: Design, start: Start) -> None:
        latched = design.spec.synthesis.anchor is Anchor.LATCHED
        first, *others = start.measured if latched else start.true
        self._shapes = design.gains
        # Entry i scales rho_i: the offset a for r_1, x_i(0) for the others.
        self._scales = (first - start.reference, *others)
        self._rhos = design.spec.performance.rho
        self._performance = {rho: performance_function(rho) for rho in self._rhos}

    @property
    def order(self) -> int:
        """Number of errors n."""
        return len(self._shapes)

    def stages(self, t: Sequence[float]) -> list[int]:
        """Return the stage in force at each of the times [s]: there is one only."""
        return [1] * len(t)

    def center(self, t: Sequence[float], y_d: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return r_1..r_n at the times t [s] after the first sample, shape (N, n)."""
        import numpy as np

        values = {
            rho: np.array([function(s) for s in t]) for rho, function in self._performance.items()
        }
        columns = [a * values[rho] for a, rho in zip(self._scales, self._rhos, strict=True)]
        columns[0] = columns[0] + y_d
        return np.column_stack(columns)

    def errors(
        self, t: Sequence[float], x: NDArray[np.float64], r: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return e_1..e_n at the times t [s], for states and center of shape (N, n)."""
        import numpy as np

        columns = [x[:, 0] - r[:, 0]]
        for i, shape in enumerate(self._shapes[:-1], start=1):
            slopes: Any = shape.k
            if isinstance(shape, Theorem1Gain):
                slopes = np.array([self._slope(shape, s) for s in t])
            carried = feedback(shape, columns[-1], np.tanh, slopes)
            columns.append(x[:, i] - r[:, i] + carried)
        return np.column_stack(columns)

    def now(self, t: float, x: Sequence[float], y_d: float) -> list[float]:
        """Return e_1..e_n at one moment t [s]."""
        result: list[float] = []
        # y_d belongs to r_1 alone; from the second error on phi of the one before is added.
        carried = -y_d
        for state, scale, rho, shape in zip(x, self._scales, self._rhos, self._shapes, strict=True):
            result.append(state - scale * self._performance[rho](t) + carried)
            carried = feedback(shape, result[-1], math.tanh, self._slope(shape, t))
        return result

    def exact(self, t: float, x: Sequence[float], y_d: float) -> tuple[list[float], list[float]]:
        """Return e_1..e_n and r_1..r_n at one moment t [s], as the compiled loop rounds them.

        The operations are those of ``errors``, with the platform's own tanh; an error that is
        no number is the largest one that there is.
        """
        r = self.middle(t, y_d)
        e: list[float] = []
        carried = 0.0
        for state, middle, shape in zip(x, r, self.law(t), strict=True):
            error = state - middle + carried
            carried = unbounded(shape, error, self._slope(shape, t))
            e.append(error if math.isfinite(error) else sys.float_info.max)
        return e, r

    def middle(self, t: float, y_d: float) -> list[float]:
        """Return r_1..r_n at one moment t [s]."""
        pairs = zip(self._scales, self._rhos, strict=True)
        r = [scale * self._performance[rho](t) for scale, rho in pairs]
        r[0] = r[0] + y_d
        return r

    def law(self, t: float) -> tuple[Gain, ...]:
        """Return the gains in force at the time t [s]."""
        del t
        return self._shapes

    def _slope(self, shape: Gain, t: float) -> float:
        """Linear gain at the time t [s]: Theorem 1 may schedule it by rho."""
        if isinstance(shape, Theorem1Gain):
            return shape.gamma * shape.height(self._performance[self._rhos[0]](t))
        return shape.k


def feedback(shape: Gain, e: T, tanh: Callable[[T], T], slope: Any) -> T:
    """Evaluate phi(e) = slope e + M tanh(M e/epsilon) + c e^N (docs/theory.md section 0)."""
    total: T = slope * e
    if shape.M != 0.0:
        total = total + shape.M * tanh(shape.M * e / shape.epsilon)
    if shape.c != 0.0:
        total = total + shape.c * e**shape.N
    return total


def unbounded(shape: Gain, e: float, slope: float) -> float:
    """Evaluate phi(e) where e**N may exceed every number: infinity then."""
    try:
        return feedback(shape, e, math.tanh, slope)
    except OverflowError:
        return math.copysign(math.inf, e)


def performance_function(spec: RhoSpec) -> Callable[[float], float]:
    """Return rho of the time since the first sample [s]: the paper's (52) or (53)."""
    if spec.kind is RhoKind.COSINE:
        t_s = 1.0 if spec.t_s is None else spec.t_s.approximate

        def cosine(t: float) -> float:
            return 0.5 * (1.0 + math.cos(t / t_s)) if t < math.pi * t_s else 0.0

        return cosine
    rate = 1.0 if spec.rate is None else spec.rate.approximate
    floor = 0.0 if spec.floor is None else spec.floor.approximate

    def exponential(t: float) -> float:
        return (1.0 - floor) * math.exp(-rate * t) + floor

    return exponential
