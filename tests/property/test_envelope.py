"""Random expressions: envelopes contain what they enclose, are nested, and formulas bound them."""

from __future__ import annotations

import math

import sympy as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import evaluate_float
from bfppc_synth.majorants.envelope import envelope, magnitude
from bfppc_synth.majorants.targets import FloatArithmetic, SympyArithmetic

EXAMPLES = max(200, settings().max_examples)
STATES = sp.symbols("x1:4", real=True)
PARAMETER = sp.Symbol("a", real=True)
SYMBOLS = (*STATES, PARAMETER)
MAGNITUDES = sp.symbols("z1:5", nonnegative=True)
FLOATS = FloatArithmetic()
R = sp.Rational

NUMBERS = st.sampled_from([R(n, d) for n in (-3, -1, 1, 2, 5) for d in (1, 2, 3)])
LEAVES = st.one_of(st.sampled_from(SYMBOLS), st.sampled_from(SYMBOLS), NUMBERS)
TOTAL = (sp.sin, sp.cos, sp.exp, sp.sinh, sp.cosh, sp.tanh, sp.atan, sp.asinh, sp.Abs, sp.sign)


def _larger(children):
    pairs = st.tuples(children, children)
    exponents = st.sampled_from([R(2), R(3), R(4), R(-1), R(-2), R(1, 2), R(1, 3), R(2, 3)])
    conditions = st.tuples(children, children, children)
    return st.one_of(
        pairs.map(lambda p: p[0] + p[1]),
        pairs.map(lambda p: p[0] - p[1]),
        pairs.map(lambda p: p[0] * p[1]),
        pairs.map(lambda p: p[0] / (3 + p[1] ** 2)),
        st.tuples(st.sampled_from(TOTAL), children).map(lambda p: p[0](p[1])),
        st.tuples(children, exponents).map(lambda p: sp.Pow(p[0], p[1], evaluate=False)),
        children.map(lambda c: sp.log(4 + c)),
        children.map(lambda c: sp.tan(c / 4)),
        children.map(lambda c: sp.Abs(c) * c),
        pairs.map(lambda p: sp.Max(*p, evaluate=False)),
        pairs.map(lambda p: sp.Min(*p, evaluate=False)),
        conditions.map(lambda p: sp.Piecewise((p[0], STATES[0] < PARAMETER), (p[1], True))),
    )


EXPRESSIONS = st.recursive(LEAVES, _larger, max_leaves=6).filter(
    lambda e: not e.has(sp.I, sp.zoo, sp.nan, sp.oo)
)
ENDS = st.integers(-16, 16).map(lambda n: n / 8)
SHARES = st.lists(st.integers(0, 8).map(lambda n: n / 8), min_size=4, max_size=4)


@st.composite
def nested_boxes(draw):
    """Draw an inner and an outer box over all symbols."""
    inner, outer = {}, {}
    for symbol in SYMBOLS:
        outer_low, low, up, outer_up = sorted(draw(ENDS) for _ in range(4))
        inner[symbol], outer[symbol] = (low, up), (outer_low, outer_up)
    return inner, outer


def slack(*numbers):
    """Allow for rounding to nearest."""
    return 1e-9 * (1.0 + max(abs(n) for n in numbers if math.isfinite(n)))


def enclose(expression, box):
    try:
        lower, upper = envelope(expression, box, FLOATS)
    except EnvelopeError:
        return None
    return (lower, upper) if max(abs(lower), abs(upper)) < 1e12 else None


@settings(max_examples=EXAMPLES)
@given(EXPRESSIONS, nested_boxes(), st.lists(SHARES, min_size=1, max_size=6))
def test_an_envelope_contains_every_sampled_value(expression, boxes, samples):
    box = boxes[1]
    pair = enclose(expression, box)
    assume(pair is not None)
    for shares in samples:
        point = {
            symbol: box[symbol][0] + share * (box[symbol][1] - box[symbol][0])
            for symbol, share in zip(SYMBOLS, shares, strict=True)
        }
        value = evaluate_float(expression, point)
        assert pair[0] - slack(*pair) <= value <= pair[1] + slack(*pair)


@settings(max_examples=EXAMPLES)
@given(EXPRESSIONS, nested_boxes())
def test_a_larger_box_has_a_larger_envelope_and_a_smaller_domain(expression, boxes):
    outer = enclose(expression, boxes[1])
    assume(outer is not None)
    inner = enclose(expression, boxes[0])
    assert inner is not None
    assert outer[0] - slack(*outer) <= inner[0] <= inner[1] + slack(*outer)
    assert inner[1] <= outer[1] + slack(*outer)


@settings(max_examples=EXAMPLES // 3)
@given(EXPRESSIONS, SHARES)
def test_a_formula_is_never_below_the_majorant_of_the_same_box(expression, shares):
    symbolic = SympyArithmetic()
    base = {s: (-z, z) for s, z in zip(SYMBOLS, MAGNITUDES, strict=True)}
    values = dict(zip(MAGNITUDES, shares, strict=True))
    pair = enclose(expression, {s: (-v, v) for s, v in zip(SYMBOLS, shares, strict=True)})
    assume(pair is not None)
    try:
        formula = magnitude(envelope(expression, base, symbolic), symbolic)
    except EnvelopeError:
        # A symbolic wave reaches both peaks, which a pole may forbid; derive writes infinity.
        formula = sp.oo
    assume(all(float(c.subs(values)) > 0.0 for c in symbolic.constraints))
    bound = float(formula.subs(values))
    assert bound >= magnitude(pair, FLOATS) - slack(bound, *pair)


def _real(expression, point):
    value = expression.subs(point).evalf(40)
    return value if value.is_real and value.is_finite else None


# sympy's own odd roots of negative numbers are complex, so only even roots appear here.
SYMPY_EXPRESSIONS = EXPRESSIONS.filter(
    lambda e: all(p.exp.q <= 2 for p in e.atoms(sp.Pow) if p.exp.is_Rational)
)


@settings(max_examples=EXAMPLES)
@given(SYMPY_EXPRESSIONS, st.lists(ENDS, min_size=4, max_size=4))
def test_evaluate_agrees_with_sympy(expression, values):
    point = dict(zip(SYMBOLS, values, strict=True))
    exact = _real(expression, {symbol: R(value) for symbol, value in point.items()})
    assume(exact is not None and abs(exact) < 1e9)
    value = evaluate_float(expression, point)
    assert abs(value - float(exact)) <= 1e-8 * (1.0 + abs(value))
