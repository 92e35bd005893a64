"""Every rule of docs/theory.md section 1: its exact range, and both sides of its domain."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.majorants.envelope import compile_envelope, envelope, magnitude
from bfppc_synth.majorants.targets import FloatArithmetic

x, y = sp.symbols("x y", real=True)
R = sp.Rational
FLOATS = FloatArithmetic()


def ends(expression, box_x, box_y=(0.0, 0.0)):
    return envelope(expression, {x: box_x, y: box_y}, FLOATS)


@pytest.mark.parametrize(
    ("expression", "box", "expected"),
    [
        (x + 1, (-2.0, 3.0), (-1.0, 4.0)),
        (1 - x, (-2.0, 3.0), (-2.0, 3.0)),
        (2 * x, (-2.0, 3.0), (-4.0, 6.0)),
        (-2 * x, (-2.0, 3.0), (-6.0, 4.0)),
        (1 / x, (2.0, 4.0), (0.25, 0.5)),
        (1 / x, (-4.0, -2.0), (-0.5, -0.25)),
        (x**3, (-2.0, 3.0), (-8.0, 27.0)),
        (x**2, (-3.0, 2.0), (0.0, 9.0)),
        (x**2, (-3.0, -2.0), (4.0, 9.0)),
        (x**2, (1.0, 2.0), (1.0, 4.0)),
        (x**-2, (-4.0, -2.0), (0.0625, 0.25)),
        (x**-3, (-2.0, -1.0), (-1.0, -0.125)),
        (x ** R(1, 3), (-8.0, 27.0), (-2.0, 3.0)),
        (x ** R(1, 3), (8.0, 27.0), (2.0, 3.0)),
        (x ** R(1, 3), (-27.0, -8.0), (-3.0, -2.0)),
        (x ** R(2, 3), (-8.0, 1.0), (0.0, 4.0)),
        (x ** R(2, 3), (-8.0, -1.0), (1.0, 4.0)),
        (x ** R(-1, 3), (-8.0, -1.0), (-1.0, -0.5)),
        (x ** R(3, 2), (4.0, 9.0), (8.0, 27.0)),
        (x ** R(-1, 2), (4.0, 16.0), (0.25, 0.5)),
        (sp.sqrt(x), (0.0, 9.0), (0.0, 3.0)),
        (sp.exp(x), (-1.0, 2.0), (math.exp(-1.0), math.exp(2.0))),
        (sp.sinh(x), (-1.0, 2.0), (math.sinh(-1.0), math.sinh(2.0))),
        (sp.tanh(x), (-1.0, 2.0), (math.tanh(-1.0), math.tanh(2.0))),
        (sp.atan(x), (-1.0, 2.0), (math.atan(-1.0), math.atan(2.0))),
        (sp.asinh(x), (-1.0, 2.0), (math.asinh(-1.0), math.asinh(2.0))),
        (sp.log(x), (1.0, math.e), (0.0, 1.0)),
        (sp.cosh(x), (-1.0, 2.0), (1.0, math.cosh(2.0))),
        (sp.cosh(x), (-2.0, -1.0), (math.cosh(1.0), math.cosh(2.0))),
        (sp.Abs(x), (-3.0, 2.0), (0.0, 3.0)),
        (sp.Abs(x), (-3.0, -2.0), (2.0, 3.0)),
        (sp.sign(x), (-1.0, 1.0), (-1.0, 1.0)),
        (sp.sign(x), (0.0, 1.0), (0.0, 1.0)),
        (sp.sign(x), (0.5, 1.0), (1.0, 1.0)),
        (sp.sign(x), (-1.0, 0.0), (-1.0, 0.0)),
        (sp.sign(x), (-1.0, -0.5), (-1.0, -1.0)),
        (sp.sign(x), (0.0, 0.0), (0.0, 0.0)),
        (sp.sin(x), (0.0, 1.0), (0.0, math.sin(1.0))),
        (sp.sin(x), (1.0, 2.0), (math.sin(1.0), 1.0)),
        (sp.sin(x), (-2.0, 1.0), (-1.0, math.sin(1.0))),
        (sp.sin(x), (4.0, 5.0), (-1.0, math.sin(4.0))),
        (sp.sin(x), (7.0, 8.0), (math.sin(7.0), 1.0)),
        (sp.sin(x), (0.0, 6.3), (-1.0, 1.0)),
        (sp.cos(x), (0.5, 1.0), (math.cos(1.0), math.cos(0.5))),
        (sp.cos(x), (-0.5, 1.0), (math.cos(1.0), 1.0)),
        (sp.cos(x), (3.0, 4.0), (-1.0, math.cos(4.0))),
        (sp.tan(x), (-1.0, 1.5), (math.tan(-1.0), math.tan(1.5))),
        (sp.tan(x), (2.0, 4.0), (math.tan(2.0), math.tan(4.0))),
        (sp.Max(x, 1), (-2.0, 3.0), (1.0, 3.0)),
        (sp.Min(x, 1), (-2.0, 3.0), (-2.0, 1.0)),
        (sp.Max(x, 1, x**2), (-2.0, 3.0), (1.0, 9.0)),
        (sp.Piecewise((x - 5, x < 0), (2 * x, True)), (1.0, 3.0), (-4.0, 6.0)),
        (sp.pi * x + sp.E, (-1.0, 1.0), (math.e - math.pi, math.e + math.pi)),
        (x * sp.Abs(x), (-1.0, 2.0), (-1.0, 4.0)),
        (sp.sign(x) * sp.Abs(x) ** R(1, 3), (-1.0, 8.0), (-1.0, 2.0)),
        (x**2 * sp.Abs(x), (-2.0, 1.0), (0.0, 8.0)),
        (sp.S(7), (0.0, 0.0), (7.0, 7.0)),
    ],
)
def test_a_rule_returns_the_exact_range(expression, box, expected):
    assert ends(expression, box) == pytest.approx(expected, rel=1e-14, abs=1e-300)


SIGNS = [(1.0, 2.0), (0.0, 3.0), (-2.0, -1.0), (-3.0, 0.0), (-2.0, 3.0), (0.0, 0.0)]


@pytest.mark.parametrize("box_y", SIGNS)
@pytest.mark.parametrize("box_x", SIGNS)
def test_a_product_is_the_range_of_the_four_corners(box_x, box_y):
    corners = [a * b for a in box_x for b in box_y]
    assert ends(x * y, box_x, box_y) == (min(corners), max(corners))


@pytest.mark.parametrize("box_y", [s for s in SIGNS if s[0] > 0.0 or s[1] < 0.0])
@pytest.mark.parametrize("box_x", SIGNS)
def test_a_quotient_is_the_range_of_the_four_corners(box_x, box_y):
    corners = [a / b for a in box_x for b in box_y]
    assert ends(x / y, box_x, box_y) == pytest.approx((min(corners), max(corners)), rel=1e-15)


@pytest.mark.parametrize(
    ("expression", "inside", "outside", "named"),
    [
        (1 / x, (1e-9, 1.0), (0.0, 1.0), "1/x"),
        (1 / x, (-1.0, -1e-9), (-1.0, 0.0), "1/x"),
        (1 / x, (1.0, 2.0), (-1.0, 2.0), "1/x"),
        (y / (x - 1) ** 2, (1.5, 2.0), (0.5, 2.0), "(x - 1)**(-2)"),
        (sp.log(x), (1e-9, 1.0), (0.0, 1.0), "log(x)"),
        (2 + sp.log(x), (1e-9, 1.0), (-1.0, 1.0), "log(x)"),
        (sp.sqrt(x), (0.0, 1.0), (-1e-9, 1.0), "sqrt(x)"),
        (x ** R(3, 4), (0.0, 1.0), (-1e-9, 1.0), "x**(3/4)"),
        (x ** R(-1, 2), (1e-9, 1.0), (0.0, 1.0), "1/sqrt(x)"),
        (x ** R(-1, 2), (1.0, 2.0), (-2.0, -1.0), "1/sqrt(x)"),
        (x ** R(-1, 3), (-1.0, -1e-9), (-1.0, 1.0), "x**(-1/3)"),
        (sp.tan(x), (-1.57, 1.57), (-1.57, 1.58), "tan(x)"),
        (sp.tan(x), (1.58, 4.71), (1.58, 4.72), "tan(x)"),
        (sp.tan(x), (0.0, 1.0), (0.0, 3.5), "tan(x)"),
        (sp.tan(x), (0.0, 1.0), (0.0, 6.5), "tan(x)"),
        (sp.tan(x + sp.pi / 2), (0.1, 3.1), (-0.1, 3.1), "cot(x)"),
        (sp.tan(x + sp.pi / 2), (0.1, 3.1), (0.1, 3.2), "cot(x)"),
    ],
)
def test_a_domain_is_checked_on_both_sides(expression, inside, outside, named):
    low, up = ends(expression, inside, (1.0, 1.0))
    assert low <= up
    with pytest.raises(EnvelopeError) as refusal:
        ends(expression, outside, (1.0, 1.0))
    assert refusal.value.subexpression == named
    assert named in str(refusal.value)
    assert refusal.value.fix


def test_cot_that_sympy_makes_of_a_shifted_tan_is_exact():
    low, up = ends(sp.tan(x + sp.pi / 2), (0.5, 2.0))
    assert (low, up) == pytest.approx((-1 / math.tan(0.5), -1 / math.tan(2.0)), rel=1e-14)


@pytest.mark.parametrize(
    ("expression", "named"),
    [
        (x + sp.gamma(x), "gamma(x)"),
        (x**x, "x**x"),
        (x**sp.pi, "x**pi"),
        (sp.I * x, "I"),
        (x + sp.zoo, "zoo"),
        (sp.Max(sp.oo, x, evaluate=False), "oo"),
        (sp.EulerGamma * x, "EulerGamma"),
        (sp.acos(x) + 1, "acos(x)"),
        (sp.Piecewise((x, sp.Eq(x, 1)), (y, True)), "Eq(x, 1)"),
        (sp.Piecewise((x, x < 1)), "Piecewise((x, x < 1))"),
    ],
)
def test_what_has_no_rule_is_refused_by_name(expression, named):
    with pytest.raises(EnvelopeError) as refusal:
        compile_envelope(expression)
    assert refusal.value.subexpression == named


def test_a_power_of_a_positive_number_is_an_exponential():
    assert ends(sp.S(2) ** x, (-1.0, 3.0)) == pytest.approx((0.5, 8.0), rel=1e-15)


def test_a_compiled_envelope_equals_the_direct_one():
    expression = x * sp.sin(y) + x * y**2
    base = {x: (-1.0, 2.0), y: (0.5, 0.75)}
    compiled = compile_envelope(expression)(base, FLOATS)
    assert compiled == envelope(expression, base, FLOATS)


def test_a_symbol_without_an_interval_is_an_error():
    with pytest.raises(KeyError):
        envelope(x + y, {x: (0.0, 1.0)}, FLOATS)


@pytest.mark.parametrize(("pair", "expected"), [((-3.0, 2.0), 3.0), ((1.0, 2.0), 2.0)])
def test_a_majorant_is_the_larger_of_upper_and_minus_lower(pair, expected):
    assert magnitude(pair, FLOATS) == expected
