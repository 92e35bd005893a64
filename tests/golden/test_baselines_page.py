"""docs/baselines.md: its rows are made again, and its text is what the script writes."""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "baselines.md").read_text(encoding="utf-8")
# A last digit decides on which side of a level a sample falls: other processors, other pairs.
FEW = 8
EVERY = os.environ.get("BFPPC_TESTS") == "all"


def script():
    """The script of ``make baselines``; a dataclass looks its module up by name."""
    path = ROOT / "benchmarks" / "compare_baselines.py"
    spec = importlib.util.spec_from_file_location("compare_baselines", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


SCRIPT = script()
PAIRS = [
    line for line in PAGE[: PAGE.index("A tuned barrier")].splitlines() if line.startswith("| 0")
] + [line for line in PAGE[: PAGE.index("A tuned barrier")].splitlines() if line.startswith("| 1")]
SECTIONS = {
    part.partition("\n")[0]: part
    for part in PAGE[: PAGE.index("## Operations of one step")].split("\n### ")[1:]
}


def cells(line):
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def rows_of(title):
    lines = [line for line in SECTIONS[title].splitlines() if line.startswith("| ")][1:]
    return {row[0]: row[1:] for row in map(cells, lines)}


def page_of(pairs):
    """The committed row of one set of pairs."""
    key = [f"{pairs.low:g} to {pairs.high:g}", f"{pairs.step:g}", f"{pairs.width:g}"]
    key.append(f"{pairs.period:g}")
    (found,) = [line for line in PAIRS if cells(line)[:4] == key]
    return found


def test_under_a_quantizer_the_barrier_fails_for_most_pairs_and_the_linear_law_for_none():
    chief = SCRIPT.ROWS[0]
    assert (chief.step, chief.width, SCRIPT.PAIRS) == (0.1, 3.1, 400)
    barrier, _, linear, diverged, _ = map(int, cells(page_of(chief))[4:])
    assert barrier > 200
    assert (linear, diverged) == (0, 0)
    # And without the quantizer for few: the gains are not what fails.
    exact, *_ = map(int, cells(page_of(SCRIPT.ROWS[1]))[4:])
    assert exact < 100
    # The linear law has a value in every row.
    assert all(cells(page_of(row))[6] == "0" for row in SCRIPT.ROWS)


@pytest.mark.parametrize("index", range(len(SCRIPT.ROWS)) if EVERY else [0])
def test_a_row_of_pairs_is_made_again(index):
    made, known = cells(SCRIPT.ROWS[index].line()), cells(page_of(SCRIPT.ROWS[index]))
    assert made[:4] == known[:4]
    for again, before in zip(made[4:], known[4:], strict=True):
        assert abs(int(again) - int(before)) <= FEW


def test_the_operations_are_counted_again():
    assert PAGE.endswith(SCRIPT.COSTS + SCRIPT.operations())


def test_the_page_is_what_the_script_writes_around_its_rows():
    assert PAGE.startswith(SCRIPT.HEAD)
    assert SCRIPT.TUNED.format(budget=SCRIPT.CompareOptions().budget) in PAGE
    assert list(SECTIONS) == [SCRIPT.QUANTIZED, *SCRIPT.EXAMPLES]
    assert len(PAIRS) == len(SCRIPT.ROWS)


@pytest.mark.parametrize("title", [SCRIPT.QUANTIZED, *SCRIPT.EXAMPLES])
def test_every_method_has_a_row_and_the_certified_one_is_inside(title):
    rows = rows_of(title)
    assert len(rows) == 6
    inside, runs = next(iter(rows.values()))[0].split(" of ")
    assert inside == runs


@pytest.mark.parametrize("title", [SCRIPT.QUANTIZED, *SCRIPT.EXAMPLES])
def test_a_wide_funnel_survives(title):
    row = rows_of(title)["Bechlioulis-Rovithakis PPC, wide funnels"]
    assert row[1:3] == ["0", "0"]


@pytest.mark.parametrize("title", [*SCRIPT.EXAMPLES] if EVERY else ["compressor_surge"])
def test_a_comparison_is_made_again(title):
    design = SCRIPT.restore(ROOT / "generated" / title)
    horizon = SCRIPT.EXAMPLES[title]
    made = SCRIPT.table(SCRIPT.compared(design, horizon if EVERY else 0.2))
    if EVERY:
        assert f"{title}\n{made}".strip() == SECTIONS[title].strip()
    # A shorter horizon gives other numbers and the same rows, ranges and words.
    lines = [line for line in made.splitlines() if line.startswith("| ")][1:]
    assert [cells(line)[0] for line in lines] == list(rows_of(title))
