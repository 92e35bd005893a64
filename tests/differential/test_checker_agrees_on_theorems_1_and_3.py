"""The checker's chains of Theorems 1 and 3 against bounds/theorem1.py and bounds/stages.py."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.gains.theorem1.judge import Theorem1Judge
from bfppc_synth.model.shapes import Shape, Theorem1Gain
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.prepare import prepare
from bfppc_synth.synthesis.theorem1 import prepare_theorem1

if TYPE_CHECKING:
    from bfppc_synth.model.bounds import ChainBounds

# The float chain's suprema are found to about 1e-9.
TOLERANCE = 1e-7

THIRD = """\
name: third
parameters: {a: [0.4, 0.6]}
states: [x1, x2, x3]
dynamics:
  x1: {f: a*x1*sin(x1), f_bound: 0.6*Abs(x1), disturbance: 0.05}
  x2: {f: 0.1*x1*x2}
  x3: {f: tanh(x3) + x1}
initial: {x1: [-0.2, 0.3], x2: 0.1, x3: [-0.1, 0]}
performance: {accuracy: 0.3, rho: RHO}
measurement: {quantizer: {kind: uniform, step: 0.002}, noise: 0.0001}
synthesis: {method: theorem1}
"""
COSINE = THIRD.replace("RHO", "{kind: cosine, t_s: 2}")
FLOOR = THIRD.replace("RHO", "{kind: exponential, rate: 0.7, floor: 0.25}")
CONSTANT = ((0.9, (1.5,), 0.3, 3), (0.5, (40.0,), 0.01, 5), (0.7, (2000.0,), 0.0, 3))
SCHEDULED = (
    (0.9, (1.2, 0.5), 0.3, 3),
    (0.5, (25.0, 5.0, 8.0), 0.0, 3),
    (0.7, (900.0, 2e3), 0.1, 3),
)
HALF_WIDTHS, C_0 = (0.3, 1.5, 40.0), 0.01


def inside(value: float, enclosure: checker.Interval, name: str, room: float = 0.0) -> None:
    lower, upper = checker.to_doubles(enclosure)
    slack = TOLERANCE * abs(value) + 1e-12
    assert lower - slack <= value <= upper + slack, (name, value, lower, upper)
    assert upper - lower <= 10 * slack + room, (name, value, lower, upper)


@pytest.mark.parametrize("gains", [CONSTANT, SCHEDULED], ids=["constant", "scheduled"])
@pytest.mark.parametrize("text", [COSINE, FLOOR], ids=["cosine", "floor"])
def test_the_two_chains_of_theorem_1_agree(tmp_path: Path, text: str, gains: tuple) -> None:
    path = tmp_path / "third.yaml"
    path.write_text(text)
    spec = load_spec(path)
    from bfppc_synth.gains.problem import Weights

    problem = prepare_theorem1(spec, Weights(peak_input=1.0, slope=1.0), 0.0)
    tall = tuple(Theorem1Gain(gamma=g, H=H, H_star=H[0], c=c, N=N) for g, H, c, N in gains)
    found = Theorem1Judge(problem).evaluate(tall, HALF_WIDTHS, C_0)
    assert found is not None
    document = json.loads(plant_json(spec))
    table = checker.derive(document, gains, HALF_WIDTHS, C_0).enclosures
    bounds, compared = found.bounds, 0
    for name in ("X", "xi", "A", "L", "W", "D", "eta", "Lambda"):
        for state, value in zip(spec.states, getattr(bounds, name), strict=True):
            inside(value, table[f"{name}[{state}]"], f"{name}[{state}]")
            compared += 1
    for state, value in zip(spec.states[:-1], bounds.B[:-1], strict=True):
        inside(value, table[f"B[{state}]"], f"B[{state}]")
    for i, state in enumerate(spec.states):
        top = found.chain.tables[i][-1]
        inside(top.H, table[f"H[{state}]"], "H")
        inside(top.needed, table[f"H_needed[{state}]"], "H_needed")
        inside(found.chain.epsilon[i], table[f"epsilon[{state}]"], "epsilon")
    inside(bounds.U, table["U"], "U")
    assert compared == 24


@pytest.mark.parametrize("gains", [CONSTANT, SCHEDULED], ids=["constant", "scheduled"])
def test_what_H_must_dominate_agrees_at_every_node_of_rho(tmp_path: Path, gains: tuple) -> None:
    path = tmp_path / "third.yaml"
    path.write_text(COSINE.replace("theorem1}", "theorem1, theorem1: {H: scheduled}}"))
    spec = load_spec(path)
    from bfppc_synth.gains.problem import Weights

    problem = prepare_theorem1(spec, Weights(peak_input=1.0, slope=1.0), 0.0)
    assert len(problem.nodes) == 9
    tall = tuple(Theorem1Gain(gamma=g, H=H, H_star=H[0], c=c, N=N) for g, H, c, N in gains)
    found = Theorem1Judge(problem).evaluate(tall, HALF_WIDTHS, C_0)
    read = checker.read_plant(json.loads(plant_json(spec)))
    shapes = tuple(checker.tall_of(g, "") for g in gains)
    widths = tuple(map(checker.Fraction, HALF_WIDTHS))
    chain = checker._Theorem1(read, shapes, widths, checker.Fraction(C_0))
    chain.obligations()
    for j, rho in enumerate(problem.nodes):
        point = int(rho * checker.ONE)
        for i, level in enumerate(chain._cell((point, point))):
            node = found.chain.tables[i][j]
            # The float chain's boxes contain 0, these do not: they may be smaller.
            upper = checker.to_doubles(level.needed)[1]
            assert upper <= node.needed * (1.0 + TOLERANCE)
            assert upper >= 0.9 * node.needed
            for name in ("p", "D", "H", "delta", "D_slope", "delta_slope"):
                inside(getattr(node, name), getattr(level, name), name)


PLANT = (Path(__file__).parents[1] / "plants" / "switching.yaml").read_text(encoding="utf-8")
TIMED = (
    "simulation:",
    "sampling: {period: 0.00002, delay: 0.00001}\nmeasurement: {noise: [0.001, 0.01]}\nsimulation:",
)
MORE = (
    "  stages:\n",
    "  stages:\n    - p: {x1: 0.03, x2: 0.8}\n      gains: {x1: {k: 2}, x2: {k: 1}}\n",
)
CONTAINED = ("method: theorem3", "method: theorem3\n  handover: containment")
LAST = (
    Shape(k=3.0, M=14.0, epsilon=0.6, c=0.5, N=3),
    Shape(k=9000.0, M=0.0, epsilon=1.0, c=0.0, N=3),
)


def rounded(value: float, enclosure: checker.Interval, name: str, steepest: float) -> None:
    """What contains the controller's rounding in the checker only, magnified by steep shapes."""
    inside(value, enclosure, name, 1e-3 * abs(value) + 1e-9 * steepest)


