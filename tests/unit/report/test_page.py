"""report.html: what it shows, what it must not contain."""

from __future__ import annotations

import base64
import dataclasses
import hashlib
import json
import re
from collections import Counter
from html.parser import HTMLParser

import pytest

from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.spec import ReferenceKind
from bfppc_synth.report.numbers import shown
from bfppc_synth.report.render import render_html, render_readme
from bfppc_synth.report.tables import report_document

VOID = {"meta", "br", "line", "rect", "polyline", "polygon", "mspace", "link", "img", "input"}
SECTIONS = [
    *("promise", "requirements", "gains", "plant", "chain", "drivers", "inequalities"),
    *("simulation", "code", "check"),
]


class Page(HTMLParser):
    """Numbers with their places, tags, attributes, ids and visible text of a page."""

    def __init__(self, text):
        super().__init__()
        self.numbers, self.tags, self.attributes, self.ids, self.headings = [], [], [], [], []
        self.text, self.open = [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.tags.append((tag, found))
        self.attributes.extend(name for name, _ in attrs)
        self.ids.extend(value for name, value in attrs if name == "id")
        if re.fullmatch("h[1-6]", tag):
            self.headings.append(int(tag[1]))
        if tag not in VOID:
            self.open.append((tag, found))

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop()[0] == tag, f"{tag} closes another element"

    def handle_data(self, data):
        tag, attrs = self.open[-1] if self.open else ("", {})
        if "data-json-path" in attrs:
            self.numbers.append((attrs["data-json-path"], attrs["data-value"], data))
        if tag not in {"style", "title", "desc"}:
            self.text.append(data)


def resolve(document, path):
    for key in re.findall(r"[^.\[\]]+", path):
        document = document[int(key)] if isinstance(document, list) else document[key]
    return document


@pytest.fixture(scope="module")
def document(design, run, adversaries):
    return json.loads(json.dumps(report_document(design, run, adversaries)))


@pytest.fixture(scope="module")
def page(document, design, run):
    return render_html(document, design, run)


@pytest.fixture(scope="module")
def shown_paths(page):
    return {path for path, _, _ in Page(page).numbers}


def test_every_number_on_the_page_equals_report_json(document, page):
    numbers = Page(page).numbers
    assert len(numbers) > 150
    for path, full, text in numbers:
        value = resolve(document, path)
        assert text == shown(value), path
        if isinstance(value, float):
            assert float(full) == value, path
            assert float(text) == pytest.approx(value, rel=1e-5), path
        else:
            assert json.loads(full) == value, path


@pytest.mark.parametrize(
    "path",
    [
        *("gains[0].k", "gains[1].epsilon", "omega.p[1]", "bounds.U", "bounds.slope"),
        *("bounds.F_star[0]", "bounds.zeta", "majorants[0].g_min", "inequalities[0].lhs[0]"),
        *("inequalities[0].rhs[1]", "inequalities[0].margin", "inequalities[0].place.line"),
        *("inequalities[0].binding_terms[0].share", "sampling.largest_certified_period"),
        *("measurement.delta[1]", "simulation.max_abs_e[1]", "simulation.adversaries.max_abs_u"),
        *("reference.Y0", "initial.x2[1]", "plant.parameters.mass[0]", "performance.final_error"),
    ],
)
def test_the_page_shows_what_an_engineer_needs(shown_paths, path):
    assert path in shown_paths


def test_the_page_runs_nothing_and_loads_nothing(page):
    parsed = Page(page)
    assert not {"script", "link", "img", "iframe", "object", "embed", "form"} & {
        tag for tag, _ in parsed.tags
    }
    assert not [name for name in parsed.attributes if name.startswith("on")]
    assert not {"src", "srcset", "style", "xlink:href"} & set(parsed.attributes)
    links = [attrs["href"] for tag, attrs in parsed.tags if tag == "a"]
    assert links
    assert all(link.startswith("#") and link[1:] in parsed.ids for link in links)
    assert "://" not in page
    assert re.findall(r"url\((.{20})", page) == ["data:font/woff2;base64"[:20]]
    assert "@import" not in page


def test_the_content_policy_allows_this_style_sheet_and_nothing_else(page):
    style = re.search(r"<style>(.*?)</style>", page, re.DOTALL)[1]
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    policy = next(
        attrs["content"]
        for tag, attrs in Page(page).tags
        if tag == "meta" and attrs.get("http-equiv") == "Content-Security-Policy"
    )
    assert policy.startswith("default-src 'none';")
    assert f"style-src 'sha256-{digest}'" in policy
    assert "font-src data:;" in policy
    assert "unsafe" not in policy


def test_the_page_is_well_formed_and_accessible(page):
    parsed = Page(page)
    assert parsed.open == []
    assert len(parsed.ids) == len(set(parsed.ids))
    assert parsed.headings[0] == 1
    assert parsed.headings.count(1) == 1
    assert all(b - a <= 1 for a, b in zip(parsed.headings, parsed.headings[1:], strict=False))
    counts = Counter(tag for tag, _ in parsed.tags)
    assert counts["table"] == counts["caption"] > 5
    drawings = [attrs for tag, attrs in parsed.tags if tag == "svg" and "role" in attrs]
    assert len(drawings) == counts["figure"] == counts["title"] - 1 == counts["desc"] == 3
    for drawing in drawings:
        assert all(name in parsed.ids for name in drawing["aria-labelledby"].split())
    decoration = [a for tag, a in parsed.tags if tag == "svg" and "role" not in a]
    assert all(attrs.get("aria-hidden") == "true" for attrs in decoration)
    assert "viewport" in page
    assert "prefers-color-scheme:dark" in page
    assert "@media print" in page


def test_the_sections_stand_in_an_engineers_order(page):
    found = [name for name in Page(page).ids if name in SECTIONS]
    assert found == SECTIONS


def test_no_backslash_and_no_program_text_of_a_formula_is_on_the_page(page):
    assert "\\" not in page
    for raw in ("**", "Abs(", "Piecewise", "sqrt(", "Rational", "Symbol(", "@"):
        assert raw not in re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL), raw


