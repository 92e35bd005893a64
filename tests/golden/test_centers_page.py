"""docs/centers.md: its rows are made again, and its text is what the script writes."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "centers.md").read_text(encoding="utf-8")
EVERY = os.environ.get("BFPPC_TESTS") == "all"
# Three digits of what the search finds: its last one may differ between processors.
LAST_DIGIT = 0.011


def script():
    """The script of ``make centers``; a dataclass looks its module up by name."""
    path = ROOT / "benchmarks" / "compare_centers.py"
    spec = importlib.util.spec_from_file_location("compare_centers", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


SCRIPT = script()
LINES = [line for line in PAGE.splitlines() if line.startswith("| ") and "| U" not in line]
CELLS = [line.strip("|").strip().split(" | ") for line in LINES]
SAMPLE = SCRIPT.ROWS.index(SCRIPT.Example(name="paper_example_2", model=SCRIPT.UNCERTAIN))


def examples():
    return [cells for cells in CELLS if len(cells) == 7]


def test_the_page_is_what_the_script_writes_around_its_rows():
    count = sum(isinstance(row, SCRIPT.Example) for row in SCRIPT.ROWS)
    first, second = (
        "".join(f"{line}\n" for line in part) for part in (LINES[:count], LINES[count:])
    )
    assert SCRIPT.HEAD + first + SCRIPT.MIDDLE + second == PAGE
    assert len(LINES) == len(SCRIPT.ROWS)


@pytest.mark.parametrize("index", range(len(SCRIPT.ROWS)) if EVERY else [SAMPLE])
def test_a_row_is_made_again(index):
    made = SCRIPT.ROWS[index].cells()
    assert len(made) == len(CELLS[index])
    assert list(made[:2]) == CELLS[index][:2]
    for cell, again in zip(CELLS[index][2:], made[2:], strict=True):
        assert float(cell) == pytest.approx(float(again), rel=LAST_DIGIT)
        assert float(cell) > 0.0


def test_all_six_examples_are_there_with_both_models():
    assert len(SCRIPT.COEFFICIENTS) == 6
    assert {(cells[0], cells[1]) for cells in examples()} == {
        (name, model) for name in SCRIPT.COEFFICIENTS for model in (SCRIPT.EXACT, SCRIPT.UNCERTAIN)
    }


def test_center_nominal_asks_for_less_everywhere():
    assert all(float(cells[3]) < float(cells[2]) for cells in examples())
    # Two to two hundred times less: no plant of the table is a coincidence.
    ratios = [float(cells[2]) / float(cells[3]) for cells in examples()]
    assert min(ratios) > 2.0
    assert max(ratios) > 150.0


def test_an_error_of_the_model_costs_tube_and_a_known_model_less():
    known = {cells[0]: cells for cells in examples() if cells[1] == SCRIPT.EXACT}
    for cells in examples():
        if cells[1] == SCRIPT.UNCERTAIN:
            assert float(cells[3]) > float(known[cells[0]][3])
            assert float(cells[5]) > float(known[cells[0]][5])


def test_what_the_split_adds_up_to_is_the_peak_input():
    for row, cells in zip(SCRIPT.ROWS, CELLS, strict=True):
        at = 3 if isinstance(row, SCRIPT.Example) else 2
        whole, feedforward, tube = map(float, cells[at : at + 3])
        assert feedforward + tube == pytest.approx(whole, rel=LAST_DIGIT)
