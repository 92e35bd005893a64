"""The one-dimensional search of inverse objectives, on functions whose answer is known."""

from __future__ import annotations

import math

import pytest

from bfppc_synth.synthesis.edge import COARSE, RESOLVED, cheapest, furthest


@pytest.mark.parametrize("root", [-3.0, 0.0, 0.3, 5.0, 40.0])
@pytest.mark.parametrize("power", [0.02, 1.0, 7.0])
def test_the_edge_is_found_from_either_side_of_even_and_steep_curves(
    root: float, power: float
) -> None:
    asked: list[float] = []

    def excess(position: float) -> float:
        asked.append(position)
        return power * (position - root) + 0.1 * math.expm1(min(position - root, 5.0))

    edge = furthest(excess, root - 2.0)
    assert excess(edge.position) <= 0.0
    assert root - RESOLVED <= edge.position <= root
    assert edge.bound
    assert len(asked) < 40


def test_an_edge_where_everything_breaks_down_is_no_bound() -> None:
    edge = furthest(lambda x: -1.0 if x < 1.0 else math.inf, 0.0)
    assert 1.0 - COARSE <= edge.position < 1.0
    assert not edge.bound


def test_a_curve_without_a_limit_ends_where_designs_end() -> None:
    edge = furthest(lambda x: -math.inf if x < 3.3 else math.inf, 0.0)
    assert 3.3 - COARSE <= edge.position < 3.3
    assert not edge.bound


def test_the_search_stops_at_the_end_that_is_given() -> None:
    assert furthest(lambda x: x - 9.0, 0.0, end=2.0).position == 2.0


def test_a_step_is_found_within_the_bracket() -> None:
    edge = furthest(lambda x: -1e-9 if x < 0.25 else 30.0, 0.0)
    assert 0.25 - RESOLVED <= edge.position < 0.25


@pytest.mark.parametrize("at", [-20.0, -0.3, 0.0, 4.0])
def test_the_cheapest_position_is_found_in_both_directions(at: float) -> None:
    found = cheapest(lambda x: abs(x - at) ** 1.5, 0.0)
    assert abs(found - at) < 0.02


def test_the_cheapest_position_stays_where_there_is_a_design() -> None:
    found = cheapest(lambda x: -x if x <= 1.5 else math.inf, 0.0)
    assert 1.45 < found <= 1.5


def test_nothing_beyond_the_end_is_asked() -> None:
    asked: list[float] = []

    def cost(position: float) -> float:
        asked.append(position)
        return -position

    assert cheapest(cost, 0.7, end=1.0) == pytest.approx(1.0, abs=0.02)
    assert max(asked) <= 1.0
