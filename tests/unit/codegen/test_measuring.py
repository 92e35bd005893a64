"""What a step costs on the emulated target: make target's numbers, or the reason for none."""

from __future__ import annotations

import dataclasses
import os
import re
import shlex
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from bfppc_synth.codegen import measuring
from bfppc_synth.codegen.measuring import COMPILER, EMULATOR, SIZE, commands, measure_step
from bfppc_synth.model.target import NotMeasured, TargetCost

NAME = "paper_example_2"
PLACE = Path(__file__).parents[3] / "generated" / NAME


def code() -> dict[str, str]:
    """The committed package, without what a make in that folder has left."""
    found = {path.relative_to(PLACE).as_posix(): path for path in sorted(PLACE.rglob("*"))}
    return {
        path: place.read_text()
        for path, place in found.items()
        if place.is_file() and not path.startswith("c/build/") and "__pycache__" not in path
    }


@pytest.fixture
def package(tmp_path):
    return shutil.copytree(PLACE / "c", tmp_path / "c", ignore=shutil.ignore_patterns("build"))


@pytest.fixture
def tools(tmp_path, monkeypatch):
    """A folder that is all of PATH, with the true tools in it; a test takes or replaces some."""
    folder = tmp_path / "tools"
    folder.mkdir()
    for tool in (COMPILER, EMULATOR, SIZE):
        stub(folder, tool, f'exec {shlex.quote(shutil.which(tool))} "$@"')
    # The compiler calls its own parts by their places; the stubs need the shell and nothing else.
    monkeypatch.setenv("PATH", str(folder))
    return folder


def stub(folder: Path, tool: str, text: str) -> None:
    path = folder / tool
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


def reason() -> str:
    found = measure_step(code(), NAME)
    assert isinstance(found, NotMeasured)
    assert not set("/\\") & set(found.reason), "a place of this machine"
    return found.reason


def plain_make() -> dict[str, str]:
    """The environment without what an outer make hands down."""
    return {key: text for key, text in os.environ.items() if not key.startswith("MAKE")}


def test_the_commands_are_those_of_the_makefile(package):
    said = subprocess.run(
        ["make", "-n", "target"],
        cwd=package,
        env=plain_make(),
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    lines = [shlex.split(line) for line in said.replace("\\\n", " ").splitlines()]
    assert [line for line in lines if line[0] != "mkdir"] == [list(line) for line in commands(NAME)]


def test_the_numbers_are_those_of_make_target(package):
    said = subprocess.run(
        ["make", "-s", "target"],
        cwd=package,
        env=plain_make(),
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    found = measure_step(code(), NAME)
    assert f"{found.least} least, {found.average} on average, {found.most} most" in said
    assert f"stack {found.stack} bytes" in said
    assert f"state {found.state} bytes" in said
    assert said.splitlines()[-1].split()[0] == str(found.code)
    assert 500 < found.least < found.average < found.most < 50_000


def test_a_measurement_says_the_same_again(tools):
    first = measure_step(code(), NAME)
    assert isinstance(first, TargetCost)
    assert measure_step(code(), NAME) == first
    assert re.fullmatch(r"arm-none-eabi-gcc \d+\.\d+\.\d+.*", first.compiler)
    assert re.fullmatch(r"QEMU \d+\.\d+", first.emulator)


@pytest.mark.parametrize("tool", [COMPILER, EMULATOR, SIZE])
def test_a_tool_that_is_not_there_is_named(tools, tool):
    (tools / tool).unlink()
    assert reason() == f"{tool} is not on PATH"


def test_a_compiler_that_fails_gives_its_own_words_without_a_place(tools):
    version = '[ "$1" = --version ] && { echo "arm-none-eabi-gcc (x) 1.2.3"; exit 0; }'
    words = (
        "echo 'In file included'; echo '/opt/of/cc1: fatal error: no \"/b/a.c\" C:\\\\d\\\\e.c' >&2"
    )
    stub(tools, COMPILER, f"{version}\n{words}\nexit 3")
    assert reason() == f'{COMPILER} ended with 3: cc1: fatal error: no "a.c" e.c'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("exit 4", "ended with 4"),
        ("kill -9 $$", "ended with -9"),
        ("echo a; echo 'b: error: c'; exit 1", "ended with 1: b: error: c"),
        ("printf 'a\\033[1m\\377b'; exit 1", "ended with 1: a [1m\N{REPLACEMENT CHARACTER}b"),
    ],
)
def test_a_compiler_that_ends_badly_is_told_with_its_status(tools, text, said):
    stub(tools, COMPILER, text)
    assert reason() == f"{COMPILER} {said}"


