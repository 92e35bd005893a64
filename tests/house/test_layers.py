"""The layer contract: it holds, and each way of breaking it is seen."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "bfppc_synth"


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    command = [str(Path(sys.executable).parent / "lint-imports"), "--no-cache", "--no-logo"]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, timeout=60
    )


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    shutil.copytree(PACKAGE, tmp_path / "bfppc_synth", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def add(folder: Path, module: str, text: str) -> None:
    path = folder / "bfppc_synth" / module
    path.parent.mkdir(exist_ok=True)
    path.write_text((path.read_text() if path.exists() else '"""New."""\n') + text)


def test_the_contract_holds(copy: Path) -> None:
    done = lint(copy)
    assert done.returncode == 0, done.stdout


def test_a_new_room_without_a_floor_breaks_the_contract(copy: Path) -> None:
    add(copy, "attic/__init__.py", "")
    done = lint(copy)
    assert done.returncode == 1
    assert "attic" in done.stdout


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("model/plant.py", "import bfppc_synth.expressions.parse\n"),
        ("report/summary.py", "import bfppc_synth.codegen.law\n"),
        ("expressions/names.py", "import bfppc_synth.pipeline\n"),
        ("spec/load.py", "import casadi\n"),
        ("pipeline.py", "import casadi\n"),
        ("certificate/produce.py", "import bfppc_synth.bounds.chain\n"),
        ("certificate/produce.py", "import bfppc_synth.majorants.envelope\n"),
        ("certificate/checker.py", "import bfppc_synth.errors\n"),
        ("certificate/checker.py", "import bfppc_synth.expressions.names\n"),
    ],
)
def test_a_forbidden_import_breaks_the_contract(copy: Path, module: str, line: str) -> None:
    add(copy, module, line)
    assert lint(copy).returncode == 1


def imported_roots(path: Path) -> set[str]:
    roots = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            roots |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            roots.add("." if node.level else (node.module or "").partition(".")[0])
    return roots


def test_the_checker_imports_only_the_standard_library() -> None:
    foreign = imported_roots(PACKAGE / "certificate" / "checker.py") - sys.stdlib_module_names
    assert foreign == set()


def test_only_the_solver_imports_casadi() -> None:
    importers = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if "casadi" in imported_roots(path)
    }
    assert importers == {"gains/solve.py"}


def test_the_rooms_do_not_import_the_public_names() -> None:
    """``bfppc_synth`` itself stands above every floor: what it offers is for users."""
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module == "bfppc_synth":
                names = {alias.name for alias in node.names}
                allowed = {"pipeline"} if path.parent.name == "commands" else set()
                assert names <= allowed, f"{path.relative_to(ROOT)}:{node.lineno}"
