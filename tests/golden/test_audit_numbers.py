"""What the audit says of the paper's printed gains: docs/theory.md sections 7, 8 and 10."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bfppc_synth.audit.audit import audit_plant
from bfppc_synth.audit.document import audit_document
from bfppc_synth.audit.records import Answer, Standing
from bfppc_synth.spec.load import load_spec

ROOT = Path(__file__).parents[2]
EXAMPLE_1 = ROOT / "examples" / "paper_example_1_printed.yaml"
EXAMPLE_2 = ROOT / "examples" / "paper_example_2_printed.yaml"


def quiet(message):
    del message


def audited(path, *starts, horizon=None):
    spec = load_spec(path)
    if horizon is not None:
        spec = replace(spec, simulation=replace(spec.simulation, horizon=horizon))
    audit, _ = audit_plant(spec, starts, quiet)
    return audit


@pytest.fixture(scope="module")
def first():
    return audited(EXAMPLE_1, {"x1": 1.5}, {"x1": 2.0, "x2": 0.0})


@pytest.fixture(scope="module")
def second():
    return audited(EXAMPLE_2)


def row(audit, name):
    return next(row for row in audit.rows if name in row.id.split(" / "))


def assumption(audit, name):
    return next(entry for entry in audit.assumptions if entry.id == name)


def line_of(path, key):
    """Line and column at which the value of a key like ``gamma: 4`` stands."""
    for number, text in enumerate(path.read_text().splitlines(), start=1):
        if key in text and not text.lstrip().startswith("#"):
            return number, text.index(key) + len(key.partition(": ")[0]) + 3
    raise AssertionError(key)


def placed(audit, remedy):
    place = audit.spec.place(remedy.path)
    return place.line, place.column


def test_example_1_has_a_height_that_85_allows(first):
    side = row(first, "T1.H[x1]").printed
    assert side.holds
    assert (side.lhs, side.rhs) == (5.0, pytest.approx(3.21, rel=0.02))


def test_example_1_needs_a_gamma_of_24_against_4(first):
    side = row(first, "T1.gamma[x1]").printed
    assert not side.holds
    (remedy,) = side.remedies
    assert (remedy.symbol, remedy.have) == ("gamma_1", 4.0)
    assert remedy.need == pytest.approx(24.4, rel=0.02)
    assert placed(first, remedy) == line_of(EXAMPLE_1, "gamma: 4,")


def test_example_1_needs_a_c_0_that_its_p_2_leaves_no_room_for(first):
    found = row(first, "T1.c[x2]")
    assert not found.printed.holds
    assert not found.sound.holds
    for side, needed in ((found.printed, 346), (found.sound, 166)):
        remedy = side.remedies[0]
        assert (remedy.symbol, remedy.have) == ("c_0", 0.0)
        assert remedy.need == pytest.approx(needed, rel=0.02)
        assert placed(first, remedy) == line_of(EXAMPLE_1, "x2: 3.1")
        other = side.remedies[1]
        assert (other.symbol, other.have, other.need) == ("c_2", 1.5, 0.0)
    c_0 = assumption(first, "c_0")
    assert c_0.standing is Standing.FAILS
    assert "p_2 = 3.1" in c_0.detail


def test_example_1_needs_a_height_of_234_against_10(first):
    found = row(first, "T1.H[x2]")
    assert not found.printed.holds
    (remedy,) = found.printed.remedies
    assert (remedy.symbol, remedy.have) == ("H_2", 10.0)
    assert remedy.need == pytest.approx(234, rel=0.02)
    # With the text's own margin delta_0 it is 228.
    (note,) = found.notes
    assert float(note.rpartition(": ")[2]) == pytest.approx(228, rel=0.02)


def test_example_1_is_wide_enough_for_its_measurement(first):
    assert assumption(first, "accuracy").standing is Standing.HOLDS
    assert assumption(first, "accuracy").detail == "0.15 > 0.1"
    assert assumption(first, "f_bound[x1]").standing in (Standing.PROVED, Standing.UNBROKEN)


def test_example_1_is_held_from_its_start_and_broken_from_further_out(first):
    held, *broken = first.runs
    assert held.declared
    assert held.held
    assert held.answer(first.sound.certificate) is Answer.HELD
    assert held.max_abs_e[0] == pytest.approx(0.084, abs=0.002)
    assert held.max_abs_u == pytest.approx(29, rel=0.02)
    for run, reached in zip(broken, (0.166, 0.463), strict=True):
        assert not run.declared
        assert run.answer(first.sound.certificate) is Answer.BROKEN
        assert run.escape.error == 1
        assert run.escape.bound == 0.15
        assert run.escape.reached == pytest.approx(reached, rel=0.02)
        assert 0.0 < run.escape.time < 1.0
    assert not first.proved
    assert first.answer is Answer.BROKEN


def test_example_2_has_the_papers_loads(second):
    F_star = second.printed.bounds.F_star
    assert F_star[0] == pytest.approx(10.41442, rel=1e-6)
    assert F_star[1] == pytest.approx(12_332.5, rel=1e-3)
    assert second.printed.holds


def test_example_2_needs_the_m_that_it_has(second):
    side = row(second, "T2[x1]").printed
    assert side.holds
    (remedy,) = side.remedies
    assert (remedy.symbol, remedy.have) == ("M_1", 13.31441)
    assert remedy.need == pytest.approx(13.314, rel=1e-3)
    assert 13.3144 < remedy.need <= 13.31441
    assert placed(second, remedy) == line_of(EXAMPLE_2, "M: 13.31441")


def test_what_example_2_leaves_open_is_solved_for_and_named(second):
    assert second.completion.filled == ("synthesis.gains.x2.M",)
    assert second.completion.zeroed == ("synthesis.gains.x2.c",)
    gain = second.completion.candidate.gains[1]
    assert (gain.k, gain.epsilon, gain.c, gain.N) == (2.0, 0.5, 0.0, 5)
    assert pytest.approx(12_330, rel=1e-3) == gain.M


def test_example_2_has_tubes_in_order_but_no_tube_that_contains_the_jump(second):
    assert row(second, "T3.order1[x1]").printed.holds
    assert row(second, "T3.order1[x2]").printed.holds
    contained = row(second, "T3.handover1[x2]").sound
    assert not contained.holds
    assert contained.lhs == 2.0
    assert contained.rhs > 4.69
    assert contained.remedies[0].need == pytest.approx(contained.rhs, rel=1e-6)
    assert any("reanchor" in note and "another law, holds" in note for note in second.notes)


def test_the_widened_tube_of_a_free_stage_is_placed_at_its_own_p(second):
    found = row(second, "T3.stage1[x2]")
    assert found.printed is None
    assert found.sound.holds
    place = second.spec.place(found.path)
    assert (place.line, place.column) == line_of(EXAMPLE_2, "x2: 1}")


def test_assumption_3_is_only_local_in_example_2(second):
    entry = assumption(second, "g_min[x1]")
    assert entry.local
    assert entry.standing in (Standing.PROVED, Standing.UNBROKEN)
    assert "Assumption 3 holds only locally (on Omega)" in entry.detail
    assert "g_1 is 0 at x1 = 2.171" in entry.detail
    assert "fails from x1 = 1.772 on" in entry.detail
    others = [one for one in second.assumptions if one.id != "g_min[x1]"]
    assert not any(one.local for one in others)


def test_example_2_stays_in_its_first_stage(second):
    (run,) = second.runs
    assert run.held
    (stage,) = run.stages
    assert stage.stage == 1
    assert stage.max_abs_e[0] == pytest.approx(0.031, abs=5e-4)
    assert stage.max_abs_e[1] == pytest.approx(0.613, abs=5e-4)
    assert run.max_abs_u == pytest.approx(1.09, rel=0.005)
    assert second.answer is Answer.HELD


@pytest.mark.parametrize(("start", "reached"), [({"x2": 2.0}, 4.69), ({"x1": 0.9}, 5.3)])
def test_example_2_jumps_out_of_its_second_tube_at_the_switch(start, reached):
    run = audited(EXAMPLE_2, start, horizon=0.1).runs[1]
    assert [stage.stage for stage in run.stages] == [1, 2]
    assert run.stages[0].max_abs_e[1] == pytest.approx(1.0, rel=1e-6)
    assert run.escape.jump
    assert (run.escape.error, run.escape.stage, run.escape.bound) == (2, 2, 2.0)
    assert run.escape.reached == pytest.approx(reached, rel=0.02)


def test_the_object_names_every_inequality_with_both_sides_and_its_place(first):
    document = audit_document(first)
    assert document["format"] == "bfppc-synth/check/1"
    for entry in document["inequalities"]:
        assert entry["place"]["line"] > 1
        for form in ("printed", "sound"):
            side = entry[form]
            assert side["margin"] == pytest.approx(side["lhs"] - side["rhs"])
            assert side["would_satisfy"]
