"""Every snippet of the manual runs, and answers what stands below it.

A page is one session in one empty folder, from top to bottom. A fence with ``title="NAME"`` is a
file of that name; ``bash`` and untitled ``python`` are run; ``text title="output"`` is what the one
before it printed, where a line ``...`` stands for any lines and a number may differ in its fourth
digit. A comment before a fence says what is special: ``fails N`` (its exit code), ``shown`` (a part
of a file, or output that depends on the machine: not run), ``needs WORD`` (a command, format or
objective: run as soon as this version has it). ``long`` before the first fence of a page keeps the
page for BFPPC_TESTS=all.
"""

from __future__ import annotations

import itertools
import math
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from bfppc_synth.arguments import COMMANDS

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
UPDATE = os.environ.get("BFPPC_DOCS") == "update"
EVERY = os.environ.get("BFPPC_TESTS") == "all"
FENCE = re.compile(
    r"^(?:<!-- snippet: (?P<mark>[^>]*?) -->\n+)?```(?P<language>[a-z]*)"
    r'(?: title="(?P<title>[^"]+)")?\n(?P<text>.*?)^```$',
    re.MULTILINE | re.DOTALL,
)
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
RUN = {"bash": ["bash", "-euo", "pipefail"], "python": [sys.executable, "-"]}
FILES = {"yaml", "c", "python", "text", "bash", "json"}
# Pages that have tests of their own.
NEW_COMMANDS = ("campaign", "compare", "doctor", "new", "schema", "sweep")
OBJECTIVES = ("accuracy", "period", "resolution")
ELSEWHERE = {"paper.md", "commands.md"}


@dataclass(frozen=True)
class Snippet:
    page: str
    mark: str
    language: str
    title: str
    text: str

    @property
    def is_output(self):
        return self.title == "output"

    @property
    def is_file(self):
        return bool(self.title) and not self.is_output

    @property
    def is_long(self):
        return self.mark.endswith("long")

    @property
    def is_shown(self):
        word = self.mark.removeprefix("needs ").removesuffix(", long")
        waits = self.mark.startswith("needs") and not is_there(word)
        return self.mark.startswith("shown") or waits

    @property
    def exit_code(self):
        return int(self.mark.split()[1]) if self.mark.startswith("fails") else 0


def is_there(word):
    """Whether this version has a command, an export format or an objective of that name."""
    if word in NEW_COMMANDS:
        return word in COMMANDS
    refused = ROOT / "bfppc_synth" / "spec" / "availability.py"
    if word in OBJECTIVES:
        return not refused.exists() or f'word="{word}"' not in refused.read_text()
    interop = "".join(path.read_text() for path in sorted(ROOT.glob("bfppc_synth/export*.py")))
    return f'"{word}"' in interop


def snippets(page):
    text = (DOCS / page).read_text(encoding="utf-8")
    return [
        Snippet(page, *(match[key] or "" for key in ("mark", "language", "title", "text")))
        for match in FENCE.finditer(text)
    ]


PAGES = sorted(
    path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md") if path.name not in ELSEWHERE
)
SNIPPETS = {page: found for page in PAGES if (found := snippets(page))}


def is_session(page):
    return any(s.language in RUN and not s.is_shown and not s.is_file for s in SNIPPETS[page])


SESSIONS = [page for page in SNIPPETS if is_session(page)]
LONG = {page for page in SESSIONS if any(s.is_long for s in SNIPPETS[page])}


def alike(expected, found):
    """Whether two lines agree but for the last digits of their numbers."""
    words = [re.sub(r"\s+", " ", word) for word in NUMBER.split(expected.strip())]
    if words != [re.sub(r"\s+", " ", word) for word in NUMBER.split(found.strip())]:
        return False
    pairs = zip(NUMBER.findall(expected), NUMBER.findall(found), strict=True)
    return all(math.isclose(float(a), float(b), rel_tol=2e-3, abs_tol=1e-12) for a, b in pairs)


