"""Whole runs of a hand-made design under a hand-written controller."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from bfppc_synth.errors import UsageError
from bfppc_synth.model.expression import Constant, Number
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.spec import Form, QuantizerKind, QuantizerSpec
from bfppc_synth.model.trajectory import within
from bfppc_synth.simulation.loop import coverage, simulate_adversaries, simulate_nominal
from bfppc_synth.simulation.scheme import Coverage

X1, X2, T = sp.symbols("x1 x2 t", real=True)


def number(value):
    exact = sp.Rational(str(value))
    return Constant(
        text=str(value), tree=Number(value=exact), exact=exact, approximate=float(value)
    )


FINE = (QuantizerSpec(kind=QuantizerKind.UNIFORM, step=number("0.0001")),) * 2
STICKY = (
    QuantizerSpec(
        kind=QuantizerKind.HYSTERESIS_UNIFORM, step=number("0.0001"), hysteresis=number("0.00005")
    ),
) * 2


def weaken(design, factor):
    """Scale k, M, c of every step; the tube stays."""
    gains = tuple(replace(g, k=g.k * factor, M=g.M * factor, c=g.c * factor) for g in design.gains)
    return replace(design, gains=gains)


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"noise": 1e-5, "error": 0.1},
        {"period": 0.0005},
        {"period": 0.0005, "quantizers": FINE, "noise": 1e-5},
        {"period": 0.0005, "quantizers": STICKY},
        {"period": 0.0002, "delay": 0.0004},
        {"quantizers": FINE, "step": 0.0005},
        {"initial": ((0.5, 1), (-0.2, 0.2))},
    ],
)
def test_gains_that_the_theorem_allows_keep_every_run_in_the_tube(
    design_of, controller_of, changed
):
    design = design_of(horizon=1.0, **changed)
    controller = controller_of(design)
    assert simulate_nominal(design, controller).within_bounds
    runs = simulate_adversaries(design, controller, runs=5)
    assert all(run.within_bounds for run in runs)
    assert max(run.max_abs_e[0] for run in runs) > 0.3 * 0.15


def test_weakened_gains_lose_the_tube(design_of, controller_of):
    design = design_of(horizon=1.0)
    weak = weaken(design, 0.25)
    runs = simulate_adversaries(weak, controller_of(weak), runs=5)
    assert not all(run.within_bounds for run in runs)
    assert max(run.max_abs_e[0] for run in runs) > 0.15


def test_the_nominal_run_starts_in_the_middle_of_the_box_or_where_it_is_told(
    design_of, controller_of
):
    design = design_of(initial=((0.5, 1), (-0.2, 0.6)), horizon=0.1)
    controller = controller_of(design)
    assert simulate_nominal(design, controller).x[0].tolist() == [0.75, pytest.approx(0.2)]
    assert simulate_nominal(design, controller, start=(1.0, 0.0)).x[0].tolist() == [1.0, 0.0]


def test_rows_hold_what_they_are_called(design_of, controller_of):
    first = Shape(k=30.0, M=1.0, epsilon=0.1, c=2.0, N=3)
    last = Shape(k=320.0, M=0.0, epsilon=1.0, c=1.0, N=3)
    design = design_of(reference=sp.sin(2 * T), horizon=0.5, gains=(first, last))
    run = simulate_nominal(design, controller_of(design))
    assert len(run.t) == 251
    assert run.t[-1] == pytest.approx(0.5)
    assert run.y_d == pytest.approx(np.sin(2.0 * run.t), abs=1e-15)
    assert run.e[:, 0] == pytest.approx(run.x[:, 0] - run.r[:, 0])
    pushed = 30.0 * run.e[:, 0] + np.tanh(10.0 * run.e[:, 0]) + 2.0 * run.e[:, 0] ** 3
    assert run.e[:, 1] == pytest.approx(run.x[:, 1] - run.r[:, 1] + pushed)
    # With exact measurement u = -phi_n(e_n), the very law of the theory.
    assert run.u == pytest.approx(-last.k * run.e[:, 1] - last.c * run.e[:, 1] ** 3, abs=1e-9)
    assert (run.q == run.x).all()
    assert set(run.status) == {0}


def test_a_sampled_loop_and_the_implicit_one_agree_where_both_are_fine(design_of, controller_of):
    implicit, sampled = design_of(step=0.0001), design_of(period=0.0001, step=0.0001)
    first = simulate_nominal(implicit, controller_of(implicit))
    second = simulate_nominal(sampled, controller_of(sampled))
    assert abs(first.x - second.x).max() < 2e-3
    assert first.max_abs_e[0] == pytest.approx(second.max_abs_e[0], rel=0.02)


def test_a_design_of_any_steepness_can_be_simulated(design_of, controller_of):
    steep = design_of(
        gains=(
            Shape(k=30.0, M=0.0, epsilon=1.0, c=0.0, N=3),
            Shape(k=0.0, M=310.0, epsilon=1e-5, c=0.0, N=3),
        )
    )
    controller = controller_of(steep)
    run = simulate_nominal(steep, controller)
    assert run.within_bounds
    assert run.max_abs_e[1] < 1e-6
    assert controller.calls < 40 * len(run.t)
    assert all(item.within_bounds for item in simulate_adversaries(steep, controller, runs=3))


def test_an_ordinary_design_costs_two_calls_of_the_controller_a_step(design_of, controller_of):
    design = design_of()
    controller = controller_of(design)
    run = simulate_nominal(design, controller)
    assert controller.calls < 2 * len(run.t)


def test_a_plant_that_escapes_is_outside_and_no_error(design_of, controller_of):
    design = design_of(horizon=5.0)
    idle = replace(design, gains=(Shape(k=0.0, M=0.0, epsilon=1.0, c=0.0, N=3),) * 2)
    exploding = replace(
        idle,
        plant=replace(
            idle.plant,
            channels=tuple(replace(c, f=3 * c.state**3, f_bound=None) for c in idle.plant.channels),
        ),
    )
    controller = controller_of(exploding)
    run = simulate_nominal(exploding, controller)
    assert not run.complete
    assert not run.within_bounds
    assert np.isfinite(run.x).all()
    assert np.isfinite(run.max_abs_e).all()
    runs = simulate_adversaries(exploding, controller, runs=2)
    assert not any(item.within_bounds for item in runs)
    assert all(np.isfinite(item.max_abs_e).all() for item in runs)


def test_a_step_too_coarse_for_the_plant_is_not_taken_for_a_broken_promise(
    design_of, controller_of
):
    # h times the plant's own rate is 3: the coarse step is unstable, a quarter of it is not.
    fast = design_of(
        ({"f": X1**2 - sp.sin(X1)}, {"f": -1500 * X2}), step=0.002, period=0.002, horizon=1.0
    )
    sampled = replace(fast, omega=(0.15, 2.0))
    lazy = replace(sampled, gains=(sampled.gains[0], replace(sampled.gains[1], k=900.0)))
    lazy = replace(lazy, bounds=replace(lazy.bounds, U=1e4))
    run = simulate_nominal(lazy, controller_of(lazy))
    assert run.complete
    assert run.within_bounds
    # What nothing covers is reported as it came.
    printed = replace(lazy, spec=replace(lazy.spec, synthesis=replace(
        lazy.spec.synthesis, form=Form.PRINTED)))  # fmt: skip
    assert not simulate_nominal(printed, controller_of(printed)).within_bounds


def test_maxima_are_over_every_step_though_rows_are_thinned(design_of, controller_of, monkeypatch):
    design = design_of(horizon=1.0)
    full = simulate_nominal(design, controller_of(design))
    monkeypatch.setattr("bfppc_synth.simulation.loop._ROWS", 50)
    thin = simulate_nominal(design, controller_of(design))
    assert len(thin.t) < 60 < len(full.t)
    assert thin.max_abs_e == full.max_abs_e
    assert thin.max_abs_u == full.max_abs_u
    assert set(thin.t) <= set(full.t)


def test_a_horizon_is_given_or_the_plant_files(design_of, controller_of):
    design = design_of(horizon=0.2)
    controller = controller_of(design)
    assert simulate_nominal(design, controller).t[-1] == pytest.approx(0.2)
    assert simulate_nominal(design, controller, horizon=0.05).t[-1] == pytest.approx(0.05, abs=1e-3)


@pytest.mark.parametrize("horizon", [0.0, -1.0, float("nan"), float("inf")])
def test_a_horizon_that_is_no_time_is_refused(design_of, controller_of, horizon):
    design = design_of()
    with pytest.raises(UsageError, match="--horizon"):
        simulate_nominal(design, controller_of(design), horizon=horizon)


@pytest.mark.parametrize("start", [(1.0,), (1.0, 0.0, 0.0), (float("nan"), 0.0), (1e12, 0.0)])
def test_a_start_that_is_no_state_is_refused(design_of, controller_of, start):
    design = design_of()
    with pytest.raises(UsageError, match="--x0"):
        simulate_nominal(design, controller_of(design), start=start)


def test_only_covered_simulations_can_contradict_a_certificate(design_of):
    assert coverage(design_of()) is Coverage.COVERED
    assert coverage(design_of(form=Form.PRINTED)) is Coverage.NOT_COVERED
    assert coverage(design_of(quantizers=FINE)) is Coverage.NOT_COVERED


def test_a_step_in_which_the_plant_alone_crosses_its_tube_contradicts_nothing(design_of):
    # xi_i / W_i = 1 s in this design, and four such times are the longest step.
    assert coverage(design_of(step=3.9)) is Coverage.COVERED
    assert coverage(design_of(step=4.1)) is Coverage.NOT_COVERED
    assert coverage(design_of(step=4.1, period=4.1)) is Coverage.COVERED


def test_a_bound_is_kept_up_to_rounding_and_by_no_nan():
    assert within((1.0 + 5e-10, 0.0), (1.0, 2.0))
    assert not within((1.0 + 2e-9, 0.0), (1.0, 2.0))
    assert not within((0.0, float("nan")), (1.0, 2.0))
