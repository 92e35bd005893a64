"""One run of the closed loop: the generated controller, the quantizers, the plant."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from bfppc_synth.bounds.funnel_values import funnel_values
from bfppc_synth.simulation.crossing import Crossing, Point
from bfppc_synth.simulation.following import FollowingTracking
from bfppc_synth.simulation.implicit import accuracy, make_solver, tried
from bfppc_synth.simulation.quantizers import make_quantizer
from bfppc_synth.simulation.recorder import BATCH, Recorder
from bfppc_synth.simulation.scheme import Stepping
from bfppc_synth.simulation.staged import Rollback, StagedTracking
from bfppc_synth.simulation.tracking import Start, Tracking

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.crossing import Passed
    from bfppc_synth.simulation.loading import Controller
    from bfppc_synth.simulation.plant import Truth
    from bfppc_synth.simulation.references import Derivatives
    from bfppc_synth.simulation.scheme import Scheme


@dataclass(frozen=True, slots=True, kw_only=True)
class Action:
    """What nature does until the plant step ``until`` (not included).

    ``arguments`` are those of ``Dynamics``; ``noise`` is added to the measurement [unit of
    x_i], ``error`` to the command [unit of u].
    """

    arguments: tuple[float, ...]
    noise: tuple[float, ...]
    error: float
    until: float


class Nature(Protocol):
    """Everything that a run is free to choose within the certificate's assumptions."""

    kind: str
    start: tuple[float, ...]
    truth: Truth
    derivatives: Derivatives | None

    def y_d(self, t: float) -> float:
        """Return the reference at time t [s]."""

    def begin(self, tracking: Tracking) -> None:
        """Learn the center of the run, which the first measurement has latched."""

    def act(self, k: int, t: float, x: Sequence[float]) -> Action:
        """Decide at plant step k; the first time before ``begin``."""

    def lag(self) -> float:
        """Return the age at which the next command starts to act [s]."""


@runtime_checkable
class Irregular(Protocol):
    """A nature that also chooses the time between samples; others sample at every period."""

    def gap(self, substeps: int) -> int:
        """Return how many plant steps the next sample is away, at most ``substeps``."""


