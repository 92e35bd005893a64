"""The true errors around center nominal (docs/theory.md section 4).

The center is computed here again, from the plant file's expressions and the measured start, and
not read from the controller.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.expressions.nominal import (
    center_series,
    fading_series,
    start_series,
    transition_weights,
)
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.simulation.loading import load_text
from bfppc_synth.simulation.recorder import BATCH
from bfppc_synth.simulation.statements import Statements
from bfppc_synth.simulation.tracking import Tracking, feedback

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.nominal import NominalModel
    from bfppc_synth.simulation.references import Derivatives
    from bfppc_synth.simulation.tracking import Start

    # (t, t / T_s, weights of the transition, y_d^(k) / k!) -> what _table lists, all arrays
    Center = Callable[..., tuple[NDArray[np.float64], ...]]

_IMPORTS = (
    "from numpy import arcsinh as asinh, arctan as atan, cos, cosh, exp, log, power as pow, sin, "
    "sinh, sqrt, tan, tanh"
)


class FollowingTracking(Tracking):
    """Errors around the trajectory that the nominal plant follows from the measured start.

    Parameters
    ----------
    design : Design
        Its ``nominal`` is there.
    model : NominalModel
        That of the design.
    start : Start
        As for ``Tracking``.
    derivatives : Derivatives | None
        y_d, dy_d, .. of a reference supplied at run time; None where it is compiled in.
    """

    def __init__(
        self, design: Design, model: NominalModel, start: Start, derivatives: Derivatives | None
    ) -> None:
        super().__init__(design, start)
        self._model = model
        self._derivatives = derivatives
        self._follow = compile_center(design, model)
        self._block = -1
        self._defects: list[list[float]] = []
        course = start_series(model, FLOAT_FUNCTIONS, start.measured)
        functions: TaylorFunctions[float] = TaylorFunctions(FLOAT_FUNCTIONS, model.order)
        if derivatives is not None:
            reference = normalized(derivatives(0.0))
        else:
            expression, time = design.plant.reference, design.plant.time
            reference = evaluate(expression, {time: (0.0, 1.0)}, functions)
        gap = functions.sub(course, reference)
        self._weights = transition_weights(FLOAT_FUNCTIONS, gap, model.transition)

    def center(self, t: Sequence[float], y_d: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return r_1..r_n at the times t [s] after the first sample, shape (N, n)."""
        del y_d
        return self._table(t)[:, : self.order]

    def defect(self, k: int, h: float) -> list[float]:
        """Return what an implicit step from k h [s] misses of the center's own motion.

        (r_i(t + h) - r_i(t)) / h - (f^_i(r(t)) + g^_i(r(t)) r_{i+1}(t + h)), r_{n+1} = v
        [unit of x_i per s]: added to f_i, it makes the center a solution of the steps, as it
        is one of the nominal plant.
        """
        block = k // BATCH
        if block != self._block:
            n, times = self.order, [j * h for j in range(block * BATCH, (block + 1) * BATCH + 1)]
            table = self._table(times)
            states, ahead = table[:, :n], table[1:, 1 : n + 1]
            f, g = table[:-1, n + 1 : 2 * n + 1], table[:-1, 2 * n + 1 :]
            moved = (states[1:] - states[:-1]) / h
            self._block, self._defects = block, (moved - (f + g * ahead)).tolist()
        return self._defects[k % BATCH]

    def _table(self, t: Sequence[float]) -> NDArray[np.float64]:
        """r_1..r_n, v, f^_1..f^_n, g^_1..g^_n, shape (N, 3n + 1)."""
        import numpy as np

        times = np.array(t)
        passed: tuple[NDArray[np.float64], ...] = ()
        if self._derivatives is not None:
            rows = np.array([normalized(self._derivatives(s)) for s in t])
            passed = tuple(rows.T)
        share = np.minimum(times / self._model.transition, 1.0)
        with np.errstate(all="ignore"):
            columns = self._follow(times, share, *self._weights, *passed)
        return np.column_stack([np.broadcast_to(column, times.shape) for column in columns])

    def now(self, t: float, x: Sequence[float], y_d: float) -> list[float]:
        """Return e_1..e_n at one moment t [s]."""
        import numpy as np

        result: list[float] = []
        carried = 0.0
        (r,) = self.center([t], np.array([y_d])).tolist()
        for state, middle, shape in zip(x, r, self._shapes, strict=True):
            result.append(state - middle + carried)
            carried = feedback(shape, result[-1], math.tanh, self._slope(shape, t))
        return result


def compile_center(design: Design, model: NominalModel) -> Center:
    """Write the center as a Python function of arrays and load it.

    Parameters
    ----------
    design : Design
        Its plant's reference.
    model : NominalModel
        f^, g^ and T_s.

    Returns
    -------
    Callable
        ``center(t, share, *weights, *passed)``: times (N,) [s], t/T_s cut at 1, the n weights
        of the transition and, where the reference is supplied at run time, y_d^(k)/k!. It
        returns r_1..r_n, v, f^_1..f^_n and g^_1..g^_n.
    """
    order, out = model.order, _ArrayStatements()
    weights = tuple(f"w{j}" for j in range(order))
    passed: tuple[str, ...] = ()
    if design.plant.reference is None:
        passed = reference = tuple(f"y{k}" for k in range(order + 1))
    else:
        functions: TaylorFunctions[str] = TaylorFunctions(out, order + 1)
        reference = evaluate(design.plant.reference, {design.plant.time: ("t", "1.0")}, functions)
    fading = fading_series(out, weights, "s", repr(model.transition), length=order + 1)
    r, v = center_series(model, out, reference, fading, length=order + 1)
    values = {state: series[0] for state, series in zip(model.states, r, strict=True)}
    fields = [evaluate(expression, values, out) for expression in (*model.f, *model.g)]
    results = ", ".join((*(series[0] for series in (*r, v)), *fields))
    head = ", ".join(("t", "s", *weights, *passed))
    body = "\n    ".join((f"def center({head}):", *out.lines, f"return ({results},)"))
    text = f"{_IMPORTS}\n\n{body}"
    center: Center = load_text(text, name="followed_center", origin="<followed center>").center
    return center


def normalized(derivatives: Sequence[float]) -> tuple[float, ...]:
    """y_d^(k) / k! of y_d, dy_d, ..."""
    return tuple(value / math.factorial(k) for k, value in enumerate(derivatives))


class _ArrayStatements(Statements):
    """Statements whose names are arrays: no value is NaN without a test for it."""

    def div(self, a: str, b: str) -> str:
        """Write a / b."""
        return self._name(f"{a} / {b}")

    def sqrt(self, a: str) -> str:
        """Write the square root."""
        return self._name(f"sqrt({a})")

    def root_power(self, a: str, p: int, q: int) -> str:
        """Write a**(p/q) for even q."""
        return self._name(f"pow({a}, {p / q!r})")

    def log(self, a: str) -> str:
        """Write the natural logarithm."""
        return self._name(f"log({a})")
