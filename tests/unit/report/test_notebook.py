"""A design in a notebook shows the tables of the report."""

from __future__ import annotations

import re

import pytest

from bfppc_synth.report.notebook import notebook_html, notebook_latex
from bfppc_synth.report.tables import design_document, report_document


def test_a_design_shows_itself(design):
    assert design._repr_html_() == notebook_html(design)
    assert design._repr_latex_() == notebook_latex(design)


def test_the_tables_are_those_of_the_report(design):
    shown = notebook_html(design)
    assert "Certified: every inequality below was proved" in shown
    assert shown.count("<table") == 3
    assert 'data-json-path="gains[0].k"' in shown
    assert 'data-json-path="bounds.U"' in shown
    assert 'data-json-path="inequalities[0].margin"' in shown
    assert "\\" not in shown
    assert "<script" not in shown
    assert "Hand-made plant &lt;for tests&gt; &amp; more" in shown


def test_a_design_that_is_not_certified_says_so_and_why(refuted):
    for shown in (notebook_html(refuted), notebook_latex(refuted)):
        assert "NOT CERTIFIED" in shown
    assert "4 is not above 5.1" in notebook_html(refuted)


def test_latex_is_balanced_and_has_the_numbers(design):
    shown = notebook_latex(design)
    assert shown.startswith("$$")
    assert shown.endswith("$$")
    assert shown.count(r"\begin{array}") == shown.count(r"\end{array}") == 2
    assert shown.count("{") == shown.count("}")
    assert "95.4321" in shown
    rows = re.search(r"\\hline\n(.*?)\n\\end\{array\}", shown, re.DOTALL)[1]
    assert len({row.count("&") for row in rows.splitlines()}) == 1


@pytest.mark.parametrize("key", ["gains", "bounds", "inequalities", "tool", "plant"])
def test_the_document_of_a_design_is_that_of_its_report(design, run, key):
    assert design_document(design)[key] == report_document(design, run, ())[key]
    assert "simulation" not in design_document(design)
