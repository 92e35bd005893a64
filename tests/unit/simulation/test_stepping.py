"""How the loop is closed: sample and hold, delays, and the step that is implicit in x_n."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from bfppc_synth.model.shapes import Shape
from bfppc_synth.simulation.plant import compile_plant
from bfppc_synth.simulation.scheme import Coverage, Scheme, Stepping
from bfppc_synth.simulation.stepping import Action, Setting, run

X1 = sp.Symbol("x1", real=True)
LINEAR = Shape(k=1.0, M=0.0, epsilon=1.0, c=0.0, N=3)


class Scripted:
    """Nature with a fixed start, fixed noise and error, and given delays."""

    kind = "scripted"

    def __init__(self, dynamics, start, *, noise=0.0, error=0.0, lags=()):
        order = dynamics.order
        self.start = start
        self.truth = dynamics.model
        self.lags = list(lags)
        self.action = Action(
            arguments=dynamics.nominal, noise=(noise,) * order, error=error, until=math.inf
        )

    def y_d(self, t):
        return 0.0

    def begin(self, tracking):
        self.tracking = tracking

    def act(self, k, t, x):
        return self.action

    def lag(self):
        return self.lags.pop(0) if self.lags else 0.0


def controller(law):
    """Class of a controller that applies u = law(t, x) and keeps a list of its calls."""

    class Controller:
        status = 0
        calls = []  # noqa: RUF012 -- shared on purpose, to be read after the run

        def step(self, t, x, y_d=None):
            self.calls.append((t, tuple(x), law(t, x)))
            return self.calls[-1][2]

    return Controller


def integrator(design_of, **changed):
    """dx = u."""
    return design_of(
        ({"f": sp.Integer(0)},), states=(X1,), gains=(LINEAR,), omega=(10.0,), peak=1e6, **changed
    )


def close(design, law, start, *, samples, scheme, **script):
    dynamics = compile_plant(design.plant)
    nature = Scripted(dynamics, start, **script)
    used = controller(law)
    setting = Setting(design=design, controller=used, scheme=scheme, samples=samples)
    return run(setting, nature, stride=1), used.calls


def sampled(sample, *, substeps=1, delay=0.0):
    return Scheme(
        stepping=Stepping.SAMPLED, sample=sample, substeps=substeps, delay=delay,
        coverage=Coverage.COVERED,
    )  # fmt: skip


IMPLICIT = Scheme(
    stepping=Stepping.IMPLICIT, sample=0.1, substeps=1, delay=0.0, coverage=Coverage.COVERED
)


@pytest.mark.parametrize("substeps", [1, 3])
def test_a_command_is_held_for_exactly_one_period(design_of, substeps):
    design = integrator(design_of)
    finished, calls = close(
        design, lambda t, x: -2.0 * x[0], (1.0,), samples=8,
        scheme=sampled(0.25, substeps=substeps),
    )  # fmt: skip
    x = finished.recorder.table().x[::substeps, 0]
    # dx = -2 x(t_k) on a period of 1/4 halves x.
    assert list(x) == pytest.approx([0.5**k for k in range(9)], rel=1e-15)
    assert [t for t, _, _ in calls] == [0.25 * k for k in range(9)]


def test_between_samples_the_rows_show_the_held_measurement_and_command(design_of):
    finished, _ = close(
        integrator(design_of),
        lambda t, x: -x[0],
        (1.0,),
        samples=2,
        scheme=sampled(0.5, substeps=2),
    )
    table = finished.recorder.table()
    assert list(table.t) == [0.0, 0.25, 0.5, 0.75, 1.0]
    assert list(table.q[:, 0]) == [1.0, 1.0, 0.5, 0.5, 0.25]
    assert list(table.u) == [-1.0, -1.0, -0.5, -0.5, -0.25]
    assert list(table.x[:, 0]) == [1.0, 0.75, 0.5, 0.375, 0.25]


def test_a_command_acts_only_after_its_delay_and_the_input_is_zero_before(design_of):
    finished, _ = close(
        integrator(design_of), lambda t, x: 1.0 + t, (0.0,), samples=3,
        scheme=sampled(1.0, delay=0.9), lags=(0.25, 0.5, 0.0, 0.0),
    )  # fmt: skip
    table = finished.recorder.table()
    # 0 until 0.25, then 1 until 1.5, then 2 until 2, then 3.
    assert list(table.x[:, 0]) == pytest.approx([0.0, 0.75, 0.75 + 0.5 + 1.0, 5.25])
    assert list(table.u) == [0.0, 1.0, 3.0, 4.0]


def test_a_delay_may_exceed_the_period_and_commands_never_overtake(design_of):
    finished, _ = close(
        integrator(design_of), lambda t, x: 1.0 + t, (0.0,), samples=5,
        scheme=sampled(1.0, delay=3.0), lags=(2.5, 0.25, 3.0, 0.0, 0.0, 0.0),
    )  # fmt: skip
    table = finished.recorder.table()
    # The first two commands (1 and 2) act at 2.5, in this order; the third, fourth and fifth
    # at 5, the late one first.
    assert list(table.x[:, 0]) == pytest.approx([0.0, 0.0, 0.0, 1.0, 3.0, 5.0])
    assert list(table.u) == [0.0, 0.0, 0.0, 2.0, 2.0, 6.0]


def test_noise_reaches_the_controller_and_the_error_the_plant(design_of):
    finished, calls = close(
        integrator(design_of), lambda t, x: -x[0], (1.0,), samples=1, scheme=sampled(0.5),
        noise=0.125, error=2.0,
    )  # fmt: skip
    table = finished.recorder.table()
    assert calls[0][1] == (1.125,)
    assert table.u[0] == pytest.approx(-1.125 + 2.0)
    assert table.x[1, 0] == pytest.approx(1.0 + 0.5 * 0.875)


@pytest.mark.parametrize("gain", [1.0, 1e3, 1e10])
def test_the_implicit_step_takes_the_law_at_its_end(design_of, gain):
    finished, calls = close(
        integrator(design_of), lambda t, x: -gain * x[0], (1.0,), samples=20, scheme=IMPLICIT
    )
    table = finished.recorder.table()
    expected = [(1.0 + 0.1 * gain) ** -k for k in range(21)]
    assert list(table.x[:, 0]) == pytest.approx(expected, rel=1e-3, abs=1e-2 / gain)
    # What is recorded is the accepted point, and its command was the last one of that time.
    last = {t: (x, u) for t, x, u in calls}
    for t, x, u in zip(table.t, table.x[:, 0], table.u, strict=True):
        assert last[t] == ((x,), u)


def test_a_law_with_a_jump_is_solved_within_the_bracket_of_its_command(design_of):
    finished, calls = close(
        integrator(design_of), lambda t, x: -math.copysign(3.0, x[0]), (1.0,), samples=50,
        scheme=IMPLICIT,
    )  # fmt: skip
    x = finished.recorder.table().x[:, 0]
    assert list(x[:4]) == pytest.approx([1.0, 0.7, 0.4, 0.1])
    assert max(abs(x[4:])) < 1e-6
    assert finished.complete
    assert len(calls) < 50 * 120


def test_noise_and_error_enter_the_implicit_equation(design_of):
    finished, _ = close(
        integrator(design_of), lambda t, x: -10.0 * x[0], (1.0,), samples=1, scheme=IMPLICIT,
        noise=0.5, error=3.0,
    )  # fmt: skip
    # x' = 1 + 0.1 (-10 (x' + 0.5) + 3)
    assert finished.recorder.table().x[1, 0] == pytest.approx(0.4, abs=1e-3)


def test_lower_states_of_an_implicit_step_follow_the_new_upper_ones(design_of):
    design = design_of(
        ({"f": sp.Integer(0), "g": sp.Integer(2)}, {"f": sp.Integer(1)}), omega=(9.0, 9.0)
    )
    finished, _ = close(
        design, lambda t, x: -4.0 * (x[1] + 3.0 * x[0]), (1.0, 2.0), samples=1, scheme=IMPLICIT
    )
    first, second = finished.recorder.table().x[1]
    u = -4.0 * (second + 3.0 * first)
    assert first == pytest.approx(1.0 + 0.1 * 2.0 * second, abs=1e-3)
    assert second == pytest.approx(2.0 + 0.1 * (1.0 + u), abs=1e-3)


def test_equal_times_are_all_that_an_implicit_step_asks_twice(design_of):
    _, calls = close(
        integrator(design_of), lambda t, x: -50.0 * x[0] - x[0] ** 3, (1.0,), samples=20,
        scheme=IMPLICIT,
    )  # fmt: skip
    times = [t for t, _, _ in calls]
    assert times == sorted(times)
    assert len(calls) <= 4 * 20


@pytest.mark.parametrize("scheme", [IMPLICIT, sampled(0.1)])
def test_a_run_that_diverges_ends_without_a_traceback(design_of, scheme):
    design = design_of(({"f": sp.exp(X1)},), states=(X1,), gains=(LINEAR,), omega=(1.0,))
    finished, _ = close(design, lambda t, x: 0.0, (2.0,), samples=5000, scheme=scheme)
    assert not finished.complete
    assert finished.recorder.peak_e[0] > 1.0
    assert all(math.isfinite(e) for e in finished.recorder.peak_e)
    assert len(finished.recorder.table().t) < 100


def test_a_run_that_only_grows_ends_within_a_batch_of_leaving_every_tube(design_of):
    design = design_of(({"f": X1},), states=(X1,), gains=(LINEAR,), omega=(1.0,))
    finished, calls = close(design, lambda t, x: 0.0, (1.0,), samples=100_000, scheme=sampled(0.05))
    assert not finished.complete
    assert len(calls) < 5000
    assert finished.recorder.peak_e[0] <= 1e12
