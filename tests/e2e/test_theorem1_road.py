"""Theorem 1, sound form, from plant file to a folder that Python alone proves."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from bfppc_synth.cli import main
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

EXAMPLE_1 = """
name: example_1
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2}
initial: {x1: 1, x2: 0}
performance: {accuracy: 0.15}
measurement: {quantizer: {kind: uniform, step: 0.1}}
synthesis: {method: theorem1, objective: OBJECTIVE, theorem1: {H: SCHEDULE}}
simulation: {horizon: 0.3, period: 0.0001}
"""


def plant(tmp_path, objective="balanced", schedule="constant"):
    path = tmp_path / "plant.yaml"
    text = EXAMPLE_1.replace("OBJECTIVE", objective).replace("SCHEDULE", schedule)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("objective", "peak"), [("balanced", 40.1e3), ("peak-input", 38.7e3)])
def test_example_1_is_certified_at_its_peak_input(tmp_path, objective, peak):
    design = synthesize(load_spec(plant(tmp_path, objective)))
    assert design.certificate.verdict is Verdict.CERTIFIED
    assert pytest.approx(peak, rel=0.01) == design.bounds.U
    names = {entry.id for entry in design.certificate.inequalities}
    assert {"T1.p[x1]", "T1.H[x1]", "T1.c[x2]", "T1.gamma[x2]"} <= names
    assert all(entry.holds for entry in design.certificate.inequalities)


@pytest.mark.parametrize("schedule", ["constant", "scheduled"])
def test_the_folder_is_proved_by_python_alone(tmp_path, capsys, schedule):
    folder = tmp_path / "out"
    assert main([str(plant(tmp_path, schedule=schedule)), "--out", str(folder), "--json"]) == 0
    capsys.readouterr()
    report = json.loads((folder / "report.json").read_text("utf-8"))
    assert (report["status"], report["method"]) == ("certified", "theorem1")
    assert len(report["gains"][0]["H"]) == (1 if schedule == "constant" else 2)
    assert "T1'.gamma[x1]" in [e["id"] for e in report["inequalities"]] or schedule == "constant"
    done = subprocess.run(
        [sys.executable, "-I", "-S", "verify.py", "--json"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stdout
    answer = json.loads(done.stdout)
    assert answer["verdict"] == "proved"
    assert any("rounding" in line and "theorem1" in line for line in answer["assumptions"])
    assert "200 commands" in answer["tests"][-1]
    # The package finds the code that it would make itself.
    assert main(["verify", str(folder)]) == 0
    assert main(["export", str(folder), "--to", "smt2"]) == 2
    assert "claims of method theorem1" in capsys.readouterr().err
    assert not (folder / "interop").exists()


def test_numbers_that_the_file_fixes_are_kept_to_the_last_digit(tmp_path):
    path = plant(tmp_path)
    text = path.read_text("utf-8").replace(
        "{H: constant}", "{c_0: 0.0001, epsilon: {x2: 2}}, gains: {x1: {gamma: 40, c: 0.001}}"
    )
    path.write_text(text, encoding="utf-8")
    design = synthesize(load_spec(path))
    assert design.certificate.failures == ()
    assert design.theorem1 is not None
    assert (design.theorem1.c_0, design.gains[0].gamma, design.gains[0].c) == (0.0001, 40.0, 0.001)
    assert design.theorem1.epsilon[1] == pytest.approx(2.0, rel=1e-12)
