"""How far a requirement is relaxed: the bracket and its narrowing."""

import math

import pytest

from bfppc_synth.reasons.boundary import least_relaxation
from bfppc_synth.reasons.requirement import Requirement


def relaxed(factors, extreme=None):
    return Requirement(
        path="a", given="1", change=lambda _factor: (), factors=factors, extreme=extreme
    )


LARGER = relaxed((1.2, 2.0, 6.0, 30.0, 1000.0))
SMALLER = relaxed((1 / 1.2, 0.5, 1 / 6, 1 / 30, 1e-3), extreme=0.0)


@pytest.mark.parametrize("boundary", [1.001, 1.19, 1.21, 5.0, 900.0])
def test_a_larger_value_is_found_within_two_percent_of_the_least_one(boundary):
    factor = least_relaxation(LARGER, lambda at: math.log(boundary / at), math.log(boundary))
    assert boundary <= factor <= 1.02 * boundary


@pytest.mark.parametrize("boundary", [0.999, 0.4, 0.0011])
def test_a_smaller_value_is_found_within_two_percent_of_the_largest_one(boundary):
    def miss(at):
        return -math.inf if at == 0.0 else math.log(at / boundary)

    factor = least_relaxation(SMALLER, miss, miss(1.0))
    assert boundary / 1.02 <= factor <= boundary


def test_a_boundary_is_found_where_only_yes_and_no_are_known():
    factor = least_relaxation(LARGER, lambda at: 0.0 if at >= 3.3 else math.inf, math.inf)
    assert 3.3 <= factor <= 3.4


def test_a_strongly_bent_miss_still_narrows():
    factor = least_relaxation(LARGER, lambda at: (2.5 / at) ** 9 - 1.0, 2.5**9 - 1.0)
    assert 2.5 <= factor <= 2.6


def test_what_not_even_zero_mends_costs_one_evaluation():
    asked = []

    def miss(at):
        asked.append(at)
        return 0.5

    assert least_relaxation(SMALLER, miss, 1.0) is None
    assert asked == [0.0]


def test_only_the_extreme_is_left_where_every_factor_misses():
    assert least_relaxation(SMALLER, lambda at: -1.0 if at == 0.0 else 0.1, 1.0) == 0.0


def test_no_factor_is_returned_where_none_suffices():
    assert least_relaxation(LARGER, lambda _at: 0.1, 0.2) is None
