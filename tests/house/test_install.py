"""The templates are found from a wheel and from an editable install."""

from __future__ import annotations

import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROBE = """
import bfppc_synth, bfppc_synth.resources as resources
print(bfppc_synth.__file__)
print("\\n".join(sorted(resources.template_environment().list_templates())))
"""


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True, timeout=60)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def templates(folder: Path, path: str) -> tuple[Path, list[str]]:
    done = subprocess.run(
        [sys.executable, "-c", PROBE],
        cwd=folder,
        env={"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    origin, *names = done.stdout.splitlines()
    return Path(origin), names


def test_a_wheel_carries_its_templates(unpacked: Path) -> None:
    origin, names = templates(unpacked, str(unpacked))
    assert origin.is_relative_to(unpacked)
    assert names
    assert names == sorted(
        path.relative_to(ROOT / "templates").as_posix()
        for path in (ROOT / "templates").rglob("*")
        if path.is_file()
    )


def test_an_editable_install_finds_the_same_templates(tmp_path: Path, unpacked: Path) -> None:
    origin, names = templates(tmp_path, "")
    assert origin.is_relative_to(ROOT)
    assert names == templates(unpacked, str(unpacked))[1]


def test_a_wheel_carries_the_examples_that_new_begins_with(unpacked: Path) -> None:
    carried = unpacked / "bfppc_synth" / "examples"
    names = [path.name for path in sorted((ROOT / "examples").iterdir())]
    assert [path.name for path in sorted(carried.iterdir())] == names
    names = [name for name in names if name.endswith(".yaml")]
    probe = "from bfppc_synth.new_plant import templates; print(*templates())"
    done = subprocess.run(
        [sys.executable, "-c", probe],
        cwd=unpacked,
        env={"PYTHONPATH": str(unpacked)},
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert done.stdout.split() == [name.removesuffix(".yaml") for name in names]


def test_a_wheel_carries_the_checker_and_no_tests(unpacked: Path) -> None:
    assert (unpacked / "bfppc_synth" / "certificate" / "checker.py").is_file()
    assert not (unpacked / "tests").exists()


def test_the_version_is_the_same_wherever_it_stands() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = (ROOT / "CITATION.cff").read_text()
    assert project["version"] == version("bfppc-synth")
    assert f"\nversion: {project['version']}\n" in citation
    assert f"## {project['version']}" in (ROOT / "CHANGELOG.md").read_text()
