"""Runs judged moment by moment with the platform's own functions: what the C loop does too.

The recorder's arrays round tanh in their own way, which no C compiler repeats. Here every row
is judged where it is met, operation by operation, so that Python and C say the same bits.
"""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

from bfppc_synth.expressions.evaluate import evaluate
from bfppc_synth.expressions.nominal import (
    center_series,
    fading_series,
    start_series,
    transition_weights,
)
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.simulation.following import FollowingTracking, normalized
from bfppc_synth.simulation.loading import load_text
from bfppc_synth.simulation.plant import IMPORTS
from bfppc_synth.simulation.recorder import DIVERGED, Recorder
from bfppc_synth.simulation.statements import Statements
from bfppc_synth.simulation.tracking import Tracking

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.nominal import NominalModel
    from bfppc_synth.simulation.recorder import Row
    from bfppc_synth.simulation.stepping import Nature
    from bfppc_synth.simulation.tracking import Start

    # Gets t, x, measured, e, r, u, y_d, status, stage of every row in one list.
    Sight = Callable[[list[float]], None]


def judging_text(design: Design) -> str:
    """Write what judging needs besides the plant as a Python module.

    Parameters
    ----------
    design : Design
        With or without a nominal center and a funnel.

    Returns
    -------
    str
        ``latch(q1..qn[, y0..y(n-1)])``: weights of the transition from the measured start;
        ``course(t, s, w0..w(n-1)[, y0..yn])``: r_1..r_n, v, f^_1..f^_n, g^_1..g^_n, with
        y_k = y_d^(k) / k! where the reference is supplied at run time; ``funnel(t)``. Each
        only where the design has it.

    References
    ----------
    docs/theory.md section 4.
    """
    blocks = [IMPORTS]
    if design.nominal is not None:
        blocks += [_latch_text(design, design.nominal), _course_text(design, design.nominal)]
    if design.plant.funnel is not None:
        out = Statements()
        edge = evaluate(design.plant.funnel, {design.plant.time: "t"}, out)
        blocks.append("\n    ".join(["def funnel(t):", *out.lines, f"return {edge}"]))
    return "\n\n".join(blocks)


def _latch_text(design: Design, model: NominalModel) -> str:
    order, out = model.order, Statements()
    measured = tuple(f"q{i}" for i in range(1, order + 1))
    course = start_series(model, out, measured)
    reference: tuple[str, ...] = ()
    passed: tuple[str, ...] = ()
    if design.plant.reference is None:
        passed = reference = tuple(f"y{k}" for k in range(order))
    else:
        functions: TaylorFunctions[str] = TaylorFunctions(out, order)
        reference = evaluate(design.plant.reference, {design.plant.time: ("0.0", "1.0")}, functions)
    gap = TaylorFunctions(out, order).sub(course, reference)
    padded = (*gap, *("0.0",) * (order - len(gap)))
    weights = transition_weights(out, padded, repr(model.transition))
    head = ", ".join((*measured, *passed))
    return "\n    ".join([f"def latch({head}):", *out.lines, f"return ({', '.join(weights)},)"])


def _course_text(design: Design, model: NominalModel) -> str:
    order, out = model.order, Statements()
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
    return "\n    ".join([f"def course({head}):", *out.lines, f"return ({results},)"])


class Exact:
    """Judges the runs of one design in exactly the compiled loop's arithmetic.

    Parameters
    ----------
    design : Design
        Gains, center, funnel.
    sight : callable, optional
        Gets every row.
    """

    def __init__(self, design: Design, sight: Sight | None = None) -> None:
        self._design = design
        self._sight = sight
        self._module = load_text(judging_text(design), name="judging", origin="<judging>")

    def following(self, start: Start, nature: Nature) -> FollowingTracking | None:
        """Return the center of a design that has a nominal one."""
        model = self._design.nominal
        if model is None:
            return None
        return ExactFollowing(self._design, model, start, nature, self._module)

    def recorder(self, step: float, tracking: Tracking, nature: Nature, stride: int) -> Recorder:
        """Return what judges the rows of the run; none is kept, whatever ``stride`` says."""
        del stride
        funnel = getattr(self._module, "funnel", None)
        return ExactRecorder(step, tracking, nature, funnel, self._sight)


class ExactFollowing(FollowingTracking):
    """Center nominal in scalars, from the module of ``judging_text``."""

    def __init__(
        self,
        design: Design,
        model: NominalModel,
        start: Start,
        nature: Nature,
        module: ModuleType,
    ) -> None:
        Tracking.__init__(self, design, start)
        self._model = model
        self._derivatives = nature.derivatives
        self._course: Callable[..., tuple[float, ...]] = module.course
        passed: tuple[float, ...] = ()
        if self._derivatives is not None:
            passed = normalized(self._derivatives(0.0))[: self.order]
        self._weights = module.latch(*start.measured, *passed)
        self._ahead: tuple[int, tuple[float, ...]] = (-1, ())

    def _at(self, t: float) -> tuple[float, ...]:
        passed: tuple[float, ...] = ()
        if self._derivatives is not None:
            passed = normalized(self._derivatives(t))
        share = t / self._model.transition
        return self._course(t, min(share, 1.0), *self._weights, *passed)

    def middle(self, t: float, y_d: float) -> list[float]:
        """Return r_1..r_n; what has no value is infinite."""
        del y_d
        try:
            return list(self._at(t)[: self.order])
        except (OverflowError, ValueError, ZeroDivisionError):
            return [math.inf] * self.order

    def defect(self, k: int, h: float) -> list[float]:
        """Return what a step from k h misses of the center's motion, as its base does."""
        n = self.order
        at, row = self._ahead
        if at != k:
            row = self._at(k * h)
        following = self._at((k + 1) * h)
        self._ahead = (k + 1, following)
        return [
            (following[i] - row[i]) / h - (row[n + 1 + i] + row[2 * n + 1 + i] * following[i + 1])
            for i in range(n)
        ]


class _Rows(list["Row"]):
    """Judges what is appended and keeps nothing."""

    def __init__(self, judge: Callable[[Row], None]) -> None:
        super().__init__()
        self._judge = judge

    def append(self, row: Row) -> None:
        self._judge(row)


class ExactRecorder(Recorder):
    """Maxima of one run, every row judged at once by ``Tracking.exact``."""

    def __init__(
        self,
        step: float,
        tracking: Tracking,
        nature: Nature,
        funnel: Callable[[float], float] | None,
        sight: Sight | None,
    ) -> None:
        super().__init__(step, tracking, nature.y_d, stride=0)
        self._edge = funnel
        self._sight = sight
        self.rows = _Rows(self._judge)

    @property
    def count(self) -> int:
        """Rows judged."""
        return self._count

    def flush(self) -> bool:
        """Say that the run goes on: a row that ends it raises OverflowError where it is met."""
        return True

    def _judge(self, row: Row) -> None:
        x, measured, u, status = row
        if not (all(abs(state) <= DIVERGED for state in x) and math.isfinite(u)):
            raise OverflowError
        t = self._count * self._step
        y_d = self._y_d(t)
        e, r = self._tracking.exact(t, x, y_d)
        stage = self._tracking.stages([t])[0]
        self.meet(stage, e)
        self.peak_u = max(self.peak_u, abs(u))
        if self._edge is not None:
            share = abs(x[0] - y_d) / self._edge(t)
            share = share if math.isfinite(share) else sys.float_info.max
            self.funnel_share = max(self.funnel_share or 0.0, share)
        self._count += 1
        if self._sight is not None:
            self._sight([t, *x, *measured, *e, *r, u, y_d, float(status), float(stage)])
