"""The compiled-in reference against sympy's own value."""

from __future__ import annotations

import ast
import math

import pytest
import sympy as sp

from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.codegen.totality import raising
from bfppc_synth.errors import UsageError
from bfppc_synth.model.law import Literal, Operator, Statement, Variable

T = sp.Symbol("t", real=True)
REFERENCES = [
    sp.Integer(0),
    sp.Rational(1, 3),
    T,
    sp.sin(T),
    sp.Rational(3, 2) * sp.cos(2 * T / 3),
    sp.pi / 30 * sp.sin(T),
    sp.pi / 2 * sp.sin(T) * (1 - sp.exp(-(T**2) / 10)),
    sp.Pow(sp.sin(T), sp.Rational(1, 3)),
    sp.Pow(sp.sin(T), sp.Rational(2, 3)),
    sp.Pow(1 + T**2, sp.Rational(3, 4)) / (1 + T**2),
    sp.Piecewise((T, T < 1), (2 - T, sp.Le(T, sp.Rational(3, 2))), (sp.Rational(1, 2), True)),
    sp.Piecewise((sp.log(T) ** 2, T > 1), (0, True)),
    sp.Abs(sp.sin(T)) - sp.sign(sp.cos(T)),
    sp.Max(sp.sin(T), sp.cos(T), 0) + sp.Min(T, 2),
    sp.atan(T) + sp.asinh(T) / (1 + T) + sp.tanh(T) + sp.tan(sp.sin(T) / 2),
    sp.sinh(sp.sin(T)) + sp.cosh(sp.cos(T)) + sp.sqrt(T + 2),
    1 / sp.cosh(T),
    1 / (1 + T**5),
]


def meaning(expression, t):
    """Value by sympy, with the odd roots of docs/theory.md section 1."""

    def real_root(base, exponent):
        size = sp.Abs(base) ** exponent
        return size if exponent.p % 2 == 0 else sp.sign(base) * size

    odd = expression.replace(
        lambda node: node.is_Pow and node.exp.is_Rational and node.exp.q % 2 == 1 < node.exp.q,
        lambda node: real_root(node.base, node.exp),
    )
    return float(sp.N(odd.subs(T, sp.Rational(t)), 30))


@pytest.mark.parametrize("expression", REFERENCES, ids=str)
def test_the_reference_is_the_expression(expression, handmade, module_of):
    module = module_of(handmade.make_design(reference=expression, Y_0=30.0))
    for t in (0.0, 0.25, 0.75, 1.0, 1.25, 1.5, 2.5, 4.0, 7.875):
        value = module.Controller.reference(t)
        assert isinstance(value, float)
        assert value == pytest.approx(meaning(expression, t), rel=1e-13, abs=1e-14)


@pytest.mark.parametrize("expression", REFERENCES, ids=str)
def test_no_reference_ever_raises_inside_the_million_seconds(expression, handmade, module_of):
    controller = module_of(handmade.make_design(reference=expression, Y_0=30.0)).Controller()
    for t in (0.0, 1e-300, 1.0, 700.0, 709.0, 711.0, 1e5, 1e6):
        u = controller.step(t, [0.5, 0.0])
        assert abs(u) <= controller.U_MAX


def test_constants_are_the_nearest_numbers(handmade):
    design = handmade.make_design(reference=sp.Rational(1, 3) * sp.sin(T) + sp.pi)
    law = build_law(design)
    literals = {o.value for s in law.reference.statements for o in s.operands if type(o) is Literal}
    assert math.pi in literals
    assert literals & {3.0, 1 / 3}


def test_a_parameter_in_the_reference_is_refused(handmade):
    design = handmade.make_design(reference=sp.Symbol("amplitude", real=True) * sp.sin(T))
    with pytest.raises(UsageError, match="amplitude stands in"):
        build_law(design)


def test_helpers_are_written_only_where_python_could_raise(handmade):
    def text(expression):
        design = handmade.make_design(reference=expression)
        return render_controller(build_law(design), make_provenance(design))

    assert "ieee_" not in text(sp.sin(T) * sp.exp(-T) / (1 + T**2))
    assert "ieee_" not in text(sp.sqrt(1 + T) / (2 + sp.cos(T)))
    assert "def ieee_exp" in text(1 / (1 + sp.exp(T)))
    assert "def ieee_divide" in text(1 / (T - 3))
    assert "def ieee_log" in text(sp.log(T))
    assert "def ieee_sqrt" in text(sp.sqrt(T - 1))
    for expression in REFERENCES:
        ast.parse(text(expression))


