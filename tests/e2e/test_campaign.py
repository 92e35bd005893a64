"""campaign: the same result from any number of threads, after a kill, and run by run."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bfppc_synth.campaign import material as material_module
from bfppc_synth.campaign.store import Store
from bfppc_synth.cli import main
from bfppc_synth.simulation.compiled import build

ROOT = Path(__file__).parents[2]
RUNS = 150


def copied(target, name="paper_example_1"):
    shutil.copytree(ROOT / "generated" / name, target)
    return target


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a finished campaign, and its result."""
    place = copied(tmp_path_factory.mktemp("campaign") / "out")
    words = ["campaign", str(place), "--runs", str(RUNS), "--horizon", "1", "--quiet"]
    assert main(words) == 0
    return place


def result(place):
    return (place / "campaign" / "campaign.json").read_bytes()


def again(place, target, *words):
    """The campaign of a folder once more, in a copy without it."""
    shutil.copytree(place, target, ignore=shutil.ignore_patterns("campaign"))
    horizon = [] if "--horizon" in words else ["--horizon", "1"]
    assert main(["campaign", str(target), *words, *horizon, "--quiet"]) == 0
    return target


def test_the_result_says_margins_runs_bounds_and_histograms(folder):
    document = json.loads(result(folder))
    assert document["runs"] == RUNS
    assert document["outside"] == 0
    assert document["covered"] is True
    assert [row["quantity"] for row in document["worst"]] == ["e[x1]", "e[x2]", "u"]
    for row in document["worst"]:
        assert 0.0 < row["ratio"] < 1.0
        assert row["margin"] == 1.0 - row["ratio"]
        assert sum(document["histograms"][row["quantity"]]) == RUNS
    bound = document["failure_probability"]["0.95"]
    assert abs(bound - (1.0 - 0.05 ** (1.0 / RUNS))) < 1e-12
    assert sum(row["runs"] for row in document["adversaries"].values()) == RUNS
    assert b"<svg" in (folder / "campaign" / "histogram.svg").read_bytes()


@pytest.mark.parametrize("workers", ["1", "4"])
def test_any_number_of_threads_gives_the_same_bytes(folder, tmp_path, workers):
    other = again(folder, tmp_path / "out", "--runs", str(RUNS), "--workers", workers)
    assert result(other) == result(folder)
    picture = Path("campaign") / "histogram.svg"
    assert (other / picture).read_bytes() == (folder / picture).read_bytes()


def test_another_seed_makes_other_runs(folder, tmp_path):
    other = again(folder, tmp_path / "out", "--runs", str(RUNS), "--seed", "9")
    assert json.loads(result(other))["worst"] != json.loads(result(folder))["worst"]


def test_without_a_compiler_python_gives_the_same_bytes(folder, tmp_path, monkeypatch, capsys):
    def missing(*_args, **_more):
        raise build.NoCompilerError("no C compiler")

    few = ("--runs", "12", "--horizon", "0.2")
    compiled = again(folder, tmp_path / "one", *few)
    monkeypatch.setattr(material_module, "CompiledLoop", missing)
    target = tmp_path / "other"
    shutil.copytree(folder, target, ignore=shutil.ignore_patterns("campaign"))
    assert main(["campaign", str(target), *few]) == 0
    assert result(target) == result(compiled)
    assert "no C compiler" in capsys.readouterr().err


def test_the_worst_runs_come_out_again_one_by_one(folder, capsys):
    for row in json.loads(result(folder))["worst"]:
        capsys.readouterr()
        assert main(["simulate", str(folder), "--run", str(row["run"]), "--json"]) == 0
        document = json.loads(capsys.readouterr().out)
        assert document["horizon"] == 1.0
        assert document["ratios"][row["quantity"]] == row["ratio"]
        assert document["within_bounds"] is True


