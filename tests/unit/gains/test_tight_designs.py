"""Designs by tight bounds: never worse than termwise, given gains kept, claims widened."""

import dataclasses
import math
import os
import re
from pathlib import Path

import pytest

from bfppc_synth.bounds.tight.search import Effort
from bfppc_synth.errors import NoDesignError
from bfppc_synth.gains.evaluation import Judge
from bfppc_synth.gains.problem import Weights
from bfppc_synth.gains.search import search
from bfppc_synth.gains.tight import repaired, search_tight
from bfppc_synth.gains.tight_repair import Widening
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import prepare, synthesize
from bfppc_synth.synthesis.tight import finder_of

ROOT = Path(__file__).parents[3]
EVERY = os.environ.get("BFPPC_TESTS") == "all"
PEAK_INPUT = Weights(peak_input=1.0, slope=0.01)
# The most that U may be by tight bounds, and by termwise ones (tests/golden).
PLANTS = {
    "examples/paper_example_1": 95.0,
    "examples/paper_example_2": 520.0,
    "examples/compressor_surge": math.inf,
    "tests/plants/nominal_motor_arm": 11.8,
    "tests/plants/nominal_jerk": 12.2,
}
MORE = {
    "examples/van_der_pol": math.inf,
    "examples/cart_pendulum": math.inf,
    "examples/motor_arm": math.inf,
    "examples/motor_arm_nominal": math.inf,
    "tests/plants/nominal_chain_of_four": 1.108,
    "tests/plants/nominal_flexible_joint": 122.5,
    "tests/plants/nominal_joint_shared": 77.6,
    "tests/plants/nominal_levitation": 16.5,
}


def posed(path):
    problem, signals = prepare(load_spec(path))
    problem = dataclasses.replace(problem, weights=PEAK_INPUT)
    return problem, finder_of(problem, signals)


def silent(message):
    del message


@pytest.mark.parametrize(("name", "most"), (PLANTS | (MORE if EVERY else {})).items())
def test_tight_designs_are_never_worse_than_termwise_ones(name, most):
    problem, finder = posed(ROOT / f"{name}.yaml")
    plain = search(problem, silent)
    found = search_tight(problem, finder, plain, silent, effort=Effort(cuts=150))
    assert found is not None
    assert plain is not None
    design = found.evaluation
    assert design.cost <= plain.cost + 1e-3
    assert min(most, 1.001 * plain.bounds.U) >= design.bounds.U
    assert design.holds(problem.margin / 2)
    for load, other in zip(design.tight.load, found.termwise.load, strict=True):
        assert 0.0 <= load <= other * (1.0 + 1e-12)
    # What is claimed is what the inequalities are made of.
    order, widths = problem.order, design.half_widths
    for i in range(order):
        ahead = widths[i + 1] if i + 1 < order else 0.0
        assert design.bounds.F_star[i] == design.tight.load[i] + ahead
    assert design.bounds.D[-1] == design.tight.rate


GIVEN = """name: given
states: [x1]
dynamics:
  x1: {{f: '-4*x1 + 0.5*x1**2'}}
reference: sin(t)
initial: {{x1: 0}}
performance: {{accuracy: 0.1, rho: {{kind: cosine, t_s: 1}}}}
synthesis: {{center: performance, gains: {{x1: {{k: {k}, M: 0, epsilon: 1, c: 0, N: 3}}}}}}
"""


def given(tmp_path, k):
    path = tmp_path / "plant.yaml"
    path.write_text(GIVEN.format(k=k), encoding="utf-8")
    return posed(path)


def test_given_gains_that_termwise_refuses_may_be_certified_tight(tmp_path):
    problem, finder = given(tmp_path, 55)
    plain = search(problem, silent)
    assert plain is not None
    assert not Judge(problem).accepts(plain)
    found = search_tight(problem, finder, None, silent)
    assert found is not None
    assert Judge(problem).accepts(found.evaluation)
    assert found.evaluation.shapes == plain.shapes
    assert found.evaluation.half_widths == plain.half_widths


def test_given_gains_that_are_too_small_stay_refused(tmp_path):
    # sup of |-4 x + 0.5 x^2| - s dr on the walls is 5.10: k p = 5.0 is below.
    problem, finder = given(tmp_path, 50)
    found = search_tight(problem, finder, None, silent)
    assert found is not None
    assert not Judge(problem).accepts(found.evaluation)


