"""The audit as text: nothing wider than the page, nothing unsaid."""

from __future__ import annotations

import json

import pytest

from bfppc_synth.audit.audit import audit_plant
from bfppc_synth.audit.document import audit_document
from bfppc_synth.audit.records import Answer, Standing
from bfppc_synth.audit.table import WIDTH, audit_lines
from bfppc_synth.spec.load import load_spec

LONG = """
name: long_names
states: [angle_of_the_first_joint, speed_of_the_first_joint]
dynamics:
  angle_of_the_first_joint: {f: 0}
  speed_of_the_first_joint: {f: sin(angle_of_the_first_joint), g: 1 - angle_of_the_first_joint/4}
initial: {angle_of_the_first_joint: 0.5, speed_of_the_first_joint: 0}
performance: {accuracy: 0.2}
actuator: {limit: 3}
synthesis:
  gains: {angle_of_the_first_joint: {k: 10}, speed_of_the_first_joint: {k: 5}}
  p: {speed_of_the_first_joint: 1}
simulation: {horizon: 1, period: 0.01}
"""


@pytest.fixture
def audit(tmp_path):
    def make(text=LONG, *starts):
        path = tmp_path / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        return audit_plant(load_spec(path), starts, lambda _message: None)[0]

    return make


def test_long_names_stay_on_the_page(audit):
    lines = audit_lines(audit(LONG, {"angle_of_the_first_joint": 3.5}))
    assert max(map(len, lines)) <= WIDTH
    assert "U1[angle_of_the_first_joint] (65)" in lines


def test_a_limit_that_is_exceeded_is_a_row_without_a_remedy(audit):
    found = audit()
    row = next(row for row in found.rows if row.id.startswith("limit"))
    assert row.sound.lhs == 3.0
    assert row.sound.rhs > 3.0
    assert not row.sound.holds
    assert row.sound.remedies == ()
    assert row.path == "actuator.limit"
    assert found.answer is not Answer.PROVED


def test_a_derived_gain_that_is_positive_only_near_the_start_is_local(audit):
    found = next(entry for entry in audit().assumptions if entry.id.startswith("g["))
    assert found.local
    assert found.standing is Standing.UNBROKEN
    assert "it fails from angle_of_the_first_joint = 4" in found.detail


def test_a_bound_that_breaks_down_is_said_and_nothing_is_run(audit):
    text = LONG.replace("f: sin(angle_of_the_first_joint)", "f: 1/(2 - speed_of_the_first_joint)")
    found = audit(text)
    assert (found.rows, found.runs, found.sound.bounds) == ((), (), None)
    assert found.answer is Answer.NOT_PROVED
    lines = audit_lines(found)
    assert any("breaks down" in line for line in lines)
    assert lines[-1] == "verdict: NOT PROVED, and nothing could be simulated"


def test_the_object_is_json_whatever_the_numbers_are(audit):
    for text in (LONG, LONG.replace("  p: {speed_of_the_first_joint: 1}\n", "")):
        document = audit_document(audit(text))
        assert json.loads(json.dumps(document, allow_nan=False)) == document
