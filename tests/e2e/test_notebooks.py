"""The notebooks of examples/ are executed, small, and say what they said when they were made."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))
EVERY = os.environ.get("BFPPC_TESTS") == "all"
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
# Executed in a process of its own: a kernel's threads and warnings stay there.
EXECUTE = """
import sys, nbformat
from nbclient import NotebookClient
book = nbformat.read(sys.argv[1], as_version=4)
NotebookClient(book, timeout=600).execute()
nbformat.write(book, "executed.ipynb")
"""


def name(path):
    return path.stem


def code(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


def printed(path):
    """Return what every cell printed; pictures are left out."""
    return "".join(
        "".join(output["text"])
        for cell in code(path)
        for output in cell["outputs"]
        if output["output_type"] == "stream" and output["name"] == "stdout"
    )


def test_there_are_two():
    assert len(NOTEBOOKS) == 2


@pytest.mark.parametrize("path", NOTEBOOKS, ids=name)
def test_every_cell_has_been_executed_in_order_without_an_error(path):
    cells = code(path)
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    kinds = {output["output_type"] for cell in cells for output in cell["outputs"]}
    assert kinds >= {"stream", "display_data"}
    assert "error" not in kinds
    assert not [o for cell in cells for o in cell["outputs"] if o.get("name") == "stderr"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=name)
def test_it_is_small_and_names_no_machine(path):
    text = path.read_text(encoding="utf-8")
    assert len(text) < 100_000
    assert not re.search(r"/(?:home|root|work|tmp|Users)/", text)


# A kernel and two to five syntheses each: with BFPPC_TESTS=all only.
if EVERY:

    @pytest.mark.parametrize("path", NOTEBOOKS, ids=name)
    def test_it_runs_again_and_prints_the_same(path, tmp_path):
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-c", EXECUTE, str(path)]
        subprocess.run(command, cwd=tmp_path, env=environment, check=True, timeout=900)
        before, after = printed(path), printed(tmp_path / "executed.ipynb")
        assert NUMBER.split(before) == NUMBER.split(after)
        for old, new in zip(NUMBER.findall(before), NUMBER.findall(after), strict=True):
            assert math.isclose(float(old), float(new), rel_tol=2e-3)
