"""Where a declared bound fails: inside a box, beyond it, and where a gain comes down to 0."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from bfppc_synth.audit.scanning import Gap, violation_beyond, violation_in, zero_beyond

X1, X2, A = sp.symbols("x1 x2 a", real=True)
G_1 = 1 + sp.sin(X1**2)


def test_a_violation_in_a_box_is_a_witness():
    gap = Gap(upper=X1**2 + X2, lower=sp.Integer(0))
    found = violation_in(gap, {X1: (-1.0, 1.0), X2: (-0.5, 0.5)})
    assert found[X1] ** 2 + found[X2] < 0.0
    assert violation_in(gap, {X1: (-1.0, 1.0), X2: (0.0, 0.5)}) is None


def test_an_equality_is_no_violation():
    bound = sp.Abs(X1) + sp.Abs(X1) * sp.exp(sp.Abs(X1) / 2)
    gap = Gap(upper=bound, lower=sp.Abs(X1 + X1 * sp.exp(-X1 / 2)))
    assert violation_in(gap, {X1: (-3.0, 3.0)}) is None


def test_a_narrow_violation_at_a_parameters_end_is_met():
    gap = Gap(upper=sp.Integer(1), lower=A * X1)
    assert violation_in(gap, {X1: (0.0, 1.0), A: (0.0, 1.02)}) is not None
    assert violation_in(gap, {X1: (0.0, 1.0), A: (0.0, 1.0)}) is None


def test_the_bound_of_example_2_fails_from_the_root_of_pi():
    gap = Gap(upper=G_1, lower=sp.Integer(1))
    assert violation_in(gap, {X1: (-1.55, 1.55)}) is None
    found = violation_beyond(gap, {X1: (-1.55, 1.55)}, (X1,))
    assert found.state == "x1"
    assert found.value == pytest.approx(math.sqrt(math.pi), rel=1e-6)


def test_the_gain_of_example_2_is_0_where_its_square_is_three_halves_of_pi():
    found = zero_beyond(G_1, {X1: (-1.55, 1.55)}, (X1,))
    assert abs(found.value) == pytest.approx(math.sqrt(1.5 * math.pi), rel=1e-4)
    assert zero_beyond(2 + sp.sin(X1**2), {X1: (-1.55, 1.55)}, (X1,)) is None


def test_what_holds_everywhere_is_not_said_to_be_local():
    assert violation_beyond(Gap(upper=X1**2 + 1, lower=X1), {X1: (-1.0, 1.0)}, (X1,)) is None


def test_a_pole_is_a_violation():
    gap = Gap(upper=1 / (X1 - 3), lower=sp.Integer(-100))
    found = violation_beyond(gap, {X1: (-1.0, 1.0)}, (X1,))
    assert 2.9 < found.value <= 3.0
