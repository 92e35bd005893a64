"""The code section of the report: counts, slope product, digits lost."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import pytest

from bfppc_synth.codegen.cost import step_cost
from bfppc_synth.codegen.law import build_law
from bfppc_synth.model.cost import StepCost
from bfppc_synth.report.code import code_entry

PLACE = Path(__file__).parents[1] / "codegen" / "handmade.py"


@pytest.fixture(scope="module")
def design():
    found = importlib.util.spec_from_file_location("handmade_for_report", PLACE)
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module.everyday()


def test_the_section_says_what_a_step_computes(design):
    cost = step_cost(build_law(design))
    entry = code_entry(design, cost)["code"]
    assert entry["operations"]["functions"] == {"cos": 1, "tanh": 2}
    assert entry["operations"]["multiplications"] == cost.multiplications


@pytest.mark.parametrize(("peak", "digits"), [(20.0, 2.0), (1e5, 0.0)])
def test_digits_lost_are_the_slopes_over_the_ranges(design, peak, digits):
    bounds = replace(design.bounds, L=(10.0, 100.0), X=(2.0, 3.0), U=peak)
    made = replace(design, bounds=bounds)
    entry = code_entry(made, step_cost(build_law(design)))["code"]
    assert entry["slope_product"] == 1000.0
    assert entry["digits_lost"] == pytest.approx(digits)


def test_without_counts_there_is_no_section(design):
    assert code_entry(design, None) == {}


def test_counts_are_said_in_words():
    cost = StepCost(
        additions=2,
        multiplications=1,
        divisions=0,
        choices=1,
        functions=(("cos", 1), ("tanh", 2)),
        remembered=5,
    )
    said = "2 additions, 1 multiplication, 1 comparison, 1 call of cos and 2 calls of tanh"
    assert cost.words() == said
