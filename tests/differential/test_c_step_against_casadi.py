"""The generated step against CasADi's C for the same law: equal commands, no larger cost.

``make bench`` prints the exact ratios, about 0.9 at n = 2 and 0.99 at n = 10. Smallest times of
rounds taken in turns hardly feel other processes; the limits here leave room all the same.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

BENCH = Path(__file__).parents[2] / "benchmarks" / "bench_c.py"
ROOM = 1.25


@pytest.fixture(scope="module")
def bench():
    found = importlib.util.spec_from_file_location("bench_c", BENCH)
    module = importlib.util.module_from_spec(found)
    sys.modules[found.name] = module
    found.loader.exec_module(module)
    return module


@pytest.mark.parametrize("order", [2, 10])
def test_a_step_costs_no_more_than_casadis(bench, order):
    pairs = [bench.measure("every term", order, rounds=60) for _ in range(3)]
    assert max(pair.apart for pair in pairs) <= 1e-9
    assert min(pair.ours / pair.casadi for pair in pairs) <= ROOM


def test_the_cost_grows_linearly_up_to_order_50(bench):
    small, large = (bench.measure("every term", order, rounds=60) for order in (10, 50))
    assert large.apart <= 1e-9
    assert large.ours / small.ours <= 5.0 * ROOM
