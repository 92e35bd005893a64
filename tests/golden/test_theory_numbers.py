"""The reference numbers of docs/theory.md sections 2 and 3, reached or beaten."""

from __future__ import annotations

import pytest

from bfppc_synth.bounds.chain import ChainRules, Coupling, Division, chain_input, evaluate_chain
from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.bounds.residual import float_residual
from bfppc_synth.model.shapes import Shape
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.prepare import prepare
from bfppc_synth.synthesis.synthesize import synthesize

EXAMPLE_1 = """
name: one
states: [x1, x2]
dynamics:
  x1: {{f: x1**2 - sin(x1), f_bound: x1**2 + 1}}
  x2: {{f: x1*x2**2}}
initial: {{x1: 1, x2: 0}}
performance: {{accuracy: 0.15}}
measurement: {{quantizer: {{kind: uniform, step: {step}}}}}
sampling: {{period: {period}}}
synthesis: {{center: performance, objective: {objective}, anchor: {anchor}}}
"""
EXAMPLE_2 = """
name: two
states: [x1, x2]
dynamics:
  x1:
    f: x1 + x1*exp(-x1/2)
    g: 1 + sin(x1**2)
    f_bound: Abs(x1) + Abs(x1)*exp(Abs(x1)/2)
    g_bound: 2
    g_min: 1
  x2: {{f: x1*sin(x2) + x1*x2**2, g: 3 + cos(x1), g_min: {g_min}}}
reference: sin(t)
initial: {{x1: 0.5, x2: 0}}
performance: {{accuracy: 0.05, rho: {{kind: cosine, t_s: 1, rate_bound: {rate}}}}}
{measurement}
sampling: {{period: {period}}}
synthesis: {synthesis}
"""


def spec_of(tmp_path, text):
    path = tmp_path / "plant.yaml"
    path.write_text(text, encoding="utf-8")
    return load_spec(path)


def example_1(tmp_path, *, delta, period, objective="peak-input", anchor="latched"):
    text = EXAMPLE_1.format(step=2 * delta or 1, period=period, objective=objective, anchor=anchor)
    if delta == 0:
        text = text.replace("{kind: uniform, step: 1}", "{kind: none}")
    return synthesize(spec_of(tmp_path, text))


def test_the_printed_chain_of_example_2_has_the_papers_numbers(tmp_path):
    text = EXAMPLE_2.format(
        g_min=1,
        rate=1,
        measurement="",
        period=0,
        synthesis=(
            "{method: theorem2, form: printed, center: performance, p: {x2: 2},"
            " gains: {x1: {k: 2, M: 13.31441, epsilon: 0.5, c: 0.1, N: 3}, x2: {k: 2, N: 5}}}"
        ),
    )
    problem, _ = prepare(spec_of(tmp_path, text))
    numbers = FloatNumbers()
    shapes = (
        Shape(k=2.0, M=13.31441, epsilon=0.5, c=0.1, N=3),
        Shape(k=2.0, M=0.0, epsilon=0.5, c=0.0, N=5),
    )
    start = chain_input(
        tuple(shape.generic for shape in shapes),
        (0.05, 2.0),
        problem.center,
        problem.conditions,
        numbers,
    )
    bounds = evaluate_chain(
        start,
        float_residual(problem.plant, problem.majorants, problem.center),
        numbers,
        ChainRules(coupling=Coupling.SIMPLE, division=Division.PRINTED),
    )
    assert bounds.X[0] == pytest.approx(1.55, rel=1e-9)
    assert bounds.W[0] == pytest.approx(4.91442 + 1.5, rel=1e-5)
    assert bounds.F_star[0] == pytest.approx(10.41442, rel=1e-6)
    assert bounds.F_star[0] + 3 - 0.1 - 1.25e-5 == pytest.approx(13.31441, rel=1e-6)
    assert bounds.A[0] == pytest.approx(11.6782, rel=1e-5)
    assert bounds.L[0] == pytest.approx(356.548, rel=1e-5)
    E_1 = bounds.D[0] + bounds.G[0] * (2.0 + bounds.A[0])
    assert pytest.approx(33.7709, rel=1e-5) == E_1
    assert bounds.F_star[1] == pytest.approx(12332.5, rel=1e-5)


def test_the_joint_suprema_of_example_2_are_those_of_the_theory(tmp_path):
    text = EXAMPLE_2.format(
        g_min=2, rate=0.5, measurement="", period=0, synthesis="{center: performance}"
    )
    problem, signals = prepare(spec_of(tmp_path, text))
    assert max(-problem.center.r_lower[0], problem.center.r_upper[0]) == pytest.approx(
        1.2808, abs=5e-5
    )
    assert problem.center.rate[0] == pytest.approx(1.0308, abs=5e-5)
    assert pytest.approx(1.0, rel=1e-9) == signals.Y_0


@pytest.mark.parametrize(
    ("delta", "period", "reference"),
    [(0, 0, 95), (0, 0.001, 142), (0.05, 0, 328), (0.05, 0.0001, 344), (0.05, 0.001, 796)],
)
def test_example_1_reaches_the_reference_peak_input(tmp_path, delta, period, reference):
    design = example_1(tmp_path, delta=delta, period=period)
    design.certificate.require()
    assert 1.03 * reference >= design.bounds.U


def test_the_papers_errors_cost_what_the_theory_says(tmp_path):
    design = example_1(tmp_path, delta=0.05, period=0, anchor="exact")
    design.certificate.require()
    assert design.bounds.U <= 1.03 * 1270
    latched = example_1(tmp_path, delta=0.05, period=0)
    assert design.bounds.U > 2 * latched.bounds.U


def test_balance_of_peak_input_and_slope_reaches_the_reference_product(tmp_path):
    design = example_1(tmp_path, delta=0.05, period=0.0001, objective="balanced")
    design.certificate.require()
    assert design.bounds.U * design.bounds.slope <= 1.03 * 7.1e5


@pytest.mark.parametrize(
    ("delta", "period", "reference"), [(0, 0, 571), (0, 0.0001, 1660), (0.01, 0.0001, 4510)]
)
def test_example_2_reaches_the_reference_peak_input(tmp_path, delta, period, reference):
    measurement = f"measurement: {{quantizer: {{kind: uniform, step: {2 * delta}}}}}"
    text = EXAMPLE_2.format(
        g_min=2,
        rate=0.5,
        measurement=measurement if delta else "",
        period=period,
        synthesis="{center: performance, objective: peak-input}",
    )
    design = synthesize(spec_of(tmp_path, text))
    design.certificate.require()
    assert 1.03 * reference >= design.bounds.U
