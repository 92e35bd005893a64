"""Numbers on their way to the page."""

from __future__ import annotations

import math

import pytest

from bfppc_synth.report.numbers import exact, finite, largest, look_up, path_text, shown


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.1, "0.1"),
        (123456.0, "123456"),
        (1234567.0, "1.23457e6"),
        (0.0001, "0.0001"),
        (0.00001, "1e-5"),
        (-2.5e-12, "-2.5e-12"),
        (3, "3"),
        (12345678, "12345678"),
        (None, "\N{EM DASH}"),
        (True, "yes"),
        (False, "no"),
        ("cosine", "cosine"),
    ],
)
def test_a_number_is_shown_with_six_digits(value, text):
    assert shown(value) == text


@pytest.mark.parametrize("value", [0.1, 1.0 / 3.0, 1e300, -2.5e-12, 5e-324])
def test_all_digits_of_a_number_read_back(value):
    assert float(exact(value)) == value
    assert float(shown(value)) == pytest.approx(value, rel=1e-5)


def test_what_is_not_finite_is_none():
    assert finite(math.inf) is None
    assert finite(math.nan) is None
    assert finite(1.7976931348623157e308) == 1.7976931348623157e308


def test_the_largest_of_numbers_is_infinite_if_one_of_them_is_not_finite():
    assert largest([1.0, 2.0]) == 2.0
    assert largest([]) == 0.0
    assert largest([1.0, math.nan]) == math.inf


def test_a_path_leads_back_to_its_number():
    document = {"a": [{"b": 5.0}]}
    assert path_text(("a", 0, "b")) == "a[0].b"
    assert look_up(document, ("a", 0, "b")) == 5.0
    with pytest.raises(KeyError):
        look_up(document, ("a", 0, "c"))
    with pytest.raises(IndexError):
        look_up(document, ("a", 1))
