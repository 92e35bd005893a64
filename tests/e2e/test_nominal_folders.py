"""Center nominal measured with an error, sampled, late, from boxes: folders that are proved."""

from __future__ import annotations

import importlib.util
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from bfppc_synth.cli import main
from bfppc_synth.synthesis.synthesize import restore

ROOT = Path(__file__).parents[2]
EVERY = os.environ.get("BFPPC_TESTS") == "all"
# A limit on the peak input for each condition of docs/centers.md; the first two are asked for.
TARGETS = {
    "resolution (1e-4, 1e-3, 1e-3), every 0.1 ms": 15.0,
    "resolution (1e-4, 1e-3, 1e-3), every 0.5 ms": 24.0,
    "the same, every 0.1 ms, commands up to 0.1 ms late": 15.0,
    "exact, every 0.1 ms, commands up to 0.1 ms late": 13.0,
    "exact, every 1 ms, commands up to 1 ms late": 1.2,
    "exact, continuous": 14.0,
    "exact, continuous, a box of starts": 14.0,
    "a box of starts, resolution and 0.1 ms as above": 15.0,
}
SAMPLE = "a box of starts, resolution and 0.1 ms as above"
SIMULATED = "simulation: {horizon: 0.02, period: 0.00002, seed: 1}\n"
MEGABYTE = 1_000_000


def script():
    """The script of ``make centers``; a dataclass looks its module up by name."""
    path = ROOT / "benchmarks" / "compare_centers.py"
    spec = importlib.util.spec_from_file_location("compare_centers", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


SCRIPT = script()


@pytest.fixture(scope="module", params=[*TARGETS] if EVERY else [SAMPLE])
def made(request, tmp_path_factory):
    base = tmp_path_factory.mktemp("condition")
    plant = base / "plant.yaml"
    plant.write_text(SCRIPT.Condition(conditions=request.param).text() + SIMULATED, "utf-8")
    folder = base / "out"
    assert main([str(plant), "--out", str(folder), "--json"]) == 0
    return request.param, folder, json.loads((folder / "report.json").read_text("utf-8"))


def test_every_condition_has_a_limit():
    assert set(TARGETS) == set(SCRIPT.CONDITIONS)


def test_the_folder_is_certified_below_its_limit(made):
    condition, folder, report = made
    assert (report["status"], report["center"]) == ("certified", "nominal")
    assert report["bounds"]["U"] <= TARGETS[condition]
    assert report["failures"] == []
    assert all(entry["holds"] for entry in report["inequalities"])
    assert (folder / "certificate.json").stat().st_size < MEGABYTE


def test_python_alone_proves_it(made):
    _, folder, _ = made
    command = [sys.executable, "-I", "-S", "verify.py", "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    answer = json.loads(done.stdout)
    assert answer["verdict"] == "proved"
    assert all(claim["verdict"] == "proved" for claim in answer["claims"])


def test_its_adversaries_stay_inside(made):
    _, _, report = made
    simulation = report["simulation"]
    assert simulation["within_bounds"]
    assert simulation["adversaries"]["within_bounds"]
    assert simulation["adversaries"]["max_abs_u"] <= report["bounds"]["U"]


def test_the_same_gains_are_proved_for_about_the_largest_period_and_not_for_twice_that(made):
    condition, folder, report = made
    longest = report["sampling"]["largest_certified_period"]
    asked = re.search(r"every (\S+) ms|and (\S+) ms", condition)
    if asked is not None:
        assert longest >= 1e-3 * float(asked[1] or asked[2])
    assert longest > 0.0
    design = restore(folder)
    proved = SCRIPT.longest_proved(design)
    # What is reported is found in binary64 numbers: the checker's own bounds are a little wider.
    assert 0.9 * longest < proved <= longest
    assert not SCRIPT.proved(design, 2.0 * longest)
