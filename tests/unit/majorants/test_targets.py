"""The two number types: overflow and NaN in floats, formulas and constraints in sympy."""

from __future__ import annotations

import math

import pytest
import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.majorants.arithmetic import Sign
from bfppc_synth.majorants.envelope import envelope, magnitude
from bfppc_synth.majorants.targets import FloatArithmetic, SympyArithmetic

x, y = sp.symbols("x y", real=True)
z, w = sp.symbols("z w", nonnegative=True)
FLOATS = FloatArithmetic()


def text(expression):
    arithmetic = SympyArithmetic()
    pair = envelope(expression, {x: (-z, z), y: (-w, w)}, arithmetic)
    return magnitude(pair, arithmetic)


@pytest.mark.parametrize("growing", [sp.exp(x), sp.sinh(x), sp.cosh(x), x**64, sp.exp(sp.exp(x))])
def test_overflow_upward_is_infinity(growing):
    assert envelope(growing, {x: (0.0, 1e6)}, FLOATS)[1] == math.inf


def test_overflow_downward_is_minus_infinity():
    assert envelope(sp.sinh(x), {x: (-1e6, 0.0)}, FLOATS) == (-math.inf, 0.0)


def test_zero_times_overflow_is_zero():
    assert envelope(y * sp.exp(x), {x: (0.0, 1e6), y: (0.0, 0.0)}, FLOATS) == (0.0, 0.0)


def test_an_infinite_box_has_an_envelope():
    base = {x: (2.0, math.inf)}
    assert envelope(1 / x, base, FLOATS) == (0.0, 0.5)
    assert envelope(sp.exp(-x), base, FLOATS) == (0.0, math.exp(-2.0))
    assert envelope(sp.sin(x) + sp.tanh(x), base, FLOATS) == (-1.0 + math.tanh(2.0), 2.0)


@pytest.mark.parametrize(
    ("expression", "box"),
    [
        (sp.exp(x) - sp.exp(2 * x), (1e5, 1e6)),
        (x + 1, (math.nan, math.nan)),
        (x * y, (math.nan, 1.0)),
        (sp.Max(x, y), (math.nan, math.nan)),
        (sp.sin(x), (math.nan, 1.0)),
        (1 / x, (math.nan, 1.0)),
        (sp.log(x), (math.nan, 1.0)),
        (sp.sqrt(x), (math.nan, 1.0)),
    ],
)
def test_nan_is_refused_and_never_returned(expression, box):
    with pytest.raises(EnvelopeError):
        envelope(expression, {x: box, y: (0.0, 1.0)}, FLOATS)


@pytest.mark.parametrize("function", [sp.sin, sp.cos])
@pytest.mark.parametrize("far", [1e9, 1e17, 1e300])
def test_a_phase_that_binary64_has_lost_is_every_phase(function, far):
    assert envelope(function(x), {x: (far, far)}, FLOATS) == (-1.0, 1.0)


@pytest.mark.parametrize("turns", [-1000, -3, 0, 5, 10**6])
def test_a_peak_is_found_from_either_side(turns):
    peak = math.pi / 2 + 2 * math.pi * turns
    assert envelope(sp.sin(x), {x: (peak - 0.1, peak + 1e-6)}, FLOATS)[1] == 1.0
    assert envelope(sp.sin(x), {x: (peak - 1e-6, peak + 0.1)}, FLOATS)[1] == 1.0
    beside = envelope(sp.sin(x), {x: (peak - 0.2, peak - 0.1)}, FLOATS)[1]
    assert beside == pytest.approx(math.cos(0.1), rel=1e-8)


