"""README tells the truth where a test can see it."""

from __future__ import annotations

import re
from pathlib import Path

from bfppc_synth.cli import COMMANDS, main

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_its_plant_file_is_certified(tmp_path: Path) -> None:
    (text,) = blocks("yaml")
    plant = tmp_path / "my_plant.yaml"
    plant.write_text(text)
    assert main([str(plant), "--out", str(tmp_path / "out"), "--quiet"]) == 0


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
