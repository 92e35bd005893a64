"""A folder with and without the tools of the emulated target."""

from __future__ import annotations

import json
import re
import shutil
import subprocess

import pytest

from bfppc_synth.artifacts import package
from bfppc_synth.codegen.measuring import COMPILER
from bfppc_synth.codegen.package import Overwrite, write_folder
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

PLANT = """\
name: small_measured
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2, disturbance: 0.125}
initial: {x1: [0.25, 0.5], x2: 0}
performance: {accuracy: 0.25}
measurement: {quantizer: {kind: uniform, step: 0.001}}
sampling: {period: 0.0005}
simulation: {horizon: 0.5, period: 0.0005, seed: 3}
"""
TOLD = {"README.md", "report.html", "report.json"}


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    path = tmp_path_factory.mktemp("plant") / "small_measured.yaml"
    path.write_text(PLANT)
    return synthesize(load_spec(path))


@pytest.fixture(scope="module")
def measured(design):
    return package(design)[0]


def target(files):
    return json.loads(files["report.json"])["code"]["target"]


def test_a_folder_has_the_numbers_that_its_make_target_prints(design, measured, tmp_path):
    folder = tmp_path / "out"
    write_folder(
        measured, folder, name="small_measured", status="certified", overwrite=Overwrite.REFUSE
    )
    said = subprocess.run(
        ["make", "-s", "target"], cwd=folder / "c", capture_output=True, text=True, check=True
    ).stdout
    found = target(measured)
    numbers = re.search(
        r"(\d+) least, (\d+) on average, (\d+) most .* stack (\d+) .* state (\d+)", said
    )
    counts = (*found["instructions"].values(), found["stack_bytes"], found["state_bytes"])
    assert tuple(map(int, numbers.groups())) == counts
    assert said.splitlines()[-1].split()[0] == str(found["code_bytes"])
    assert found["not_measured"] is None
    assert f"{found['instructions']['most']} instructions" in measured["README.md"].decode()


def test_the_same_design_gives_the_same_bytes(design, measured):
    assert package(design)[0] == measured


@pytest.mark.parametrize("fault", ["nothing on PATH", "a compiler that fails"])
def test_without_a_measurement_all_else_is_the_same(design, measured, tmp_path, monkeypatch, fault):
    reason = f"{COMPILER} is not on PATH"
    if fault == "a compiler that fails":
        stub = tmp_path / COMPILER
        stub.write_text("#!/bin/sh\necho 'error: out of order' >&2\nexit 1\n")
        stub.chmod(0o755)
        for tool in ("qemu-system-arm", "arm-none-eabi-size"):
            (tmp_path / tool).symlink_to(shutil.which(tool))
        reason = f"{COMPILER} ended with 1: error: out of order"
    monkeypatch.setenv("PATH", str(tmp_path))
    files = package(design)[0]
    assert target(files)["not_measured"] == reason
    said = f"Not measured on a Cortex-M4F (QEMU mps2-an386): {reason}."
    assert said in files["README.md"].decode()
    assert said in files["report.html"].decode()
    assert {path for path in measured if files[path] != measured[path]} == TOLD
    plain, full = (json.loads(found["report.json"]) for found in (files, measured))
    plain["code"]["target"] = full["code"]["target"]
    assert plain == full
    assert sorted(files) == sorted(measured)
