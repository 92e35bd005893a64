"""Rounding to few digits in the safe direction."""

from __future__ import annotations

import pytest

from bfppc_synth.gains.rounding import to_digits


@pytest.mark.parametrize(
    ("value", "digits", "upward", "expected"),
    [
        (1.23456, 3, 0, 1.23),
        (1.23456, 3, 1, 1.24),
        (1.23456, 3, -1, 1.23),
        (9.9999, 3, 1, 10.0),
        (1.23e-7, 3, 1, 1.23e-7),
        (-1.23456, 3, 1, -1.23),
        (0.0, 4, 1, 0.0),
        (4.4e12, 4, -1, 4.4e12),
    ],
)
def test_digits_round_to_the_named_side(value, digits, upward, expected):
    assert to_digits(value, digits, upward=upward) == pytest.approx(expected, rel=1e-15, abs=0.0)


@pytest.mark.parametrize("value", [0.1, 3.14159, 7.7e5, 1e-9, 123456.789])
def test_upward_is_never_below_and_downward_never_above(value):
    assert to_digits(value, 4, upward=1) >= value * (1 - 1e-15)
    assert to_digits(value, 4, upward=-1) <= value * (1 + 1e-15)
