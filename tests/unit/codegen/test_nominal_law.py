"""Center nominal in the law: what is latched, what is followed, what it costs."""

from __future__ import annotations

import ast
import importlib.util
import math
from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

from bfppc_synth.certificate.checker import screen
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.nominal import nominal_center
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import evaluate_float
from bfppc_synth.model.law import Literal, Operator
from bfppc_synth.model.nominal import NominalModel

T = sp.Symbol("t", real=True)
STARTS = {
    "integrator": (0.7,),
    "pendulum": (0.9, -0.6),
    "supplied": (0.4, -0.8, 0.5),
    "joint": (0.2, 0.3, 0.1, -0.7),
}
NAMES = sorted(STARTS)


def _designs():
    path = Path(__file__).with_name("handmade_nominal.py")
    spec = importlib.util.spec_from_file_location("handmade_nominal", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


nominal = _designs()


class Program:
    """The programs of center nominal, run statement by statement."""

    def __init__(self, design):
        self.law = build_law(design)
        self.values = {c.name: float(c.value) for c in self.law.certified}

    def run(self, statements, values):
        values = dict(values)
        for statement in statements:
            operands = [self.value(o, values) for o in statement.operands]
            values[statement.target] = compute(statement.operator, operands)
        return values

    def value(self, operand, values):
        return operand.value if isinstance(operand, Literal) else values[operand.name]

    def latch(self, start, passed=()):
        """Latch the weights of a start."""
        block = self.law.center.latch
        values = self.values | self.signals(0.0, passed)
        values |= {f"x_{i}": x for i, x in enumerate(start, start=1)}
        values = self.run(block.statements, values)
        pairs = zip(self.law.center.latched, block.values, strict=True)
        self.values |= {name: self.value(operand, values) for name, operand in pairs}

    def signals(self, t, passed=()):
        values = {"elapsed": t} | {f"y_d_{k}": y for k, y in enumerate(passed)}
        return self.run(self.law.center.latch.signals, values)

    def center(self, t, passed=()):
        """r_1..r_n, v at t."""
        block = self.law.center
        values = self.run(block.statements, self.values | self.signals(t, passed))
        return [self.value(operand, values) for operand in (*block.r, block.v)]


def compute(operator, operands):
    match operator:
        case Operator.SELECT_LESS:
            left, right, then, otherwise = operands
            return then if left < right else otherwise
        case Operator.ADD:
            return operands[0] + operands[1]
        case Operator.SUB:
            return operands[0] - operands[1]
        case Operator.MUL:
            return operands[0] * operands[1]
        case Operator.DIV:
            return operands[0] / operands[1]
        case Operator.NEG:
            return -operands[0]
    return getattr(math, operator.value)(*operands)


def supplied_reference(t):
    """A quarter of sin t and its derivatives."""
    return tuple(0.25 * math.sin(t + k * math.pi / 2) for k in range(4))


def made(name):
    design = nominal.DESIGNS[name]()
    passed = supplied_reference if design.plant.reference is None else lambda _: ()
    program = Program(design)
    program.latch(STARTS[name], passed(0.0))
    return design, program, passed


@pytest.mark.parametrize("name", NAMES)
def test_the_center_starts_in_the_measured_state(name):
    _, program, passed = made(name)
    *r, _ = program.center(0.0, passed(0.0))
    assert r == pytest.approx(STARTS[name], rel=1e-13, abs=1e-13)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("share", [0.0, 0.03, 0.4, 0.97, 1.0, 1.7])
def test_the_center_is_a_trajectory_of_the_nominal_plant(name, share):
    design, program, passed = made(name)
    model, t, h = design.nominal, share * design.nominal.transition, 1e-5
    middle = program.center(t, passed(t))
    # From both sides, also around T_s, where v is smooth and its derivative is not.
    ends = [program.center(s, passed(s)) for s in (max(t - h, 0.0), t + h)]
    length = (t + h) - max(t - h, 0.0)
    values = dict(zip(model.states, middle, strict=False))
    for i, (f, g) in enumerate(zip(model.f, model.g, strict=True)):
        slope = (ends[1][i] - ends[0][i]) / length
        field = evaluate_float(f, values) + evaluate_float(g, values) * middle[i + 1]
        assert slope == pytest.approx(field, rel=1e-4, abs=3e-3)


@pytest.mark.parametrize("name", NAMES)
def test_the_transition_is_over_exactly_at_its_end(name):
    design, program, passed = made(name)
    T_s = design.nominal.transition
    other = Program(design)
    other.latch(tuple(0.5 * x for x in STARTS[name]), passed(0.0))
    for t in (T_s, math.nextafter(T_s, 9.0), 3.0 * T_s, 1e6):
        assert program.center(t, passed(t)) == other.center(t, passed(t))
        y_d = passed(t)[0] if passed(t) else evaluate_float(design.plant.reference, {T: t})
        assert program.center(t, passed(t))[0] == pytest.approx(y_d, rel=1e-15)
    before = 0.9 * T_s
    assert program.center(before, passed(before)) != other.center(before, passed(before))


@pytest.mark.parametrize("name", NAMES)
def test_the_command_is_the_feedforward_of_the_measured_start(name, module_of):
    design, program, passed = made(name)
    controller = module_of(design).Controller()
    reference = passed(0.0) or None
    v = program.center(0.0, passed(0.0))[-1]
    u = controller.step(5.0, STARTS[name], reference)
    limit = controller.U_MAX
    assert u == pytest.approx(max(-limit, min(limit, v)), rel=1e-12, abs=1e-12)
    assert controller.status == 0


def test_the_constants_carry_t_s_just_before_the_clamp():
    law = build_law(nominal.joint())
    assert [c.name for c in law.certified][-3:] == ["p_4", "T_s", "U_MAX"]
    assert law.certified[-2].value == 2.0
    assert law.certified[-2].used
    assert law.center.latched == ("b_0", "b_1", "b_2", "b_3")
    assert [operand.name for operand in law.center.r] == ["r_1", "r_2", "r_3", "r_4"]
    assert law.center.v.name == "v"


def test_another_t_s_is_another_constant_and_no_other_text():
    design = nominal.pendulum()
    other = replace(design, nominal=replace(design.nominal, transition=1.25))
    texts = [render_controller(build_law(d), make_provenance(d)) for d in (design, other)]
    assert texts[0] != texts[1]
    assert texts[0].replace("T_s = 2.0\n", "T_s = 1.25\n") == texts[1]


# Operations measured with a prototype on a trigonometric plant (issue 5).
BAR = {2: 37, 5: 335, 10: 2145}
COUNTS = {2: 34, 3: 66, 4: 116, 5: 188, 10: 1018}


@pytest.mark.parametrize("order", sorted(COUNTS))
def test_a_step_costs_fewer_operations_than_the_bar(order):
    states = sp.symbols(f"x1:{order + 1}", real=True)
    model = NominalModel(
        states=states,
        f=tuple(sp.Rational(3, 2) * sp.sin(x) for x in states),
        g=(sp.Integer(1),) * order,
        left_out=((),) * order,
        transition=2.0,
    )
    center = nominal_center(model, sp.sin(T), T)
    assert len(center.statements) == COUNTS[order]
    assert COUNTS[order] <= BAR.get(order, COUNTS[order])
    assert len(center.latch.signals) <= 3 * order
    # Once, not at every step.
    assert len(center.latch.statements) <= COUNTS[order]


def test_every_statement_is_needed():
    for make in nominal.DESIGNS.values():
        law = build_law(make())
        block, latch = law.center, law.center.latch
        blocks = (latch.signals, latch.statements, block.statements, law.feedback)
        targets = [s.target for statements in blocks for s in statements]
        assert len(set(targets)) == len(targets)
        operands = [o for statements in blocks for s in statements for o in s.operands]
        read = {o.name for o in (*operands, *latch.values) if not isinstance(o, Literal)}
        assert set(targets) - read == {"u"}


def test_a_reference_with_a_kink_is_refused():
    design = nominal.pendulum()
    with pytest.raises(EnvelopeError, match="absolute"):
        nominal_center(design.nominal, sp.Abs(sp.sin(T)), T)


def test_the_checker_lets_every_controller_run():
    for make in nominal.DESIGNS.values():
        law = build_law(make())
        text = render_controller(law, make_provenance(make()))
        screen(text, [constant.name for constant in (*law.certified, *law.limits)])
        ast.parse(text)


def test_helpers_are_written_only_where_python_could_raise():
    texts = {
        name: render_controller(build_law(make()), make_provenance(make()))
        for name, make in nominal.DESIGNS.items()
    }
    for name in ("integrator", "pendulum", "joint"):
        assert "ieee_" not in texts[name]
    for helper in ("divide", "exp"):
        assert f"def ieee_{helper}" in texts["vanishing"]
