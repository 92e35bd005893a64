"""A long formula comes in pieces that a browser may put on lines of their own."""

from __future__ import annotations

import re

import pytest

from bfppc_synth.report.breaking import LONGEST_LINE, broken, widest
from bfppc_synth.report.formulas import displayed, inline

LONG = " + ".join(f"k_{{{i}}} x_{{{i}}}" for i in range(1, 30))


def text(markup):
    return "".join(re.sub(r"<[^>]+>", "", markup).split())


def test_a_short_formula_stays_in_one_piece():
    assert displayed("x_{1} = a + b").count("<math") == 1


def test_a_long_sum_is_cut_before_its_signs_and_loses_nothing():
    made = displayed(f"y = {LONG}")
    assert made.count("<math") > 3
    assert text(made) == text(inline(f"y = {LONG}"))
    for piece in re.findall(r"<math.*?</math>", made)[1:]:
        assert re.match(r'<math displaystyle="true"><mrow><mo form="infix">[=+]</mo>', piece)
    assert widest(made) < LONGEST_LINE


def test_a_sum_in_brackets_is_not_cut():
    assert displayed(rf"\left({LONG}\right)").count("<math") == 1
    assert displayed(f"f({LONG})").count("<math") == 1


def test_a_sign_stays_with_the_relation_before_it():
    made = displayed(f"abcdefghijklmnop = -{LONG}")
    assert not re.search(r"<mo[^>]*>=</mo></mrow></math>", made)


def test_a_formula_in_running_text_is_not_displayed_when_it_is_cut():
    assert "displaystyle" not in broken(inline(f"y = {LONG}"))
    assert "displaystyle" in displayed(f"y = {LONG}")


@pytest.mark.parametrize(("narrow", "wide"), [("x", "x + y"), (r"\frac{a}{b}", "a + b")])
def test_the_estimate_of_a_width_grows_with_the_formula(narrow, wide):
    assert widest(inline(narrow)) < widest(inline(wide))


def test_nothing_is_zero_wide():
    assert widest("<p>no formula</p>") == 0.0
