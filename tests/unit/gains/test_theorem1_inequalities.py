"""Theorem 1's chain and inequalities, against dense evaluation of what they bound."""

from __future__ import annotations

import pytest

from bfppc_synth.bounds.theorem1 import faded, polynomial, polynomial_slope
from bfppc_synth.gains.methods.theorem1 import lemma_growth, power_growth
from bfppc_synth.gains.theorem1.problem import Given1, implied_c_0
from bfppc_synth.model.bounds import CenterBounds
from bfppc_synth.model.shapes import Shape, Theorem1Gain


@pytest.mark.parametrize(("p", "D", "N"), [(0.15, 0.1, 3), (3.1, 2.1, 3), (1.01, 0.01, 5)])
def test_the_power_growth_is_the_supremum_and_the_lemma_is_above_it(p, D, N):
    exact = power_growth(p, D, N)
    assert exact == pytest.approx((p + D) ** N - p**N, rel=1e-12)
    seen = max(
        abs((j / 100 * p + s * D) ** N - (j / 100 * p) ** N)
        for j in range(-100, 101)
        for s in (-1.0, -0.5, 0.5, 1.0)
    )
    assert seen <= exact * (1 + 1e-12)
    assert exact < lemma_growth(p, D, N) <= 2.0 * N * exact


def test_a_polynomial_and_its_slope_are_horner_of_the_coefficients():
    H = (1.15201, 2.02, 10.0)
    assert polynomial(H, 0.5) == pytest.approx(1.15201 + 1.01 + 2.5)
    assert polynomial_slope(H, 0.5, 0.0) == pytest.approx(2.02 + 10.0)
    assert polynomial_slope((5.0,), 0.5, 0.0) == 0.0
    assert Theorem1Gain(gamma=1.0, H=H, H_star=1.0, c=0.0, N=3).height(0.5) == polynomial(H, 0.5)


def test_the_shape_of_a_constant_gain_is_the_product_that_the_code_computes():
    gain = Theorem1Gain(gamma=30.2, H=(2.824,), H_star=2.824, c=0.25, N=3)
    assert gain.shape == Shape(k=30.2 * 2.824, M=0.0, epsilon=1.0, c=0.25, N=3)


def test_a_faded_center_contains_zero_and_is_nested():
    center = CenterBounds(
        r_lower=(0.2, -1.0), r_upper=(1.0, 0.5), rate=(0.5, 0.5), feed=(1.0, 0.0), v=0.0,
        v_rate=0.0, v_start=0.0,
    )  # fmt: skip
    inner, outer = faded(center, 0.25), faded(center, 0.5)
    assert inner.r_lower == (0.0, -0.25)
    assert inner.r_upper == (0.25, 0.125)
    assert all(a >= b for a, b in zip(inner.r_lower, outer.r_lower, strict=True))
    assert all(a <= b for a, b in zip(inner.r_upper, outer.r_upper, strict=True))
    assert inner.rate == center.rate


def given(**changes):
    fixed = {"gamma": 4.0, "H": (5.0,), "H_star": None, "c": 0.1, "N": 3, "p": 0.15}
    return Given1(**({**fixed, "epsilon": None} | changes))


def test_the_printed_example_leaves_exactly_nothing_for_c_0():
    steps = (given(), given(p=3.1, epsilon=1.0))
    assert implied_c_0(steps, (0.1, 0.1)) == 0.0
    assert implied_c_0((given(), given(p=3.4, epsilon=1.0)), (0.1, 0.1)) == pytest.approx(0.3)


@pytest.mark.parametrize("change", [{"p": None}, {"epsilon": None}])
def test_c_0_is_not_implied_where_p_or_epsilon_is_free(change):
    fixed = {"p": 3.1, "epsilon": 1.0} | change
    assert implied_c_0((given(), given(**fixed)), (0.1, 0.1)) is None
    assert implied_c_0((given(),), (0.1,)) is None


def test_a_step_is_decided_only_when_everything_is_fixed():
    assert given().decided
    assert not given(gamma=None).decided
    assert not given(H=None).decided
