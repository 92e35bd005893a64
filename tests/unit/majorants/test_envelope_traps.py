"""The traps of docs/theory.md section 1, one test each, and the paper's Remark 1."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.majorants.envelope import envelope, magnitude
from bfppc_synth.majorants.targets import FloatArithmetic, SympyArithmetic

x1, x2, a = sp.symbols("x1 x2 a", real=True)
z1, z2 = sp.symbols("z1 z2", nonnegative=True)
FLOATS = FloatArithmetic()


def over(expression, z, w=0.0):
    return envelope(expression, {x1: (-z, z), x2: (-w, w), a: (0.5, 0.5)}, FLOATS)


def majorant(expression, z, w=0.0):
    return magnitude(over(expression, z, w), FLOATS)


@pytest.mark.parametrize("z", [0.0, 0.3, 1.0, 2.5])
@pytest.mark.parametrize("w", [0.0, 0.7, 3.0])
def test_majorants_are_no_larger_than_remark_1(z, w):
    first = x1**2 + x1 * sp.sin(x1) + x1 * x2
    second = x2 * x1**2 + sp.exp(x2) * sp.cos(x2)
    assert majorant(first, z, w) <= (z**2 + z + z * w) * (1 + 1e-15)
    assert majorant(second, z, w) <= (w * z**2 + math.exp(w)) * (1 + 1e-15)


def test_the_golden_number_of_example_2():
    value = majorant(x1 + x1 * sp.exp(-a * x1), 1.55)
    assert value == pytest.approx(4.914417797134336, rel=1e-14)
    assert value == pytest.approx(1.55 + 1.55 * math.exp(0.775), rel=1e-14)


@pytest.mark.parametrize("z", [0.5, 2.0])
def test_an_even_argument_keeps_its_sign(z):
    assert over(sp.exp(-(x1**2)), z) == (math.exp(-(z**2)), 1.0)
    assert majorant(sp.exp(-x1 / 2), z) == math.exp(z / 2)
    assert over(1 / (1 + x1**2), z) == (1 / (1 + z**2), 1.0)


def test_the_exact_range_of_sin_certifies_example_2():
    # With sin bounded by 1 beyond pi/2 alone the lower end would be 0, and no g_m > 0 exists.
    assert over(1 + sp.sin(x1**2), 1.55) == (1.0, 2.0)


@pytest.mark.parametrize(("z", "holds"), [(1.7724, True), (1.7725, False)])
def test_g_of_example_2_leaves_1_where_its_argument_passes_pi(z, holds):
    assert (over(1 + sp.sin(x1**2), z)[0] >= 1.0) == holds


def test_sin_of_a_negative_argument_is_not_clamped():
    lower, upper = over(sp.sin(-(x1**2)), 1.0)
    assert (lower, upper) == (-math.sin(1.0), 0.0)
    assert over(sp.sin(-(x1**2)), 2.0)[0] == -1.0


def test_a_product_stays_nested_when_a_factor_changes_sign():
    expression = (1 - x1) * (2 + x2)
    previous = (math.inf, -math.inf)
    for step in range(60):
        current = over(expression, 0.1 * step, 0.05 * step)
        assert current[0] <= previous[0]
        assert current[1] >= previous[1]
        previous = current


def test_a_sign_change_is_not_lost_in_the_formula():
    # The formula may not be chosen by the sign that 1 - x1 has on the smallest box.
    arithmetic = SympyArithmetic()
    base = {x1: (-z1, z1), x2: (-z2, z2)}
    text = magnitude(envelope((1 - x1) * (2 - x1) * x2, base, arithmetic), arithmetic)
    for z, w in [(0.5, 1.0), (1.5, 1.0), (3.0, 2.0)]:
        assert float(text.subs({z1: z, z2: w})) >= majorant((1 - x1) * (2 - x1) * x2, z, w) - 1e-12


@pytest.mark.parametrize("square", [x1 * x1, sp.Mul(x1, x1, evaluate=False), x1**2])
def test_equal_factors_are_a_power(square):
    assert over(square, 3.0) == (0.0, 9.0)


def test_factors_that_differ_in_sign_only_are_a_power():
    assert over((x1 - x2) * (x2 - x1), 1.0, 2.0) == (-9.0, 0.0)
    assert over((x2 - x1) * sp.Abs(x1 - x2), 1.0, 2.0) == (-9.0, 9.0)
    square = sp.Pow(x2 - x1, 2, evaluate=False)
    assert over(sp.Mul(square, x1 - x2, evaluate=False), 1.0, 2.0) == (-27.0, 27.0)
    assert envelope(sp.Mul(square, x1, evaluate=False), {x1: (1, 1), x2: (3, 3)}, FLOATS)[0] == 4


def test_a_quotient_of_opposite_factors_keeps_its_pole_and_its_sign():
    quotient = (x2 - x1) / (x1 - x2)
    with pytest.raises(EnvelopeError, match="pole"):
        over(quotient, 1.0, 2.0)
    assert envelope(quotient, {x1: (3.0, 3.0), x2: (1.0, 1.0)}, FLOATS) == (-1.0, -1.0)


@pytest.mark.parametrize(
    ("p", "expected"), [(1, (-2.0, 1.0)), (2, (0.0, 4.0)), (3, (-8.0, 1.0)), (4, (0.0, 16.0))]
)
def test_odd_roots_of_negative_numbers_keep_the_sign_of_odd_powers(p, expected):
    root = sp.Pow(x1, sp.Rational(p, 3), evaluate=False)
    assert envelope(root, {x1: (-8.0, 1.0)}, FLOATS) == pytest.approx(expected, rel=1e-15)


def test_the_odd_root_of_a_cube_is_the_base():
    assert over((x1**3) ** sp.Rational(1, 3), 2.0) == pytest.approx((-2.0, 2.0), rel=1e-15)


@pytest.mark.parametrize("bound", [2 + sp.sin(x1), 2 - x1 + x1**2, sp.exp(-x1)])
def test_a_declared_bound_need_not_be_monotone(bound):
    previous = 0.0
    for step in range(40):
        z = 0.1 * step
        value = majorant(bound, z)
        assert value >= previous
        for share in (-1.0, -0.6, 0.0, 0.4, 1.0):
            assert value >= float(bound.subs(x1, share * z)) - 1e-12
        previous = value


def test_both_branches_of_a_piecewise_count():
    step = sp.Piecewise((x1, x1 < 0), (x1**2, True))
    assert over(step, 3.0) == (-3.0, 9.0)


def test_a_branch_that_is_not_reached_must_have_a_value_too():
    with pytest.raises(EnvelopeError, match="log"):
        over(sp.Piecewise((sp.log(x1), x1 > 1), (0, True)), 2.0)


def test_a_parameter_range_enters_like_a_state():
    base = {x1: (-2.0, 2.0), a: (0.9, 1.1)}
    assert envelope(a * x1, base, FLOATS) == pytest.approx((-2.2, 2.2))


def test_a_signed_box_is_tighter_than_magnitudes():
    signed = envelope(sp.exp(-x1), {x1: (-0.5, 1.5)}, FLOATS)
    assert signed[1] == math.exp(0.5) < over(sp.exp(-x1), 1.5)[1]


def test_a_pole_at_0_is_no_obstacle_to_a_box_beside_it():
    assert envelope(1 / x1**2, {x1: (-0.02, -0.01)}, FLOATS) == pytest.approx((2500.0, 10000.0))
