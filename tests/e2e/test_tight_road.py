"""`bounds: tight`, from plant file to a folder that Python alone proves."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from bfppc_synth.cli import main

ROOT = Path(__file__).parents[2]
EVERY = os.environ.get("BFPPC_TESTS") == "all"
# The most that U may be; by termwise bounds it is 1,019, 12.25, 77.5 and 20.3.
TARGETS = {
    "examples/paper_example_2": 760.0,
    "tests/plants/nominal_jerk": 12.2,
    "tests/plants/nominal_joint_shared": 60.0,
    "tests/plants/tight_boxes": 12.2,
}
CASES = [*TARGETS] if EVERY else [*TARGETS][:2]
GIVEN = """name: given
states: [x1]
dynamics:
  x1: {{f: '-4*x1 + 0.5*x1**2'}}
reference: sin(t)
initial: {{x1: 0}}
performance: {{accuracy: 0.1, rho: {{kind: cosine, t_s: 1}}}}
synthesis:
  center: performance
  bounds: {bounds}
  gains: {{x1: {{k: {k}, M: 0, epsilon: 1, c: 0, N: 3}}}}
"""


def page_reader():
    """The parser of test_report_page: every number on a page with its path."""
    place = ROOT / "tests" / "e2e" / "test_report_page.py"
    spec = importlib.util.spec_from_file_location("page_reader", place)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def tightened(text):
    """The plant file with `bounds: tight`."""
    if "bounds: tight" in text:
        return text
    text = text.replace("{center: nominal,", "{center: nominal, bounds: tight,")
    return text.replace("center: performance\n", "center: performance\n  bounds: tight\n")


@pytest.fixture(scope="module", params=CASES)
def made(request, tmp_path_factory):
    base = tmp_path_factory.mktemp("tight")
    plant, folder = base / "plant.yaml", base / "out"
    text = tightened((ROOT / f"{request.param}.yaml").read_text("utf-8"))
    plant.write_text(text, encoding="utf-8")
    assert main([str(plant), "--out", str(folder), "--json"]) == 0
    return request.param, folder, json.loads((folder / "report.json").read_text("utf-8"))


def test_the_plant_is_certified_at_or_below_its_termwise_design(made):
    name, _, report = made
    tight = report["tight"]
    assert report["status"] == "certified"
    assert report["bounds"]["U"] <= TARGETS[name]
    assert report["bounds"]["U"] <= tight["termwise_U"]
    assert report["failures"] == []
    for load, other in zip(tight["load"], tight["termwise_load"], strict=True):
        assert load <= other
    assert report["bounds"]["D"][-1] == tight["rate"]
    ids = {entry["id"] for entry in report["inequalities"]}
    assert {f"tight[{state}]" for state in report["states"]} <= ids


def test_adversaries_stay_inside_a_tight_design(made):
    _, _, report = made
    assert report["simulation"]["within_bounds"]
    assert report["simulation"]["adversaries"]["within_bounds"]
    assert report["simulation"]["adversaries"]["max_abs_u"] <= report["bounds"]["U"]


def test_python_alone_proves_the_folder_and_its_certificate_is_small(made):
    _, folder, _ = made
    done = subprocess.run(
        [sys.executable, "-I", "-S", "verify.py", "--json"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    answer = json.loads(done.stdout)
    assert (done.returncode, answer["verdict"]) == (0, "proved")
    tight = [claim for claim in answer["claims"] if claim["id"].startswith("tight")]
    assert tight
    assert all(claim["verdict"] == "proved" for claim in tight)
    assert (folder / "certificate.json").stat().st_size < 1_000_000


def test_the_page_shows_tight_against_termwise(made):
    _, folder, report = made
    reader = page_reader()
    text = (folder / "report.html").read_text("utf-8")
    paths = set()
    for path, full, _ in reader.Numbers(text).found:
        value = reader.resolve(report, path)
        paths.add(path)
        if isinstance(value, float):
            assert float(full) == value, path
    assert "Tight against termwise" in text
    assert {"tight.load[0]", "tight.termwise_load[0]", "tight.rate", "tight.termwise_U"} <= paths
    assert "\\" not in text


def test_the_folder_is_read_back_verified_simulated_and_not_exported(made, capsys):
    _, folder, report = made
    for command in ("verify", "simulate"):
        assert main([command, str(folder), "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert answer["format"].split("/")[1] in ("verification", "simulation")
    assert json.loads((folder / "report.json").read_text("utf-8")) == report
    assert main(["export", str(folder), "--to", "smt2"]) == 2
    assert "are not available in this version" in capsys.readouterr().err
    assert not (folder / "interop").exists()


def judged(tmp_path, capsys, *words, bounds, k):
    plant = tmp_path / "plant.yaml"
    plant.write_text(GIVEN.format(bounds=bounds, k=k), encoding="utf-8")
    code = main([*words, str(plant), *(() if words else ("--out", str(tmp_path / "out")))])
    captured = capsys.readouterr()
    return code, captured.out + captured.err


def test_gains_that_termwise_refuses_are_certified_tight(tmp_path, capsys):
    # Termwise |f| and |dr| add up to 6.0; at one and the same t they reach 5.10.
    assert judged(tmp_path, capsys, bounds="termwise", k=55)[0] == 4
    assert judged(tmp_path, capsys, bounds="tight", k=55)[0] == 0
    assert judged(tmp_path, capsys, bounds="tight", k=50)[0] == 4


def test_check_audits_given_gains_by_tight_bounds_and_says_so(tmp_path, capsys):
    code, text = judged(tmp_path, capsys, "check", bounds="tight", k=55)
    assert code == 0
    assert "bounds tight: F_i* is the supremum of the whole residual" in text
    code, text = judged(tmp_path, capsys, "check", bounds="termwise", k=55)
    assert code == 4
    assert "bounds termwise" in text


def test_tight_bounds_of_another_method_are_refused_at_their_place(tmp_path, capsys):
    plant = tmp_path / "plant.yaml"
    text = GIVEN.format(bounds="tight", k=55).replace(
        "bounds: tight", "bounds: tight\n  method: theorem2"
    )
    plant.write_text(text, encoding="utf-8")
    assert main([str(plant), "--out", str(tmp_path / "out")]) == 2
    found = capsys.readouterr().err
    assert "synthesis.bounds" in found
    assert "proved for method unified, not for theorem2" in found
    assert not (tmp_path / "out").exists()