@pytest.mark.parametrize(
    ("pair", "sign"),
    [
        ((1.0, 2.0), Sign.POSITIVE),
        ((0.0, 2.0), Sign.NONNEGATIVE),
        ((0.0, 0.0), Sign.ZERO),
        ((-1.0, 1.0), Sign.MIXED),
        ((-1.0, 0.0), Sign.NONPOSITIVE),
        ((-2.0, -1.0), Sign.NEGATIVE),
    ],
)
def test_signs_of_floats_and_of_constants_agree(pair, sign):
    exact = tuple(sp.Rational(end) for end in pair)
    assert FLOATS.sign_of(*pair) is sign
    assert FLOATS.side_of(*pair) is sign
    assert SympyArithmetic().sign_of(*exact) is sign


@pytest.mark.parametrize(
    ("pair", "sign", "side"),
    [
        ((-z, z), Sign.MIXED, Sign.UNKNOWN),
        ((1, 1 + z), Sign.POSITIVE, Sign.POSITIVE),
        ((-z - 2, -1), Sign.NEGATIVE, Sign.NEGATIVE),
        ((1 - z, 1 + z), Sign.UNKNOWN, Sign.POSITIVE),
        ((-1 - z, z - 1), Sign.UNKNOWN, Sign.NEGATIVE),
        ((1 - sp.exp(z), z), Sign.MIXED, Sign.UNKNOWN),
    ],
)
def test_a_symbolic_sign_holds_for_every_box(pair, sign, side):
    lower, upper = map(sp.sympify, pair)
    assert SympyArithmetic().sign_of(lower, upper) is sign
    assert SympyArithmetic().side_of(lower, upper) is side


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        (x + x * sp.exp(-x / 2), "z*exp(z/2) + z"),
        (x**2 - sp.sin(x), "z**2 + 1"),
        (1 + sp.sin(x**2), "2"),
        (x * sp.sin(y) + x * y**2, "w**2*z + z"),
        (3 + sp.cos(x), "4"),
        (sp.exp(-(x**2)), "1"),
        (1 / (1 + x**2), "1"),
        (1 / (2 - x), "1/(2 - z)"),
        ((2 - x) ** -2, "(2 - z)**(-2)"),
        (sp.sqrt(3 + x), "sqrt(z + 3)"),
        (sp.tan(x / 2), "tan(z/2)"),
        ((x - 1) * (y - 3), "(w + 3)*(z + 1)"),
        (sp.Max(x, y), "Max(w, z)"),
        (x**2 * y + sp.exp(y) * sp.cos(y), "w*z**2 + exp(w)"),
        (-2 * (x**2 - 1) * y - x + 1, "2*w*Max(1, z**2 - 1) + z + 1"),
        (sp.sin(sp.Integer(2)) * x, "z*sin(2)"),
        (x * sp.Abs(x), "z**2"),
    ],
)
def test_a_formula_reads_as_a_person_would_write_it(expression, expected):
    assert str(text(expression)) == expected


def test_what_a_formula_rests_on_is_collected():
    arithmetic = SympyArithmetic()
    envelope(sp.log(3 - x) + sp.sqrt(2 - y), {x: (-z, z), y: (-w, w)}, arithmetic)
    assert set(arithmetic.constraints) == {3 - z, 2 - w}


@pytest.mark.parametrize(
    "expression",
    [1 / x, sp.log(x), sp.log(x - 1), sp.sqrt(x - 1), sp.tan(2 + sp.S.Zero * x) + 1 / x**2],
)
def test_a_formula_that_holds_for_no_box_is_refused(expression):
    with pytest.raises(EnvelopeError):
        text(expression)


@pytest.mark.parametrize(
    ("ends", "expected"),
    [((0, 1), (0, sp.sin(1))), ((1, 2), (sp.sin(1), 1)), ((4, 5), (-1, sp.sin(4)))],
)
def test_sin_of_a_constant_interval_is_exact_in_sympy(ends, expected):
    pair = tuple(map(sp.Integer, ends))
    assert envelope(sp.sin(x), {x: pair}, SympyArithmetic()) == expected


def test_constants_stay_exact():
    assert text(sp.Rational(1, 10) * x) == z / 10
    assert FLOATS.number(sp.pi / 60) == math.pi / 60
    assert FLOATS.number(sp.Rational(1, 10)) == 0.1
