"""References of several periods, or that settle slowly: the checker's center and the search's."""

from __future__ import annotations

import json
import os
from fractions import Fraction
from math import cos, pi, sin
from typing import TYPE_CHECKING

import pytest

from bfppc_synth.bounds.nominal.signals import nominal_center
from bfppc_synth.certificate import checker
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from pathlib import Path

EVERY = os.environ.get("BFPPC_TESTS") == "all"
PLANT = """\
name: followed
parameters: {a: [0.9, 1.1]}
states: [x1]
dynamics: {x1: {f: -a*sin(x1)}}
reference: REFERENCE
initial: {x1: 0.2}
performance: {accuracy: 0.1, transition: 1}
sampling: {period: 0.0001, delay: 0.0001}
synthesis: {center: nominal}
"""
REFERENCES = [
    "sin(t) + 0.5*sin(pi*t)",
    "sin(t)*atan(t)",
    "1/(1 + t)",
    "sin(t)**2/(1 + exp(-t))",
    "sin(t)/(1 + t)",
    "0.3*sin(sin(t))",
    "exp(-t/1000)",
    "0.5*sin(t) + 0.3*sin(sqrt(2)*t) + 0.2*cos(sqrt(3)*t)",
    "atan(t) + 0.2*cos(sqrt(5)*t)",
    "sin(t + 1/(1 + t))",
]


@pytest.mark.parametrize("reference", REFERENCES if EVERY else REFERENCES[0:3:2])
def test_both_enclose_the_center_alike(tmp_path: Path, reference: str) -> None:
    path = tmp_path / "plant.yaml"
    path.write_text(PLANT.replace("REFERENCE", reference), encoding="utf-8")
    spec = load_spec(path)
    searched = nominal_center(build_plant(spec), 1.0).center
    checked = checker.nominal_center(checker.read_plant(json.loads(plant_json(spec))), Fraction(1))
    assert checked.following is not None
    pairs = [
        (max(-searched.r_lower[0], searched.r_upper[0]), checked.size(0)),
        (searched.rate[0], checked.rate[0]),
        (searched.v, checked.size(1)),
        (searched.v_rate, checked.following.v_rate),
    ]
    for found, enclosure in pairs:
        assert enclosure[1] / checker.ONE == pytest.approx(found, rel=0.02)


@pytest.mark.parametrize("reference", REFERENCES if EVERY else REFERENCES[:1])
def test_a_design_that_follows_it_is_proved(tmp_path: Path, reference: str) -> None:
    path = tmp_path / "plant.yaml"
    path.write_text(PLANT.replace("REFERENCE", reference), encoding="utf-8")
    synthesize(load_spec(path)).certificate.require()


def test_a_late_command_is_counted_with_what_several_periods_reach(tmp_path: Path) -> None:
    """v_0 = sup|v| up to the delay, which lies far behind T_s here, where phases would do."""
    text = PLANT.replace("delay: 0.0001", "delay: 9").replace("REFERENCE", REFERENCES[0])
    path = tmp_path / "plant.yaml"
    path.write_text(text, encoding="utf-8")
    problem = checker.read_plant(json.loads(plant_json(load_spec(path))))
    found = checker.nominal_center(problem, Fraction(1))
    assert found.following is not None
    # v = dy_d + sin(y_d) after T_s, at a = 1.
    times = [1 + k / 500 for k in range(4001)]
    pairs = [(sin(t) + 0.5 * sin(pi * t), cos(t) + 0.5 * pi * cos(pi * t)) for t in times]
    sampled = max(abs(rate + sin(y)) for y, rate in pairs)
    early, most = found.following.v_start[1] / checker.ONE, found.size(1)[1] / checker.ONE
    assert sampled <= early < 0.9 * most
    assert early <= 1.02 * sampled
