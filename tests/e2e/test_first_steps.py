"""``new``, ``schema``, ``doctor``, shell completion, and --json of every command."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML

from bfppc_synth.arguments import COMMANDS, arrange_completion
from bfppc_synth.cli import main
from bfppc_synth.new_plant import SCHEMA_FILE, templates
from bfppc_synth.spec.load import load_spec

ROOT = Path(__file__).parents[2]
HEADER = f"# yaml-language-server: $schema={SCHEMA_FILE}\n"


@pytest.fixture
def run(tmp_path, capsys, monkeypatch):
    """Run a command in an empty folder; code, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def command(*words):
        code = main(words)
        streams = capsys.readouterr()
        return code, streams.out, streams.err

    return command


def test_a_new_plant_file_is_certified_at_once(run, tmp_path):
    assert run("new", "arm")[0] == 0
    assert (tmp_path / "arm.yaml").read_text().startswith(HEADER)
    code, out, errors = run("arm.yaml", "--json")
    assert (code, errors) == (0, "")
    assert json.loads(out)["status"] == "certified"


def test_every_key_that_a_new_plant_file_offers_is_one(run, tmp_path):
    run("new", "arm")
    text = (tmp_path / "arm.yaml").read_text()
    lines = text.splitlines()
    begin = next(i for i, line in enumerate(lines) if line.startswith("name:"))
    # What is commented out, but for what excludes something that stands there.
    apart = ("f_bound:", "g_min:", "bounds:")
    offered = [
        line.replace("# ", "", 1)
        if line.lstrip().startswith(("# ", "#   ")) and not any(word in line for word in apart)
        else line
        for line in lines[begin:]
    ]
    (tmp_path / "all.yaml").write_text("\n".join(offered) + "\n")
    spec = load_spec(tmp_path / "all.yaml")
    for path in ("performance.funnel", "actuator.limit", "sampling.delay", "measurement.noise"):
        assert spec.gives(path)


@pytest.mark.parametrize("template", templates())
def test_an_example_can_be_begun_with(run, tmp_path, template):
    code, out, _ = run("new", "sub/mine", "--template", template, "--json")
    assert code == 0
    assert json.loads(out)["files"] == ["sub/mine.yaml", f"sub/{SCHEMA_FILE}"]
    text = (tmp_path / "sub" / "mine.yaml").read_text()
    assert text.startswith(HEADER)
    spec = load_spec(tmp_path / "sub" / "mine.yaml")
    origin = load_spec(ROOT / "examples" / f"{template}.yaml")
    assert (spec.name, spec.dynamics) == ("mine", origin.dynamics)
    schema = json.loads((tmp_path / "sub" / SCHEMA_FILE).read_text())
    document = YAML(typ="safe", pure=True).load(text)
    assert list(Draft202012Validator(schema).iter_errors(document)) == []


def test_a_file_is_replaced_by_force_only(run, tmp_path):
    (tmp_path / "arm.yaml").write_text("mine")
    code, _, errors = run("new", "arm")
    assert code == 2
    assert "is there already" in errors
    assert (tmp_path / "arm.yaml").read_text() == "mine"
    assert not (tmp_path / SCHEMA_FILE).exists()
    assert run("new", "arm", "--force")[0] == 0
    assert (tmp_path / "arm.yaml").read_text().startswith(HEADER)