def matches(expected, found):
    """Whether found lines are the expected ones; a line ``...`` stands for any number of them."""
    if not expected:
        return not found
    if expected[0].strip() == "...":
        return any(matches(expected[1:], found[index:]) for index in range(len(found) + 1))
    return bool(found) and alike(expected[0], found[0]) and matches(expected[1:], found[1:])


def update(snippet, printed):
    """Put what was printed into the page, as many lines as stood there before ``...``."""
    path, lines = DOCS / snippet.page, snippet.text.splitlines()
    kept = [*printed[: lines.index("...")], "..."] if "..." in lines else printed
    fence = '```text title="output"\n'
    new = "".join(f"{line}\n" for line in kept)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(fence + snippet.text, fence + new, 1), encoding="utf-8")


@pytest.fixture
def environment(tmp_path):
    """An environment whose first `bfppc-synth` and `python` are the ones under test."""
    tools = tmp_path / "tools"
    tools.mkdir()
    for name, call in {"bfppc-synth": "-m bfppc_synth", "python": ""}.items():
        script = tools / name
        script.write_text(f'#!/bin/sh\nexec "{sys.executable}" {call} "$@"\n')
        script.chmod(0o755)
    path = os.pathsep.join([str(tools), os.environ["PATH"]])
    return {**os.environ, "PATH": path, "PYTHONPATH": str(ROOT), "NO_COLOR": "1", "COLUMNS": "100"}


@pytest.mark.parametrize("page", SESSIONS if EVERY else sorted(set(SESSIONS) - LONG))
def test_a_page_runs_from_top_to_bottom(page, tmp_path, environment):
    folder = tmp_path / "empty"
    folder.mkdir()
    printed = []
    for snippet in SNIPPETS[page]:
        if snippet.is_shown:
            continue
        if snippet.is_output:
            expected = snippet.text.splitlines()
            if UPDATE and not matches(expected, printed):
                update(snippet, printed)
                continue
            assert matches(expected, printed), "\n".join(["printed:", *printed])
        elif snippet.is_file:
            path = folder / snippet.title
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(snippet.text, encoding="utf-8")
        elif snippet.language in RUN:
            done = subprocess.run(
                RUN[snippet.language],
                input=snippet.text,
                cwd=folder,
                env=environment,
                check=False,
                capture_output=True,
                text=True,
                timeout=600,
            )
            assert done.returncode == snippet.exit_code, snippet.text + done.stdout + done.stderr
            # What a failure says stands on stderr.
            printed = (done.stderr if snippet.exit_code else done.stdout).splitlines()


@pytest.mark.parametrize("page", SNIPPETS)
def test_a_fence_is_run_or_says_why_not(page):
    for snippet in SNIPPETS[page]:
        assert re.fullmatch(r"|long|fails \d|shown: .+|needs [a-z0-9]+(?:, long)?", snippet.mark), (
            snippet.mark
        )
        runs = snippet.language in RUN
        assert snippet.is_shown or snippet.is_output or runs or snippet.is_file, snippet.text
        assert snippet.language in FILES, snippet


def test_an_output_stands_below_what_printed_it():
    for found in SNIPPETS.values():
        for before, after in itertools.pairwise(found):
            if after.is_output:
                assert before.language in RUN
                assert not before.is_file


def test_the_sample_is_small_and_has_the_tutorial():
    short = set(SESSIONS) - LONG
    assert "tutorial.md" in short
    assert len(short) <= 4
    assert len(SESSIONS) >= 10


@pytest.mark.parametrize(
    ("expected", "found", "same"),
    [
        (["U 1.000", "..."], ["U 1.0001", "more"], True),
        (["U 1.000"], ["U 1.01"], False),
        (["...", "end"], ["a", "b", "end"], True),
        (["a", "end"], ["a", "b", "end"], False),
        (["margin 0"], ["margin x"], False),
    ],
)
def test_the_comparison_sees_a_changed_word_and_a_third_digit(expected, found, same):
    assert matches(expected, found) is same
