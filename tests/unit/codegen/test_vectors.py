"""Golden vectors: their tolerances are bounds, and what another libm may turn round is left out."""

from __future__ import annotations

import itertools
import math
import random
from fractions import Fraction
from types import SimpleNamespace

import pytest

from bfppc_synth.codegen.choosing import make_samples, through_switches
from bfppc_synth.codegen.cost import step_cost
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.codegen.running import Meter, Running, error_of
from bfppc_synth.codegen.vectors import answer, render_vectors
from bfppc_synth.model.vectors import Sample
from bfppc_synth.simulation.loading import load_text

UNIT = 2.0**-53
NAMES = ["everyday", "kinked", "run_time"]


def module_of(design):
    text = render_controller(build_law(design), make_provenance(design))
    return load_text(text, name="answering", origin="controller.py")


def wave(middle, k):
    return tuple(value + 0.01 * math.sin(k) for value in middle)


def samples_of(design, count=40):
    law = build_law(design)
    limits = {constant.name: float(constant.value) for constant in law.limits}
    middle = tuple(
        0.5 * (limits[f"start_lower_{i}"] + limits[f"start_upper_{i}"])
        for i in range(1, law.order + 1)
    )
    return make_samples(
        law, [Sample(t=0.01 * k, x=wave(middle, k), y_d=(0.0,)) for k in range(count)]
    )


@pytest.mark.parametrize("seed", range(20))
def test_the_running_error_bounds_what_rounding_does(seed):
    draw = random.Random(seed)  # noqa: S311
    meter = Meter(unit=UNIT)
    exact = [Fraction(draw.uniform(-2.0, 2.0)) for _ in range(4)]
    found = [meter.number(float(value)) for value in exact]
    for _ in range(30):
        i, j = draw.randrange(len(exact)), draw.randrange(len(exact))
        kind = draw.choice("+-*/")
        if kind == "/" and abs(exact[j]) < Fraction(1, 10):
            continue
        pairs = ((exact[i], exact[j]), (found[i], found[j]))
        results = [
            {"+": a + b, "-": a - b, "*": a * b, "/": a / b if kind == "/" else 0}[kind]
            for a, b in pairs
        ]
        if abs(results[0]) < 1e3:
            exact.append(results[0])
            found.append(results[1])
    assert len(exact) > 10
    for value, number in zip(exact, found, strict=True):
        assert abs(Fraction(float(number)) - value) <= Fraction(number.error)


@pytest.mark.parametrize("name", NAMES)
def test_the_plain_answers_are_those_of_the_controller(handmade, name):
    design = handmade.DESIGNS[name]()
    law, plain = build_law(design), module_of(design).Controller()
    vectors = answer(law, module_of(design), samples_of(design))
    for row in vectors.rows:
        if row.sample.reset:
            plain.reset()
        u = plain.step(row.sample.t, row.sample.x, row.sample.y_d[0])
        assert (u, int(plain.status)) == (row.u, row.status)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", NAMES)
def test_another_libm_stays_within_the_tolerance(handmade, name, seed):
    design = handmade.DESIGNS[name]()
    law, module, draw = build_law(design), module_of(design), random.Random(seed)  # noqa: S311

    def off(plain):
        def function(*arguments):
            value = plain(*arguments)
            for _ in range(draw.randrange(5)):
                value = math.nextafter(value, draw.choice((-math.inf, math.inf)))
            return value

        return function

    for key in ("tanh", "cos", "sin", "exp"):
        if hasattr(module, key):
            setattr(module, key, off(getattr(math, key)))
    controller, moved = module.Controller(), 0
    for row in answer(law, module_of(design), samples_of(design)).rows:
        if row.sample.reset:
            controller.reset()
        u = controller.step(row.sample.t, row.sample.x, row.sample.y_d[0])
        assert int(controller.status) == row.status
        assert abs(u - row.u) <= row.tolerance
        moved += u != row.u
    assert moved > 10


