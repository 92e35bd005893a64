"""Every letter of a formula is found, and explained where it first stands."""

from __future__ import annotations

import dataclasses
import re

import pytest

from bfppc_synth.model.spec import QuantizerKind
from bfppc_synth.report.formulas import expression_latex, inline, name_latex
from bfppc_synth.report.glossary import PLACE, Glossary
from bfppc_synth.report.letters import letters
from bfppc_synth.report.render import render_html
from bfppc_synth.report.tables import report_document


def keys(latex):
    return [letter.key for letter in letters(inline(latex))]


@pytest.mark.parametrize(
    ("latex", "found"),
    [
        ("x_{1}", ["x_i"]),
        ("x_{12}^{3}", ["x_i"]),
        (r"\dot{x}_{2} = x_{3} \, u", ["dot x_i", "x_i", "u"]),
        (r"\hat{e}_{i-1}", ["hat e_i"]),
        (r"\underline{g}_{1} \le \overline{g}_{1}", ["under g_i", "bar g_i"]),
        ("F_{1}^{*}", ["F_i*"]),
        (r"\varphi_{1}'(e_{1})", ["φ_i\N{PRIME}", "e_i"]),
        (r"\delta_{0,2} + \delta_{u} + \delta_{M,1}", ["δ_0,i", "δ_u", "δ_M,i"]),
        ("g_{m,1}", ["g_m,i"]),
        ("H_{1,0} + H_{2}^{0}(1)", ["H_i,j", "H_i0"]),
        ("c_{0} + c_{1} + v_{0} + v", ["c_0", "c_i", "v_0", "v"]),
        ("e^{N_{1}}", ["e", "N_i"]),
        ("r_{1}^{(l)}", ["r_i(l)"]),
        (r"\frac{D_{1}}{\sqrt{G_{1}}}", ["D_i", "G_i"]),
        (r"\sup\left|w_{1}\right|", ["w_i"]),
        (r"T_{s}^{\mu}", ["T_s", "μ"]),
        ("2 + 3", []),
        (r"\ln\left(x_{1}\right) + \max\left(x_{1}, 2\right)", ["x_i"]),
    ],
)
def test_the_letters_of_a_formula_are_found(latex, found):
    assert keys(latex) == found


@pytest.mark.parametrize("name", ["a", "M1", "M_1", "tau", "e", "rho_1", "eta2", "h", "V"])
def test_a_name_of_the_plant_file_is_never_taken_for_a_letter_of_the_page(name):
    (letter,) = letters(inline(name_latex(name)))
    assert letter.stem.startswith('"')


@pytest.mark.parametrize("name", ["x1", "t", "m", "B", "theta", "mass"])
def test_a_name_that_the_page_does_not_use_itself_stays_as_it_was(name):
    assert r"\text" not in name_latex(name) or len(name) > 1


def test_eulers_number_is_no_letter(design):
    import sympy as sp

    x = sp.Symbol("x1", real=True)
    assert r"\text{e}^" in expression_latex(sp.exp(-2 * x))
    assert keys(expression_latex(sp.exp(-2 * x) * x)) == ["x_i", '"e"']


def test_a_letter_is_explained_once_with_all_that_its_explanation_needs(design, run):
    document = report_document(design, run, ())
    glossary = Glossary(document, lambda text: re.sub(r"\$([^$]+)\$", lambda m: inline(m[1]), text))
    first = glossary.explain(f"{PLACE}{inline('U')}")
    assert first.index("peak input: ") < first.index("command of the law")
    second = glossary.explain(f"{PLACE}{inline('U + u + k_{1}')}")
    assert "peak input: " not in second
    assert "gain of the linear term" in second


def test_a_letter_without_explanation_is_named(design, run):
    glossary = Glossary(report_document(design, run, ()), str)
    assert glossary.unknown(inline(r"x_{1} + \Omega_{1}")) == ("Ω_i",)


def unexplained(page):
    """List (section, letter) of letters that stand before their explanation, or have none."""
    known, found = set(), []
    for section in page.split("<section")[1:]:
        body = section.partition("</section>")[0]
        for entry in re.findall(r"<dt>(.*?)</dt>", body):
            known |= {letter.key for letter in letters(entry)}
        heading = re.search(r'id="(\w+)"', body)[1]
        found += [
            (heading, letter.key)
            for letter in letters(body)
            if letter.key not in known and (letter.accent or not letter.stem.startswith('"'))
        ]
    return found


def test_every_letter_of_the_page_is_explained_where_it_first_stands(design, run, adversaries):
    page = render_html(report_document(design, run, adversaries), design, run)
    assert unexplained(page) == []


def test_the_names_of_the_plant_file_are_explained(design, run):
    states = ("angle", "a")
    spec = dataclasses.replace(
        design.spec,
        states=states,
        measurement=dataclasses.replace(
            design.spec.measurement,
            quantizers=tuple(
                dataclasses.replace(each, kind=QuantizerKind.NONE, step=None)
                for each in design.spec.measurement.quantizers
            ),
        ),
    )
    document = report_document(design, run, ()) | {"states": list(states)}
    glossary = Glossary(document, str)
    shown = glossary.explain(PLACE + inline(name_latex("angle")) + inline(name_latex("mass")))
    assert spec.states == states
    assert "`angle`, state $x_{1}$ and output" in shown
    assert "`mass`, a parameter of the plant file" in shown