@pytest.mark.parametrize(
    ("operator", "safe", "unsafe"),
    [
        (Operator.EXP, (0.0, 699.0), (0.0, 710.0)),
        (Operator.SINH, (-699.0, 699.0), (-710.0, 0.0)),
        (Operator.COSH, (-699.0, 699.0), (-710.0, 0.0)),
        (Operator.LOG, (1e-300, 1.0), (0.0, 1.0)),
        (Operator.SQRT, (0.0, 1.0), (-1e-300, 1.0)),
        (Operator.SIN, (-1e300, 1e300), (0.0, math.inf)),
        (Operator.COS, (-1e300, 1e300), (0.0, math.inf)),
        (Operator.TAN, (-1e300, 1e300), (0.0, math.inf)),
    ],
)
def test_an_operation_is_guarded_only_outside_its_domain(operator, safe, unsafe):
    statement = Statement(target="y", operator=operator, operands=(Variable(name="x"),))
    assert raising([statement], {"x": safe}) == frozenset()
    assert raising([statement], {"x": unsafe}) == {"y"}
    assert raising([statement], {}) == {"y"}


@pytest.mark.parametrize(("divisor", "guarded"), [((0.5, 2.0), False), ((0.0, 2.0), True)])
def test_a_quotient_is_guarded_where_its_divisor_may_be_zero(divisor, guarded):
    x, y = Variable(name="x"), Variable(name="y")
    statement = Statement(target="q", operator=Operator.DIV, operands=(x, y))
    found = raising([statement], {"x": (0.0, 1.0), "y": divisor})
    assert found == ({"q"} if guarded else frozenset())


def test_the_guards_begin_where_the_results_overflow():
    exponential, hyperbolic = 709.782712893384, 710.4758600739439
    assert math.exp(exponential) < math.inf
    assert math.sinh(hyperbolic) < math.inf
    assert math.cosh(hyperbolic) < math.inf
    for function, edge in ((math.exp, exponential), (math.sinh, hyperbolic)):
        with pytest.raises(OverflowError):
            function(math.nextafter(edge, math.inf))


EDGES = [0.0, -0.0, 1.0, -1.0, 800.0, -800.0, math.inf, -math.inf, math.nan]


def test_guarded_operations_answer_as_ieee_754_does(handmade, module_of):
    t = T - 5
    parts = [sp.exp(t), sp.sinh(t), sp.cosh(t), sp.log(t), sp.sqrt(t), sp.Pow(t, sp.Rational(3, 4))]
    parts += [f(sp.exp(t)) for f in (sp.sin, sp.cos, sp.tan)] + [1 / t]
    module = module_of(handmade.make_design(reference=sp.Add(*parts)))
    for v in EDGES:
        expected = {
            "exp": math.exp(v) if not v > 709 else math.inf,
            "sinh": v
            if math.isinf(v)
            else math.copysign(math.inf, v)
            if abs(v) > 710
            else math.sinh(v),
            "cosh": math.inf if abs(v) > 710 else math.cosh(v),
            "log": -math.inf if v == 0 else math.nan if v < 0 else math.log(v),
            "sqrt": math.nan if v < 0 else math.sqrt(v),
            "sin": math.nan if math.isinf(v) else math.sin(v),
            "cos": math.nan if math.isinf(v) else math.cos(v),
            "tan": math.nan if math.isinf(v) else math.tan(v),
        }
        for name, value in expected.items():
            assert same(getattr(module, f"ieee_{name}")(v), value), (name, v)
    assert module.ieee_power(1e300, 1.5) == math.inf
    assert module.ieee_power(math.inf, 1.5) == math.inf
    assert module.ieee_power(2.0, 1.5) == math.pow(2.0, 1.5)
    assert math.isnan(module.ieee_power(-1.0, 0.75))
    assert math.isnan(module.ieee_power(math.nan, 0.75))
    assert module.ieee_power(0.0, 0.75) == 0.0
    assert module.ieee_divide(1.0, 0.0) == math.inf
    assert module.ieee_divide(1.0, -0.0) == -math.inf
    assert module.ieee_divide(-1.0, 0.0) == -math.inf
    assert math.isnan(module.ieee_divide(0.0, 0.0))
    assert math.isnan(module.ieee_divide(math.nan, 0.0))
    assert module.ieee_divide(1.0, 4.0) == 0.25


def same(left, right):
    return (math.isnan(left) and math.isnan(right)) or (
        left == right and math.copysign(1.0, left) == math.copysign(1.0, right)
    )
