"""The manual's pages that a script writes, its links, and its place in the navigation."""

from __future__ import annotations

import importlib.util
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from bfppc_synth.arguments import COMMANDS

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def script(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


WRITER = script(DOCS / "reference" / "write_pages.py")
GALLERY = script(DOCS / "draw_gallery.py")
HOOKS = script(DOCS / "site_pages.py")
GENERATED = {path.name for path in (ROOT / "generated").iterdir()}


def test_the_page_of_commands_is_what_help_says(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    page = (DOCS / "reference" / "commands.md").read_text(encoding="utf-8")
    assert page == WRITER.commands_page()
    assert re.findall(r"^## (\S+)$", page, re.MULTILINE) == ["bfppc-synth", *COMMANDS]


def test_the_page_of_the_plant_file_is_what_the_reader_reads():
    page = (DOCS / "reference" / "plant-file.md").read_text(encoding="utf-8")
    assert page == WRITER.plant_page()
    for key in ("performance.accuracy", "measurement.quantizer.step", "synthesis.gains.STATE.k"):
        assert f"| `{key}` |" in page


def test_the_gallery_has_every_example_with_its_lesson_and_picture():
    page = (DOCS / "gallery.md").read_text(encoding="utf-8")
    names = [path.stem for path in GALLERY.examples()]
    assert re.findall(r"^`examples/(\w+)\.yaml`", page, re.MULTILINE) == names
    assert sorted(path.stem for path in (DOCS / "gallery").iterdir()) == names
    assert len(names) >= 14
    for path in GALLERY.examples():
        source, lesson = GALLERY.comment(path)
        assert len(source) > 40
        assert len(lesson) > 40


@pytest.mark.parametrize(
    "path", [path for path in GALLERY.examples() if path.stem in GENERATED], ids=lambda p: p.stem
)
def test_a_part_of_the_gallery_is_what_its_folder_says(path):
    page = (DOCS / "gallery.md").read_text(encoding="utf-8")
    made = GALLERY.entry(path, ROOT / "generated" / path.stem)
    start = page.index(made.splitlines()[0] + "\n")
    there = page[start : start + len(made) + 40].partition("\n\n## ")[0].strip()
    assert NUMBER.split(there) == NUMBER.split(made.strip())
    for ours, theirs in zip(NUMBER.findall(made), NUMBER.findall(there), strict=True):
        assert math.isclose(float(ours), float(theirs), rel_tol=0.011)


@pytest.mark.parametrize("path", sorted((DOCS / "gallery").iterdir()), ids=lambda p: p.stem)
def test_a_picture_of_the_gallery_is_small_and_asks_for_nothing(path):
    text = path.read_text(encoding="utf-8")
    assert len(text) < 60_000
    assert "<script" not in text
    assert "<dc:date>" not in text


def test_the_navigation_names_pages_that_are_there_and_no_page_is_left_out():
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    named = re.findall(r": (\S+\.md)$", text, re.MULTILINE)
    assert [name for name in named if not (DOCS / name).exists()] == []
    missing = {page.relative_to(DOCS).as_posix() for page in PAGES} - set(named)
    # The hook of the site appends measurements, which stand in docs/ itself.
    assert [name for name in sorted(missing) if "/" in name] == []
    assert len(named) == len(set(named))


@pytest.mark.parametrize("path", PAGES, ids=lambda p: p.relative_to(DOCS).as_posix())
def test_what_a_page_links_to_is_there(path):
    text = path.read_text(encoding="utf-8")
    links = [link for link in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text) if "://" not in link]
    assert [link for link in links if not (path.parent / link).exists()] == []


def test_every_theorem_and_lemma_has_a_proof():
    text = (DOCS / "theory.md").read_text(encoding="utf-8")
    claims = re.findall(r"^\*\*(?:Theorem|Lemma|Proposition)[^*]*\*\*", text, re.MULTILINE)
    assert len(claims) >= 20
    for part in re.split(r"^(?=\*\*(?:Theorem|Lemma|Proposition) ?)", text, flags=re.MULTILINE)[1:]:
        statement = part.splitlines()[0]
        assert "*Proof.*" in part, statement
        assert "QED" in part, statement


def test_the_sections_of_the_theory_keep_their_numbers():
    text = (DOCS / "theory.md").read_text(encoding="utf-8")
    numbers = re.findall(r"^## (\d+)\. ", text, re.MULTILINE)
    assert numbers == [str(number) for number in range(12)]


def test_the_site_builds_without_a_warning_and_asks_no_other_host(tmp_path):
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(
        [*command, "--site-dir", str(tmp_path)],
        cwd=ROOT,
        env=environment,
        check=False,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    asked = re.compile(r"<(?:script|link|img|iframe)[^>]*(?:src|href)=\"(?:https?:)?//[^\"]*")
    texts = [page.read_text(encoding="utf-8") for page in tmp_path.rglob("*.html")]
    assert len(texts) > 25
    assert [match[0] for text in texts for match in asked.finditer(text)] == []


@pytest.mark.parametrize(
    ("plain", "printed"),
    [
        ("<p>x_{i+1} &lt;= eps</p>", "<p>x<sub>i+1</sub> ≤ ε</p>"),
        ("<p>drho_1 and rhobar(t)</p>", "<p>dρ<sub>1</sub> and ρ̄(t)</p>"),
        (
            "<p>e^0.775, s^(N-1), f^_i</p>",
            "<p>e<sup>0.775</sup>, s<sup>(N-1)</sup>, f\u0302<sub>i</sub></p>",
        ),
        ("<p>a declared f_bound, the n-th</p>", "<p>a declared f_bound, the n-th</p>"),
        ("<p><code>sampling.rho_max</code></p>", "<p><code>sampling.rho_max</code></p>"),
        ("<p><code>phi_1(e) = 0</code></p>", "<p><code>φ<sub>1</sub>(e) = 0</code></p>"),
    ],
)
def test_the_site_prints_formulas_and_leaves_words_alone(plain, printed):
    assert HOOKS.typeset(plain) == printed
