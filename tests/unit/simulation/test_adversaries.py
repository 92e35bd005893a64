"""Adversaries stay within what the certificate assumes, and use it."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest
import sympy as sp

from bfppc_synth.simulation.adversary import Adversary
from bfppc_synth.simulation.loop import simulate_adversaries
from bfppc_synth.simulation.plant import compile_plant
from bfppc_synth.simulation.scheme import choose_scheme
from bfppc_synth.simulation.tracking import Start, Tracking

X1, X2, A = sp.symbols("x1 x2 a", real=True)
CHANNELS = (
    {"f": A * X1, "f_bound": 2 + X1**2, "g_min": sp.Integer(1), "g_bound": sp.Integer(3)},
    {"f": A * X2, "disturbance": sp.Rational(1, 2)},
)
CHANGED = {
    "parameters": ((A, -1, 2),),
    "noise": 0.01,
    "error": 0.5,
    "delay": 0.003,
    "period": 0.001,
    "initial": ((-1, 1), (0, 0.5)),
}
RUNS = range(20)
INNER = {
    f"independent switching; {truth}; random point"
    for truth in ("model", "within the declared bounds")
}


def adversary(design, run, *, seed=1):
    dynamics = compile_plant(design.plant)
    return Adversary(design, dynamics, choose_scheme(design), seed=seed, run=run)


def actions(design, run):
    """Let the adversary decide along a made-up path."""
    nature = adversary(design, run)
    k, chosen = 0, []
    while k < 2000:
        chosen.append(nature.act(k, k * 0.001, (math.sin(k), math.cos(3 * k))))
        if k == 0:
            start = Start(true=nature.start, measured=nature.start, reference=nature.y_d(0.0))
            nature.begin(Tracking(design, start))
        k = min(chosen[-1].until, 2000)
    return chosen


@pytest.mark.parametrize("run", RUNS)
def test_every_choice_is_within_its_bounds_and_noise_and_error_are_on_them(design_of, run):
    design = design_of(CHANNELS, **CHANGED)
    inner = adversary(design, run).kind in INNER
    for action in actions(design, run):
        (a, *shares), gains = action.arguments[:5], action.arguments[5:]
        assert -1.0 < a < 2.0 if inner else a in (-1.0, 2.0)
        assert all(share in (-1.0, 1.0) for share in shares)
        assert all(place in (0.0, 1.0) for place in gains)
        assert [abs(noise) for noise in action.noise] == [0.01, 0.01]
        assert abs(action.error) == 0.5


def test_time_passes_between_decisions(design_of):
    for run in RUNS:
        nature = adversary(design_of(CHANNELS, **CHANGED), run)
        assert nature.act(7, 0.007, (0.5, 0.1)).until > 7


def test_the_runs_switch_disturbances_parameters_and_gains(design_of):
    design = design_of(CHANNELS, **CHANGED)
    seen = {(run, action.arguments) for run in RUNS for action in actions(design, run)}
    for run in RUNS:
        different = {arguments for number, arguments in seen if number == run}
        steady = adversary(design, run).kind.startswith("steady")
        assert (len(different) == 1) == steady
    for place in range(7):
        assert len({arguments[place] for _, arguments in seen}) >= 2


def test_starts_are_corners_and_random_points_of_the_box(design_of):
    starts = [adversary(design_of(CHANNELS, **CHANGED), run).start for run in RUNS]
    corners = [start for start in starts if start[0] in (-1.0, 1.0) and start[1] in (0.0, 0.5)]
    assert len(corners) == 10
    assert len(set(corners)) == 4
    assert all(-1.0 <= x <= 1.0 and 0.0 <= y <= 0.5 for x, y in starts)


def test_delays_fill_their_range(design_of):
    nature = adversary(design_of(CHANNELS, **CHANGED), 3)
    lags = [nature.lag() for _ in range(400)]
    assert all(0.0 <= lag <= 0.003 for lag in lags)
    assert lags.count(0.003) > 100
    assert min(lags) < 0.0003


def test_declared_bounds_and_the_model_take_turns_as_the_truth(design_of):
    kinds = [adversary(design_of(CHANNELS, **CHANGED), run).kind for run in RUNS]
    assert sum("declared bounds" in kind for kind in kinds) == 10
    assert len(set(kinds)) == 20
    plain = design_of(({"f": X1}, {"f": X2}))
    assert not any("declared bounds" in adversary(plain, run).kind for run in RUNS)


def test_a_pushing_adversary_pushes_the_watched_error_outward(design_of):
    design = design_of(CHANNELS, **CHANGED)
    nature = adversary(design, 1)
    nature.begin(Tracking(design, Start(true=(0, 0), measured=(0, 0), reference=0.0)))
    for x_1 in (0.1, -0.1):
        action = nature.act(5, 0.005, (x_1, 0.2))
        sign = math.copysign(1.0, x_1)
        assert action.arguments[1:5] == (sign,) * 4
        assert action.noise == (-sign * 0.01,) * 2
        assert action.error == sign * 0.5
        # Much gain where x_2 > 0 helps to push, little where it holds back.
        assert action.arguments[5] == (1.0 if sign > 0 else 0.0)


def test_a_reference_at_run_time_keeps_its_bounds_and_the_offset(design_of):
    design = design_of(CHANNELS, reference_bounds=(0.5, 2), **CHANGED)
    offset = design.spec.initial[1].upper
    design = replace(design, spec=replace(design.spec, offset=offset))
    for run in RUNS:
        nature = adversary(design, run)
        values = [nature.y_d(0.01 * k) for k in range(1000)]
        assert max(abs(v) for v in values) <= 0.5
        assert max(abs(b - a) for a, b in pairwise(values)) <= 0.02
        assert abs(nature.start[0] - values[0]) <= 0.5 + 1e-12


def test_a_run_depends_on_its_number_and_the_seed_alone(design_of, controller_of):
    design = design_of(horizon=0.5)
    controller = controller_of(design)
    many = simulate_adversaries(design, controller, runs=6)
    assert simulate_adversaries(design, controller, runs=3) == many[:3]
    other = replace(design, spec=replace(design.spec, simulation=replace(
        design.spec.simulation, seed=2)))  # fmt: skip
    assert simulate_adversaries(other, controller, runs=6) != many
