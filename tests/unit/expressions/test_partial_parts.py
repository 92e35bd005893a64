"""Which parts of an expression may be undefined."""

from __future__ import annotations

import pytest
import sympy as sp

from bfppc_synth.expressions.parse import parse_expression
from bfppc_synth.expressions.partial import partial_parts
from bfppc_synth.expressions.symbolic import to_sympy

SYMBOLS = {name: sp.Symbol(name, real=True) for name in ("x", "y")}


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("x + y*2 - sin(x)", []),
        ("x**(1/3) + x**(2/3) + exp(x) + x**2", []),
        ("x/2", ["1/2"]),
        ("x/y", ["1/y"]),
        ("0*x**(-2)", ["x**(-2)"]),
        ("x**(-1/3)", ["x**(-1/3)"]),
        ("x**(3/4)", ["x**(3/4)"]),
        ("sqrt(x)**2 + log(y)", ["sqrt(x)", "log(y)"]),
        ("tan(x)", ["tan(x)"]),
        ("1/(1/x)", ["1/(1/x)", "1/x"]),
        ("log(sqrt(x))", ["log(sqrt(x))", "sqrt(x)"]),
        ("-max(1/x, log(y))", ["1/x", "log(y)"]),
        ("Piecewise((1/x, log(y) < 1), (sqrt(x), True))", ["1/x", "log(y)", "sqrt(x)"]),
    ],
)
def test_quotients_roots_and_logarithms_are_found_in_order(text: str, parts: list[str]) -> None:
    found = partial_parts(parse_expression(text, names=SYMBOLS).tree)
    wanted = [parse_expression(part, names=SYMBOLS).tree for part in parts]
    assert [to_sympy(a, SYMBOLS) for a in found] == [to_sympy(b, SYMBOLS) for b in wanted]


def test_a_long_sum_is_walked_without_recursion() -> None:
    text = "+".join(["1/x"] * 240)
    assert len(partial_parts(parse_expression(text, names=SYMBOLS).tree)) == 240
