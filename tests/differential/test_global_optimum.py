"""The same geometric programs, written down again for another solver: the optimum is global."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cvxpy as cp
import pytest

from bfppc_synth.gains.geometric import is_geometric
from bfppc_synth.gains.optimality import optimality_of
from bfppc_synth.gains.problem import DesignProblem, patterns, slots
from bfppc_synth.gains.search import search
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.prepare import prepare

EXAMPLES = Path(__file__).parents[2] / "examples"
Load = Callable[[Any, Any], Any]
LINEAR = "synthesis:\n  gains: {x1: {M: 0, c: 0}, x2: {M: 0, c: 0}}\n  objective: peak-input\n"


def posed(name: str, tmp_path: Path, gains: str = LINEAR) -> DesignProblem:
    path = tmp_path / "plant.yaml"
    path.write_text((EXAMPLES / f"{name}.yaml").read_text().replace("synthesis:\n", gains))
    return prepare(load_spec(path))[0]


def written_again(problem: DesignProblem, loads: tuple[Load, Load], form: str) -> float:
    """Solve order 2 with linear shapes as docs/theory.md sections 2 and 3 write it, by DGP.

    ``loads`` are f_1*(X_1) and f_2*(X_1, X_2), by hand; no quantizer, g = 1, no margins.
    """
    center, p1 = problem.center, problem.accuracy
    p2, k1, k2, inner, peak = (cp.Variable(pos=True) for _ in range(5))
    X = [max(-a, b) for a, b in zip(center.r_lower, center.r_upper, strict=True)]
    X1, X2 = X[0] + p1, X[1] + p2 + k1 * p1
    D1 = loads[0](X1, X2) + center.rate[0]
    B1 = k1 * (D1 + p2 + center.feed[0] + k1 * p1)
    D2 = loads[1](X1, X2) + center.rate[1] + B1
    V = D2 + k2 * p2
    hold = problem.conditions.hold
    lost = V if form == "U2" else D2
    rows = [
        D1 + p2 + center.feed[0] <= k1 * p1,
        (inner + hold * lost if hold else inner) <= p2,
        k2 * inner >= D2,
        k2 * p2 <= peak,
    ]
    if form == "U2'":
        rows.append(2.0 * hold * V <= p2)
    weights = problem.weights
    program = cp.Problem(cp.Minimize(peak**weights.peak_input * k2**weights.slope), rows)
    program.solve(gp=True, solver=cp.CLARABEL)
    return math.log(program.value)


# By hand: of -1.5 x^2 - 0.5 x^3 over [-0.5 - p_1, p_1], x^2 <= X_1^2 and x^3 <= p_1^3.
PLANTS: dict[str, tuple[Load, Load]] = {
    "paper_example_1": (lambda X1, _: X1**2 + 1.0, lambda X1, X2: X1 * X2**2),
    "compressor_surge": (lambda X1, _: 1.5 * X1**2 + 0.5 * 0.05**3, lambda _, __: 0.0),
}


@pytest.mark.parametrize("name", sorted(PLANTS))
def test_another_solver_finds_the_same_optimum_within_half_a_percent(
    name: str, tmp_path: Path
) -> None:
    problem = posed(name, tmp_path)
    # Nearly no margins: what is compared is the program, not the room that rounding needs.
    found = search(replace(problem, margin=1e-6), lambda _message: None)
    assert found is not None
    known = optimality_of(problem, found)
    assert known is not None
    assert known.gap is not None
    assert known.gap_without_margins is not None
    assert known.gap_without_margins < 0.005
    forms = ("U2", "U2'") if problem.conditions.hold else ("U2",)
    again = min(written_again(problem, PLANTS[name], form) for form in forms)
    assert found.cost == pytest.approx(again, abs=0.005)
    assert found.lower is not None
    assert found.lower[1] <= again + 1e-4


@pytest.mark.parametrize("name", sorted(PLANTS))
def test_the_design_that_is_offered_is_within_a_percent_of_the_bound(
    name: str, tmp_path: Path
) -> None:
    problem = posed(name, tmp_path)
    found = search(problem, lambda _message: None)
    assert found is not None
    known = optimality_of(problem, found)
    assert known is not None
    assert known.gap is not None
    assert known.gap_without_margins is not None
    assert known.gap < 0.005
    assert known.gap_without_margins < 0.01


def test_a_free_tanh_is_no_geometric_program(tmp_path: Path) -> None:
    problem = posed("paper_example_1", tmp_path, "synthesis:\n")
    first = tuple(patterns(gains)[0] for gains in problem.gains)
    assert not is_geometric(problem, slots(problem, first), "U2")
    found = search(problem, lambda _message: None)
    assert found is not None
    known = optimality_of(problem, found)
    assert known is not None
    assert known.gap is None
    assert known.starts >= 2
    assert 0.0 <= known.spread < 0.01


def test_a_gain_that_shrinks_with_the_box_is_no_geometric_program(tmp_path: Path) -> None:
    problem = posed("cart_pendulum", tmp_path)
    pattern = tuple(patterns(gains)[0] for gains in problem.gains)
    assert not is_geometric(problem, slots(problem, pattern), "U2")
