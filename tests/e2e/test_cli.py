"""The command line from outside: words, exit codes, streams, answer times."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from bfppc_synth import cli
from bfppc_synth.cli import arrange, main
from bfppc_synth.errors import UsageError

ROOT = Path(__file__).parents[2]
GOOD = ROOT / "examples" / "paper_example_1.yaml"
HEAVY = ("sympy", "casadi", "matplotlib", "scipy", "numpy")


def run(
    *words: str, cwd: Path | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "bfppc_synth", *words],
        cwd=cwd,
        env={**os.environ, **environment},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


@pytest.fixture
def bad(tmp_path: Path) -> Path:
    path = tmp_path / "bad.yaml"
    path.write_text(
        GOOD.read_text().replace("accuracy:", "acuracy:").replace("name:", "nane:"),
    )
    return path


@pytest.mark.parametrize(
    ("words", "arranged"),
    [
        (["plant.yaml"], ["synth", "plant.yaml"]),
        (["plant.YML", "--json"], ["synth", "plant.YML", "--json"]),
        (["--out", "o", "--json", "plant.yaml"], ["synth", "--out", "o", "--json", "plant.yaml"]),
        (["--out=o", "plant.yaml"], ["synth", "--out=o", "plant.yaml"]),
        (["--json", "verify", "d"], ["verify", "--json", "d"]),
        (["--seed", "3", "simulate", "d"], ["simulate", "--seed", "3", "d"]),
        (["synth", "plant.yaml"], ["synth", "plant.yaml"]),
        (["--help"], ["--help"]),
        ([], []),
    ],
)
def test_options_may_stand_before_the_command_or_the_plant(
    words: list[str], arranged: list[str]
) -> None:
    assert arrange(words) == arranged


def test_any_file_is_a_plant_and_a_command_stays_a_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.txt").touch()
    (tmp_path / "verify").touch()
    assert arrange(["arm.txt"]) == ["synth", "arm.txt"]
    assert arrange(["verify", "d"]) == ["verify", "d"]
    with pytest.raises(UsageError, match="neither a command"):
        arrange(["leg.txt"])


def test_a_mistyped_command_is_answered_with_the_nearest() -> None:
    with pytest.raises(UsageError, match="did you mean verify"):
        arrange(["verfy", "d"])


@pytest.mark.parametrize("words", [["--real", "half"], ["--math", "newlib"]])
def test_a_number_type_or_library_that_there_is_not_is_refused(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(GOOD), *words]) == 2
    told = capsys.readouterr().err
    assert f"'{words[0]}': '{words[1]}' is not one of" in told
    assert "see bfppc-synth synth --help" in told
    assert main(["synth", "--help"]) == 0
    listed = capsys.readouterr().out
    assert "double|float" in listed
    assert "libm|portable" in listed


@pytest.mark.parametrize(
    "words",
    [
        ["synth"],
        ["verify"],
        ["synth", "plant.yaml", "--jsn"],
        ["--seed", "x", "plant.yaml"],
        ["simulate", "d", "--x0", "x1"],
        ["nothing"],
        ["nothing.yaml"],
        ["verify", "nothing"],
        ["simulate", "nothing"],
    ],
)
def test_a_mistake_of_usage_ends_in_2_without_a_traceback(words: list[str], tmp_path: Path) -> None:
    done = run(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_help_lists_the_commands_and_imports_nothing_heavy() -> None:
    probe = (
        "import sys\nfrom bfppc_synth.cli import main\ncode = main(['--help'])\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", probe], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.splitlines()[-1] == "[] 0"
    for command in cli.COMMANDS:
        assert f"\n  {command} " in done.stdout


def test_a_mistake_in_a_plant_file_is_found_before_anything_heavy_is_imported(bad: Path) -> None:
    probe = (
        "import sys\nfrom bfppc_synth.cli import main\n"
        f"code = main([{str(bad)!r}])\n"
        f"print([name for name in {HEAVY!r} if name in sys.modules], code)"
    )
    done = subprocess.run(
        [sys.executable, "-c", probe], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout == "[] 2\n"
    assert f"{bad}:" in done.stderr
    assert "fix:" in done.stderr


def test_a_mistake_in_a_plant_file_is_one_object_with_json(bad: Path, tmp_path: Path) -> None:
    done = run("--json", str(bad), cwd=tmp_path)
    document = json.loads(done.stdout)
    assert done.returncode == document["exit_code"] == 2
    assert document["format"] == "bfppc-synth/error/1"
    assert {mistake["path"] for mistake in document["mistakes"]} >= {"nane", "performance.acuracy"}
    assert all(mistake["line"] > 1 and mistake["message"] for mistake in document["mistakes"])
    assert [path.name for path in tmp_path.iterdir()] == ["bad.yaml"]


def test_version_names_what_the_numbers_come_from() -> None:
    done = run("--version")
    assert done.returncode == 0
    for word in ("bfppc-synth 0.1.0", "casadi", "sympy", "Python"):
        assert word in done.stdout


def fail_with(error: BaseException) -> object:
    def stand_in(*_args: object, **_keywords: object) -> None:
        raise error

    return stand_in


def test_an_unexpected_error_is_one_line_and_1(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from bfppc_synth import pipeline

    monkeypatch.delenv("BFPPC_TRACEBACK", raising=False)
    monkeypatch.setattr(pipeline, "verify", fail_with(ZeroDivisionError("by nought")))
    assert main(["verify", "."]) == 1
    streams = capsys.readouterr()
    assert streams.out == ""
    assert streams.err.splitlines() == [
        "unexpected ZeroDivisionError: by nought (BFPPC_TRACEBACK=1 shows where)"
    ]


def test_the_traceback_of_an_unexpected_error_is_there_on_request(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from bfppc_synth import pipeline

    monkeypatch.setenv("BFPPC_TRACEBACK", "1")
    monkeypatch.setattr(pipeline, "verify", fail_with(ZeroDivisionError("by nought")))
    with pytest.raises(ZeroDivisionError):
        main(["verify", "."])


def test_an_interrupt_ends_in_130_without_a_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from bfppc_synth import pipeline

    monkeypatch.setattr(pipeline, "verify", fail_with(KeyboardInterrupt()))
    assert main(["verify", "."]) == 130
    assert "Traceback" not in capsys.readouterr().err