def test_a_foreign_schema_is_kept_and_an_old_one_renewed(run, tmp_path):
    (tmp_path / SCHEMA_FILE).write_text('{"$id": "urn:other"}')
    code, _, errors = run("new", "arm")
    assert code == 2
    assert "is not the schema of a plant file" in errors
    (tmp_path / SCHEMA_FILE).write_text('{"$id": "urn:bfppc-synth:plant:1"}')
    assert run("new", "arm")[0] == 0
    assert "properties" in json.loads((tmp_path / SCHEMA_FILE).read_text())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("new", "Arm"), "small letters"),
        (("new", "double"), "already"),
        (("new", "stdio"), "already"),
        (("new", ""), "small letters"),
        (("new", ".."), "small letters"),
        (("new", "a" * 25), "1 to 24"),
        (("new", "arm", "--template", "motor_rm"), "did you mean motor_arm?"),
        (("new", "arm", "--template", "../van_der_pol"), "no such example"),
        (("new",), "NAME"),
    ],
)
def test_a_name_that_no_plant_has_is_refused(run, tmp_path, words, said):
    code, _, errors = run(*words)
    assert code == 2
    assert said in errors
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_written_is_an_answer(run, tmp_path):
    (tmp_path / "file").write_text("")
    code, _, errors = run("new", "file/arm")
    assert code == 2
    assert "no plant file was written" in errors


def test_the_schema_is_printed_as_it_is_written(run, tmp_path):
    _, out, _ = run("schema")
    run("new", "arm", "--quiet")
    assert out == (tmp_path / SCHEMA_FILE).read_text()
    document = json.loads(run("schema", "--json")[1])
    assert document["format"] == "bfppc-synth/schema/1"
    assert document["schema"] == json.loads(out)


def test_the_doctor_knows_what_is_there(run):
    code, out, _ = run("doctor", "--json")
    document = json.loads(out)
    assert (code, document["format"], document["ready"]) == (0, "bfppc-synth/doctor/1", True)
    entries = {entry["name"]: entry for entry in document["entries"]}
    assert entries["casadi"]["ok"]
    assert entries["casadi"]["version"]
    assert all(entry["purpose"] for entry in document["entries"])


def test_the_doctor_says_how_to_get_what_is_missing(run, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda *_words, **_named: None)
    code, out, _ = run("doctor")
    assert code == 0
    lines = out.splitlines()
    place = next(i for i, line in enumerate(lines) if line.startswith("missing  frama-c"))
    assert "to get it: apt-get install frama-c" in lines[place + 1]
    assert lines[-1] == "everything that a synthesis needs is there"


def test_a_tool_that_does_not_run_is_no_error(run, tmp_path, monkeypatch):
    (tmp_path / "typst").write_text("no program")
    (tmp_path / "typst").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    entries = json.loads(run("doctor", "--json")[1])["entries"]
    assert {e["name"]: e["version"] for e in entries}["typst"] == "there, but it does not run"


@pytest.mark.parametrize(
    ("words", "place", "answers"),
    [
        ("bfppc-synth s", "1", {"synth", "simulate", "sweep", "schema"}),
        ("bfppc-synth sweep --w", "2", {"--workers"}),
        ("bfppc-synth plant.yaml --forc", "2", {"--force"}),
    ],
)
def test_a_shell_is_told_what_may_follow(words, place, answers):
    done = subprocess.run(
        [sys.executable, "-m", "bfppc_synth"],
        env={
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "_BFPPC_SYNTH_COMPLETE": "complete_bash",
            "COMP_WORDS": words,
            "COMP_CWORD": place,
        },
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert set(done.stdout.split()) == answers


def test_completion_leaves_other_words_alone():
    environment = {"COMP_WORDS": "bfppc-synth plant.yaml", "COMP_CWORD": "1"}
    arrange_completion(environment)
    assert environment == {"COMP_WORDS": "bfppc-synth plant.yaml", "COMP_CWORD": "1"}
    environment = {"_TYPER_COMPLETE_ARGS": "bfppc-synth a.YML --f"}
    arrange_completion(environment)
    assert environment == {"_TYPER_COMPLETE_ARGS": "bfppc-synth synth a.YML --f"}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_answers_in_json(run, command):
    """Also where it cannot do anything: one object with a format and the exit code."""
    code, out, _ = run(command, *(() if command in ("schema", "doctor") else ("none",)), "--json")
    document = json.loads(out)
    assert document["format"].startswith("bfppc-synth/")
    assert document["exit_code"] == code
