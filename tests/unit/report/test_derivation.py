"""The chain and the inequalities with their numbers put in."""

from __future__ import annotations

import dataclasses
import re

import pytest

from bfppc_synth.model.spec import Form
from bfppc_synth.report.derivation import derivation
from bfppc_synth.report.obligations import obligation, term_sentence
from bfppc_synth.report.tables import report_document


@pytest.fixture(scope="module")
def document(design, run):
    return report_document(design, run, ())


def places(markup):
    return re.findall(r'data-json-path="([^"]+)"', markup)


def test_the_chain_has_a_step_for_every_state_and_ends_in_the_input(design, document):
    steps = derivation(design, document)
    assert [step.title for step in steps] == ["Step 1: state x1", "Step 2: state x2", "Input"]
    assert [row.keys for row in steps[-1].rows] == [
        ("bounds", "V"),
        ("bounds", "zeta"),
        ("bounds", "U"),
    ]
    assert ("bounds", "B", 0) in [row.keys for row in steps[0].rows]
    assert ("bounds", "B", 1) not in [row.keys for row in steps[1].rows]


def test_the_numbers_of_a_constant_are_put_into_its_formula(design, document):
    steps = derivation(design, document)
    rows = {row.keys[1:]: row for step in steps for row in step.rows}
    demand = rows["F_star", 0]
    assert places(demand.numbers[0]) == [
        "bounds.D[0]",
        "bounds.g_min[0]",
        "omega.p[1]",
        "bounds.s[0]",
    ]
    assert places(rows["X", 1].numbers[0]) == ["bounds.r[1]", "bounds.xi[1]"]
    assert places(rows["zeta",].numbers[0]) == ["bounds.V", "sampling.hold", "bounds.eta[1]"]


def test_every_letter_of_the_chain_is_replaced_where_numbers_are_shown(design, document):
    for step in derivation(design, document):
        for row in step.rows:
            for text in row.numbers:
                letters = set(re.findall(r"<mi>([^<]+)</mi>", text))
                assert letters <= {"\N{GREEK SMALL LETTER SIGMA}"}, (row.keys, letters)


def test_the_printed_form_shows_the_papers_undivided_formula(design, document):
    synthesis = dataclasses.replace(design.spec.synthesis, form=Form.PRINTED)
    printed = dataclasses.replace(
        design, spec=dataclasses.replace(design.spec, synthesis=synthesis)
    )
    sound, paper = (
        {row.keys[1:]: row for step in derivation(each, document) for row in step.rows}
        for each in (design, printed)
    )
    assert "bounds.G[0]" in places(paper["F_star", 0].numbers[0])
    assert "bounds.G[0]" not in places(sound["F_star", 0].numbers[0])
    assert "bounds.L[0]" in places(paper["B", 0].numbers[0])
    assert "bounds.L[0]" not in places(sound["B", 0].numbers[0])
    # The one g_m of the paper is the least of all channels.
    assert places(paper["F_star", 1].numbers[0])[:2] == ["bounds.D[1]", "bounds.g_min[0]"]


def test_a_term_that_is_off_is_left_out(design, document):
    rows = {row.keys[1:]: row for step in derivation(design, document) for row in step.rows}
    assert "gains[0].c" in places(rows["A", 0].numbers[0])
    assert "gains[1].c" not in places(rows["A", 1].numbers[0])


@pytest.mark.parametrize(
    ("identifier", "sides"),
    [
        *(("U0[x1]", 0), ("U1[x1]", 2), ("U2[x2]", 2), ("U2'[x2]", 2)),
        *(("U2.room[x2]", 0), ("U2'.room[x2]", 2), ("T2[x1]", 2), ("T2[x2]", 2)),
        *(("f_bound[x1]", 0), ("g_min[x2]", 0), ("g_bound[x2]", 0), ("limit", 0)),
    ],
)
def test_every_known_inequality_has_words_and_a_formula(design, document, identifier, sides):
    found = obligation(design, document, identifier)
    assert found.formula.startswith("<math")
    assert found.meaning != obligation(design, document, "unheard of").meaning
    assert len(found.sides) == sides
    assert all(places(side.numbers) for side in found.sides)


def test_every_loss_is_subtracted_in_the_argument_of_u2_prime(design, document):
    found = obligation(design, document, "U2'[x2]")
    text = re.sub(r"<[^>]+>", " ", found.formula).split()
    start = text.index("(")
    minus = [text[k + 1] for k in range(start, len(text)) if text[k] == "\N{MINUS SIGN}"]
    assert minus == ["\N{GREEK SMALL LETTER ETA}", "("]


@pytest.mark.parametrize("identifier", ["unheard of", "Z9[x1]", "U1[no_state]"])
def test_an_unknown_inequality_has_words_only(design, document, identifier):
    found = obligation(design, document, identifier)
    assert found.sides == ()
    assert found.formula == ""
    assert found.meaning


def test_a_feedback_that_is_off_altogether_is_zero(design, document):
    off = dataclasses.replace(design.gains[0], k=0.0, M=0.0, c=0.0)
    quiet = dataclasses.replace(design, gains=(off, *design.gains[1:]))
    assert ">0</mn>" in obligation(quiet, document, "U1[x1]").sides[0].numbers


@pytest.mark.parametrize(
    ("term", "sentence"),
    [
        ("f_1* and disturbance", "drift $f_{1}$ and disturbance"),
        ("sup|dr_2|", r"motion of the center, $\dot{r}_{2}$"),
        ("|d alpha_1|", r"motion of the feedback $\varphi_{1}$"),
        ("p_2", "next tube, $p_{2}$"),
        ("sup|r_2|", "next center, $r_{2}$"),
        ("some $new# `term`", "some new term"),
    ],
)
def test_a_term_of_the_demand_is_put_into_words(term, sentence):
    assert term_sentence(term) == sentence
