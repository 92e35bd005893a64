"""What the command does before it parses its words: Ctrl-C, and the mistakes of a plant file."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from bfppc_synth import cli
from bfppc_synth.__main__ import main

if TYPE_CHECKING:
    from pathlib import Path

BAD = """\
name: plant
states: [x1]
dynamics: {x1: {f: y}}
initial: {x1: 0}
performance: {accuracy: 1}
"""
INTERRUPTED = """\
import sys


class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            raise KeyboardInterrupt


sys.meta_path.insert(0, Finder())
from bfppc_synth.__main__ import main

sys.exit(main([{word!r}]))
"""


@pytest.fixture
def plant(tmp_path: Path) -> Path:
    path = tmp_path / "plant.yaml"
    path.write_text(BAD)
    return path


def run(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


@pytest.mark.parametrize(
    "name", ["bfppc_synth.cli", "typer", "bfppc_synth.spec.load", "ruamel", "bfppc_synth.errors"]
)
def test_ctrl_c_while_modules_are_imported_exits_130_without_a_traceback(
    plant: Path, name: str
) -> None:
    done = run("-c", INTERRUPTED.format(name=name, word=str(plant)))
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_a_faulty_file_is_answered_before_the_command_line_is_parsed(plant: Path) -> None:
    # What typer imports to convert a path takes longer than reading the file.
    program = (
        "import sys\nfrom bfppc_synth.__main__ import main\ncode = main(sys.argv[1:])\n"
        "heavy = {'pydantic', 'rich', 'jinja2', 'numpy', 'sympy', 'bfppc_synth.pipeline'}\n"
        "print(sorted(heavy & set(sys.modules)))\nsys.exit(code)\n"
    )
    done = run("-c", program, str(plant))
    assert (done.returncode, done.stdout) == (2, "[]\n")
    assert done.stderr.startswith(f"{plant}:3:20: error: dynamics.x1.f: unknown name `y`\n")


@pytest.mark.parametrize(
    "words",
    [
        ("{}",),
        ("synth", "{}"),
        ("--quiet", "{}"),
        ("{}", "--out", "folder"),
        ("--out", "folder", "{}"),
        ("synth", "--seed", "3", "{}", "--force"),
    ],
)
def test_both_roads_answer_a_faulty_file_with_the_same_words(
    plant: Path, words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    given = [word.format(plant) for word in (*words, "--json")]
    assert main(given) == 2
    early = capsys.readouterr()
    assert cli.main(given) == 2
    assert capsys.readouterr() == early
    document = json.loads(early.out)
    assert document["format"] == "bfppc-synth/error/1"
    assert [row["column"] for row in document["mistakes"]] == [20]


@pytest.mark.parametrize(
    ("words", "code", "answer"),
    [
        (["{}", "--help"], 0, "Usage"),
        (["--version"], 0, "bfppc-synth "),
        (["verify", "{}"], 2, "no such folder"),
        (["frobnicate"], 2, "neither a command"),
        (["{}", "{}"], 2, "unexpected extra argument"),
    ],
)
def test_other_words_are_left_to_the_command_line(
    plant: Path, words: list[str], code: int, answer: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([word.format(plant) for word in words]) == code
    said = capsys.readouterr()
    assert answer in said.out + said.err


def test_letters_that_the_terminal_lacks_are_escaped(tmp_path: Path) -> None:
    path = tmp_path / "plant.yaml"
    path.write_text(BAD.replace("f: y", "f: x1*\u03b1"), encoding="utf-8")
    command = [sys.executable, "-m", "bfppc_synth", str(path)]
    ascii_only = {**os.environ, "PYTHONIOENCODING": "ascii:strict"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=ascii_only)
    assert done.returncode == 2
    assert "`\\u03b1` is no ASCII character" in done.stderr


def test_the_module_is_the_command(plant: Path) -> None:
    done = run("-m", "bfppc_synth", str(plant))
    assert done.returncode == 2
    assert "\n  fix: the names here are x1\n" in done.stderr
