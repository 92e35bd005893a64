"""Theorem 1 from plant file to folder: the printed examples held and broken, the sound form."""

from __future__ import annotations

import json

import pytest

from bfppc_synth.cli import main

PRINTED = """
name: printed
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2}
initial: {x1: 1, x2: 0}
performance: {accuracy: 0.15}
measurement: {quantizer: {kind: uniform, step: 0.1}}
synthesis:
  method: theorem1
  form: printed
  gains:
    x1: {gamma: 4, H: [5], H_star: 5, c: 0.1, N: 3}
    x2: {gamma: 0.4, H: [10], H_star: 10, c: 1.5, N: 3}
  p: {x2: 3.1}
  theorem1: {epsilon: {x2: 1}}
simulation: {horizon: 3, period: 0.0004}
"""
SOUND = PRINTED[: PRINTED.index("synthesis:")] + (
    "synthesis: {method: theorem1, theorem1: {H: SCHEDULE}}\n"
    "simulation: {horizon: 0.5, period: 0.0001}\n"
)
COUNTEREXAMPLE = """
name: counterexample
states: [x1]
dynamics:
  x1: {f: 0.1*x1**2}
initial: {x1: 10}
performance: {accuracy: 1.01, rho: {kind: cosine, t_s: 100}}
measurement: {quantizer: {kind: uniform, step: 0.01}}
synthesis:
  method: theorem1
  form: printed
  gains: {x1: {gamma: GAMMA, H: [1.15201, 2.02, 10], H_star: 1, c: 1.6177, N: 3}}
  theorem1: {c_0: 0.1}
simulation: {horizon: 2, period: 0.0005}
"""


@pytest.fixture
def run(tmp_path, capsys):
    def command(text, *options):
        plant = tmp_path / "plant.yaml"
        plant.write_text(text, encoding="utf-8")
        folder = tmp_path / "out"
        code = main([str(plant), "--out", str(folder), "--force", *options])
        errors = capsys.readouterr().err
        report = folder / "report.json"
        document = json.loads(report.read_text("utf-8")) if report.exists() else None
        return code, document, errors

    return command


@pytest.fixture
def simulated(tmp_path, capsys):
    def command(*options):
        assert main(["simulate", str(tmp_path / "out"), "--json", *options]) == 0
        return json.loads(capsys.readouterr().out)

    return command


def test_the_printed_example_1_fails_its_own_inequalities_and_is_held_in_simulation(run, simulated):
    code, document, errors = run(PRINTED, "--allow-uncertified")
    assert code == 4
    assert (document["status"], document["method"]) == ("printed", "theorem1")
    assert document["gains"][0] == {
        "gamma": 4.0, "H": [5.0], "H_star": 5.0, "c": 0.1, "N": 3, "k": 20.0,
    }  # fmt: skip
    failed = {entry["id"] for entry in document["inequalities"] if not entry["holds"]}
    assert failed == {"T1.c[x1]", "T1.gamma[x1]", "T1.H[x2]", "T1.c[x2]"}
    assert "T1.gamma[x1] (39): 4 is not above 24.3987" in errors
    assert document["simulation"]["max_abs_e"][0] == pytest.approx(0.084, abs=0.003)
    assert document["simulation"]["max_abs_u"] == pytest.approx(29, rel=0.02)
    assert document["simulation"]["within_bounds"]
    for start, reached in (("x1=1.5,x2=0", 0.166), ("x1=2,x2=0", 0.463)):
        broken = simulated("--x0", start)
        assert not broken["within_bounds"]
        assert broken["max_abs_e"][0] == pytest.approx(reached, rel=0.02)


def test_the_counterexample_holds_on_paper_and_leaves_its_tube(run):
    code, document, _ = run(COUNTEREXAMPLE.replace("GAMMA", "0.01"), "--allow-uncertified")
    assert code == 4
    assert all(entry["holds"] for entry in document["inequalities"])
    assert not document["simulation"]["within_bounds"]
    # Without the clamp it would turn back at 2.07; the clamp is what a valid proof would allow.
    assert document["simulation"]["max_abs_e"][0] > 2.0
    _, document, _ = run(COUNTEREXAMPLE.replace("GAMMA", "1.2"), "--allow-uncertified")
    assert document["simulation"]["within_bounds"]
    assert document["simulation"]["max_abs_e"][0] == pytest.approx(0.695, rel=0.02)


def test_the_sound_form_names_what_the_counterexample_lacks(run):
    text = COUNTEREXAMPLE.replace("GAMMA", "0.01").replace("form: printed", "form: sound")
    code, document, errors = run(text)
    assert (code, document) == (4, None)
    assert "T1.gamma[x1]: refuted" in errors
    assert "((1.798438" in errors
    assert "> (13.27201" in errors


@pytest.mark.parametrize("schedule", ["constant", "scheduled"])
def test_the_sound_form_keeps_its_bounds_in_simulation(run, schedule):
    code, document, _ = run(SOUND.replace("SCHEDULE", schedule))
    assert (code, document["status"], document["failures"]) == (0, "certified", [])
    assert all(entry["holds"] for entry in document["inequalities"])
    assert document["simulation"]["within_bounds"]
    assert document["bounds"]["U"] < 8e4
    assert len(document["gains"][0]["H"]) == (1 if schedule == "constant" else 2)
    assert min(document["theorem1"]["epsilon"]) > 0.0


def test_an_impossible_demand_is_answered_with_the_least_peak_input(run):
    text = SOUND.replace("SCHEDULE", "constant") + "actuator: {limit: 20000}\n"
    code, document, errors = run(text)
    assert (code, document) == (3, None)
    assert "above actuator.limit 20000" in errors
    assert "actuator.limit" in errors.partition("would suffice")[2]
