"""Every generated controller attacked by a loop that shares no code with the package."""

from __future__ import annotations

import ast
import importlib.util
import os
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
SCRIPT_PATH = ROOT / "benchmarks" / "attack_from_outside.py"
PAGE = (ROOT / "docs" / "conservatism.md").read_text(encoding="utf-8")
EVERY = os.environ.get("BFPPC_TESTS") == "all"
FOLDERS = sorted(path for path in (ROOT / "generated").iterdir() if path.is_dir())
NAMES = [path.name for path in FOLDERS]
PAPER = ("paper_example_1", "paper_example_2")
# Steps a run: the first part of a run is where the center moves most.
STEPS = 600


def script():
    """The script of ``make conservatism``; a dataclass looks its module up by name."""
    spec = importlib.util.spec_from_file_location("attack_from_outside", SCRIPT_PATH)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


SCRIPT = script()
CELLS = {
    cells[0]: cells[1:]
    for cells in (
        line.strip("|").strip().split(" | ")
        for line in PAGE.splitlines()
        if line.startswith("| ") and not line.startswith("| example")
    )
}


def test_the_script_imports_nothing_of_the_package():
    tree = ast.parse(SCRIPT_PATH.read_text(encoding="utf-8"))
    imported = {
        name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in (
            [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else [item.name for item in node.names]
        )
    }
    assert not [name for name in imported if name.startswith("bfppc")]
    assert "bfppc_synth" not in "".join(sorted(imported))


@pytest.mark.parametrize("name", NAMES)
def test_nobody_leaves_the_tube_of_certified_gains(name):
    folder = ROOT / "generated" / name
    steps = None if EVERY else STEPS
    found = SCRIPT.attack(folder, factors=(1.0,), repeats=1, steps=steps)
    assert found.shares[1.0].max() <= 1.0
    # They do try, and the errors are those of a run that moves.
    assert found.shares[1.0].max() > (0.0 if found.pushed == "nothing" else 1e-3)


def leaves_at(name):
    return float(CELLS[name][3]), float(CELLS[name][4])


@pytest.mark.parametrize("name", PAPER)
def test_weakened_gains_of_the_papers_examples_lose_the_tube(name):
    largest, _ = leaves_at(name)
    assert largest >= 0.5
    factor = largest if EVERY else 0.3
    folder = ROOT / "generated" / name
    found = SCRIPT.attack(folder, factors=(factor,), repeats=2)
    assert found.shares[factor].max() > 1.0


def test_the_page_is_the_scripts_and_names_only_generated_folders():
    assert {*PAPER, "compressor_surge", "motor_arm_nominal"} <= set(CELLS) <= set(NAMES)
    rows = [line for line in PAGE.splitlines() if line.startswith("| ")][1:]
    assert SCRIPT.HEAD + "".join(f"{line}\n" for line in rows) == PAGE
    for cells in CELLS.values():
        for factor in cells[3:]:
            assert factor.startswith("none down to") or float(factor) in SCRIPT.FACTORS


@pytest.mark.parametrize("name", sorted(CELLS) if EVERY else ["compressor_surge"])
def test_a_row_of_the_page_is_made_again(name):
    found = SCRIPT.attack(ROOT / "generated" / name)
    assert SCRIPT.line(found).strip().strip("|").strip().split(" | ")[1:] == CELLS[name]


def test_a_certified_design_that_were_lost_would_stop_the_page():
    lost = SCRIPT.Found(
        name="x", pushed="", step=0.1, runs=1, shares={1.0: np.array([1.1]), 0.5: np.array([2.0])}
    )
    with pytest.raises(SystemExit, match="lost the tube"):
        SCRIPT.line(lost)
