"""T_s left open against T_s given: what the search of T_s is for."""

from __future__ import annotations

import math
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest

from bfppc_synth.gains.problem import Weights
from bfppc_synth.gains.search import search
from bfppc_synth.spec.build import DEFAULT_HORIZON
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.nominal import prepare_nominal

ROOT = Path(__file__).parents[2]
PLANTS = sorted((ROOT / "tests" / "plants").glob("nominal_*.yaml"))
EVERY = os.environ.get("BFPPC_TESTS") == "all"
PEAK_INPUT = Weights(peak_input=1.0, slope=0.01)
BALANCED = Weights(peak_input=1.0, slope=1.0)
MARGIN = 2e-4
GIVEN = (0.5, 1.0, 2.0, 5.0)
# What twice the time, or any, has to gain, and what four digits of the gains leave open.
PATIENCE, ROUNDED = 1e-3, 2e-4
EXAMPLES = [
    (name, weights)
    for weights in (PEAK_INPUT, BALANCED)
    for name in ("compressor_surge", "van_der_pol", "cart_pendulum", "motor_arm")
]
if not EVERY:
    EXAMPLES = EXAMPLES[:1]
    PLANTS = [path for path in PLANTS if path.stem.endswith(("motor_arm", "chain_of_four"))]
# A set point to reach under a disturbance: the longer the better, by less and less.
REGULATION = """\
name: settle
states: [x1]
dynamics: {x1: {f: 0, disturbance: 0.1}}
initial: {x1: 1}
performance: {accuracy: 0.05}
synthesis: {center: nominal, objective: peak-input}
"""
QUANTIZED = """\
measurement: {noise: {x1: 0.0001, x2: 0.001, x3: 0.001}}
sampling: {period: 0.0001}
synthesis:"""


def open_spec(path):
    spec = load_spec(path)
    return replace(spec, performance=replace(spec.performance, transition=None))


def solved(spec, weights, transition=None):
    problem, _ = prepare_nominal(spec, weights, MARGIN, transition=transition)
    return problem.nominal.model.transition, search(problem, lambda _message: None)


def require_never_worse(spec, weights, given=GIVEN):
    chosen, free = solved(spec, weights)
    assert free is not None
    assert free.holds(MARGIN / 2)
    compared = 0
    for transition in given:
        _, other = solved(spec, weights, transition)
        if other is None:
            continue
        compared += 1
        octaves = math.log2(transition / chosen)
        room = ROUNDED + PATIENCE * min(max(0.0, octaves), 1.0)
        assert free.cost <= other.cost + room
        if weights is PEAK_INPUT:
            assert other.bounds.U * math.exp(room) >= free.bounds.U
    assert compared >= 1
    return chosen, free


@pytest.mark.parametrize("path", PLANTS, ids=lambda path: path.stem)
def test_no_given_transition_costs_less(path):
    require_never_worse(open_spec(path), PEAK_INPUT)


def test_nor_with_noise_and_samples(tmp_path):
    path = tmp_path / "plant.yaml"
    text = (ROOT / "tests" / "plants" / "nominal_motor_arm.yaml").read_text("utf-8")
    path.write_text(text.replace("synthesis:", QUANTIZED), "utf-8")
    require_never_worse(open_spec(path), PEAK_INPUT)


@pytest.mark.parametrize(("name", "weights"), EXAMPLES)
def test_nor_for_an_example(tmp_path, name, weights):
    path = tmp_path / "plant.yaml"
    text = (ROOT / "examples" / f"{name}.yaml").read_text("utf-8")
    text, count = re.subn("center: performance$", "center: nominal", text, flags=re.MULTILINE)
    assert count == 1
    path.write_text(text, "utf-8")
    require_never_worse(open_spec(path), weights)


@pytest.mark.parametrize("horizon", [None, 40.0, 1e4])
def test_no_transition_is_longer_than_what_is_simulated(tmp_path, horizon):
    path = tmp_path / "plant.yaml"
    asked = "" if horizon is None else f"simulation: {{horizon: {horizon}}}\n"
    path.write_text(REGULATION + asked, "utf-8")
    longest = DEFAULT_HORIZON if horizon is None else horizon
    spec = open_spec(path)
    given = [share * longest for share in (1e-3, 0.01, 0.1, 0.3, 1.0)]
    chosen, free = require_never_worse(spec, PEAK_INPUT, given)
    assert chosen <= longest
    # Without that there is no best T_s: U = 0.1 + c / T_s.
    _, longer = solved(spec, PEAK_INPUT, 8.0 * longest)
    assert longer.bounds.U < free.bounds.U


def test_where_longer_is_hardly_better_the_shorter_is_taken(tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(REGULATION + "simulation: {horizon: 100000}\n", "utf-8")
    spec = open_spec(path)
    chosen, free = solved(spec, PEAK_INPUT)
    assert chosen < 0.5e5
    _, longest = solved(spec, PEAK_INPUT, 1e5)
    assert longest.bounds.U < free.bounds.U < longest.bounds.U * math.exp(1.1 * PATIENCE)
    _, half = solved(spec, PEAK_INPUT, 0.5 * chosen)
    assert half.bounds.U > free.bounds.U * (1.0 + 0.5 * PATIENCE)


def test_a_transition_that_costs_nothing_is_short():
    # The chain starts on the reference: nothing is carried anywhere.
    path = next(path for path in PLANTS if path.stem.endswith("chain_of_four"))
    chosen, free = require_never_worse(open_spec(path), PEAK_INPUT)
    assert chosen < 0.125
    assert free.bounds.U < 1.108


def test_gains_that_are_given_get_the_transition_with_the_most_room(tmp_path):
    path = tmp_path / "plant.yaml"
    fixed = REGULATION.replace("peak-input}", "peak-input, gains: {x1: {k: 3, M: 0, c: 0}}}")
    path.write_text(fixed, "utf-8")
    spec = open_spec(path)
    _, found = solved(spec, PEAK_INPUT)
    for transition in GIVEN:
        _, other = solved(spec, PEAK_INPUT, transition)
        assert found.shortfall <= other.shortfall
