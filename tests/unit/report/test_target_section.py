"""What a target measured, or why nothing was: report.json, page and README."""

from __future__ import annotations

import dataclasses

import pytest

from bfppc_synth.model.cost import StepCost
from bfppc_synth.model.target import NotMeasured, TargetCost
from bfppc_synth.report.render import render_html, render_readme
from bfppc_synth.report.tables import report_document

COUNTED = StepCost(
    additions=2, multiplications=1, divisions=0, choices=1, functions=(), remembered=5
)
MEASURED = TargetCost(
    compiler="gcc <1>",
    emulator="QEMU 2",
    least=101,
    average=102,
    most=103,
    stack=104,
    code=105,
    state=106,
)
MISSING = NotMeasured(reason="<x> is not on PATH")
KEYS = ["processor", "compiler", "emulator", "instructions"]
KEYS += ["stack_bytes", "code_bytes", "state_bytes", "not_measured"]


def entry(design, run, *target):
    given = {"target": target[0]} if target else {}
    return report_document(design, run, (), cost=COUNTED, **given)["code"]["target"]


def pages(design, run, target):
    document = report_document(design, run, (), cost=COUNTED, target=target)
    return render_html(document, design, run), render_readme(document)


def test_the_target_has_every_number(design, run):
    found = entry(design, run, MEASURED)
    assert list(found) == KEYS
    assert found["processor"] == "Cortex-M4F (QEMU mps2-an386)"
    assert [found["compiler"], found["emulator"]] == ["gcc <1>", "QEMU 2"]
    assert found["instructions"] == {"least": 101, "average": 102, "most": 103}
    assert [found[key] for key in KEYS[4:]] == [104, 105, 106, None]


@pytest.mark.parametrize(
    ("target", "reason"),
    [((MISSING,), "<x> is not on PATH"), ((), "no measurement was asked for")],
    ids=["failed", "not asked"],
)
def test_a_target_that_was_not_measured_has_the_same_keys(design, run, target, reason):
    found = entry(design, run, *target)
    assert list(found) == KEYS
    assert found["instructions"] == {"least": None, "average": None, "most": None}
    assert [found[key] for key in ("compiler", "emulator", *KEYS[4:7])] == [None] * 5
    assert found["not_measured"] == reason


def test_a_step_that_needs_no_stack_is_measured_all_the_same(design, run):
    leaf = dataclasses.replace(MEASURED, stack=0)
    assert entry(design, run, leaf)["stack_bytes"] == 0
    assert (
        'data-json-path="code.target.stack_bytes" data-value="0">0<' in pages(design, run, leaf)[0]
    )


def test_page_and_readme_show_what_was_measured(design, run):
    page, readme = pages(design, run, MEASURED)
    assert page.count("<table") == page.count("<caption") == page.count("</table>")
    assert "compiled by gcc &lt;1&gt; with -O2 and counted by QEMU 2" in page
    rows = {"instructions.least": 101, "instructions.average": 102, "instructions.most": 103}
    rows |= {"stack_bytes": 104, "code_bytes": 105, "state_bytes": 106}
    for key, number in rows.items():
        assert f'data-json-path="code.target.{key}" data-value="{number}"' in page
    assert "101 to 103 instructions (102 on average), 104 bytes of stack, 105 of code" in readme
    assert "ot measured" not in page + readme


def test_page_and_readme_say_why_nothing_was_measured(design, run):
    page, readme = pages(design, run, MISSING)
    said = "Not measured on a Cortex-M4F (QEMU mps2-an386): "
    assert f"{said}&lt;x&gt; is not on PATH. <code>make -C c target</code>" in page
    assert f"{said}<x> is not on PATH.\n" in readme
    assert "code.target" not in page