def test_every_status_is_among_the_vectors(handmade):
    design = handmade.everyday()
    vectors = answer(build_law(design), module_of(design), samples_of(design))
    assert {row.status for row in vectors.rows} == {0, 1, 2, 3}
    assert [row.sample.reset for row in vectors.rows].count(True) == 3
    assert vectors.rows[0].sample.reset
    assert len(vectors.points) >= 40


def test_a_sample_on_a_border_is_left_out(handmade):
    design = handmade.everyday()
    law, module = build_law(design), module_of(design)
    samples = samples_of(design, 3)
    first = samples[0]
    meter = Meter(unit=UNIT)
    border = meter.number(1.0) / 3.0
    assert (border < 1.0 / 3.0, meter.doubtful) == (False, True)
    # The error e_1 of this sample is on the border of its tube up to its rounding.
    on = Sample(t=0.0, x=(first.x[0] + module.tube_1, first.x[1]), y_d=first.y_d)
    kept = answer(law, module, [first, on, samples[1]]).rows
    assert on not in [row.sample for row in kept]
    assert len(kept) == 2


def test_comparisons_of_exact_numbers_leave_no_doubt():
    meter = Meter(unit=UNIT)
    one = meter.number(1.0)
    assert one <= 1.0
    assert not one < 1.0
    assert one >= -1.0
    assert not meter.doubtful


def test_a_quotient_by_a_number_that_may_be_zero_has_no_bound():
    meter = Meter(unit=UNIT)
    small = Running(1e-20, 1e-19, meter)
    assert error_of(1.0 / small) == math.inf
    assert error_of(1.0 / meter.number(2.0)) <= 2.0 * UNIT


def test_a_stage_is_left_where_bisection_finds_it():
    class Controller:
        def __init__(self):
            self.stage = 1

        def step(self, t, x, y_d):
            del t, y_d
            if abs(x[0]) > 0.25:
                self.stage = 2
            return 0.0

    run = [Sample(t=float(k), x=(0.1 * k,), y_d=(0.0,)) for k in range(6)]
    found = through_switches(SimpleNamespace(Controller=Controller), run)
    assert len(found) == 7
    added = next(sample for sample in found if sample not in run)
    assert 0.25 < added.x[0] < 0.250001
    assert 2.5 < added.t < 2.50001


def test_a_step_is_counted(handmade):
    cost = step_cost(build_law(handmade.everyday()))
    assert dict(cost.functions) == {"cos": 1, "tanh": 2}
    assert cost.remembered == 5
    assert "2 calls of tanh" in cost.words()
    assert cost.additions > 0 < cost.multiplications


def test_the_operations_of_a_step_grow_linearly(handmade):
    def total(order):
        gains = (handmade.shape(k=1.5, M=1.25, epsilon=0.5, c=0.5),) * order
        box = (("-1", "1"),) * order
        design = handmade.make_design(gains=gains, p=(0.05,) * order, initial=box)
        cost = step_cost(build_law(design))
        calls = sum(count for _, count in cost.functions)
        return cost.additions + cost.multiplications + cost.divisions + cost.choices + calls

    counts = [total(order) for order in (2, 10, 18, 26, 50)]
    steps = [(b - a) / 8 for a, b in itertools.pairwise(counts[:4])]
    assert len(set(steps)) == 1
    assert counts[-1] == counts[3] + 24 * steps[0]


def test_the_header_of_vectors_says_what_it_holds(handmade):
    design = handmade.everyday()
    law = build_law(design)
    vectors = answer(law, module_of(design), samples_of(design))
    text = render_vectors(law, make_provenance(design), vectors)
    again = render_vectors(law, make_provenance(design), vectors)
    assert text == again
    assert text.count("\n    {0, ") + text.count("\n    {1, ") >= len(vectors.rows)
    assert f"{vectors.rows[1].u!r}" in text