def test_a_fixed_half_width_and_fixed_gains_are_kept(tmp_path):
    spec = load_spec(ROOT / "examples/paper_example_1.yaml")
    text = spec.source.replace("center: performance", "center: performance\n  p: {x2: 0.9}")
    text = text.replace("  p:", "  gains: {x1: {epsilon: 0.7, c: 0.5}}\n  p:")
    path = tmp_path / "plant.yaml"
    path.write_text(text, encoding="utf-8")
    problem, finder = posed(path)
    found = search_tight(problem, finder, search(problem, silent), silent)
    assert found is not None
    design = found.evaluation
    assert design.half_widths == (0.15, 0.9)
    assert (design.shapes[0].epsilon, design.shapes[0].c) == (0.7, 0.5)
    assert design.holds(problem.margin / 2)


def test_a_design_is_found_where_there_is_no_termwise_one_to_start_from():
    problem, finder = posed(ROOT / "examples/paper_example_1.yaml")
    found = search_tight(problem, finder, None, silent)
    assert found is not None
    assert found.evaluation.bounds.U <= search(problem, silent).bounds.U


def test_a_claim_that_the_checker_wants_wider_is_widened_and_the_levels_follow():
    problem, finder = posed(ROOT / "examples/paper_example_2.yaml")
    found = search_tight(problem, finder, search(problem, silent), silent)
    assert found is not None
    wider = repaired(problem, finder, found, Widening(load=(1.05, 1.0), rate=1.0))
    assert wider is not None
    before, after = found.evaluation, wider.evaluation
    assert after.half_widths == before.half_widths
    assert after.tight.load[0] == pytest.approx(1.05 * before.tight.load[0], rel=1e-6)
    assert after.holds(problem.margin / 2)
    assert after.bounds.A[0] > before.bounds.A[0]
    termwise = repaired(problem, finder, found, Widening(load=(math.inf, math.inf), rate=math.inf))
    assert termwise is not None
    loads, others = termwise.evaluation.tight.load, termwise.termwise.load
    assert all(load > other for load, other in zip(loads, others, strict=True))


LIMITED = """name: limited
states: [x1, x2]
dynamics:
  x1: {{f: 'x1**2'}}
  x2: {{f: 'x1*x2'}}
reference: sin(t)
initial: {{x1: 0.1, x2: 0}}
performance: {{accuracy: 0.1}}
actuator: {{limit: {limit}}}
synthesis: {{center: performance, bounds: {bounds}}}
"""


def limited(tmp_path, limit, bounds):
    path = tmp_path / "plant.yaml"
    path.write_text(LIMITED.format(limit=limit, bounds=bounds), encoding="utf-8")
    return load_spec(path)


def test_a_limit_that_termwise_bounds_exceed_is_kept_by_tight_ones(tmp_path):
    with pytest.raises(NoDesignError, match=r"above actuator\.limit 65"):
        synthesize(limited(tmp_path, 65, "termwise"))
    design = synthesize(limited(tmp_path, 65, "tight"))
    assert design.certificate.verdict is Verdict.CERTIFIED
    assert design.bounds.U <= 65.0
    assert design.termwise.U is None


def test_a_limit_below_the_least_tight_input_is_refused_with_that_input(tmp_path):
    with pytest.raises(NoDesignError) as caught:
        synthesize(limited(tmp_path, 5, "tight"))
    found = re.search(r"least peak input found is ([0-9.]+)", str(caught.value))
    # The termwise one is 91.
    assert 5.0 < float(found[1]) < 50.0


def test_a_plant_that_nothing_pushes_gets_a_feedback_all_the_same(tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(
        "name: still\nstates: [x1, x2]\ndynamics: {x1: {f: 0}, x2: {f: 0}}\n"
        "initial: {x1: 0.5, x2: 0}\nperformance: {accuracy: 0.1, transition: 2}\n"
        "synthesis: {center: nominal, bounds: tight}\n",
        encoding="utf-8",
    )
    design = synthesize(load_spec(path))
    assert design.certificate.verdict is Verdict.CERTIFIED
    assert all(value > 0.0 for value in design.bounds.A)


def test_terms_without_a_bounded_slope_are_bounded_all_the_same(tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(
        "name: rough\nstates: [x1, x2]\ndynamics:\n"
        "  x1: {f: 'x1**(1/3) + sqrt(abs(x1))'}\n  x2: {f: 'sign(x2) + min(x1, x2)'}\n"
        "reference: sin(t)\ninitial: {x1: 0.1, x2: 0}\nperformance: {accuracy: 0.1}\n"
        "synthesis: {center: performance, bounds: tight}\n",
        encoding="utf-8",
    )
    design = synthesize(load_spec(path))
    assert design.certificate.verdict is Verdict.CERTIFIED
    assert design.bounds.U < design.termwise.U
