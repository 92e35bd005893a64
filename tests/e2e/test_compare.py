"""Command compare: what it writes, says and refuses."""

from __future__ import annotations

import csv
import json
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from bfppc_synth.cli import main
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.compare import run as road
from bfppc_synth.report.comparison import comparison_csv, comparison_lines
from bfppc_synth.simulation.loading import load_controller
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

ROOT = Path(__file__).parents[2]
FEW = ["--runs", "3", "--budget", "4", "--horizon", "0.1"]
FILES = ["compare.csv", "compare.json", "compare.svg", "manifest.json"]
KEYS = [
    "bfppc-synth",
    "ln-barrier",
    "bechlioulis-rovithakis",
    "bechlioulis-rovithakis-wide",
    "dynamic-surface",
    "backstepping",
]


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    folder = tmp_path_factory.mktemp("compare") / "paper_example_1"
    shutil.copytree(ROOT / "generated" / "paper_example_1", folder)
    assert main(["compare", str(folder), "--quiet", *FEW]) == 0
    return folder


@pytest.fixture
def copy(tmp_path):
    folder = tmp_path / "compressor_surge"
    shutil.copytree(ROOT / "generated" / "compressor_surge", folder)
    return folder


def document(folder):
    return json.loads((folder / "compare" / "compare.json").read_text("utf-8"))


def contents(folder):
    return {path.name: path.read_bytes() for path in (folder / "compare").iterdir()}


def test_the_files_say_who_was_tuned_how_and_what_came_of_it(compared):
    assert sorted(contents(compared)) == FILES
    found = document(compared)
    assert found["format"] == "bfppc-synth/compare/1"
    assert (found["runs"], found["budget"], found["seed"]) == (3, 4, 1)
    assert [row["method"] for row in found["methods"]] == KEYS
    own, *others = found["methods"]
    assert own["gains"] == {}
    assert own["share_inside"] == 1.0
    for row in others:
        assert not row["certified"]
        assert row["tried"] == 4
        assert set(row["gains"]) == set(row["ranges"])
        for name, (low, high) in row["ranges"].items():
            assert low * 0.999 < row["gains"][name] < high * 1.001
        assert 0.0 <= row["share_inside"] <= 1.0
        assert row["inside"] + row["nan"] + row["diverged"] <= row["runs"] == 3


def test_nothing_is_called_certified_that_this_sampling_does_not_cover(compared, copy):
    # The design of the first example is for continuous measurement.
    assert document(compared)["sampling"]["covered"] is False
    assert document(compared)["methods"][0]["certified"] is False
    assert main(["compare", str(copy), "--quiet", *FEW]) == 0
    assert document(copy)["sampling"]["covered"] is True
    assert document(copy)["methods"][0]["certified"] is True
    # Nothing is open in this plant, so there is one run.
    assert document(copy)["runs"] == 1


def test_the_csv_has_the_rows_of_the_json(compared):
    with (compared / "compare" / "compare.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["method"] for row in rows] == KEYS
    for row, full in zip(rows, document(compared)["methods"], strict=True):
        assert int(row["inside"]) == full["inside"]
        assert float(row["peak_u"]) == full["peak_u"]
        assert row["level_changes_per_second"] == ""


def test_the_picture_has_a_curve_a_method_inside_one_envelope(compared):
    text = (compared / "compare" / "compare.svg").read_text(encoding="utf-8")
    tree = ET.fromstring(text)  # noqa: S314 -- written by the tool itself
    space = "{http://www.w3.org/2000/svg}"
    assert len(tree.findall(f".//{space}polyline")) == len(KEYS)
    assert len(tree.findall(f".//{space}polygon")) == 1
    for row in document(compared)["methods"]:
        assert row["title"] in text


def test_operations_are_counted_against_n(compared):
    found = document(compared)["operations"]
    assert [row["n"] for row in found["this_plant"]] == [1, 2]
    family = found["family"]
    assert [row["n"] for row in family] == [1, 2, 3, 4, 5]
    assert family[-1]["backstepping"] > 4 * family[-1]["bfppc"]
    assert family[0]["backstepping"] < family[0]["bfppc"]


def test_the_same_words_give_the_same_bytes_and_another_seed_does_not(compared):
    first = contents(compared)
    assert main(["compare", str(compared), "--quiet", *FEW]) == 0
    assert contents(compared) == first
    assert main(["compare", str(compared), "--quiet", "--seed", "9", *FEW]) == 0
    assert contents(compared)["compare.json"] != first["compare.json"]
    assert main(["compare", str(compared), "--quiet", *FEW]) == 0
    assert contents(compared) == first


def test_json_is_one_object_and_the_folder_stays_valid(copy, capsys):
    assert main(["--json", "compare", str(copy), *FEW]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["exit_code"] == 0
    assert said["written"] == copy.as_posix() + "/compare"
    assert {key: said[key] for key in document(copy)} == document(copy)
    assert main(["compare", str(copy), *FEW]) == 0
    told = capsys.readouterr().out
    assert "1/1" in told
    assert "best gains of ln-barrier PPC: k_1" in told
    assert main(["verify", str(copy), "--quiet"]) == 0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--runs", "0"], "not from 1 to 400"),
        (["--runs", "401"], "not from 1 to 400"),
        (["--budget", "0"], "not from 1 to 1000"),
        (["--budget", "-5"], "not from 1 to 1000"),
        (["--horizon", "0"], "not a positive time"),
        (["--horizon", "nan"], "not a positive time"),
        (["--horizon", "inf"], "not a positive time"),
        (["--horizon", "1e9"], "samples"),
        (["--seed", "-1"], "below 0"),
        (["--runs", "many"], "runs"),
    ],
)
def test_options_out_of_range_are_refused_and_nothing_is_written(words, sentence, copy, capsys):
    assert main(["compare", str(copy), *words]) == 2
    told = capsys.readouterr().err
    assert sentence in told
    assert "Traceback" not in told
    assert not (copy / "compare").exists()


