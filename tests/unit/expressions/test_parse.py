from fractions import Fraction

import pytest

from bfppc_synth.expressions.names import FUNCTIONS, RESERVED, did_you_mean, is_identifier
from bfppc_synth.expressions.parse import ExpressionError, parse_constant, parse_expression
from bfppc_synth.model.expression import (
    Branches,
    Call,
    Comparison,
    Name,
    Number,
    Operation,
)

NAMES = ("x1", "x2", "a")


def tree(text):
    return parse_expression(text, names=NAMES).tree


def number(value):
    return Number(value=Fraction(value))


def test_a_caret_binds_tighter_than_plus_and_equals_two_stars():
    expected = Operation(
        operator="+",
        operands=(
            Operation(operator="**", operands=(Name(name="x1"), number(2))),
            number(1),
        ),
    )
    assert tree("x1^2+1") == tree("x1**2 + 1") == expected


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("-x1**2", "-(x1**2)"),
        ("2**-1", "2**(-1)"),
        ("x1**2**2", "x1**(2**2)"),
        ("x1-x2-a", "(x1-x2)-a"),
        ("x1/x2/a", "(x1/x2)/a"),
        ("x1*-x2", "x1*(-x2)"),
        ("+x1", "x1"),
        ("Abs(x1)", "abs(x1)"),
        ("ln(x1)", "log(x1)"),
        ("Min(x1, x2)", "min(x1,x2)"),
        ("Max(x1, x2, a)", "max(x1,x2,a)"),
        ("E**x1", "exp(x1)"),
        ("1e-1*x1", "0.1*x1"),
        ("5.*x1", "5*x1"),
        (".5*x1", "0.5*x1"),
        ("x1**0.5", "x1**(1/2)"),
        (" x1 \n + x2\t", "x1+x2"),
    ],
)
def test_two_spellings_give_one_tree(text, same):
    assert tree(text) == tree(same)


def test_numbers_are_exact_fractions_of_their_text():
    assert tree("0.1") == number(Fraction(1, 10))
    assert tree("1.25e-3") == number(Fraction(1, 800))
    assert tree("123456789012345678901234567890") == number(123456789012345678901234567890)


def test_piecewise_keeps_its_conditions():
    assert tree("Piecewise((x1, x1 <= 0), (x2, True))") == Branches(
        branches=(
            (Name(name="x1"), Comparison(relation="<=", left=Name(name="x1"), right=number(0))),
            (Name(name="x2"), None),
        )
    )


def test_every_listed_function_is_read_with_its_arity():
    for function, arity in FUNCTIONS.items():
        count = arity or 2
        text = f"{function}({', '.join(['x1'] * count)})"
        assert tree(text) == Call(function=function, arguments=(Name(name="x1"),) * count)
        with pytest.raises(ExpressionError, match="argument"):
            tree(f"{function}()")


REFUSED = [
    # text, column, length, words
    ("", 1, 1, "empty"),
    ("   ", 4, 1, "empty"),
    ("x1 +", 5, 1, "ends after `.`"),
    ("x1 + * x2", 6, 1, r"`\*` after `\+`"),
    ("2x1", 2, 2, "operator is missing"),
    ("x1 x2", 4, 2, "operator is missing"),
    ("x1(x2)", 1, 2, "no function"),
    ("(x1", 1, 1, "never closed"),
    ("sin(x1", 4, 1, "never closed"),
    ("x1)", 3, 1, "without an opening"),
    ("x1, x2", 3, 1, "comma"),
    ("x3 + 1", 1, 2, "unknown name `x3`"),
    ("Sin(x1)", 1, 3, "unknown function `Sin`"),
    ("cbrt(x1)", 1, 4, "unknown function `cbrt`"),
    ("__import__(x1)", 1, 10, "unknown function"),
    ('__import__("os")', 12, 1, "quotation"),
    ("x1.real", 3, 1, "dot"),
    ("x1[0]", 3, 1, "brackets"),
    ("().__class__", 3, 1, "dot"),
    ("lambda: 1", 7, 1, "no place"),
    ("x1 if x2 else 1", 4, 2, "no mathematics"),
    ("x1 and x2", 4, 3, "no mathematics"),
    ("True", 1, 4, "no mathematics"),
    ("sin", 1, 3, "without arguments"),
    ("sin(x1, x2)", 1, 11, "takes 1 argument, not 2"),
    ("Min(x1)", 1, 7, "takes 2 to 32 arguments, not 1"),
    ("sin(x1=2)", 7, 1, "named argument"),
    ("x1 < 2", 4, 1, "only in Piecewise"),
    ("x1 == 2", 4, 2, "equation"),
    ("x1 % 2", 4, 1, "remainder"),
    ("x1 // 2", 4, 2, "rounding division"),
    ("x1!", 3, 1, "factorial"),
    ("|x1|", 1, 1, "abs"),
    ("x\uff11", 2, 1, "no ASCII"),
    ("\u03c0*x1", 1, 1, "no ASCII"),
    ("x1\u00b2", 3, 1, "no ASCII"),
    ("1_000", 2, 4, "operator is missing"),
    ("0x10", 2, 3, "operator is missing"),
    ("1j", 2, 1, "operator is missing"),
    ("010", 1, 3, "begins with 0"),
    ("1e-9999999", 1, 10, "outside 1e-300"),
    ("1e999999999999999999", 1, 20, "outside 1e-300"),
    ("1e400", 1, 5, "outside 1e-300"),
    ("9**9**9", 4, 4, "beyond 64"),
    ("x1**65", 5, 2, "beyond 64"),
    ("x1**-65", 5, 3, "beyond 64"),
    ("x1**0.1234", 5, 6, "denominator"),
    ("x1**a", 5, 1, "not a constant"),
    ("2**x1", 4, 2, "not a constant"),
    ("x1**pi", 5, 2, "irrational"),
    ("(10**60)**60", 1, 12, "bits"),
    ("1e200*1e200", 1, 11, "outside 1e-300"),
    ("exp(1000)", 1, 9, "outside 1e-300"),
    ("x1*exp(1000)", 4, 9, "outside 1e-300"),
    ("((x1**64)**64)", 2, 12, "degree"),
    ("1/0", 1, 3, "division by zero"),
    ("x1/0", 1, 4, "division by zero"),
    ("x1/(2 - 2)", 1, 10, "division by zero"),
    ("1/sin(pi)", 1, 9, "division by zero"),
    ("1/(pi - pi)", 1, 11, "division by zero"),
    ("0**-1", 1, 5, "division by zero"),
    ("log(0)", 1, 6, "log of zero"),
    ("x1 + log(-2)", 6, 7, "log of a negative"),
    ("log(sin(pi))", 1, 12, "log of zero"),
    ("sqrt(-1)", 1, 8, "even root"),
    ("(-1)**0.5", 1, 9, "even root"),
    ("(-2)**(3/4)", 1, 11, "even root"),
    ("tan(pi/2)", 1, 9, "pole"),
    ("Piecewise((x1, x1 < 0))", 1, 23, "every condition is false"),
    ("Piecewise((x1, Piecewise((x1, True)) < 1), (0, True))", 16, 9, "inside of a condition"),
    ("Piecewise(x1)", 11, 2, "a branch"),
    ("Piecewise((x1, x1))", 18, 1, "one comparison"),
    ("Piecewise((x1, 0 < x1 < 1), (0, True))", 23, 1, "single comparisons"),
    ("Piecewise((x1, True), (0, True))", 21, 1, "after the condition True"),
    ("Piecewise((x1, x1 < 0 & x2 < 0), (0, True))", 23, 1, "single comparisons"),
]


