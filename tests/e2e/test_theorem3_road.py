"""Theorem 3 made sound, from plant file to a folder that Python alone proves."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from bfppc_synth.cli import main
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

PLANT = (Path(__file__).parents[1] / "plants" / "switching.yaml").read_text(encoding="utf-8")
START = "x1: 0.5, x2: 2}"
SAMPLED = ("simulation:", "sampling: {period: 0.0001}\nsimulation:")
SHORT = ("horizon: 10, period: 0.002", "horizon: 0.5, period: 0.002")
CONTAINED = ("method: theorem3", "method: theorem3\n  handover: containment")
NARROW = ("p: {x1: 0.04, x2: 1}", "p: {x1: 0.01, x2: 1}")
PRINTED = ("method: theorem3", "method: theorem3\n  form: printed")
MORE = (
    "  stages:\n",
    "  stages:\n    - p: {x1: 0.03, x2: 0.8}\n      gains: {x1: {k: 2}, x2: {k: 1}}\n",
)


def plant(tmp_path, *changes):
    text = PLANT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "plant.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("start", "timing", "peak"),
    [
        (START, (), 6.21e3),
        ("x1: 0.5, x2: -2}", (), 6.21e3),
        ("x1: 0.9, x2: 0}", (), 5.16e3),
        (START, (SAMPLED,), 1.245e4),
        ("x1: 0.5, x2: -2}", (SAMPLED,), 1.245e4),
        ("x1: 0.9, x2: 0}", (SAMPLED,), 9.72e3),
    ],
)
def test_reanchoring_is_certified_from_every_start_that_breaks_the_printed_text(
    tmp_path, start, timing, peak
):
    design = synthesize(load_spec(plant(tmp_path, (START, start), *timing)))
    assert design.certificate.verdict is Verdict.CERTIFIED
    assert design.certificate.failures == ()
    assert pytest.approx(peak, rel=0.01) == design.bounds.U


@pytest.mark.parametrize(
    "changes", [(), (MORE,), (CONTAINED, NARROW)], ids=["reanchor", "three", "containment"]
)
def test_the_folder_is_proved_by_python_alone(tmp_path, capsys, changes):
    folder = tmp_path / "out"
    path = plant(tmp_path, SHORT, *changes)
    assert main([str(path), "--out", str(folder), "--json"]) == 0
    capsys.readouterr()
    report = json.loads((folder / "report.json").read_text("utf-8"))
    assert (report["status"], report["method"]) == ("certified", "theorem3")
    assert report["simulation"]["within_bounds"]
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
    claims = {claim["id"] for claim in answer["claims"]}
    assert "T3.stage1[x1]" in claims
    assert ("T3.handover1[x2]" in claims) == (CONTAINED in changes)
    assert main(["verify", str(folder)]) == 0
    assert main(["export", str(folder), "--to", "coq"]) == 2
    assert "claims of method theorem3" in capsys.readouterr().err


def test_the_printed_form_is_never_certified(tmp_path, capsys):
    folder = tmp_path / "out"
    path = plant(tmp_path, SHORT, PRINTED)
    assert main([str(path), "--out", str(folder)]) == 4
    assert "the printed form of the paper is never certified" in capsys.readouterr().err
    assert not folder.exists()
    assert main([str(path), "--out", str(folder), "--allow-uncertified"]) == 4
    assert json.loads((folder / "report.json").read_text("utf-8"))["status"] == "printed"
    assert not (folder / "certificate.json").exists()
    assert main(["verify", str(folder)]) == 2