def test_a_folder_of_something_else_is_refused(tmp_path, copy, capsys):
    assert main(["compare", str(tmp_path / "nothing")]) == 2
    (tmp_path / "empty").mkdir()
    assert main(["compare", str(tmp_path / "empty")]) == 2
    (copy / "compare").mkdir()
    (copy / "compare" / "mine.txt").write_text("kept", encoding="utf-8")
    assert main(["compare", str(copy), *FEW]) == 2
    assert "fix:" in capsys.readouterr().err
    assert [path.name for path in (copy / "compare").iterdir()] == ["mine.txt"]


def test_an_interrupt_leaves_no_half_written_folder(copy, monkeypatch, capsys):
    def interrupted(*words, **others):
        raise KeyboardInterrupt

    monkeypatch.setattr("bfppc_synth.simulation.baselines.tuning.tune", interrupted)
    before = sorted(path.name for path in copy.iterdir())
    assert main(["compare", str(copy), *FEW]) == 130
    assert capsys.readouterr().out == ""
    assert sorted(path.name for path in copy.iterdir()) == before


def compared_design(text, tmp_path):
    """Compare a design that has no folder: its law and nothing else is written."""
    plant, place = tmp_path / "plant.yaml", tmp_path / "controller.py"
    plant.write_text(text, encoding="utf-8")
    design = synthesize(load_spec(plant))
    place.write_text(render_controller(build_law(design), make_provenance(design)), "utf-8")
    options = road.CompareOptions(runs=3, budget=4, horizon=0.1)
    return road.compare_design(design, load_controller(place), options).document


def test_a_plant_known_by_bounds_alone_has_rows_that_say_so(tmp_path):
    text = (ROOT / "examples" / "paper_example_1.yaml").read_text(encoding="utf-8")
    text = text.replace("    f: x1**2 - sin(x1)\n", "")
    found = compared_design(text, tmp_path)
    said = "\n".join(comparison_lines(found))
    assert "backstepping with exact derivatives: not applicable: f of x1 is known by" in said
    rows = {row["method"]: row for row in found["methods"]}
    for key in ("dynamic-surface", "backstepping"):
        assert rows[key]["share_inside"] is None
        assert rows[key]["operations"] is None
        assert "bound alone" in rows[key]["missing"]
    assert rows["ln-barrier"]["share_inside"] is not None
    assert comparison_csv(found).splitlines()[-1].startswith("backstepping,False,,")


def test_a_covered_run_outside_of_its_envelope_is_said_aloud(copy, monkeypatch, capsys):
    real = road.measured
    monkeypatch.setattr(road, "measured", lambda *words: {**real(*words), "inside": 0})
    assert main(["compare", str(copy), *FEW]) == 0
    assert "a run that the certificate covers left the envelope" in capsys.readouterr().err


EVERYTHING = """\
name: everything
states: [x1]
dynamics: {x1: {f: x1**2, f_bound: x1**2 + 0.1, disturbance: 0.05}}
reference: 0.5*sin(t)
initial: {x1: [0.4, 0.6]}
performance: {accuracy: 0.15, rho: {kind: exponential, rate: 1}}
measurement:
  quantizer: {kind: hysteresis-uniform, step: 0.02, hysteresis: 0.005}
  noise: 0.001
sampling: {period: 0.001, delay: 0.0015}
actuator: {error: 0.1, limit: 100}
simulation: {horizon: 0.1, period: 0.001, seed: 2}
"""

SUPPLIED = """\
name: supplied
states: [x1, x2]
dynamics: {x1: {f: 0}, x2: {f: -sin(x1), disturbance: 0.1}}
reference: {bounds: [1, 1, 1, 1]}
initial: {x1: [-0.1, 0.1], x2: 0}
performance: {accuracy: 0.1, transition: 2}
sampling: {period: 0.001}
synthesis: {center: nominal}
simulation: {horizon: 0.1, period: 0.001, seed: 2}
"""


@pytest.mark.parametrize("text", [EVERYTHING, SUPPLIED], ids=["everything", "supplied"])
def test_delays_noise_limits_and_references_at_run_time_are_met_by_every_method(text, tmp_path):
    found = compared_design(text, tmp_path)
    assert found["runs"] == 3
    own, *others = found["methods"]
    assert own["certified"]
    assert own["inside"] == own["runs"]
    assert all(row["missing"] == "" for row in others)
    assert all(row["peak_u"] <= 100.0 for row in found["methods"] if "limit" in text)
