"""Formulas as MathML."""

from __future__ import annotations

import pytest
import sympy as sp

from bfppc_synth.report.formulas import (
    LONGEST,
    dotted,
    dynamics_latex,
    expression_latex,
    inline,
    name_latex,
    number,
    unknowns_latex,
    with_numbers,
)

x1, x2 = sp.symbols("x1 x2", real=True)
THETA = sp.Symbol("theta_1", real=True)
MASS = sp.Symbol("arm_mass", real=True)


@pytest.mark.parametrize(
    ("name", "latex"),
    [
        ("x1", "x_{1}"),
        ("x", "x"),
        ("theta", r"\theta"),
        ("theta_2", r"\theta_{2}"),
        ("mass", r"\text{mass}"),
        ("arm_mass", r"\text{arm}_{\text{mass}}"),
        ("omega_m", r"\omega_{m}"),
        ("x1_max", r"x_{1,\text{max}}"),
        ("x1dot", r"\text{x1dot}"),
        ("_x", r"\text{ x}"),
    ],
)
def test_a_name_of_the_plant_file_is_written_as_a_symbol(name, latex):
    assert name_latex(name) == latex


def test_the_dot_of_a_derivative_stands_over_the_letter_alone():
    assert dotted("x1") == r"\dot{x}_{1}"
    assert dotted("omega_m") == r"\dot{\omega}_{m}"
    assert dotted("theta") == r"\dot{\theta}"


@pytest.mark.parametrize(
    "expression",
    [
        x1**2 - sp.sin(x1),
        sp.Piecewise((x1, x1 < 0), (x2, True)),
        sp.Min(x1, x2) + sp.Max(x1, 3, x2),
        sp.asinh(x2) + sp.atan(x1) + sp.tan(x1) + sp.sinh(x1) + sp.cosh(x2) + sp.tanh(x2),
        sp.sign(x1) * sp.Abs(x1) ** sp.Rational(1, 3),
        sp.log(x1) / sp.sqrt(x2) + sp.exp(-x1 / 2),
        sp.pi * x1 / 30 + sp.E,
        THETA * MASS,
        sp.Rational(1, 10**20) * x1,
    ],
)
def test_no_backslash_and_no_style_survives_in_a_formula(expression):
    markup = inline(expression_latex(expression))
    assert "\\" not in markup
    assert "style=" not in markup
    assert markup.startswith("<math>")


@pytest.mark.parametrize(
    ("expression", "text"),
    [
        (sp.Rational(321, 5000) * x1 + sp.Rational(1, 10), r"0.0642\,x_{1} + 0.1"),
        (x1 / 2, r"\frac{x_{1}}{2}"),
        (x1 / 30, r"\frac{x_{1}}{30}"),
        (sp.Rational(100, 7) * x1, r"\frac{100\,x_{1}}{7}"),
        (sp.exp(sp.Rational(1, 10)) * x1, r"x_{1}\,\text{e}^{\frac{1}{10}}"),
        (2 * sp.sqrt(x1), r"2\,\sqrt{x_{1}}"),
    ],
)
def test_a_decimal_of_the_plant_file_is_shown_as_a_decimal(expression, text):
    assert expression_latex(expression) == text


def test_a_formula_too_long_to_read_points_to_report_json():
    long = sp.Add(*(sp.sin(k * x1) for k in range(1, 200)))
    assert "report.json" in expression_latex(long)
    short = sp.Add(*(sp.sin(k * x1) for k in range(1, 9)))
    assert len(expression_latex(short)) < LONGEST
    assert "report.json" not in expression_latex(short)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.25, '<mn data-json-path="a[0]" data-value="0.25">0.25</mn>'),
        (-0.25, '<mrow><mo>(</mo><mn data-json-path="a[0]" data-value="-0.25">-0.25</mn>'),
        (1e-9, '<mrow><mo>(</mo><mn data-json-path="a[0]" data-value="1e-09">1e-9</mn>'),
        (None, '<mn data-json-path="a[0]" data-value="null">'),
    ],
)
def test_a_number_in_a_formula_carries_its_path_and_all_its_digits(value, shown):
    markup = with_numbers(inline(number("a", 0) + " + b"), {"a": [value]})
    assert shown in markup


def test_a_number_that_report_json_lacks_is_an_error():
    with pytest.raises(KeyError):
        with_numbers(inline(number("absent")), {"a": 1.0})


def test_the_dynamics_show_known_parts_and_name_unknown_ones(design):
    first, second = dynamics_latex(design.plant)
    assert first.startswith(r"\dot{x}_{1} = ")
    assert first.endswith(r" \, x_{2} + d_{1}")
    assert second.endswith(" + u")
    assert unknowns_latex(design.plant) == (
        r"\left|f_{1}\right| \le x_{1}^{2} + 1",
        r"\left|d_{1}\right| \le 0.1",
    )


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ((321, 5000), "0.0642"),
        ((-563862928348909623, 2 * 10**18), "-0.2819314641744548115"),
        ((31234567890123456789123, 10**13), "3123456789.0123456789123"),
        ((7 * 10**40 + 1, 1000), f"7{'0' * 37}.001"),
        ((1, 2**20), r"9.5367431640625 \cdot 10^{-7}"),
        ((1, 2**21), r"\frac{1}{2097152}"),
        ((1, 3000), r"\frac{1}{3000}"),
    ],
)
def test_a_fraction_is_shown_as_the_decimal_that_it_is_or_not_at_all(value, text):
    assert expression_latex(sp.Rational(*value)) == text
