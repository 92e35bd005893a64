"""Expressions in a target's functions: binary64, text, and what is refused."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import (
    FLOAT_FUNCTIONS,
    evaluate,
    evaluate_float,
    nearest_float,
    power_by_products,
)
from bfppc_synth.expressions.flatten import flatten

x, y = sp.symbols("x y", real=True)
R = sp.Rational


def unevaluated_root(base, p, q):
    return sp.Pow(base, R(p, q), evaluate=False)


@pytest.mark.parametrize(
    ("expression", "at", "value"),
    [
        (x**2 - sp.sin(x), 0.5, 0.25 - math.sin(0.5)),
        (x / 10, 3.0, 3.0 / 10.0),
        (R(2, 3) * x, 3.0, 2.0 / 3.0 * 3.0),
        (1 / x, 4.0, 0.25),
        (3 / x**2, 2.0, 0.75),
        (x**5, -2.0, -32.0),
        (x**-3, -2.0, -0.125),
        (sp.sqrt(x), 9.0, 3.0),
        (x ** R(3, 2), 4.0, 8.0),
        (x ** R(-1, 2), 4.0, 0.5),
        (unevaluated_root(x, 1, 3), -8.0, -2.0),
        (unevaluated_root(x, 2, 3), -8.0, pytest.approx(4.0, rel=1e-15)),
        (unevaluated_root(x, 5, 3), -8.0, pytest.approx(-32.0, rel=1e-15)),
        (unevaluated_root(x, -1, 3), -8.0, -0.5),
        (unevaluated_root(x, 1, 4), 16.0, 2.0),
        (sp.Abs(x), -2.0, 2.0),
        (sp.sign(x), -2.0, -1.0),
        (sp.sign(x), 0.0, 0.0),
        (sp.sign(x), 3.0, 1.0),
        (sp.exp(x), 1.0, math.e),
        (sp.Pow(sp.E, x, evaluate=False), 1.0, math.e),
        (sp.exp(x * sp.log(2)), 3.0, pytest.approx(8.0)),
        (sp.S(2) ** x, 3.0, pytest.approx(8.0)),
        (sp.log(x), math.e, 1.0),
        (sp.cos(x), 1.0, math.cos(1.0)),
        (sp.tan(x), 1.0, math.tan(1.0)),
        (sp.tan(x + sp.pi / 2), 1.0, pytest.approx(-1.0 / math.tan(1.0))),
        (sp.sinh(x), 1.0, math.sinh(1.0)),
        (sp.cosh(x), 1.0, math.cosh(1.0)),
        (sp.tanh(x), 1.0, math.tanh(1.0)),
        (sp.atan(x), 1.0, math.atan(1.0)),
        (sp.asinh(x), 1.0, math.asinh(1.0)),
        (sp.Max(x, 2, x**2), 1.5, 2.25),
        (sp.Min(x, 2, x**2), 1.5, 1.5),
        (sp.pi * x + sp.E, 1.0, math.pi + math.e),
        (sp.Piecewise((1, x < 0), (2, x <= 1), (3, True)), -1.0, 1.0),
        (sp.Piecewise((1, x < 0), (2, x <= 1), (3, True)), 0.0, 2.0),
        (sp.Piecewise((1, x < 0), (2, x <= 1), (3, True)), 1.0, 2.0),
        (sp.Piecewise((1, x > 1), (2, x >= 0), (3, True)), 1.0, 2.0),
        (sp.Piecewise((1, x > 1), (2, x >= 0), (3, True)), 0.0, 2.0),
        (sp.Piecewise((1, x > 1), (2, x >= 0), (3, True)), -1.0, 3.0),
        (sp.Piecewise((sp.log(x), x > 1), (0, True)), -1.0, 0.0),
        (sp.S(7), 0.0, 7.0),
    ],
)
def test_binary64_values(expression, at, value):
    assert evaluate_float(expression, {x: at}) == value
    assert evaluate(expression, {x: at}, FLOAT_FUNCTIONS) == value


@pytest.mark.parametrize(
    ("expression", "at", "named"),
    [
        (1 + 1 / x, 0.0, "1/x"),
        (sp.log(x) + 1, 0.0, "log(x)"),
        (sp.log(x) + 1, -1.0, "log(x)"),
        (2 * sp.sqrt(x), -1e-9, "sqrt(x)"),
        (x ** R(1, 4), -1.0, "x**(1/4)"),
        (sp.exp(x) - sp.exp(2 * x), 1e4, "-exp(2*x) + exp(x)"),
        (sp.sin(sp.exp(x)), 1e4, "sin(exp(x))"),
        (x + 1, math.nan, "x"),
        (sp.Max(1, sp.log(x)), -1.0, "log(x)"),
        (sp.Min(1, sp.log(x)), -1.0, "log(x)"),
    ],
)
def test_a_point_without_a_value_is_refused_by_name(expression, at, named):
    with pytest.raises(EnvelopeError) as refusal:
        evaluate_float(expression, {x: at})
    assert refusal.value.subexpression == named
    assert math.isnan(evaluate(expression, {x: at}, FLOAT_FUNCTIONS))


@pytest.mark.parametrize(
    ("expression", "at", "value"),
    [
        (sp.exp(x), 1e4, math.inf),
        (sp.sinh(x), -1e4, -math.inf),
        (sp.cosh(x), -1e4, math.inf),
        (x**3, -1e200, -math.inf),
    ],
)
def test_overflow_is_infinity(expression, at, value):
    assert evaluate_float(expression, {x: at}) == value


@pytest.mark.parametrize("node", [sp.gamma(x), x**y, sp.I, sp.zoo, sp.oo, sp.nan])
def test_what_has_no_rule_is_refused_by_name(node):
    with pytest.raises(EnvelopeError) as refusal:
        evaluate(sp.Add(1, node, evaluate=False), {x: 1.0, y: 1.0}, FLOAT_FUNCTIONS)
    assert refusal.value.subexpression == str(node)


def test_a_piecewise_without_a_last_branch_is_refused():
    with pytest.raises(EnvelopeError, match="none of its conditions"):
        evaluate_float(sp.Piecewise((x, x < 0)), {x: -1.0})


def test_a_missing_symbol_is_an_error():
    with pytest.raises(KeyError):
        evaluate_float(x + y, {x: 1.0})


def test_equal_subexpressions_are_computed_once():
    operators = [step.operator for step in flatten(sp.sin(x**2) * x**2 + sp.exp(sp.sin(x**2)))]
    assert operators.count("sin") == 1
    assert operators.count("power") == 1


class Text:
    """Prints what it is asked to do."""

    def __getattr__(self, name):
        return lambda *arguments: f"{name}({', '.join(map(str, arguments))})"


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        (y - x, "sub(y, x)"),
        (-x, "neg(x)"),
        (x / 3, "div(x, number(3))"),
        (-2 * x / y, "neg(div(mul(number(2), x), y))"),
        (1 / (x * y), "div(number(1), mul(x, y))"),
        (x**3, "power(x, 3)"),
        (unevaluated_root(x, 2, 3), "root_power(x, 2, 3)"),
        (x ** R(3, 2), "power(sqrt(x), 3)"),
        (sp.Max(x, y), "maximum(x, y)"),
        (sp.Piecewise((x, x > y), (y, True)), "select(<, y, x, x, y)"),
        (sp.Piecewise((x, x <= y), (y, True)), "select(<=, x, y, x, y)"),
    ],
)
def test_a_target_is_asked_for_plain_operations(expression, expected):
    assert evaluate(expression, {x: "x", y: "y"}, Text()) == expected


@pytest.mark.parametrize("exponent", range(1, 20))
def test_powers_are_products(exponent):
    assert power_by_products(-3.0, exponent) == (-3.0) ** exponent


@pytest.mark.parametrize(
    ("constant", "value"), [(R(1, 10), 0.1), (sp.pi, math.pi), (sp.E, math.e), (sp.Float(2.5), 2.5)]
)
def test_constants_are_the_nearest_binary64(constant, value):
    assert nearest_float(constant) == value
