"""What controller.py and report.json state of the promise must be what is proved."""

from __future__ import annotations

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from bfppc_synth.certificate.checker import verify_folder
from bfppc_synth.cli import main

ROOT = Path(__file__).parents[2]


@pytest.fixture
def spoiled(tmp_path):
    """Copy a folder, replace text of a file in it, and hash the file anew."""

    def spoil(name, file, old, new):
        folder = tmp_path / name
        shutil.copytree(ROOT / "generated" / name, folder)
        text = (folder / file).read_text(encoding="utf-8")
        assert text.count(old) >= 1
        (folder / file).write_text(text.replace(old, new, 1), encoding="utf-8")
        manifest = json.loads((folder / "manifest.json").read_text())
        manifest["files"][file] = hashlib.sha256((folder / file).read_bytes()).hexdigest()
        (folder / "manifest.json").write_text(json.dumps(manifest))
        return folder

    return spoil


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("PERIOD = 0.0005", "PERIOD = 10.0"),
        ("ACCURACY = 0.05", "ACCURACY = 0.0001"),
        ("ORDER = 2", "ORDER = 3"),
        ("ORDER = 2", "ORDER = True"),
    ],
)
def test_another_promise_in_the_controller_is_refused(spoiled, old, new):
    folder = spoiled("van_der_pol", "controller.py", old, new)
    report = verify_folder(folder)
    assert report.verdict == "malformed"
    assert old.partition(" ")[0] in " ".join(report.failures)


def test_another_period_in_the_report_is_refused(spoiled, capsys):
    folder = spoiled("van_der_pol", "report.json", '"period": 0.0005', '"period": 100')
    assert main(["verify", str(folder)]) == 4
    assert "sampling.period is not 0.0005" in capsys.readouterr().err


def test_the_stated_bounds_are_those_of_the_certificate():
    for name in ("chua", "motor_arm_nominal", "paper_example_2", "switching_example_2"):
        folder = ROOT / "generated" / name
        stated = json.loads((folder / "report.json").read_text())
        proof = json.loads((folder / "certificate.json").read_text())["enclosures"]
        assert stated["bounds"]["U"] >= float.fromhex(proof["U"][1])
        for state, size in zip(stated["states"], stated["bounds"]["X"], strict=True):
            assert size >= float.fromhex(proof[f"X[{state}]"][1])