def test_the_users_text_is_escaped(page):
    assert "Hand-made plant &lt;for tests&gt; &amp; more" in page
    assert "<for tests>" not in page


def test_the_page_and_the_readme_are_the_same_every_time(document, design, run, page):
    assert render_html(document, design, run) == page
    assert render_readme(document) == render_readme(document)


def test_a_page_of_order_four_stays_below_400_kilobytes(design_of, run_of):
    large = design_of(4)
    run = run_of(large, 20001)
    text = render_html(report_document(large, run, ()), large, run)
    assert len(text.encode()) < 400_000
    assert Page(text).open == []


def test_a_certified_page_carries_no_banner(page, document):
    assert "NOT CERTIFIED" not in page
    assert "This holds for" in page
    assert "is proved never" in page
    assert "## Promise\n" in render_readme(document)
    assert "NOT CERTIFIED" not in render_readme(document)


@pytest.mark.parametrize("verdict", [Verdict.REFUTED, Verdict.UNDECIDED, Verdict.PRINTED])
def test_an_uncertified_page_says_so_first_and_names_what_fails(refuted, run, verdict):
    design = dataclasses.replace(
        refuted, certificate=dataclasses.replace(refuted.certificate, verdict=verdict)
    )
    document = report_document(design, run, ())
    page, readme = render_html(document, design, run), render_readme(document)
    failure = "U1[x1] (65): 4 is not above 5.1"
    assert page.index("NOT CERTIFIED") < page.index(failure) < page.index('id="promise"')
    assert page.count(failure) == 2
    assert "What would be promised" in page
    assert "This holds for" not in page
    assert "is proved never" not in page
    assert "## Promise, not proved" in readme
    lines = readme.splitlines()
    assert lines[0].startswith("# ")
    assert "NOT CERTIFIED" in lines[2]
    assert failure in readme
    assert Page(page).open == []


def test_a_number_that_is_not_finite_is_a_dash_on_the_page(refuted, run):
    page = render_html(report_document(refuted, run, ()), refuted, run)
    assert ("bounds.U", "null", "\N{EM DASH}") in Page(page).numbers


def test_the_readme_says_how_to_call_check_and_simulate(document):
    text = render_readme(document)
    for part in (
        "controller.step(t, x)",
        "hand_made_step(&state, t, x, hand_made_reference(t), &u)",
        "bfppc-synth simulate .",
        "| x1 | 0.15 | 2 | 13.3144 | 0.5 | 0.1 | 3 |",
        "|u| <= 95.4321",
    ):
        assert part in text
    assert "\n\n\n" not in text
    assert text.endswith("\n")
    assert "somewhere" not in text


def test_the_checker_is_named_only_where_the_folder_has_one(design, document, run):
    assert "verify.py" not in render_readme(document)
    certificate = dataclasses.replace(design.certificate, document="{}")
    proved = dataclasses.replace(design, certificate=certificate)
    renewed = report_document(proved, run, ())
    assert "python verify.py" in render_readme(renewed)
    assert "python verify.py" in render_html(renewed, proved, run)


def test_a_reference_of_run_time_is_an_argument_of_the_call(design, run):
    reference = dataclasses.replace(
        design.spec.reference, kind=ReferenceKind.RUNTIME, expression=None
    )
    spec = dataclasses.replace(design.spec, reference=reference)
    plant = dataclasses.replace(design.plant, spec=spec, reference=None)
    supplied = dataclasses.replace(design, spec=spec, plant=plant)
    document = report_document(supplied, run, ())
    assert "controller.step(t, x, y_d)" in render_readme(document)
    assert "hand_made_step(&state, t, x, y_d, &u)" in render_readme(document)
    assert "supplied at run time" in render_html(document, supplied, run)


def test_estimates_of_what_requirements_cost_have_a_section_of_their_own(document, design, run):
    entry = {"path": "performance.accuracy", "given": "0.15", "eased": "0.165"}
    costs = {"U_percent": -9.25, "slope_percent": -17.5, "kind": "estimate"}
    page = render_html(document | {"sensitivities": [entry | costs]}, design, run)
    assert ("sensitivities[0].U_percent", "-9.25", "-9.25") in Page(page).numbers
    assert page.index('id="inequalities"') < page.index('id="sensitivities"')
    assert page.index('id="sensitivities"') < page.index('id="simulation"')
    assert "Estimates, not proofs" in page
    assert 'id="sensitivities"' not in render_html(document, design, run)
