"""Drawn runs stay within what the certificate assumes, use it, and depend on two numbers."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from itertools import pairwise

import pytest
import sympy as sp

from bfppc_synth.simulation.drawing import (
    BUDGET,
    SEGMENTS,
    Adversary,
    choices,
    draw_run,
    length,
    plan_at,
    search,
)
from bfppc_synth.simulation.drawn import Drawn, Generator, Manner
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
HORIZON = 2.0


def prepared(design_of, **changed):
    design = design_of(CHANNELS, **(CHANGED | changed))
    dynamics, scheme = compile_plant(design.plant), choose_scheme(design)
    return design, dynamics, scheme, choices(design, dynamics, scheme, HORIZON)


def acted(design, dynamics, scheme, draw):
    """Let a drawn adversary decide along a made-up path."""
    nature = Drawn(design, dynamics, scheme, draw)
    k, found = 0, []
    while k < 2000:
        found.append(nature.act(k, k * scheme.step, (math.sin(k), math.cos(3 * k))))
        if k == 0:
            start = Start(true=draw.start, measured=draw.start, reference=nature.y_d(0.0))
            nature.begin(Tracking(design, start))
        assert found[-1].until > k
        k = min(found[-1].until, 2000)
    return nature, found


@pytest.mark.parametrize("number", range(40))
def test_every_choice_is_within_what_the_certificate_assumes(design_of, number):
    design, dynamics, scheme, menu = prepared(design_of)
    _, draw = draw_run(menu, 3, number)
    assert -1.0 <= draw.start[0] <= 1.0
    assert 0.0 <= draw.start[1] <= 0.5
    nature, actions = acted(design, dynamics, scheme, draw)
    for action in actions:
        a, w1, w2, b1, b2, m1, m2 = action.arguments
        assert -1.0 <= a <= 2.0
        assert all(abs(share) <= 1.0 for share in (w1, w2, b1, b2))
        assert all(0.0 <= place <= 1.0 for place in (m1, m2))
        assert all(abs(noise) <= 0.01 for noise in action.noise)
        assert abs(action.error) <= 0.5
    assert all(0.0 <= nature.lag() <= 0.003 for _ in range(50))
    assert all(1 <= nature.gap(4) <= 4 for _ in range(50))
    assert draw.jitter or {nature.gap(4) for _ in range(50)} == {4}


def test_all_that_is_allowed_is_used(design_of):
    design, dynamics, scheme, menu = prepared(design_of)
    draws = [draw_run(menu, 3, number) for number in range(300)]
    kinds = Counter(adversary for adversary, _ in draws)
    assert set(kinds) == set(Adversary)
    assert {draw.manner for _, draw in draws} == set(Manner)
    for name in ("bounded", "corners", "late", "jitter"):
        assert {getattr(draw, name) for _, draw in draws} == {False, True}
    assert {draw.target for _, draw in draws} == {-2, -1, 0, 1}
    switching = next(draw for kind, draw in draws if kind is Adversary.SWITCHING and draw.corners)
    _, actions = acted(design, dynamics, scheme, replace(switching, dwell=0.002))
    assert {action.arguments[0] for action in actions} == {-1.0, 2.0}
    assert {action.noise[0] for action in actions} == {-0.01, 0.01}


def test_a_run_depends_on_its_seed_and_number_alone(design_of):
    *_, menu = prepared(design_of)
    assert draw_run(menu, 5, 17) == draw_run(menu, 5, 17)
    others = [draw_run(menu, 5, 18), draw_run(menu, 6, 17)]
    assert draw_run(menu, 5, 17) not in others


def test_a_continuous_law_is_never_sampled_irregularly(design_of):
    *_, menu = prepared(design_of, period=0, delay=0)
    assert not any(draw_run(menu, 1, number)[1].jitter for number in range(200))


def test_references_at_run_time_keep_every_bound(design_of):
    design, dynamics, scheme, menu = prepared(
        design_of, reference_bounds=(0.5, 0.8), initial=((-0.2, 0.2), (0, 0.5))
    )
    for number in range(60):
        _, draw = draw_run(menu, 2, number)
        nature = Drawn(design, dynamics, scheme, draw)
        values = [nature.y_d(0.01 * k) for k in range(2000)]
        assert max(map(abs, values)) <= 0.5
        assert max(abs(b - a) for a, b in pairwise(values)) <= 0.8 * 0.01 * (1.0 + 1e-9)


def test_a_greedy_adversary_pushes_the_error_nearest_to_its_facet(design_of):
    design, dynamics, scheme, menu = prepared(design_of)
    found = (draw_run(menu, 3, number) for number in range(300))
    draw = next(draw for kind, draw in found if kind is Adversary.GREEDY and draw.target < 0)
    nature = Drawn(design, dynamics, scheme, replace(draw, start=(0.0, 0.0)))
    nature.act(0, 0.0, (0.0, 0.0))
    tracking = Tracking(design, Start(true=(0.0, 0.0), measured=(0.0, 0.0), reference=0.0))
    nature.begin(tracking)
    # omega is (0.15, 1.0); e_1 = x_1 and e_2 = x_2 + 30 x_1 here.
    for x, sign in (((0.1, -3.0), 1.0), ((-0.1, 3.0), -1.0), ((0.01, -1.2), -1.0)):
        action = nature.act(5, 0.005, x)
        assert action.arguments[1:5] == (sign,) * 4
        assert action.error == sign * 0.5
        assert action.noise == (-sign * 0.01,) * 2


def test_a_plan_from_any_point_of_the_cube_is_allowed_and_its_segments_follow(design_of):
    *_, menu = prepared(design_of)
    size = length(menu, SEGMENTS)
    for share in (-1.0, -0.3, 0.0, 1.0):
        plan = plan_at(menu, [share] * size, SEGMENTS)
        assert len(plan) == SEGMENTS
        assert plan[-1].until == math.inf
        assert [segment.until for segment in plan] == sorted(segment.until for segment in plan)
        for segment in plan:
            assert -1.0 <= segment.arguments[0] <= 2.0
            assert all(0.0 <= place <= 1.0 for place in segment.arguments[-2:])


def test_a_search_climbs_within_its_budget_and_the_same_way_each_time(design_of):
    *_, menu = prepared(design_of)
    _, draw = draw_run(menu, 3, 1)
    calls = []

    def height(trial):
        calls.append(trial)
        return sum(trial.plan[0].arguments) if trial.plan else -math.inf

    first = search(menu, draw, height)
    assert len(calls) == BUDGET
    beginning = max(height(trial) for trial in calls[:2])
    assert first[1] > beginning
    assert height(first[0]) == first[1]
    assert search(menu, draw, height) == first


def test_the_generator_is_splitmix64():
    # The first outputs for the seed 1234567, from the algorithm's definition.
    generator = Generator(1234567)
    expected = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    assert [generator.uniform() for _ in expected] == [(z >> 11) * 2.0**-53 for z in expected]