@pytest.mark.parametrize(("text", "column", "length", "words"), REFUSED)
def test_a_mistake_is_refused_at_its_column(text, column, length, words):
    with pytest.raises(ExpressionError, match=words) as caught:
        tree(text)
    assert (caught.value.column, caught.value.length) == (column, length)


@pytest.mark.parametrize(
    ("inside", "outside"),
    [
        ("x1**64", "x1**65"),
        ("x1**(1/1000)", "x1**(1/1001)"),
        ("1e300", "2e300"),
        ("1e-300", "0.9e-300"),
        ("(" * 59 + "x1" + ")" * 59, "(" * 61 + "x1" + ")" * 61),
        ("-" * 60 + "x1", "-" * 61 + "x1"),
        ("+".join(["x1"] * 500), "+".join(["x1"] * 501)),
        ("x1" + " " * 3998, "x1" + " " * 3999),
        ("(x1**64)**4", "(x1**64)**5"),
        ("Min(" + ",".join(["x1"] * 32) + ")", "Min(" + ",".join(["x1"] * 33) + ")"),
        ("1/1e-300*x1", "1/(1e-300*1e-10)*x1"),
        ("exp(690)", "exp(691)"),
    ],
)
def test_each_limit_holds_on_both_sides(inside, outside):
    assert tree(inside)
    with pytest.raises(ExpressionError):
        tree(outside)


def test_an_unknown_name_is_answered_with_the_nearest_known_one():
    with pytest.raises(ExpressionError) as caught:
        parse_expression("theta1 + omga", names=("theta1", "omega"))
    assert caught.value.fix == "did you mean `omega`?"
    assert did_you_mean("Exp", FUNCTIONS) == "exp"
    assert did_you_mean("qqq", FUNCTIONS) == ""


def test_a_name_that_exists_elsewhere_gets_its_own_sentence():
    with pytest.raises(ExpressionError, match="later state") as caught:
        parse_expression("x1*x2", names=("x1",), elsewhere={"x2": ("a later state", "reorder")})
    assert (caught.value.column, caught.value.fix) == (4, "reorder")


def test_a_constant_may_contain_no_name():
    with pytest.raises(ExpressionError, match="unknown name"):
        parse_constant("2*x1")
    assert parse_constant("100/7").exact == Fraction(100, 7)


@pytest.mark.parametrize("name", ["x1", "A", "theta_dot", "a" * 31])
def test_a_plain_word_may_be_a_name(name):
    assert is_identifier(name)
    assert name not in RESERVED


@pytest.mark.parametrize("name", ["1x", "_x", "x-1", "x.1", "x 1", "", "a" * 32, "\u00e9"])
def test_what_is_no_plain_word_may_be_no_name(name):
    assert not is_identifier(name)


@pytest.mark.parametrize(
    "name", ["t", "u", "y_d", "pi", "E", "sin", "Min", "Piecewise", "for", "double", "class"]
)
def test_the_contracts_words_are_reserved(name):
    assert name in RESERVED
