"""The bare law's runs: what they are held against, when and by how much they leave it."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from bfppc_synth.audit.audit import audit_plant
from bfppc_synth.audit.records import Answer
from bfppc_synth.audit.runs import Limits, bare, full_start, limits_of, run_from
from bfppc_synth.errors import UsageError
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

PLANT = """
name: runs
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2}
initial: {x1: [0.9, 1.1], x2: 0}
performance: {accuracy: 0.15}
synthesis: {gains: {x1: {k: 40, M: 0, c: 0}, x2: {k: 20000, M: 0, c: 0}}, p: {x2: 0.05}}
simulation: {horizon: 1, period: 0.002}
"""


@pytest.fixture
def read(tmp_path):
    def load(text=PLANT):
        path = tmp_path / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        return load_spec(path)

    return load


def test_a_start_is_filled_up_with_the_middle_of_the_file(read):
    spec = read()
    assert full_start(spec, {}) == (1.0, 0.0)
    assert full_start(spec, {"x2": 0.25}) == (1.0, 0.25)
    with pytest.raises(UsageError, match="x9"):
        full_start(spec, {"x9": 1.0})


def test_a_run_is_held_against_its_tube_and_its_peak(read):
    design = synthesize(read())
    limits = Limits(widths=(design.omega,), peak=design.bounds.U)
    report, run = run_from(design, (1.0, 0.0), limits)
    assert report.held
    assert report.declared
    narrow = Limits(widths=((0.15, report.max_abs_e[1] / 2),), peak=design.bounds.U)
    escape = run_from(design, (1.0, 0.0), narrow)[0].escape
    assert (escape.error, escape.stage, escape.jump) == (2, None, False)
    rows = abs(run.e[:, 1]) > escape.bound
    assert escape.time == run.t[rows.argmax()]
    assert escape.reached == report.max_abs_e[1]
    weak = Limits(widths=(design.omega,), peak=report.max_abs_u / 2)
    escape = run_from(design, (1.0, 0.0), weak)[0].escape
    assert (escape.error, escape.bound) == (0, report.max_abs_u / 2)
    assert escape.reached == report.max_abs_u


def test_a_start_beyond_the_declared_ones_is_said_to_be(read):
    design = synthesize(read())
    limits = Limits(widths=(design.omega,), peak=design.bounds.U)
    for start, declared in (((1.1, 0.0), True), ((1.11, 0.0), False), ((1.0, 0.1), False)):
        report, _ = run_from(design, start, limits)
        assert report.declared is declared
        assert report.answer(design.certificate) is (Answer.PROVED if declared else Answer.HELD)
        assert report.answer(None) is Answer.HELD


def test_nothing_clamps_the_bare_law(read):
    design = synthesize(read())
    tight = replace(design, bounds=replace(design.bounds, U=1.0))
    limits = Limits(widths=(design.omega,), peak=math.inf)
    report, run = run_from(tight, (1.0, 0.0), limits)
    assert report.held
    assert report.max_abs_u > 2.0
    assert set(run.status) == {0}
    assert bare(tight).certificate.document == ""


def test_a_half_width_that_is_nobodys_choice_breaks_nothing(read):
    text = PLANT.replace(", p: {x2: 0.05}", "").replace("k: 40", "k: 3").replace("k: 20000", "k: 5")
    spec = read(text)
    audit, runs = audit_plant(spec, ({"x2": 50.0},), lambda _message: None)
    design = runs[0][0]
    limits = limits_of(design, audit.completion)
    assert limits == Limits(widths=((0.15, math.inf),), peak=math.inf)
    assert all(run.escape is None or run.escape.error == 1 for run in audit.runs)
    assert [run.peak_input for run in audit.runs] == [math.inf, math.inf]


def test_a_run_that_diverges_is_broken(read):
    text = PLANT.replace("k: 20000", "k: 0.001")
    audit, _ = audit_plant(read(text), ({"x1": 30.0},), lambda _message: None)
    assert audit.runs[1].diverged
    assert audit.answer is Answer.BROKEN