def test_long_words_of_a_tool_are_cut(tools):
    stub(tools, COMPILER, f"echo {'word ' * 100}; exit 1")
    assert len(reason()) < 200
    assert reason().endswith("...")


def test_a_file_that_is_no_program_does_not_start(tools):
    (tools / EMULATOR).write_bytes(b"\x7fELF no more")
    assert reason().startswith(f"{EMULATOR} does not start: ")


def test_an_emulator_without_numbers_is_not_believed(tools):
    stub(tools, EMULATOR, "echo QEMU emulator version 9.8.7")
    assert reason() == f"{EMULATOR} gave no numbers"


def test_sizes_without_numbers_are_not_believed(tools):
    stub(tools, SIZE, "echo text data")
    assert reason() == f"{SIZE} gave no numbers"


def test_code_that_answers_otherwise_on_the_target_has_no_cost():
    path = "c/test/vectors.h"
    wrong = code()
    wrong[path] = wrong[path].replace(", 2.814246950984661, ", ", 2.914246950984661, ")
    assert wrong[path] != code()[path]
    found = measure_step(wrong, NAME)
    assert isinstance(found, NotMeasured)
    assert found.reason.startswith(f"{EMULATOR} ended with 1: vector 1: 2.814")


@pytest.mark.parametrize("then", ["wait", "exit 0"])
def test_a_command_that_does_not_end_is_ended_with_all_that_it_started(
    tools, tmp_path, monkeypatch, then
):
    monkeypatch.setattr(measuring, "TIME_LIMIT", 0.5)
    sleep = shutil.which("sleep", path="/usr/bin:/bin")
    note = tmp_path / "started"
    stub(tools, COMPILER, f"{sleep} 60 & echo $! > {shlex.quote(str(note))}; {then}")
    begin = time.monotonic()
    assert reason() == f"{COMPILER} took longer than 0.5 s"
    assert time.monotonic() - begin < 30.0
    assert not running(int(note.read_text()))


def running(process: int) -> bool:
    """Whether a process still does something; one that nobody has waited for does not."""
    for _ in range(50):
        state = Path(f"/proc/{process}/stat")
        try:
            if state.read_text().rpartition(")")[2].split()[0] == "Z":
                return False
        except (FileNotFoundError, ProcessLookupError):
            return False
        time.sleep(0.1)
    return True


def test_without_room_for_the_compilation_there_is_a_reason(monkeypatch, tmp_path):
    monkeypatch.setattr(measuring.tempfile, "tempdir", str(tmp_path / "nowhere"))
    assert reason() == "no folder to compile in: No such file or directory"


def test_only_the_c_folder_is_compiled_and_a_file_less_is_said(tools):
    less = {path: text for path, text in code().items() if path != "c/target/startup.c"}
    found = measure_step(less, NAME)
    assert isinstance(found, NotMeasured)
    assert "startup.c" in found.reason


def test_a_cost_is_a_record_of_whole_numbers():
    found = measure_step(code(), NAME)
    numbers = [value for value in dataclasses.astuple(found) if not isinstance(value, str)]
    assert all(type(value) is int and value > 0 for value in numbers)
    assert len(numbers) == 6
