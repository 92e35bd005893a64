"""Tallies do not depend on the order of the runs; the bound is Clopper and Pearson's."""

from __future__ import annotations

import json
import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bfppc_synth.campaign.tally import BINS, LISTED, Tally, failure_bound
from bfppc_synth.errors import UsageError
from bfppc_synth.simulation.drawing import Adversary

RUN = st.tuples(
    st.sampled_from(list(Adversary)),
    st.tuples(*(st.sampled_from([0.0, 0.5, 0.98, 1.0, 1.5, 1e308]),) * 3),
)


def counted(numbered):
    tally = Tally.empty(2, funnel=False)
    for number, (adversary, ratios) in numbered:
        tally.count(number, adversary, ratios, inside=max(ratios) <= 1.0)
    return tally


@given(st.lists(RUN, max_size=10), st.randoms(use_true_random=False))
def test_any_division_in_any_order_gives_the_same_tally(runs, source):
    numbered = list(enumerate(runs))
    whole = counted(numbered).document()
    parts = [numbered[::3], numbered[1::3], numbered[2::3]]
    source.shuffle(parts)
    total = Tally.empty(2, funnel=False)
    for part in parts:
        source.shuffle(part)
        text = json.dumps(counted(part).document())
        total.add(Tally.read(json.loads(text), total))
    assert total.document() == whole


def test_what_reaches_its_bound_has_a_bin_of_its_own():
    tally = counted([(0, (Adversary.GREEDY, (0.0, 0.999999, 1.0)))])
    assert tally.bins[0][0] == tally.bins[1][BINS - 1] == tally.bins[2][BINS] == 1


def test_the_first_runs_that_left_are_listed():
    runs = [(number, (Adversary.GREEDY, (2.0, 0.0, 0.0))) for number in range(3 * LISTED)]
    tally = counted(runs[::-1])
    assert tally.outside == 3 * LISTED
    assert tally.left == list(range(LISTED))
    assert tally.worst[0] == (2.0, 0)


@pytest.mark.parametrize("runs", [1, 20, 100_000])
def test_without_a_leaver_the_bound_is_the_closed_form(runs):
    bound = failure_bound(runs, 0, confidence=0.95)
    assert math.isclose((1.0 - bound) ** runs, 0.05, rel_tol=1e-9)


@pytest.mark.parametrize(("runs", "left"), [(10, 1), (20, 7), (40, 39)])
def test_with_leavers_the_binomial_tail_is_what_is_left_of_the_confidence(runs, left):
    p = Fraction(failure_bound(runs, left, confidence=0.99))
    tail = sum(math.comb(runs, k) * p**k * (1 - p) ** (runs - k) for k in range(left + 1))
    assert math.isclose(tail, 0.01, rel_tol=1e-9)


def test_where_every_run_left_nothing_is_bounded():
    assert failure_bound(5, 5, confidence=0.95) == 1.0


@pytest.mark.parametrize(
    "spoil",
    [
        lambda document: document.pop("worst"),
        lambda document: document.update(runs="many"),
        lambda document: document.update(runs=7),
        lambda document: document["bins"].pop(),
        lambda document: document["adversaries"].update(greedy=[1]),
        lambda document: document["adversaries"].pop("greedy"),
    ],
)
def test_a_spoiled_tally_is_refused(spoil):
    tally = counted([(0, (Adversary.GREEDY, (0.1, 0.2, 0.3)))])
    document = json.loads(json.dumps(tally.document()))
    assert Tally.read(document, tally).document() == tally.document()
    spoil(document)
    with pytest.raises(UsageError):
        Tally.read(document, tally)
