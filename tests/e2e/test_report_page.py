"""The report of a real run: page, README and trajectory agree with report.json."""

from __future__ import annotations

import csv
import hashlib
import json
import re
from html.parser import HTMLParser

import pytest

from bfppc_synth.pipeline import Options, Report, Uncertified, run
from bfppc_synth.report.typst_page import typst_source

PLANT = """\
name: small_report
title: Second order, quantized
units: {x1: rad, u: V}
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2, disturbance: 0.125}
initial: {x1: [0.25, 0.5], x2: 0}
performance: {accuracy: 0.25}
measurement: {quantizer: {kind: uniform, step: 0.001}}
sampling: {period: 0.0005}
simulation: {horizon: 0.5, period: 0.0005, seed: 3}
"""
PRINTED = """\
name: small_printed
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2}
initial: {x1: 0.5, x2: 0}
performance: {accuracy: 0.25}
synthesis: {method: theorem2, form: printed}
simulation: {horizon: 0.5, period: 0.001, seed: 3}
"""


class Numbers(HTMLParser):
    """(path in report.json, all digits, shown text) of every number on a page."""

    def __init__(self, text):
        super().__init__()
        self.found, self.attributes = [], {}
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        del tag
        self.attributes = dict(attrs)

    def handle_data(self, data):
        if "data-json-path" in self.attributes:
            self.found.append(
                (self.attributes["data-json-path"], self.attributes["data-value"], data)
            )
        self.attributes = {}


def resolve(document, path):
    for key in re.findall(r"[^.\[\]]+", path):
        document = document[int(key)] if isinstance(document, list) else document[key]
    return document


def make(text, base):
    base.mkdir()
    plant = base / "plant.yaml"
    plant.write_text(text, encoding="utf-8")
    options = Options(out=base / "out", uncertified=Uncertified.WRITE, report=Report.PAGE_AND_PDF)
    outcome = run(plant, options)
    return outcome, base / "out"


@pytest.fixture(scope="module")
def certified(tmp_path_factory):
    return make(PLANT, tmp_path_factory.mktemp("report") / "certified")


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    return make(PRINTED, tmp_path_factory.mktemp("report") / "printed")


@pytest.fixture(params=["certified", "printed"])
def made(request):
    return request.getfixturevalue(request.param)


def test_every_number_on_the_page_equals_report_json(made):
    _, folder = made
    document = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    numbers = Numbers((folder / "report.html").read_text(encoding="utf-8")).found
    assert len(numbers) > 150
    for path, full, text in numbers:
        value = resolve(document, path)
        if isinstance(value, float):
            assert float(full) == value, path
            assert float(text) == pytest.approx(value, rel=1e-5, abs=1e-300), path
        elif not isinstance(value, bool):
            assert text == ("\N{EM DASH}" if value is None else str(value)), path


def test_a_certified_report_says_so_and_nothing_else(certified):
    outcome, folder = certified
    assert outcome.exit_code == 0
    assert outcome.document["status"] == "certified"
    for name in ("report.html", "README.md", "trajectory.csv"):
        assert "NOT CERTIFIED" not in (folder / name).read_text(encoding="utf-8")
    assert all(entry["holds"] for entry in outcome.document["inequalities"])
    assert all(entry["margin"] > 0.0 for entry in outcome.document["inequalities"])


def test_a_report_without_certificate_says_so_in_every_file(printed):
    outcome, folder = printed
    assert outcome.exit_code == 4
    assert outcome.document["failures"]
    for name in ("report.html", "README.md", "trajectory.csv", "report.json"):
        text = (folder / name).read_text(encoding="utf-8")
        assert "NOT CERTIFIED" in text, name
        assert outcome.document["failures"][0] in text, name


def test_the_page_loads_nothing_and_is_small(made):
    _, folder = made
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert len(page.encode()) < 400_000
    assert "<script" not in page
    assert "://" not in page
    assert "\\" not in page
    assert "default-src 'none'" in page


def test_the_trajectory_is_the_run_of_the_report(certified):
    outcome, folder = certified
    with (folder / "trajectory.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == ["t", "x1", "x2", "q1", "q2", "e1", "e2", "u", "y_d"]
    assert 1000 <= len(rows) <= 2001
    bounds = outcome.document["omega"]["p"]
    for row in rows:
        assert abs(float(row["e1"])) <= bounds[0]
        assert abs(float(row["e2"])) <= bounds[1]
        assert abs(float(row["u"])) <= outcome.document["bounds"]["U"]
    assert outcome.document["simulation"]["within_bounds"] is True


def test_the_numbers_in_the_readme_are_those_of_report_json(certified):
    outcome, folder = certified
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert f"|u| <= {outcome.document['bounds']['U']:.6g}" in text
    for state, gains, p in zip(
        ("x1", "x2"), outcome.document["gains"], outcome.document["omega"]["p"], strict=True
    ):
        assert f"| {state} | {p:.6g} | {gains['k']:.6g} |" in text


def test_the_report_is_there_as_a_pdf_and_in_the_manifest(made):
    _, folder = made
    made_pdf = (folder / "report.pdf").read_bytes()
    assert made_pdf.startswith(b"%PDF-")
    digest = hashlib.sha256(made_pdf).hexdigest()
    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    assert manifest["files"]["report.pdf"] == digest


def test_the_pdf_of_a_report_without_certificate_says_so_too(printed):
    _, folder = printed
    source = typst_source((folder / "report.html").read_text(encoding="utf-8"))
    assert source.count("NOT CERTIFIED") == (folder / "report.html").read_text("utf-8").count(
        "NOT CERTIFIED"
    )
