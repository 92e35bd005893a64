"""The pages of committed designs, laid out again: every method, both centers."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from bfppc_synth.artifacts import simulate_trajectory
from bfppc_synth.report.glossary import Glossary
from bfppc_synth.report.letters import letters
from bfppc_synth.report.meanings import NUMBERS
from bfppc_synth.report.render import render_html
from bfppc_synth.report.tables import report_document
from bfppc_synth.synthesis.synthesize import restore

ROOT = Path(__file__).parents[2]
SAMPLE = {"motor_arm_nominal", "theorem1_example_1", "switching_example_2"}
FOLDERS = [
    path.parent
    for path in sorted((ROOT / "generated").glob("*/plant.yaml"))
    if path.parent.name in SAMPLE or os.environ.get("BFPPC_TESTS") == "all"
]
RAW = ("**", "Abs(", "Piecewise", "sqrt(", "Rational", "Symbol(", "Float(", "@", "<!-- letters")


@pytest.fixture(scope="module", params=FOLDERS, ids=lambda path: path.name)
def made(request):
    design = restore(request.param)
    nominal = simulate_trajectory(design, horizon=0.05)
    document = report_document(design, nominal, ())
    return document, render_html(document, design, nominal)


def test_every_letter_is_explained_where_it_first_stands(made):
    document, page = made
    assert Glossary(document, str).unknown(page) == ()
    known = set()
    for section in page.split("<section")[1:]:
        body = section.partition("</section>")[0]
        for entry in re.findall(r"<dt>(.*?)</dt>", body):
            known |= {letter.key for letter in letters(entry)}
        words = {each.key for each in letters(body) if each.stem.startswith('"')}
        assert {letter.key for letter in letters(body)} - words - NUMBERS <= known


def test_no_backslash_and_no_program_text_reaches_the_page(made):
    _, page = made
    shown = re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL)
    assert "\\" not in page
    # A funnel and code are shown as they are written.
    shown = re.sub(r"<(pre|code)\b.*?</\1>", "", shown, flags=re.DOTALL)
    assert [raw for raw in RAW if raw in shown] == []


def test_the_page_stays_below_400_kilobytes(made):
    assert len(made[1].encode()) < 400_000
