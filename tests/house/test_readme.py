"""README tells the truth where a test can see it."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

from bfppc_synth.cli import COMMANDS, main

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_its_plant_file_is_certified_and_its_ten_lines_of_python_run(tmp_path: Path) -> None:
    (text,) = blocks("yaml")
    (program,) = blocks("python")
    (tmp_path / "my_plant.yaml").write_text(text)
    assert len([line for line in program.splitlines() if line]) <= 10
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    first, second = done.stdout.splitlines()
    assert first.startswith("certified with |u| <= ")
    assert second.startswith("largest error ")
    # The folder that Python wrote is the one that the command line checks.
    assert main(["verify", str(tmp_path / "generated" / "my_plant"), "--quiet"]) == 0


def test_its_make_targets_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    named = set(re.findall(r"(?:^|`)make ([a-z-]+)", README, flags=re.MULTILINE))
    assert named >= {"demo", "test", "bench"}
    assert named <= targets


def test_its_commands_exist() -> None:
    lines = "\n".join(blocks("sh")).splitlines()
    words = [line.split()[1] for line in lines if line.startswith(".venv/bin/bfppc-synth")]
    assert words
    assert all(word in COMMANDS or word.endswith(".yaml") for word in words)


def test_what_it_links_to_is_there() -> None:
    links = re.findall(r"\]\(([^)#]+)\)", README)
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []
