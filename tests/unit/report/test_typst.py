"""The page as a document of typst: formulas, tables, and nothing read as markup."""

from __future__ import annotations

import pytest

from bfppc_synth.errors import UsageError
from bfppc_synth.pipeline import Options, Report
from bfppc_synth.pipeline import run as run_pipeline
from bfppc_synth.report import pdf
from bfppc_synth.report.formulas import inline
from bfppc_synth.report.markup import read_page
from bfppc_synth.report.pdf import render_pdf
from bfppc_synth.report.render import render_html
from bfppc_synth.report.tables import report_document
from bfppc_synth.report.typst_math import equation, quoted
from bfppc_synth.report.typst_page import typst_source


@pytest.fixture(scope="module")
def page(design, run, adversaries):
    return render_html(report_document(design, run, adversaries), design, run)


@pytest.mark.parametrize(
    ("latex", "source"),
    [
        ("x_{1}", 'attach(x, b: "1")'),
        (r"\frac{D_1}{2}", 'frac(attach(D, b: "1"), "2")'),
        (r"\hat{e}_i", "attach(hat(e), b: i)"),
        (r"\dot{x}", "dot(x)"),
        (r"\overline{f}", "overline(f)"),
        (r"\underline{g}", "underline(g)"),
        (r"\left|u\right| \le U", "lr(bar.v u bar.v) lt.eq U"),
        (r"\tanh\left(x\right)", 'op("tanh") ( x )'),
        (r"\sqrt{x}", "sqrt(x)"),
        ("x^2", 'attach(x, t: "2")'),
        ("F_1^*", 'attach(F, b: "1", t: ast)'),
        (r"\sum_{j=0}^{2} s^j", 'attach(sum, b: j = "0", t: "2") attach(s, t: j)'),
        (r"\text{mass}", 'upright("mass")'),
        ("f(a, b)", "f ( a comma b )"),
    ],
)
def test_a_formula_is_written_in_typsts_language(latex, source):
    body = read_page(f"<html><body>{inline(latex)}</body></html>")
    assert equation(body.find("body/math")) == source


def test_no_text_of_the_page_is_read_as_markup():
    text = (
        '<html><head><title>"\\#x"</title></head><body><p>#read("a") *b* $c$ \\</p></body></html>'
    )
    source = typst_source(text)
    assert quoted('#read("a") *b* $c$ \\') in source
    assert '"\\"\\\\#x\\""' in source
    assert render_pdf(text).startswith(b"%PDF-")


def test_the_whole_page_becomes_the_same_pdf_every_time(page):
    made = render_pdf(page)
    assert made.startswith(b"%PDF-")
    assert made == render_pdf(page)
    assert b"CreationDate" not in made
    source = typst_source(page)
    assert source.count("#table(") == page.count("<table")
    assert source.count("#image(") == page.count('<svg class="plot"')
    assert source.count("#heading(") == page.count("</h1>") + page.count("</h2>") + page.count(
        "</h3>"
    )


def test_a_missing_typst_is_refused_before_anything_is_done(monkeypatch, tmp_path):
    monkeypatch.setattr(pdf, "find_spec", lambda _: None)
    with pytest.raises(UsageError, match=r"--pdf: .* not installed; fix: pip install"):
        run_pipeline(tmp_path / "absent.yaml", Options(report=Report.PAGE_AND_PDF))
