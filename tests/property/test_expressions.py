import math

import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.expressions.evaluate import evaluate_float
from bfppc_synth.expressions.parse import ExpressionError, parse_constant, parse_expression
from bfppc_synth.expressions.symbolic import to_sympy
from bfppc_synth.model.expression import Branches, Call, Name, Number, Operation

SYMBOLS = {name: sp.Symbol(name, real=True) for name in ("x", "y")}
RELATIONS = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}
FUNCTIONS = {
    "abs": abs,
    "sign": lambda x: float((x > 0) - (x < 0)),
    "min": min,
    "max": max,
    **{
        name: getattr(math, name)
        for name in ("exp", "sinh", "cosh", "tanh", "atan", "asinh", "log", "sin", "cos", "tan")
    },
}


def power(base, exponent):
    """Follow docs/theory.md section 1: an odd root keeps the sign."""
    if exponent.denominator % 2 and exponent.denominator > 1 and base < 0:
        sign = -1.0 if exponent.numerator % 2 else 1.0
        return sign * abs(base) ** float(exponent)
    if exponent.denominator % 2 == 0 and base < 0:
        raise ValueError
    return base ** (exponent.numerator if exponent.denominator == 1 else float(exponent))


def value(tree, at):
    """Evaluate a tree as it stands, without any rewriting."""
    match tree:
        case Number(value=number):
            return float(number)
        case Name(name=name):
            return {"pi": math.pi, "E": math.e, **at}[name]
        case Call(function="sqrt", arguments=(argument,)):
            return math.sqrt(value(argument, at))
        case Call(function=function, arguments=arguments):
            return FUNCTIONS[function](*(value(part, at) for part in arguments))
        case Branches(branches=branches):
            for result, when in branches:
                if when is None or RELATIONS[when.relation](
                    value(when.left, at), value(when.right, at)
                ):
                    return value(result, at)
            raise ValueError
        case Operation(operator="**", operands=(base, Number(value=exponent))):
            return power(value(base, at), exponent)
        case Operation(operator="neg", operands=(operand,)):
            return -value(operand, at)
        case Operation(operator=operator, operands=(left, right)):
            a, b = value(left, at), value(right, at)
            return {"+": a + b, "-": a - b, "*": a * b, "/": a / b if b else math.nan}[operator]


def texts(children):
    def call(name):
        return children.map(lambda a: f"{name}({a})")

    def pair(form):
        return st.tuples(children, children).map(lambda ab: form.format(*ab))

    exponents = ["2", "3", "-1", "(1/2)", "(1/3)", "(2/3)", "(5/3)", "(-1/3)", "1.5", "4"]
    return st.one_of(
        *(pair(form) for form in ("({} + {})", "({} - {})", "({}*{})", "({}/{})")),
        pair("min({}, {})"),
        pair("Max({}, {})"),
        pair("Piecewise(({0}, {1} < x), ({1}, y >= {0}), (x, True))"),
        *(call(name) for name in ("sin", "cos", "tanh", "atan", "asinh", "abs", "sign", "-")),
        *(call(name) for name in ("exp", "log", "sqrt", "cosh")),
        st.tuples(children, st.sampled_from(exponents)).map(lambda ab: f"({ab[0]})**{ab[1]}"),
    )


# pi/5 and not pi: sign(sin(pi)) is 0 for sympy and 1 in floats.
LEAVES = st.sampled_from(["x", "y", "x", "y", "2", "0.3", "1/7", "pi/5", "E"])
EXPRESSIONS = st.recursive(LEAVES, texts, max_leaves=6)
POINTS = st.floats(-3.0, 3.0).map(lambda x: round(x, 3))


@given(text=EXPRESSIONS, x=POINTS, y=POINTS)
def test_the_sympy_form_has_the_value_of_the_text(text, x, y):
    near = [{"x": x + dx, "y": y + dy} for dx, dy in ((0, 0), (1e-9, 0), (0, 1e-9), (-1e-9, -1e-9))]
    try:
        tree = parse_expression(text, names=SYMBOLS).tree
        expected, *others = (value(tree, at) for at in near)
        expression = to_sympy(tree, SYMBOLS)
    except (ExpressionError, EnvelopeError, ValueError, ArithmeticError):
        assume(False)
    # Where a function jumps, or nearly so, two orders of rounding give two values.
    spread = max(abs(other - expected) for other in others)
    assume(abs(expected) < 1e8 and spread < 1e-4)
    found = evaluate_float(expression, {SYMBOLS["x"]: x, SYMBOLS["y"]: y})
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-6 + 10 * spread)


def refusal(text):
    try:
        parse_expression(text, names=("x1", "y"))
    except ExpressionError as error:
        return error
    return None


SIGNS = "x1y+-*/^()., \t<>=!%eE0123456789_[]{}'\"&|\u03c0\uff11\x00\\:;@#$~?"


@given(text=st.text(alphabet=SIGNS, max_size=40) | st.text(max_size=40))
def test_any_text_is_read_or_refused_with_a_column_inside_it(text):
    error = refusal(text)
    if error is not None:
        assert 1 <= error.column <= len(text) + 1
        assert error.length >= 1
        assert error.message


@given(number=st.fractions(min_value=-(10**6), max_value=10**6, max_denominator=10**6))
def test_a_quotient_of_integers_is_read_exactly(number):
    text = f"{number.numerator}/{number.denominator}"
    assert parse_constant(text).exact == number


@given(number=st.floats(allow_nan=False, allow_infinity=False, width=64))
def test_the_shortest_text_of_a_float_reads_back_to_it(number):
    assume(number == 0 or 1e-299 < abs(number) < 1e299)
    constant = parse_constant(repr(number))
    assert constant.approximate == number
