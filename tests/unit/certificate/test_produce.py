"""The untrusted side: what it writes is proved or says plainly why not."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest

from bfppc_synth.certificate import checker, produce
from bfppc_synth.errors import NotCertifiedError
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.shapes import Shape


def document(**plant: Any) -> dict[str, Any]:
    return {"format": checker.PLANT_FORMAT, "plant_sha256": "ab" * 32, "plant": plant}


EXAMPLE_1 = document(
    name="paper_example_1",
    states=["x1", "x2"],
    dynamics={"x1": {"f": "x1**2 - sin(x1)", "f_bound": "x1**2 + 1"}, "x2": {"f": "x1*x2**2"}},
    initial={"x1": "1", "x2": "0"},
    performance={"accuracy": "0.15"},
)


def linear(*gains: float) -> tuple[Shape, ...]:
    return tuple(Shape(k=k, M=0.0, epsilon=1.0, c=0.0, N=3) for k in gains)


def certificate(*gains: float) -> dict[str, Any]:
    return produce.produce_certificate(EXAMPLE_1, linear(*gains), (0.15, 2.0), tool="test 1")


def test_a_proved_design_is_certified_and_requires_nothing_more() -> None:
    answer = produce.judge(EXAMPLE_1, certificate(40.0, 300.0))
    assert answer.verdict is Verdict.CERTIFIED
    assert answer.failures == ()
    assert len(answer.assumptions) >= 4
    answer.require()


def test_a_design_that_fails_says_which_inequality_and_by_how_much() -> None:
    answer = produce.judge(EXAMPLE_1, certificate(40.0, 253.0))
    assert answer.verdict is Verdict.REFUTED
    with pytest.raises(NotCertifiedError, match=r"U2\[x2\]"):
        answer.require()
    failed = [entry for entry in answer.inequalities if not entry.holds]
    assert [entry.id for entry in failed] == ["U2[x2]"]
    assert failed[0].margin < 0.0
    # F_2* = 506.5 and p_2 = 2: 253.25 is just too little.
    assert produce.judge(EXAMPLE_1, certificate(40.0, 253.26)).verdict is Verdict.CERTIFIED


def test_the_inequalities_carry_the_ids_and_equations_of_the_report() -> None:
    answer = produce.judge(EXAMPLE_1, certificate(40.0, 300.0))
    assert [(entry.id, entry.equation) for entry in answer.inequalities] == [
        ("U0[x1]", "Theorem U"),
        ("U1[x1]", "(65)"),
        ("U0[x2]", "Theorem U"),
        ("U2[x2]", "(71)"),
        ("U2.room[x2]", "(71)"),
    ]
    assert [entry.id for entry in answer.assumption_checks] == [
        "f_bound[x1]",
        "g_min[x1]",
        "g_min[x2]",
    ]
    assert all(entry.holds for entry in (*answer.inequalities, *answer.assumption_checks))


def test_the_document_has_no_decimal_number_and_equal_bytes_each_time() -> None:
    text = produce.judge(EXAMPLE_1, certificate(40.0, 300.0)).document
    assert text == produce.judge(EXAMPLE_1, certificate(40.0, 300.0)).document
    json.loads(text, parse_float=lambda number: pytest.fail(f"the decimal {number}"))
    assert not re.search(r"NaN|Infinity", text)
    assert len(text) < 20_000


def test_a_bound_that_breaks_down_leaves_no_document() -> None:
    plant = json.loads(json.dumps(EXAMPLE_1))
    plant["plant"]["dynamics"]["x2"] = {"f": "1/x1"}
    made = produce.produce_certificate(plant, linear(40.0, 300.0), (0.15, 2.0), tool="test")
    answer = produce.judge(plant, made)
    assert answer.verdict is Verdict.UNDECIDED
    assert answer.document == ""
    assert "reachable box of x2" in answer.failures[0]


def test_a_plant_that_the_checker_has_no_theorem_for_is_not_certified() -> None:
    plant = json.loads(json.dumps(EXAMPLE_1))
    plant["plant"]["synthesis"] = {"bounds": "tight"}
    made = produce.produce_certificate(plant, linear(40.0, 300.0), (0.15, 2.0), tool="test")
    answer = produce.judge(plant, made)
    assert answer.verdict is Verdict.UNDECIDED
    assert "tight" in answer.failures[0]


def test_the_other_form_of_the_last_inequality_is_taken_where_only_it_holds() -> None:
    plant = document(
        name="held",
        states=["x1"],
        dynamics={"x1": {"f": "0.1*x1"}},
        initial={"x1": "0.5"},
        performance={"accuracy": "0.25"},
        sampling={"period": "0.05"},
    )
    shape = Shape(k=1.4, M=0.0, epsilon=1.0, c=0.0, N=3)
    answer = produce.judge(
        plant, produce.produce_certificate(plant, (shape,), (0.25,), tool="test")
    )
    forms = {entry.id for entry in answer.inequalities}
    assert answer.verdict is Verdict.CERTIFIED
    assert forms == {"U0[x1]", "U2'[x1]", "U2'.room[x1]"}


def test_thin_margins_are_named() -> None:
    assert produce.thin_margins(produce.judge(EXAMPLE_1, certificate(40.0, 300.0))) == ()
    barely = produce.judge(EXAMPLE_1, certificate(40.0, 253.2500000003))
    assert produce.thin_margins(barely) == ("U2[x2]",)


@pytest.mark.parametrize("method", ["unified", "theorem2"])
def test_a_plant_of_order_four_is_proved(method: str) -> None:
    plant = document(
        name="order_four",
        parameters={"d": ["0.9", "1.1"]},
        states=["x1", "x2", "x3", "x4"],
        dynamics={
            "x1": {"f": "0"},
            "x2": {"f": "0.1*x1*sin(x2)", "f_bound": "0.1*Abs(x1*x2)"},
            "x3": {"f": "0.1*sin(x1*x2) + 0.2*tanh(x3)", "f_bound": "0.1 + 0.2*Abs(x3)"},
            "x4": {"f": "d*x4*cos(x1) + abs(x3)", "g": "2*d + sin(x2)/4", "g_min": "1.5"},
        },
        reference="0.1*sin(t) + 0.05*sin(sqrt(2)*t)",
        initial={"x1": "0.2", "x2": ["-0.1", "0.1"], "x3": "0", "x4": "0"},
        performance={"accuracy": "0.1"},
        synthesis={"method": method},
    )
    shapes = linear(30.0, 400.0, 6000.0, 90000.0)
    half_widths = (0.1, 1.2, 300.0, 2e6)
    made = produce.produce_certificate(plant, shapes, half_widths, tool="test")
    report = checker.check_documents(plant, made)
    named = {claim.id: claim.verdict for claim in report.claims}
    pointwise = [name for name in named if name.startswith(("f_bound", "g_min", "g_bound"))]
    assert all(named[name] == "proved" for name in pointwise)
    assert report.verdict in ("proved", "refuted")
