import pytest
import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import evaluate_float
from bfppc_synth.expressions.parse import parse_expression
from bfppc_synth.expressions.symbolic import to_sympy

SYMBOLS = {name: sp.Symbol(name, real=True) for name in ("x", "y")}
X, Y = SYMBOLS["x"], SYMBOLS["y"]


def symbolic(text):
    return to_sympy(parse_expression(text, names=SYMBOLS).tree, SYMBOLS)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x**2 + 2*x*y - 0.1", X**2 + 2 * X * Y - sp.Rational(1, 10)),
        ("x*x", X**2),
        ("x/3/y", X / (3 * Y)),
        ("sqrt(x**2)", sp.Abs(X)),
        ("E**x", sp.exp(X)),
        ("exp(1)", sp.E),
        ("ln(x) + pi", sp.log(X) + sp.pi),
        ("min(x, y) + Max(x, 2)", sp.Min(X, Y) + sp.Max(X, 2)),
        ("tan(x + pi/2)", -sp.cos(X) / sp.sin(X)),
        ("Piecewise((x, x < 0), (y, True))", sp.Piecewise((X, X < 0), (Y, True))),
    ],
)
def test_the_tree_becomes_the_sympy_expression_that_was_written(text, expected):
    assert symbolic(text) == expected


def test_every_branch_keeps_its_own_single_comparison():
    found = symbolic("Piecewise((2, 2 < x), (2, y >= 2), (x, True))")
    assert not found.has(sp.And, sp.Or, sp.Not, sp.ITE)
    assert not (sp.sqrt(found) * X).has(sp.And, sp.Or, sp.Not, sp.ITE)
    values = [evaluate_float(found, {X: x, Y: y}) for x, y in ((3, 0), (1, 2), (1, 1))]
    assert values == [2, 2, 1]
    assert symbolic("Piecewise((x, 1 < 2), (y, True))") == X
    assert symbolic("Piecewise((x, 2 < 1), (y, True))") == Y


@pytest.mark.parametrize(
    ("text", "at_minus_8"),
    [
        ("x**(1/3)", -2.0),
        ("x**(2/3)", 4.0),
        ("x**(-1/3)", -0.5),
        ("x**(5/3)", -32.0),
        ("(x**3)**(1/3)", -8.0),
        ("(-x)**(1/3)", 2.0),
        ("(-x**2)**(1/3)", -4.0),
        ("(8*x)**(1/3)", -4.0),
        ("x**(1/3)*x**(1/3)", 4.0),
        ("(x**(1/3))**2", 4.0),
        ("(x**(2/3))**(1/2)", 2.0),
        ("(x**(2/3))**(3/2)", 8.0),
        ("(4*x**(2/3))**(1/2)", 4.0),
        ("(x**(1/3)*x**(1/3))**(1/2)", 2.0),
        ("sqrt(x**2)", 8.0),
        ("(x**2)**(1/6)", 2.0),
        ("(-exp(x)*x)**(2/3)*exp(-2*x/3)", 4.0),
        ("(-8)**(1/3)*x", 16.0),
        ("(x*abs(x))**(1/3)", -4.0),
    ],
)
def test_odd_roots_of_negative_numbers_are_real_and_keep_their_sign(text, at_minus_8):
    assert evaluate_float(symbolic(text), {X: -8.0, Y: 1.0}) == pytest.approx(at_minus_8)


@pytest.mark.parametrize(
    "text",
    [
        "1/(x - x)",
        "x/(y*0)",
        "sqrt(-x**2)",
        "log(x - x)",
        "sqrt(-exp(x))",
        "min(sqrt(-1 - x**2), x)",
        "Piecewise((1, sqrt(-1 - x**2) < 1), (2, True))",
    ],
)
def test_a_part_without_a_real_value_is_refused(text):
    with pytest.raises(EnvelopeError, match="no finite real value"):
        symbolic(text)


def test_a_coefficient_beyond_binary64_is_refused():
    assert symbolic("(1e100*x)**2") == sp.Integer(10) ** 200 * X**2
    with pytest.raises(EnvelopeError, match="outside 1e-300 to 1e300"):
        symbolic("(1e200*x)**2")


def test_a_long_sum_and_a_long_product_need_no_deep_recursion():
    assert symbolic("+".join(["x"] * 450)) == 450 * X
    assert symbolic("*".join(["x"] * 200)) == X**200


@pytest.mark.parametrize("text", ["abs(exp(sqrt(x)))", "sign(exp(sqrt(x)))", "exp(sqrt(x))**(2/3)"])
def test_a_root_under_an_absolute_value_stays_real(text):
    found = symbolic(text)
    assert not found.has(sp.re, sp.im, sp.arg, sp.atan2)
    assert evaluate_float(found, {X: 4.0}) > 0