def compare(
    bounds: ChainBounds[float], table: dict, states: tuple[str, ...], mark: str, steepest: float
) -> None:
    for name in ("X", "xi", "A", "L", "W", "D", "G", "g_min"):
        for state, value in zip(states, getattr(bounds, name), strict=True):
            # The center's rate and size contain measured errors, and those the rounding.
            rounded(value, table[f"{name}{mark}[{state}]"], f"{name}{mark}", steepest)
    for name in ("eta", "Lambda"):
        for state, value in zip(states, getattr(bounds, name), strict=True):
            rounded(value, table[f"{name}{mark}[{state}]"], f"{name}{mark}", steepest)
    for name in ("B", "s"):
        for state, value in zip(states[:-1], getattr(bounds, name)[:-1], strict=True):
            rounded(value, table[f"{name}{mark}[{state}]"], f"{name}{mark}", steepest)


@pytest.mark.parametrize(
    "changes", [(), (TIMED,), (MORE,), (TIMED, MORE), (TIMED, MORE, CONTAINED)]
)
def test_the_two_chains_of_every_stage_agree(tmp_path: Path, changes: tuple) -> None:
    text = PLANT
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "switching.yaml"
    path.write_text(text)
    spec = load_spec(path)
    problem, _ = prepare(spec)
    from bfppc_synth.gains.evaluation import Judge

    found = Judge(problem).best(LAST, (0.05, 2.0))
    stages = problem.staging.stages
    given = [
        (tuple((s.k, s.M, s.epsilon, s.c, s.N) for s in stage.gains), stage.omega, stage.widened)
        for stage in stages
    ]
    gains = tuple((s.k, s.M, s.epsilon, s.c, s.N) for s in LAST)
    document = json.loads(plant_json(spec))
    derived = checker.derive(document, gains, (0.05, 2.0), None, given)
    table = derived.enclosures
    for number, stage in enumerate(stages, start=1):
        mark = f".stage{number}"
        compare(stage.bounds, table, spec.states, mark, 1e3)
        rounded(stage.peak, table[f"U{mark}"], "U", 1e3)
        for state, value in zip(spec.states, stage.speed, strict=True):
            rounded(value, table[f"V{mark}[{state}]"], "V", 1e3)
    compare(found.bounds, table, spec.states, "", 1e7)
    for name in ("U", "V", "zeta"):
        rounded(getattr(found.bounds, name), table[name], name, 1e7)
    demands = {f"{d.name}[{spec.states[d.step]}]": d for d in found.demands}
    handovers = [claim for claim in derived.claims if claim.id.startswith("T3.handover")]
    assert bool(handovers) == (CONTAINED in changes)
    for claim in handovers:
        comparison = claim.comparisons[0]
        rounded(demands[claim.id].rhs, comparison.rhs, claim.id, 1e5)
        rounded(demands[claim.id].lhs, comparison.lhs, claim.id, 1.0)
