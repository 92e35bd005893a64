"""A plant file with another number: the same file otherwise, and printed so that it reads back."""

from __future__ import annotations

from pathlib import Path

import pytest

from bfppc_synth.spec.canonical import plant_document
from bfppc_synth.spec.changed import changed, numeric_paths, plant_text
from bfppc_synth.spec.document import document_of, read_document
from bfppc_synth.spec.load import load_spec, load_text

ROOT = Path(__file__).parents[3]
PLANTS = sorted([*(ROOT / "examples").glob("*.yaml"), *(ROOT / "tests/plants").glob("*.yaml")])
SMALL = """\
name: small
title: "a: b, # c"
parameters: {a: [1, 2]}
states: [y, v]
dynamics:
  y: {f: 0}
  v:
    f: >-
      sin(y)
      + a*v
    disturbance: 0.1
initial: {y: [0, 0.1], v: 0}
performance: {accuracy: 0.2}
measurement:
  quantizer: [{kind: uniform, step: 0.01}, {kind: none}]
synthesis: {objective: slope}
"""


def with_value(path: str, text: str, source: str = SMALL):
    spec = load_text(source, "small.yaml")
    tree = changed(document_of("small.yaml", source).root, path, text, spec.states)
    return load_text(plant_text(tree), "small.yaml")


@pytest.mark.parametrize("path", PLANTS, ids=lambda path: path.stem)
def test_a_printed_plant_file_says_the_same(path):
    spec, root = load_spec(path), read_document(path).root
    text = plant_text(root)
    assert plant_document(load_text(text, path.name))["plant"] == plant_document(spec)["plant"]
    assert plant_text(document_of(path.name, text).root) == text


def test_quoted_and_folded_texts_survive():
    again = with_value("performance.accuracy", "0.3")
    assert again.title == "a: b, # c"
    assert again.dynamics[1].f.text.split() == ["sin(y)", "+", "a*v"]


@pytest.mark.parametrize(
    ("path", "read"),
    [
        ("performance.accuracy", lambda spec: spec.performance.accuracy),
        ("parameters.a", lambda spec: spec.parameters[0].range.upper),
        ("initial.y", lambda spec: spec.initial[0].lower),
        ("measurement.quantizer.y.step", lambda spec: spec.measurement.quantizers[0].step),
        ("actuator.limit", lambda spec: spec.actuator.limit),
        ("sampling.period", lambda spec: spec.sampling.period),
        ("performance.rho.t_s", lambda spec: spec.performance.rho[1].t_s),
        ("performance.rho.v.t_s", lambda spec: spec.performance.rho[1].t_s),
        ("measurement.noise.v", lambda spec: spec.measurement.noise[1]),
        ("synthesis.p.v", lambda spec: spec.synthesis.p[1]),
        ("synthesis.gains.v.k", lambda spec: spec.synthesis.gains[1].k),
    ],
)
def test_a_number_is_set_wherever_the_file_may_have_one(path, read):
    spec = with_value(path, "0.125")
    assert read(spec).text == "0.125"
    assert path in numeric_paths(spec)


def test_a_value_of_one_state_leaves_the_others():
    spec = with_value("measurement.noise.v", "0.125")
    assert [noise.text for noise in spec.measurement.noise] == ["0", "0.125"]
    spec = with_value("performance.rho.v.t_s", "0.125")
    assert [rho.t_s.text for rho in spec.performance.rho] == ["1", "0.125"]


def test_paths_without_numbers_are_not_listed():
    paths = numeric_paths(load_text(SMALL, "small.yaml"))
    assert not {"name", "synthesis.method", "performance", "parameters.b"} & set(paths)
