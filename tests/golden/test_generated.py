"""What the examples generate is what is committed: ``make generated`` after a wanted change."""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from bfppc_synth.cli import main

ROOT = Path(__file__).parents[2]
# The paper's printed gains are never certified, so nothing of them is committed.
EXAMPLES = sorted(
    path for path in (ROOT / "examples").glob("*.yaml") if not path.stem.endswith("_printed")
)
FOLDERS = sorted(path for path in (ROOT / "generated").iterdir() if path.is_dir())
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
# Simulated numbers may differ in the last digits between processors; code and gains may not.
# A drawing rounds its coordinates to six decimals, so its floor is one unit there.
# The golden vectors are answers of one libm to samples of that simulation.
FLOORS = {
    "trajectory.csv": 1e-9,
    "report.json": 1e-9,
    "report.html": 2e-6,
    "README.md": 1e-9,
    "c/test/vectors.h": 1e-9,
}
RELATIVE = 1e-6


def floor(path: str) -> float | None:
    """Absolute tolerance of a file by its path in the folder; None: byte for byte."""
    return 2e-6 if path.endswith(".svg") else FLOORS.get(path)


def same_but_for_last_digits(ours: str, theirs: str, absolute: float) -> bool:
    if NUMBER.split(ours) != NUMBER.split(theirs):
        return False
    return all(
        a == b or math.isclose(float(a), float(b), rel_tol=RELATIVE, abs_tol=absolute)
        for a, b in zip(NUMBER.findall(ours), NUMBER.findall(theirs), strict=True)
    )


def files(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    }


def manifest(content: dict[str, bytes]) -> dict[str, object]:
    return json.loads(content["manifest.json"])


def assert_manifest_is_true(content: dict[str, bytes]) -> None:
    hashes = {
        path: hashlib.sha256(data).hexdigest()
        for path, data in content.items()
        if path != "manifest.json"
    }
    assert manifest(content)["files"] == hashes


def without_tolerant_hashes(content: dict[str, bytes]) -> dict[str, object]:
    document = manifest(content)
    entries = document["files"]
    assert isinstance(entries, dict)
    document["files"] = {
        path: None if floor(path) is not None else digest for path, digest in entries.items()
    }
    return document


def test_every_example_has_its_folder_and_every_folder_its_example() -> None:
    assert [path.stem for path in EXAMPLES] == [path.name for path in FOLDERS]
    assert len(EXAMPLES) >= 6


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda path: path.name)
def test_a_committed_folder_is_what_its_manifest_says(folder: Path) -> None:
    content = files(folder)
    assert_manifest_is_true(content)
    assert manifest(content)["name"] == folder.name
    assert manifest(content)["status"] == "certified"
    assert content["plant.yaml"] == (ROOT / "examples" / f"{folder.name}.yaml").read_bytes()


@pytest.mark.parametrize("plant", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_generates_what_is_committed(plant: Path, tmp_path: Path) -> None:
    assert main([str(plant), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    new, old = files(tmp_path / "out"), files(ROOT / "generated" / plant.stem)
    assert sorted(new) == sorted(old)
    assert_manifest_is_true(new)
    assert without_tolerant_hashes(new) == without_tolerant_hashes(old)
    for path in sorted(set(new) - {"manifest.json"}):
        absolute = floor(path)
        if absolute is None:
            assert new[path] == old[path], path
        else:
            close = same_but_for_last_digits(new[path].decode(), old[path].decode(), absolute)
            assert close, path


@pytest.mark.parametrize(
    "name", ["paper_example_1", pytest.param("paper_example_2", marks=pytest.mark.full)]
)
def test_the_bytes_do_not_depend_on_the_hash_seed(name: str, tmp_path: Path) -> None:
    contents = []
    for seed in ("1", "4242"):
        out = tmp_path / seed
        plant = ROOT / "examples" / f"{name}.yaml"
        command = [sys.executable, "-m", "bfppc_synth", str(plant), "--out", str(out), "--quiet"]
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        subprocess.run(command, env=environment, cwd=tmp_path, check=True, timeout=120)
        contents.append(files(out))
    assert contents[0] == contents[1]


@pytest.mark.parametrize(
    ("ours", "theirs", "same"),
    [
        ("t,x\n0.1,2.0\n", "t,x\n0.1,2.000001\n", True),
        ("t,x\n0.1,2.0\n", "t,x\n0.1,2.00001\n", False),
        ("t,x\n0.1,1e-12\n", "t,x\n0.1,-3e-11\n", True),
        ("t,x\n0.1,1e-7\n", "t,x\n0.1,2e-7\n", False),
        ("t,x\n0.1,2.0\n", "t,y\n0.1,2.0\n", False),
        ("1 2", "1 2 3", False),
        ("status certified", "status refuted", False),
    ],
)
def test_the_comparison_sees_a_changed_word_and_a_sixth_digit(
    ours: str, theirs: str, same: bool
) -> None:
    assert same_but_for_last_digits(ours, theirs, 1e-9) is same