def test_pictures_are_drawn_where_asked_for(folder, capsys):
    assert main(["simulate", str(folder), "--run", "3", "--plot", "--quiet"]) == 0
    assert b"<svg" in (folder / "run_3.svg").read_bytes()
    assert main(["simulate", str(folder), "--plot", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["picture"].endswith("simulation.svg")
    assert b"<svg" in Path(document["picture"]).read_bytes()


def test_a_campaign_leaves_the_folder_verified(folder):
    assert main(["verify", str(folder), "--quiet"]) == 0


def test_more_runs_go_on_from_those_that_are_there(folder, tmp_path):
    place = again(folder, tmp_path / "one", "--runs", "60")
    assert main(["campaign", str(place), "--resume", "--runs", "90", "--quiet"]) == 0
    whole = again(folder, tmp_path / "other", "--runs", "90")
    assert result(place) == result(whole)


def test_a_killed_campaign_resumes_to_the_same_bytes(folder, tmp_path):
    place, whole = tmp_path / "killed", tmp_path / "whole"
    words = ("--runs", "640", "--horizon", "4")
    again(folder, whole, *words)
    shutil.copytree(folder, place, ignore=shutil.ignore_patterns("campaign"))
    command = [sys.executable, "-m", "bfppc_synth", "campaign", str(place), *words, "--workers=1"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    batches, deadline = place / "campaign" / "batches", time.monotonic() + 120.0
    while not list(batches.glob("0*.json")):
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert not (place / "campaign" / "campaign.json").exists()
    kept = {path: path.stat().st_mtime_ns for path in batches.glob("0*.json")}
    assert 0 < len(kept) < len(list((whole / "campaign" / "batches").glob("0*.json")))
    assert main(["campaign", str(place), *words, "--quiet"]) == 2
    assert main(["campaign", str(place), "--resume", "--quiet"]) == 0
    assert result(place) == result(whole)
    assert all(path.stat().st_mtime_ns == at for path, at in kept.items())


def weaken(place):
    """A fiftieth of the last gain, in the code only."""
    for path in (place / "controller.py", place / "c" / "src" / "paper_example_1.c"):
        text = path.read_text("utf-8")
        assert text.count("199.9") == 1
        path.write_text(text.replace("199.9", "3.998"), encoding="utf-8")


def test_a_run_that_leaves_ends_in_4_and_is_named(tmp_path, capsys):
    place = copied(tmp_path / "out")
    weaken(place)
    assert main(["campaign", str(place), "--runs", "40", "--horizon", "2", "--json"]) == 4
    shown = capsys.readouterr()
    document = json.loads(shown.out)
    assert 0 < document["outside"] == len(document["left"])
    assert document["failure_probability"]["0.95"] > document["outside"] / 40
    first = document["left"][0]
    assert f"--run {first}" in shown.err
    assert main(["simulate", str(place), "--run", str(first), "--json"]) == 4
    assert json.loads(capsys.readouterr().out)["within_bounds"] is False


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--runs", "0"], "--runs 0: not a positive number"),
        (["--workers", "0"], "--workers 0: not a positive number"),
        (["--horizon", "nan"], "--horizon nan: not a positive time"),
        (["--resume"], "nothing to resume"),
        (["--cluster", "nowhere"], "no address of a scheduler"),
        (["--cluster", "tcp://127.0.0.1:1", "--workers", "2"], "exclude each other"),
    ],
)
def test_what_cannot_be_done_is_said(tmp_path, capsys, words, sentence):
    place = copied(tmp_path / "out")
    assert main(["campaign", str(place), *words]) == 2
    assert sentence in capsys.readouterr().err
    assert not (place / "campaign" / "settings.json").exists()


def test_resuming_with_other_numbers_or_code_is_refused(folder, tmp_path, capsys):
    place = tmp_path / "out"
    shutil.copytree(folder, place)
    assert main(["campaign", str(place), "--resume", "--seed", "5"]) == 2
    assert "the campaign began with 1" in capsys.readouterr().err
    assert main(["campaign", str(place), "--resume", "--horizon", "3"]) == 2
    weaken(place)
    assert main(["campaign", str(place), "--resume"]) == 2
    assert "about another controller" in capsys.readouterr().err
    assert main(["simulate", str(place), "--run", "1"]) == 2
    assert "about another controller" in capsys.readouterr().err


def test_settings_or_batches_that_were_spoiled_are_not_believed(folder, tmp_path, capsys):
    place = tmp_path / "out"
    shutil.copytree(folder, place)
    batches = sorted((place / "campaign" / "batches").glob("*.json"))
    batches[0].write_text("{}", encoding="utf-8")
    batches[1].write_text(batches[2].read_text("utf-8").replace('"runs"', '"walks"'), "utf-8")
    assert main(["campaign", str(place), "--resume", "--quiet"]) == 0
    assert result(place) == result(folder)
    (place / "campaign" / "settings.json").write_text("[]", encoding="utf-8")
    assert main(["campaign", str(place), "--resume"]) == 2
    assert "is not the settings of a campaign" in capsys.readouterr().err


def test_a_law_in_stages_is_judged_stage_by_stage(tmp_path):
    place = copied(tmp_path / "out", "switching_example_2")
    assert main(["campaign", str(place), "--runs", "20", "--horizon", "0.3", "--quiet"]) == 0
    document = json.loads(result(place))
    assert [row["quantity"] for row in document["worst"]] == [
        "e[x1], stage 1",
        "e[x2], stage 1",
        "e[x1], stage 2",
        "e[x2], stage 2",
        "u",
    ]
    assert [row["bound"] for row in document["worst"][:4]] == [
        pytest.approx(0.04, rel=1e-3),
        pytest.approx(1.0, rel=1e-3),
        0.05,
        3.322,
    ]
    assert all(0.0 < row["ratio"] < 1.0 for row in document["worst"])


def test_a_horizon_of_too_many_steps_is_refused(tmp_path, capsys):
    place = copied(tmp_path / "out")
    assert main(["campaign", str(place), "--horizon", "1e300"]) == 2
    assert "plant steps a run" in capsys.readouterr().err


def test_two_campaigns_do_not_share_a_folder(folder, tmp_path, capsys):
    place = tmp_path / "out"
    shutil.copytree(folder, place)
    with Store(place).held():
        assert main(["campaign", str(place), "--resume"]) == 2
    assert "another campaign is running there" in capsys.readouterr().err
    assert result(place) == result(folder)


def test_a_file_where_the_campaign_must_stand_is_said(tmp_path, capsys):
    place = copied(tmp_path / "out")
    (place / "campaign").write_text("mine", encoding="utf-8")
    assert main(["campaign", str(place), "--runs", "5"]) == 2
    assert "make the folder writable" in capsys.readouterr().err
    assert (place / "campaign").read_text("utf-8") == "mine"
