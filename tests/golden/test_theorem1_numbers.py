"""The numbers of docs/theory.md section 7: the sound design, the audit, the counterexample."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest

from bfppc_synth.bounds.true_starts import printed_start_center
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.gains.methods.theorem1 import Theorem1
from bfppc_synth.gains.problem import Weights
from bfppc_synth.gains.theorem1.judge import Theorem1Judge
from bfppc_synth.gains.theorem1.search import search_theorem1
from bfppc_synth.gains.theorem1.setup import theorem1_problem
from bfppc_synth.majorants.derive import derive_majorants
from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.model.spec import Form
from bfppc_synth.model.theorem1 import Schedule, Theorem1Spec
from bfppc_synth.spec.load import load_spec

EXAMPLE_1 = """
name: one
states: [x1, x2]
dynamics:
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2}
initial: {x1: 1, x2: 0}
performance: {accuracy: 0.15}
measurement: {quantizer: {kind: uniform, step: 0.1}}
"""
COUNTEREXAMPLE = """
name: counterexample
states: [x1]
dynamics:
  x1: {f: 0.1*x1**2}
initial: {x1: 10}
performance: {accuracy: 1.01, rho: {kind: cosine, t_s: 100}}
measurement: {quantizer: {kind: uniform, step: 0.01}}
"""
PEAK = Weights(peak_input=1.0, slope=0.01)
BALANCED = Weights(peak_input=1.0, slope=1.0)
PRINTED_GAINS = (
    Theorem1Gain(gamma=4.0, H=(5.0,), H_star=5.0, c=0.1, N=3),
    Theorem1Gain(gamma=0.4, H=(10.0,), H_star=10.0, c=1.5, N=3),
)
# H(rho) = 0.1 (p_1 + 10 rho)^2 + 1.05
DOMINATING = (0.1 * 1.01**2 + 1.05, 2.02, 10.0)


def problem_of(tmp_path, text, *, weights=PEAK, form=Form.SOUND, schedule=Schedule.CONSTANT):
    path = tmp_path / "plant.yaml"
    path.write_text(text, encoding="utf-8")
    spec = load_spec(path)
    options = Theorem1Spec(c_0=None, epsilon=(None,) * spec.order, H=schedule)
    synthesis = replace(spec.synthesis, form=form, theorem1=options)
    plant = build_plant(replace(spec, synthesis=synthesis))
    return theorem1_problem(plant, derive_majorants(plant), weights, 2e-4)


def quiet(message):
    del message


def by_name(evaluation):
    return {(demand.name, demand.step): demand for demand in evaluation.demands}


def test_example_1_has_a_sound_design_at_or_below_the_reference(tmp_path):
    problem = problem_of(tmp_path, EXAMPLE_1)
    design = search_theorem1(problem, quiet)
    assert design.holds(1e-4)
    assert design.half_widths[0] == 0.15
    assert design.bounds.U <= 4.43e4
    assert design.gains[0].k == pytest.approx(82.3, rel=0.1)
    assert design.gains[1].k <= 2599
    again = Theorem1Judge(problem).evaluate(design.gains, design.half_widths, design.c_0)
    assert again == design


def test_the_default_objective_trades_peak_input_for_slope(tmp_path):
    peak = search_theorem1(problem_of(tmp_path, EXAMPLE_1), quiet)
    both = search_theorem1(problem_of(tmp_path, EXAMPLE_1, weights=BALANCED), quiet)
    assert both.bounds.U > peak.bounds.U
    assert both.bounds.slope < peak.bounds.slope
    assert both.bounds.U * both.bounds.slope < peak.bounds.U * peak.bounds.slope


def test_a_scheduled_design_dominates_its_load_between_the_nodes_too(tmp_path):
    problem = problem_of(tmp_path, EXAMPLE_1, schedule=Schedule.SCHEDULED)
    design = search_theorem1(problem, quiet)
    assert design.holds(1e-4)
    assert all(len(gain.H) == 2 and min(gain.H) >= 0.0 for gain in design.gains)
    fine = replace(problem, nodes=tuple(j / 64 for j in range(65)))
    judged = Theorem1Judge(fine).evaluate(design.gains, design.half_widths, design.c_0)
    assert judged.holds(1e-4)
    for table, gain, room in zip(
        judged.chain.tables, design.gains, judged.chain.epsilon, strict=True
    ):
        loads = [node.needed for node in table]
        assert loads == sorted(loads)
        step = judged.chain.tables.index(table)
        ahead = design.c_0
        if step + 1 < len(design.gains):
            ahead += 0.1 + judged.chain.epsilon[step + 1]
        # The two ends that are certified stand for every rho.
        assert all(
            gain.gamma * node.H * room + gain.c * node.p**gain.N > node.H + ahead for node in table
        )


def test_a_scheduled_design_satisfies_the_theory_written_out_for_example_1(tmp_path):
    """Section 7 by hand, on a fine grid of rho: shares no code with the chain."""
    problem = problem_of(tmp_path, EXAMPLE_1, schedule=Schedule.SCHEDULED)
    design = search_theorem1(problem, quiet)
    (first, second), (_, top_2) = design.gains, design.half_widths
    c_0, rho_M, delta_M = design.c_0, 0.5, 0.1
    assert first.c == second.c == 0.0
    eps_1 = 0.15 - delta_M
    eps_2 = top_2 - (delta_M + first.k * delta_M + c_0)
    for j in range(501):
        rho = j / 500
        H_1, H_2, slope = first.height(rho), second.height(rho), first.H[1]
        k_1 = first.gamma * H_1
        p_1, D_2 = delta_M + eps_1, delta_M + k_1 * delta_M + c_0
        p_2 = D_2 + eps_2
        load = (p_1 + rho) ** 2 + 1 + rho_M
        rate = k_1 * (load + p_2 + k_1 * p_1) + first.gamma * slope * rho_M * p_1
        force = (p_1 + rho) * (p_2 + k_1 * p_1) ** 2
        assert load < H_1
        assert force + rate + rho_M * first.gamma * slope * delta_M < H_2
        assert k_1 * eps_1 > H_1 + c_0 + delta_M + eps_2
        assert second.gamma * H_2 * eps_2 > H_2 + c_0
    assert pytest.approx(second.k * (p_2 + D_2), rel=1e-12) == design.bounds.U


def test_a_scheduled_design_starts_steeper_and_ends_flatter_than_a_constant_one(tmp_path):
    constant = search_theorem1(problem_of(tmp_path, EXAMPLE_1), quiet)
    problem = problem_of(tmp_path, EXAMPLE_1, schedule=Schedule.SCHEDULED)
    scheduled = search_theorem1(problem, quiet)
    last = scheduled.gains[-1]
    assert last.gamma * last.height(0.0) < constant.gains[-1].k < last.k


def test_nothing_is_certified_below_the_papers_resolution(tmp_path):
    text = EXAMPLE_1.replace("accuracy: 0.15", "accuracy: 0.0999")
    assert search_theorem1(problem_of(tmp_path, text), quiet) is None
    text = EXAMPLE_1.replace("accuracy: 0.15", "accuracy: 0.11")
    assert search_theorem1(problem_of(tmp_path, text), quiet).holds(1e-4)


def test_a_limit_below_the_least_peak_input_is_not_met(tmp_path):
    base = problem_of(tmp_path, EXAMPLE_1)
    assert search_theorem1(replace(base, limit=2e4), quiet) is None
    kept = search_theorem1(replace(base, limit=4.2e4), quiet)
    assert kept.bounds.U < 4.2e4


def test_fixed_numbers_stay_fixed(tmp_path):
    base = problem_of(tmp_path, EXAMPLE_1)
    first, second = base.steps
    steps = (replace(first, gamma=40.0, c=0.1), replace(second, epsilon=2.0, H=(6000.0,)))
    design = search_theorem1(replace(base, steps=steps, c_0=0.01), quiet)
    assert (design.gains[0].gamma, design.gains[0].c, design.c_0) == (40.0, 0.1, 0.01)
    assert design.gains[1].H == (6000.0,)
    assert design.chain.epsilon[1] == pytest.approx(2.0, rel=1e-9)
    assert design.holds(1e-4)


def test_the_audit_of_the_printed_example_1(tmp_path):
    problem = problem_of(tmp_path, EXAMPLE_1, form=Form.PRINTED)
    second = replace(problem.steps[1], p=3.1, epsilon=1.0)
    problem = replace(problem, steps=(problem.steps[0], second), c_0=0.0)
    found = by_name(Theorem1Judge(problem).evaluate(PRINTED_GAINS, (0.15, 3.1), 0.0))
    # (85) holds.
    assert found["T1.H", 0].lhs == 5.0
    assert found["T1.H", 0].rhs == pytest.approx(3.2125, rel=1e-9)
    # (39) asks for gamma_1 and c_0.
    assert found["T1.gamma", 0].lhs == 4.0
    assert found["T1.gamma", 0].rhs == pytest.approx(24.4, rel=0.02)
    assert found["T1.c", 1].lhs == 0.0
    assert found["T1.c", 1].rhs == pytest.approx(346, rel=0.02)
    # (86) with its printed margins.
    assert found["T1.H", 1].lhs == 10.0
    assert found["T1.H", 1].rhs == pytest.approx(234, rel=0.02)
    assert found["T1.p", 1].lhs >= found["T1.p", 1].rhs


def test_the_audit_by_the_exact_difference_and_by_delta_0(tmp_path):
    problem = problem_of(tmp_path, EXAMPLE_1, form=Form.PRINTED)
    exact = replace(problem, theorem=Theorem1())
    found = by_name(Theorem1Judge(exact).evaluate(PRINTED_GAINS, (0.15, 3.1), 0.0))
    assert found["T1.c", 1].rhs == pytest.approx(166, rel=0.02)
    margins = (Fraction(1, 20), Fraction(1, 20))
    problem = replace(problem, center=printed_start_center(problem.plant.spec, margins))
    found = by_name(Theorem1Judge(problem).evaluate(PRINTED_GAINS, (0.15, 3.1), 0.0))
    assert found["T1.H", 1].rhs == pytest.approx(228, rel=0.02)


def test_the_printed_form_can_be_satisfied_by_the_search(tmp_path):
    problem = problem_of(tmp_path, EXAMPLE_1, form=Form.PRINTED)
    found = search_theorem1(problem, quiet)
    assert Theorem1Judge(problem).accepts(found)


def test_the_counterexample_satisfies_every_printed_inequality(tmp_path):
    problem = problem_of(tmp_path, COUNTEREXAMPLE, form=Form.PRINTED, schedule=Schedule.SCHEDULED)
    judge = Theorem1Judge(problem)
    gain = Theorem1Gain(gamma=0.01, H=DOMINATING, H_star=1.0, c=1.6177, N=3)
    found = judge.evaluate((gain,), (1.01,), 0.1)
    assert judge.accepts(found)
    assert by_name(found)["T1.gamma", 0].rhs == pytest.approx(-0.567, abs=1e-3)
    # 1.6177 is the largest c_1 that (39) allows.
    assert not judge.accepts(judge.evaluate((replace(gain, c=1.6178),), (1.01,), 0.1))


def test_the_counterexample_is_refused_by_the_sound_form(tmp_path):
    problem = problem_of(tmp_path, COUNTEREXAMPLE, schedule=Schedule.SCHEDULED)
    judge = Theorem1Judge(problem)
    gain = Theorem1Gain(gamma=0.01, H=DOMINATING, H_star=1.0, c=1.6177, N=3)
    refused = judge.evaluate((gain,), (1.01,), 0.1)
    failed = [demand.name for demand in refused.demands if demand.lhs <= demand.rhs]
    assert failed == ["T1'.gamma"]
    repaired = judge.evaluate((replace(gain, gamma=1.2),), (1.01,), 0.1)
    assert judge.accepts(repaired)


def test_the_constant_form_refuses_the_counterexample_too(tmp_path):
    problem = problem_of(tmp_path, COUNTEREXAMPLE)
    judge = Theorem1Judge(problem)
    gain = Theorem1Gain(gamma=0.01, H=(sum(DOMINATING),), H_star=1.0, c=1.6177, N=3)
    refused = judge.evaluate((gain,), (1.01,), 0.1)
    failed = [demand.name for demand in refused.demands if demand.lhs <= demand.rhs]
    assert failed == ["T1.gamma"]


@pytest.mark.parametrize("gamma", [0.9, 1.1])
def test_the_gamma_boundary_lies_where_the_inequality_says(tmp_path, gamma):
    problem = problem_of(tmp_path, COUNTEREXAMPLE)
    judge = Theorem1Judge(problem)
    height = sum(DOMINATING)
    limit = (height + 0.1 - 1.6177 * 1.01**3) / height
    gain = Theorem1Gain(gamma=gamma * limit, H=(height,), H_star=1.0, c=1.6177, N=3)
    assert judge.accepts(judge.evaluate((gain,), (1.01,), 0.1)) is (gamma > 1.0)


def test_a_sound_constant_design_satisfies_theorem_u_with_the_exact_anchor(tmp_path):
    """What lets one checker prove both: Theorem 1 is a corollary of Theorem U."""
    from bfppc_synth.bounds.signals import bound_signals, conditions, performance_center
    from bfppc_synth.gains.evaluation import Judge
    from bfppc_synth.gains.methods.unified import Unified
    from bfppc_synth.gains.problem import DesignProblem, fixed_gains
    from bfppc_synth.model.spec import Anchor

    problem = problem_of(tmp_path, EXAMPLE_1)
    first, second = problem.steps
    steps = (replace(first, c=0.05), replace(second, c=1e-5))
    design = search_theorem1(replace(problem, steps=steps), quiet)
    assert design.gains[1].c == 1e-5
    spec = problem.plant.spec
    exact = replace(spec, synthesis=replace(spec.synthesis, anchor=Anchor.EXACT))
    plant = replace(problem.plant, spec=exact)
    unified = DesignProblem(
        plant=plant,
        majorants=problem.majorants,
        center=performance_center(plant, bound_signals(plant)),
        conditions=conditions(exact),
        theorem=Unified(),
        accuracy=problem.accuracy,
        half_widths=(None, None),
        gains=tuple(fixed_gains(gain) for gain in exact.synthesis.gains),
        weights=PEAK,
        limit=None,
        margin=2e-4,
    )
    shapes = tuple(gain.shape for gain in design.gains)
    found = Judge(unified).evaluate(shapes, design.half_widths, "U2")
    assert found.shortfall < 0.0
    assert found.bounds.U <= design.bounds.U
