"""``bfppc-synth check``: what it prints, writes and ends in."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from bfppc_synth.cli import main

ROOT = Path(__file__).parents[2]
COUNTEREXAMPLE = ROOT / "tests" / "plants" / "lemma_39_counterexample.yaml"
PRINTED = ROOT / "examples" / "paper_example_1_printed.yaml"
PLANT = """
name: given
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2}
initial: {x1: 1, x2: 0}
performance: {accuracy: 0.15}
synthesis: {gains: {x1: {k: 40}, x2: {k: 9000}}, p: {x2: 0.05}}
simulation: {horizon: 2, period: 0.002}
"""


@pytest.fixture
def check(tmp_path, capsys, monkeypatch):
    """Run ``check`` in an empty folder; code, JSON object, lines, stderr."""
    empty = tmp_path / "empty"
    empty.mkdir()
    monkeypatch.chdir(empty)

    def command(plant, *options):
        if isinstance(plant, str):
            path = tmp_path / "plant.yaml"
            path.write_text(plant, encoding="utf-8")
            plant = path
        code = main(["check", str(plant), *options])
        streams = capsys.readouterr()
        document = json.loads(streams.out) if "--json" in options else None
        return code, document, streams.out.splitlines(), streams.err

    return command


def test_gains_that_are_proved_end_in_0(check):
    code, document, _, errors = check(PLANT, "--json")
    assert (code, document["exit_code"], errors) == (0, 0, "")
    assert document["format"] == "bfppc-synth/check/1"
    assert (document["status"], document["proved"]) == ("proved", True)
    assert document["forms"]["printed"] is None
    assert document["forms"]["sound"]["certificate"] == "certified"
    assert document["forms"]["sound"]["assumed"]
    assert all(entry["sound"]["holds"] for entry in document["inequalities"])
    assert [run["status"] for run in document["runs"]] == ["proved"]
    assert document["assumptions"][1]["standing"] == "proved"


def test_gains_that_are_proved_and_broken_elsewhere_end_in_4(check):
    # From 12 the law's own k is no match for x1**2, and the certificate says nothing of it.
    code, document, lines, _ = check(PLANT, "--json", "--x0", "x1=12")
    assert code == 4
    assert document["proved"]
    assert document["status"] == "broken"
    assert [run["status"] for run in document["runs"]] == ["proved", "broken"]
    assert not document["runs"][1]["declared_start"]
    escape = document["runs"][1]["escape"]
    assert escape["what"] in ("e_1", "e_2")
    assert escape["reached"] > escape["bound"]
    assert lines[0] == "{"


def test_gains_that_are_too_small_are_named_with_what_would_do(check):
    code, document, _, _ = check(PLANT.replace("k: 40", "k: 12"), "--json")
    assert code == 4
    failed = [entry for entry in document["inequalities"] if not entry["sound"]["holds"]]
    assert [entry["id"] for entry in failed] == ["U1[x1]"]
    (remedy,) = failed[0]["sound"]["would_satisfy"]
    assert (remedy["symbol"], remedy["have"]) == ("k_1", 12.0)
    text = PLANT.replace("k: 40", f"k: {remedy['need'] * 1.0001}")
    _, document, _, _ = check(text, "--json")
    assert all(entry["sound"]["holds"] for entry in document["inequalities"])
    text = PLANT.replace("k: 40", f"k: {remedy['need'] * 0.9999}")
    code, document, _, _ = check(text, "--json")
    assert code == 4


def test_the_counterexample_holds_on_paper_and_breaks_in_simulation(check):
    code, document, _, _ = check(COUNTEREXAMPLE, "--json")
    assert code == 4
    assert document["status"] == "broken"
    assert document["forms"]["printed"]["holds"]
    sides = [entry["printed"] for entry in document["inequalities"] if entry["printed"]]
    assert len(sides) == 4
    assert all(side["holds"] for side in sides)
    (run,) = document["runs"]
    escape = run["escape"]
    assert escape["what"] == "e_1"
    assert escape["bound"] == 1.01
    assert escape["time"] == pytest.approx(0.096, abs=0.001)
    assert escape["reached"] == pytest.approx(2.07, rel=0.01)


def test_the_counterexample_is_certified_by_no_form(check):
    _, document, _, _ = check(COUNTEREXAMPLE, "--json")
    assert not document["proved"]
    assert not document["forms"]["sound"]["holds"]
    assert document["forms"]["sound"]["certificate"] != "certified"
    refused = [entry for entry in document["inequalities"] if not entry["sound"]["holds"]]
    assert [entry["id"] for entry in refused] == ["T1'.gamma[x1]"]


def test_the_table_puts_both_forms_side_by_side_in_100_columns(check):
    code, _, lines, _ = check(PRINTED, "--x0", "x1=1.5", "--x0", "x1=2,x2=0")
    assert code == 4
    assert max(map(len, lines)) <= 100
    (row,) = [line for line in lines if line.startswith("T1.gamma[x1]")]
    assert row.split() == [
        "T1.gamma[x1]", "(39)", "4", ">=", "24.3987", "FAILS", "1.00034", ">", "6.1", "FAILS",
    ]  # fmt: skip
    needed = lines[lines.index(row) + 1]
    assert needed.strip() == "25:17 gamma_1 = 4: printed needs 24.4; sound needs 24.4"
    starts = [line for line in lines if line.startswith("from x1=")]
    assert starts[0] == "from x1=1, x2=0, 5 s: NOT PROVED BUT HELD IN SIMULATION"
    assert [line.rpartition(": ")[2] for line in starts[1:]] == ["BROKEN", "BROKEN"]
    assert any("|e_1| passes 0.15 at t = 0.1342 s" in line for line in lines)
    assert "proof: NOT PROVED" in lines
    assert lines[-1] == "verdict: BROKEN"


def test_nothing_is_written_without_out(check):
    check(COUNTEREXAMPLE)
    assert list(Path.cwd().iterdir()) == []


def test_out_gets_the_object_the_table_and_the_runs(check):
    code, document, _, _ = check(COUNTEREXAMPLE, "--json", "--out", "kept", "--x0", "x1=9")
    assert (code, document["folder"]) == (4, "kept")
    folder = Path("kept")
    names = sorted(path.name for path in folder.iterdir())
    assert names == [
        "check.json", "check.txt", "manifest.json", "plant.yaml", "run_1.csv", "run_2.csv",
    ]  # fmt: skip
    written = json.loads((folder / "check.json").read_text())
    assert written == {
        key: value for key, value in document.items() if key not in ("folder", "exit_code")
    }
    assert json.loads((folder / "manifest.json").read_text())["status"] == "broken"
    assert (folder / "check.txt").read_text().splitlines()[-1] == "verdict: BROKEN"
    assert (folder / "run_1.csv").read_text().startswith("# NOT CERTIFIED")
    assert (folder / "plant.yaml").read_bytes() == COUNTEREXAMPLE.read_bytes()


def test_a_generated_controller_is_not_replaced_by_its_audit(check):
    assert main([str(COUNTEREXAMPLE), "--allow-uncertified", "--out", "made", "--quiet"]) == 4
    before = sorted(path.name for path in Path("made").iterdir())
    code, _, _, errors = check(COUNTEREXAMPLE, "--out", "made")
    assert code == 2
    assert "fix: name another folder" in errors
    assert sorted(path.name for path in Path("made").iterdir()) == before


@pytest.mark.parametrize("words", [["--x0", "x9=1"], ["--x0", "x1"], ["--x0", "x1=nan"]])
def test_a_start_that_is_none_ends_in_2(check, words):
    code, _, lines, errors = check(COUNTEREXAMPLE, *words)
    assert (code, lines) == (2, [])
    assert "--x0" in errors
    assert "fix:" in errors


def test_a_mistake_of_the_file_ends_in_2_and_one_object(check):
    code, document, _, errors = check(PLANT.replace("k: 40", "k: -1"), "--json")
    assert (code, document["exit_code"]) == (2, 2)
    assert document["format"] == "bfppc-synth/error/1"
    assert "synthesis.gains.x1.k" in errors


def test_a_mistake_of_the_file_is_found_before_anything_heavy_is_imported(tmp_path):
    plant = tmp_path / "bad.yaml"
    plant.write_text(PLANT.replace("accuracy", "acuracy"))
    probe = (
        "import sys\nfrom bfppc_synth.cli import main\n"
        f"code = main(['check', {str(plant)!r}])\n"
        "heavy = ('sympy', 'casadi', 'matplotlib', 'scipy', 'numpy')\n"
        "print([name for name in heavy if name in sys.modules], code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", probe], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout == "[] 2\n"
    assert "did you mean accuracy" in done.stderr


def test_gains_that_are_open_and_not_found_end_in_3(check):
    text = PLANT.replace("synthesis: {gains: {x1: {k: 40}, x2: {k: 9000}}, p: {x2: 0.05}}", "")
    code, _, _, errors = check(text + "actuator: {limit: 0.01}\n")
    assert code == 3
    assert "synthesis.gains.x1.k" in errors
    assert "fix:" in errors


def test_open_half_widths_are_solved_for(check):
    code, document, lines, _ = check(PLANT.replace(", p: {x2: 0.05}", ""), "--json")
    assert code == 0
    assert document["solved_for"] == ["synthesis.p.x2"]
    assert document["origin"] == "solved"
    assert 0.0 < document["omega"]["p"][1] < 0.15
    _, _, lines, _ = check(PLANT.replace(", p: {x2: 0.05}", ""))
    assert lines[-1].startswith("verdict: PROVED, for what the file fixes together with")


def test_a_printed_file_with_sound_gains_is_proved_in_its_sound_form(check):
    text = PLANT.replace("synthesis: {", "synthesis: {method: theorem2, form: printed, ")
    code, document, _, _ = check(text, "--json")
    assert code == 0
    assert document["form"] == "printed"
    assert document["forms"]["printed"]["holds"]
    assert document["forms"]["sound"]["certificate"] == "certified"
    assert any("never certified" in note for note in document["notes"])
    # The folder of the printed form stays uncertified all the same.
    assert main([str(Path.cwd().parent / "plant.yaml"), "--quiet"]) == 4


def test_the_printed_example_1_is_written_as_not_certified(tmp_path):
    text = PRINTED.read_text().replace("horizon: 5", "horizon: 0.2")
    plant = tmp_path / "plant.yaml"
    plant.write_text(text)
    out = tmp_path / "out"
    assert main([str(plant), "--quiet"]) == 4
    assert main([str(plant), "--out", str(out), "--allow-uncertified", "--quiet"]) == 4
    name = "paper_example_1_printed"
    texts = ["README.md", "controller.py", "report.html", "trajectory.csv", "c/README.md"]
    texts += [f"c/include/{name}.h", f"c/src/{name}.c", "c/example/main.c", "c/Makefile"]
    for path in texts:
        assert "NOT CERTIFIED" in (out / path).read_text(), path
    report = json.loads((out / "report.json").read_text())
    assert (report["status"], report["notice"]) == ("printed", "NOT CERTIFIED")
    assert json.loads((out / "manifest.json").read_text())["status"] == "printed"
    assert not (out / "certificate.json").exists()
