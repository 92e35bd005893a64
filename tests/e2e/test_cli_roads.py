"""Whole commands on a real plant: what they print, write, refuse and leave alone."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bfppc_synth.cli import main

ROOT = Path(__file__).parents[2]
PLANT = ROOT / "examples" / "paper_example_1.yaml"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("made") / "out"
    assert main([str(PLANT), "--out", str(folder), "--quiet"]) == 0
    return folder


def state_of(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    }


def test_a_plant_file_alone_writes_into_generated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([str(PLANT)]) == 0
    streams = capsys.readouterr()
    lines = streams.out.splitlines()
    assert lines[0].startswith("paper_example_1: certified")
    assert lines[-1] == "  report: generated/paper_example_1/report.html"
    assert (tmp_path / "generated" / "paper_example_1" / "report.html").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["generated"]


def test_json_is_the_report_and_nothing_else(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--json", str(PLANT), "--out", str(tmp_path / "out")]) == 0
    streams = capsys.readouterr()
    document = json.loads(streams.out)
    assert document.pop("exit_code") == 0
    assert document.pop("folder") == (tmp_path / "out").as_posix()
    assert document == json.loads((made / "report.json").read_text())
    assert state_of(tmp_path / "out") == state_of(made)


def test_quiet_says_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--quiet", str(PLANT), "--out", str(tmp_path / "out")]) == 0
    streams = capsys.readouterr()
    assert streams.out == ""
    assert streams.err == ""


def test_a_folder_of_another_plant_is_left_alone_without_force(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "manifest.json").write_text('{"name": "another", "files": {}}')
    before = state_of(folder)
    assert main([str(PLANT), "--out", str(folder), "--quiet"]) == 2
    assert state_of(folder) == before
    assert "--force" in capsys.readouterr().err
    assert main([str(PLANT), "--out", str(folder), "--quiet", "--force"]) == 0
    assert json.loads((folder / "manifest.json").read_text())["name"] == "paper_example_1"


def test_a_users_file_survives_a_second_run(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    assert main([str(PLANT), "--out", str(folder), "--quiet"]) == 0
    (folder / "notes.txt").write_text("mine")
    assert main([str(PLANT), "--out", str(folder), "--quiet"]) == 0
    assert (folder / "notes.txt").read_text() == "mine"


def test_verify_says_yes_to_what_was_made(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(made)]) == 0
    assert "proved" in capsys.readouterr().out
    assert main(["verify", "--json", str(made)]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["format"].startswith("bfppc-synth/")
    assert document["exit_code"] == 0


def test_verify_says_no_to_an_edited_plant(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "copy"
    for path, data in state_of(made).items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
    assert main(["verify", str(folder), "--quiet"]) == 0
    text = (folder / "plant.yaml").read_text()
    (folder / "plant.yaml").write_text(text.replace("accuracy: 0.15", "accuracy: 0.14"))
    assert main(["verify", str(folder), "--quiet"]) != 0
    assert capsys.readouterr().err


def test_simulate_runs_the_controller_again(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = state_of(made)
    assert main(["simulate", "--json", str(made), "--horizon", "1"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["within_bounds"] is True
    assert state_of(made) == before


def test_simulate_refuses_a_state_that_is_not_there(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["simulate", str(made), "--x0", "x9=1"]) == 2
    assert "x9" in capsys.readouterr().err
    assert main(["simulate", str(made), "--x0", "x1=0.9,x2=0", "--horizon", "0.5"]) == 0


@pytest.fixture
def weak(tmp_path: Path) -> Path:
    """Example 1 with gains that are fixed and far too small."""
    path = tmp_path / "weak.yaml"
    fixed = "{k: 0.1, M: 0, c: 0, epsilon: 1, N: 3}"
    path.write_text(
        "name: weak\nstates: [x1, x2]\n"
        "dynamics:\n  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}\n  x2: {f: x1*x2**2}\n"
        "initial: {x1: 1, x2: 0}\nperformance: {accuracy: 0.15}\n"
        f"synthesis: {{gains: {{x1: {fixed}, x2: {fixed}}}, p: {{x2: 1}}}}\n"
    )
    return path


def test_fixed_gains_that_fail_end_in_4_and_write_nothing(
    weak: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main([str(weak), "--out", str(out)]) == 4
    assert "U1[x1]" in capsys.readouterr().err
    assert not out.exists()


def test_allow_uncertified_writes_and_says_so_and_still_ends_in_4(
    weak: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main([str(weak), "--out", str(out), "--allow-uncertified"]) == 4
    streams = capsys.readouterr()
    assert "NOT CERTIFIED" in streams.out
    assert "NOT CERTIFIED" in streams.err
    for name in ("controller.py", "README.md", "report.html", "c/src/weak.c"):
        assert "NOT CERTIFIED" in (out / name).read_text(), name
    assert json.loads((out / "manifest.json").read_text())["status"] != "certified"