class Judging(Protocol):
    """Another way to take the errors of a run than by arrays: see ``simulation.exact``."""

    def following(self, start: Start, nature: Nature) -> FollowingTracking | None:
        """Return the center of a design that has a nominal one."""

    def recorder(self, step: float, tracking: Tracking, nature: Nature, stride: int) -> Recorder:
        """Return what judges the rows of the run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What the runs of one design have in common."""

    design: Design
    controller: type[Controller]
    scheme: Scheme
    samples: int
    judging: Judging | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A finished run: who was met, what was recorded, whether the horizon was reached."""

    nature: Nature
    recorder: Recorder
    complete: bool


def run(setting: Setting, nature: Nature, *, stride: int) -> Run:
    """Close the loop from the first sample to the horizon.

    Parameters
    ----------
    setting : Setting
        Design, controller class, time axis.
    nature : Nature
        Start, plant behaviour, noise, delays.
    stride : int
        Keep every ``stride``-th row; 0 keeps only the maxima.

    Returns
    -------
    Run
        A run that leaves every number behind (overflow, NaN, a state beyond 1e12 X_i) ends
        there and is not complete.

    References
    ----------
    docs/theory.md section 3, Timing; SPEC section 1, Simulation.
    """
    loop = _Loop(setting, nature, stride)
    march = loop.implicit if setting.scheme.stepping is Stepping.IMPLICIT else loop.sampled
    try:
        complete = march()
    except (OverflowError, ValueError, ZeroDivisionError):
        # Arithmetic of a state on its way to infinity: an answer about the run, no failure.
        complete = False
    alive = loop.recorder.flush()
    return Run(nature=nature, recorder=loop.recorder, complete=alive and complete)


class _Loop:
    """State of a run under way."""

    def __init__(self, setting: Setting, nature: Nature, stride: int) -> None:
        self.setting = setting
        self.nature = nature
        scheme, design = setting.scheme, setting.design
        self.controller = setting.controller()
        self.passed = _passed(design, nature)
        self.quantizers = [make_quantizer(item) for item in design.spec.measurement.quantizers]
        self.exact = not any(quantizer.resolution for quantizer in self.quantizers)
        # The center is latched with the first noise, so nature chooses that one without it.
        self.action = nature.act(0, 0.0, nature.start)
        self.measured = self._measure(nature.start)
        start = Start(true=nature.start, measured=tuple(self.measured), reference=nature.y_d(0.0))
        self.staged = StagedTracking(design, start) if design.stages else None
        judging = setting.judging
        self.following: FollowingTracking | None = None
        if judging is not None:
            self.following = judging.following(start, nature)
        elif design.nominal is not None:
            self.following = FollowingTracking(design, design.nominal, start, nature.derivatives)
        tracking = self.staged or self.following or Tracking(design, start)
        nature.begin(tracking)
        if judging is not None:
            self.recorder = judging.recorder(scheme.step, tracking, nature, stride)
        else:
            self.recorder = Recorder(
                scheme.step,
                tracking,
                nature.y_d,
                stride=stride,
                funnel=partial(funnel_values, design.plant),
                sizes=design.bounds.X,
            )

    def _measure(self, x: Sequence[float]) -> Sequence[float]:
        noise = self.action.noise
        if self.exact and not any(noise):
            return x
        return [q(s) + n for q, s, n in zip(self.quantizers, x, noise, strict=True)]

    def sampled(self) -> bool:
        """Sample and hold; every hold is integrated by the RK4 method."""
        scheme, nature, recorder = self.setting.scheme, self.nature, self.recorder
        controller, advance, passed = self.controller, nature.truth.advance, self.passed
        substeps, h, delay = scheme.substeps, scheme.step, scheme.delay
        measured, action, staged = self.measured, self.action, self.staged
        x: Sequence[float] = nature.start
        u = 0.0
        # (when it acts, command): later commands never overtake earlier ones.
        pending: deque[tuple[float, float]] = deque()
        last, due = self.setting.samples * substeps, 0
        gap = nature.gap if isinstance(nature, Irregular) else int
        for k in range(last + 1):
            now, end = k * h, (k + 1) * h
            if k >= action.until:
                self.action = action = nature.act(k, now, x)
            if k == due:
                due = k + gap(substeps)
                if k:
                    measured = self._measure(x)
                if k % substeps == 0:
                    now = k // substeps * scheme.sample
                command = controller.step(now, measured, passed(now))
                if staged is not None and controller.stage != staged.stage:
                    y_d = nature.y_d(now)
                    recorder.meet(staged.stage, staged.now(now, x, y_d))
                    staged.switch(controller.stage, now, measured, y_d)
                if delay == 0.0:
                    u = command
                else:
                    acts = now + nature.lag()
                    pending.append((max(acts, pending[-1][0]) if pending else acts, command))
            while pending and pending[0][0] <= now:
                u = pending.popleft()[1]
            recorder.rows.append((x, measured, u + action.error, controller.status))
            if k == last:
                break
            while pending and pending[0][0] < end:
                acts, command = pending.popleft()
                x = advance(now, acts - now, *x, u + action.error, *action.arguments)
                now, u = acts, command
            x = advance(now, end - now, *x, u + action.error, *action.arguments)
            if len(recorder.rows) >= BATCH and not recorder.flush():
                return False
        return True

    def implicit(self) -> bool:
        """Take steps whose command belongs to their end."""
        design, scheme, nature = self.setting.design, self.setting.scheme, self.nature
        recorder, controller, h = self.recorder, self.controller, scheme.sample
        following = self.following
        coefficients, action = nature.truth.coefficients, self.action
        solve, slope = make_solver(design.plant.order), 1.0
        step = tried(controller, design.bounds.X, design.bounds.U)
        (enough, close), peak = accuracy(design, h), design.bounds.U
        x: Sequence[float] = nature.start
        u = step(0.0, self.measured, self.passed(0.0))
        recorder.rows.append((x, self.measured, u + action.error, controller.status))
        crossing = None
        if self.staged is not None:
            crossing = Crossing(
                solve=solve,
                truth=nature.truth,
                tracking=self.staged,
                back=Rollback(controller),
                passed=self.passed,
                y_d=nature.y_d,
                meet=recorder.meet,
                enough=enough / h,
                close=close,
                peak=peak,
            )
        for k in range(self.setting.samples):
            now, end = k * h, (k + 1) * h
            if k >= action.until:
                action = nature.act(k, now, x)
            error, noise, y_d = action.error, action.noise, self.passed(end)
            if crossing is not None:
                point = Point(x=tuple(x), measured=(), u=u)
                point = crossing.advance(now, end - now, point, action)
                x, u = point.x, point.u
                recorder.rows.append((x, point.measured, u + error, controller.status))
                if len(recorder.rows) >= BATCH and not recorder.flush():
                    return False
                continue
            pairs = coefficients(now, *x, *action.arguments)
            if following is not None:
                pairs = _exact_on_center(pairs, following.defect(k, h))
            x, measured, u, slope = solve(
                step, end, h, enough, close, peak, slope, u, error, y_d, *x, *pairs, *noise
            )
            recorder.rows.append((x, measured, u + error, controller.status))
            if len(recorder.rows) >= BATCH and not recorder.flush():
                return False
        return True


def _exact_on_center(pairs: Sequence[float], defect: Sequence[float]) -> tuple[float, ...]:
    """Add to f_i of (f_1, g_1, ..) what a step misses of the center's own motion."""
    forces = zip(pairs[::2], pairs[1::2], defect, strict=True)
    return tuple(number for f, g, missed in forces for number in (f + missed, g))


def _passed(design: Design, nature: Nature) -> Passed:
    """Return what the controller gets as y_d at a time."""
    if design.plant.reference is not None:
        return _compiled_in
    if design.nominal is not None and nature.derivatives is not None:
        return nature.derivatives
    return nature.y_d


def _compiled_in(t: float) -> None:
    """Pass no reference: the controller has it."""
    del t
