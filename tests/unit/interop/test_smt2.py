"""A claim as SMT-LIB text: one negated assertion, balanced, nothing lost."""

from __future__ import annotations

from fractions import Fraction

import pytest

from bfppc_synth.interop.claims import (
    Claim,
    InexpressibleError,
    Provenance,
    Relation,
    Term,
    Variable,
    apply,
    number,
    power,
    symbol,
    total,
)
from bfppc_synth.interop.coq import lemma, render_coq
from bfppc_synth.interop.smt2 import render_smt2

ABOUT = Provenance(plant="arm", tool="bfppc-synth 0", plant_sha256="00", theorem="Theorem U")
X = symbol("x1")
PIECE = Term(kind="piece", args=(X, X, number(0)), relations=("<=",))
TREES = [
    *(apply(name, X) for name in ("exp", "sin", "tanh", "log", "atan", "asinh", "abs", "sign")),
    *(apply(name, X) for name in ("root2", "root3", "signed5/3", "min", "cosh")),
    total(power(X, 3), power(X, -2), number(Fraction(-1, 3)), Term(kind="pi")),
    PIECE,
]


def claim(tree: Term, relation: Relation = Relation.AT_MOST) -> Claim:
    side = Variable(name="x1", lower=Fraction(-1, 2), upper=Fraction(3))
    return Claim(
        id="U2'[x1]",
        statement="p > |f| and more",
        lhs=tree,
        relation=relation,
        rhs=number(7),
        variables=(side,),
    )


@pytest.mark.parametrize("tree", TREES, ids=lambda tree: tree.name or tree.kind)
def test_parentheses_balance_and_exactly_one_assertion_is_negated(tree: Term) -> None:
    text = render_smt2(claim(tree), ABOUT)
    code = "\n".join(line for line in text.splitlines() if not line.startswith(";"))
    assert code.count("(") == code.count(")")
    assert text.count("(assert (not (") == 1
    assert text.rstrip().endswith("(check-sat)\n(exit)")
    assert text.count("|") == 2


def test_the_logic_says_whether_transcendental_functions_occur() -> None:
    assert "(set-logic QF_NRA)" in render_smt2(claim(power(X, 2)), ABOUT)
    assert "(set-logic QF_NRAT)" in render_smt2(claim(apply("exp", X)), ABOUT)


def test_numbers_are_exact_and_the_relation_is_kept() -> None:
    text = render_smt2(claim(power(X, 2), Relation.LESS), ABOUT)
    assert "(assert (<= (- (/ 1.0 2.0)) v_x1))" in text
    assert "(assert (not (< (* v_x1 v_x1) 7.0)))" in text


def test_one_auxiliary_variable_stands_for_equal_roots() -> None:
    root = apply("root2", X)
    text = render_smt2(claim(total(root, root)), ABOUT)
    assert text.count("(declare-fun w_1 () Real)") == 1
    assert "w_2" not in text


def test_a_label_is_an_identifier() -> None:
    assert claim(power(X, 2)).label == "U2_prime_x1"


@pytest.mark.parametrize("tree", [PIECE, apply("sign", X), apply("root3", X)])
def test_coq_refuses_what_its_tactic_has_no_rule_for(tree: Term) -> None:
    with pytest.raises(InexpressibleError, match="no form in Coq-Interval"):
        lemma(claim(tree))


def test_coq_text_ends_in_print_assumptions_and_admits_nothing() -> None:
    text = render_coq([claim(apply("tanh", X))], ABOUT)
    assert text.rstrip().endswith("Print Assumptions all_claims.")
    assert "Admitted" not in text
    assert "admit" not in text
    assert "1 - 2 / (exp (2 * v_x1) + 1)" in text
