"""The rules of the house that no linter knows."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "bfppc_synth"
MODULES = sorted(PACKAGE.rglob("*.py"))
TESTS = sorted((ROOT / "tests").rglob("*.py"))
CHECKER = PACKAGE / "certificate" / "checker.py"
PRINTERS = {PACKAGE / "cli.py", PACKAGE / "voice.py", CHECKER}
PARSERS = {"sympify", "S", "parse_expr"}
RUNNERS = {"eval", "exec", "compile"}
SHOUTS = re.compile(r"\b(?:TO" + r"DO|FIX" + r"ME|XX" + r"X)\b")


def name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def called(node: ast.AST) -> str:
    """Name of the function of a plain call; empty for everything else."""
    if not isinstance(node, ast.Call):
        return ""
    function = node.func
    if isinstance(function, ast.Name):
        return function.id
    return function.attr if isinstance(function, ast.Attribute) else ""


@pytest.mark.parametrize("path", MODULES, ids=name)
def test_a_module_stays_under_300_lines(path: Path) -> None:
    # The checker is one file on purpose. It was to stay below 1500 lines and does not: see
    # DECISIONS.md. The number here keeps it from growing further.
    limit = 6700 if path == CHECKER else 299
    assert len(path.read_text(encoding="utf-8").splitlines()) <= limit


@pytest.mark.parametrize("path", MODULES, ids=name)
def test_no_module_runs_text_or_asserts_or_swallows_everything(path: Path) -> None:
    faults = []
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Assert):
            faults.append((node.lineno, "assert"))
        if isinstance(node, ast.ExceptHandler) and node.type is None:
            faults.append((node.lineno, "bare except"))
        if isinstance(node, ast.Call):
            # `.eval` of some object is not the builtin; sympy's parsers are unsafe however called.
            banned = PARSERS if isinstance(node.func, ast.Attribute) else PARSERS | RUNNERS
            if called(node) in banned:
                faults.append((node.lineno, called(node)))
    assert faults == []


@pytest.mark.parametrize("path", [*MODULES, *TESTS], ids=name)
def test_no_comment_leaves_work_for_later(path: Path) -> None:
    kinds = {tokenize.COMMENT, tokenize.STRING}
    with path.open("rb") as file:
        tokens = [token for token in tokenize.tokenize(file.readline) if token.type in kinds]
    words = [token.start for token in tokens if SHOUTS.search(token.string)]
    assert words == []


@pytest.mark.parametrize("path", MODULES, ids=name)
def test_every_module_says_what_it_is_for(path: Path) -> None:
    assert ast.get_docstring(tree(path))


@pytest.mark.parametrize("path", [p for p in MODULES if p not in PRINTERS], ids=name)
def test_only_the_command_line_prints(path: Path) -> None:
    prints = [node.lineno for node in ast.walk(tree(path)) if called(node) == "print"]
    assert prints == []
    assert "sys.stdout" not in path.read_text(encoding="utf-8")


@pytest.mark.parametrize("path", MODULES, ids=name)
def test_no_room_is_a_lumber_room(path: Path) -> None:
    assert path.stem not in {"utils", "util", "helpers", "helper", "manager", "common", "misc"}


@pytest.mark.parametrize("path", TESTS, ids=name)
def test_no_test_is_skipped_or_expected_to_fail(path: Path) -> None:
    banned = {"skip", "skipif", "xfail", "importorskip", "skipTest"}
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Attribute):
            assert node.attr not in banned, node.lineno
        if isinstance(node, ast.Assert) and isinstance(node.test, ast.Constant):
            assert not node.test.value, node.lineno


def test_every_record_is_frozen_and_slotted() -> None:
    loose = []
    for path in sorted((PACKAGE / "model").glob("*.py")):
        for node in ast.walk(tree(path)):
            if not isinstance(node, ast.ClassDef):
                continue
            for decorator in node.decorator_list:
                if called(decorator) == "dataclass":
                    given = {keyword.arg for keyword in decorator.keywords}
                    if not {"frozen", "slots", "kw_only"} <= given:
                        loose.append(f"{name(path)}:{node.lineno}")
                elif isinstance(decorator, ast.Name) and decorator.id == "dataclass":
                    loose.append(f"{name(path)}:{node.lineno}")
    assert loose == []


def committed_texts() -> list[Path]:
    """Every text file of the repository that a reader may open."""
    kinds = {".py", ".md", ".toml", ".yaml", ".jinja", ".c", ".h", ".json", ".html", ".lock"}
    folders = ("bfppc_synth", "templates", "docs", "examples", "generated", "benchmarks")
    files = [path for path in ROOT.iterdir() if path.suffix in kinds or path.name == "Makefile"]
    for folder in (*folders, ".ci"):
        files += [path for path in (ROOT / folder).rglob("*") if path.is_file()]
    return sorted(path for path in files if path.suffix in kinds or path.suffix == "")


def test_no_file_names_a_path_or_an_index_of_one_machine() -> None:
    machine = re.compile(r"(?<![A-Za-z0-9_.])/(?:home|root|work|tmp|Users)/|--(?:extra-)?index-url")
    found = []
    for path in committed_texts():
        if "__pycache__" in path.parts:
            continue
        text = path.read_text(encoding="utf-8")
        found += [f"{name(path)}: {match[0]}" for match in machine.finditer(text)]
    assert found == []


def test_the_lock_pins_every_package_once() -> None:
    lines = (ROOT / "requirements.lock").read_text().splitlines()
    pattern = re.compile(r"([A-Za-z0-9._-]+)==[0-9][A-Za-z0-9.]*")
    matches = [pattern.fullmatch(line) for line in lines]
    assert all(matches), lines
    names = [match[1].lower() for match in matches if match]
    assert len(set(names)) == len(names)


def test_the_lock_covers_what_the_package_asks_for() -> None:
    import tomllib

    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [*project["dependencies"], *project["optional-dependencies"]["dev"]]
    lock = io.StringIO((ROOT / "requirements.lock").read_text())
    pinned = {re.sub(r"[-_.]+", "-", line.partition("==")[0]).lower() for line in lock}
    for requirement in wanted:
        key = re.sub(r"[-_.]+", "-", re.split(r"[<>=!~,\[ ]", requirement)[0]).lower()
        assert key in pinned, requirement
