"""Subtrees with what the grammar must know of them: value, degree, place in the text."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Final, Literal

from bfppc_synth.expressions import constants
from bfppc_synth.expressions.constants import ConstantError, Value
from bfppc_synth.expressions.cursor import Cursor
from bfppc_synth.expressions.names import FUNCTIONS, VARIADIC
from bfppc_synth.model.expression import Call, Node, Number, Operation

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from bfppc_synth.expressions.lexer import Token

MOST_ARGUMENTS: Final = 32
_MOST_NODES: Final = 1000
_LARGEST_EXPONENT: Final = 64
_LARGEST_DENOMINATOR: Final = 1000
_LARGEST_DEGREE: Final = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """A subtree, its value if constant, its growth as a power, and its place in the text."""

    node: Node
    value: Value | None
    degree: Fraction
    start: int
    end: int


class Builder(Cursor):
    """Makes nodes; refuses constants without a value, wild exponents and sheer size."""

    def __init__(
        self, text: str, names: frozenset[str], elsewhere: Mapping[str, tuple[str, str]]
    ) -> None:
        super().__init__(text, names, elsewhere)
        self._nodes = 0

    def part(self, node: Node, start: int, end: int, degree: Fraction, value: Value | None) -> Part:
        """Count a new node and keep its size in bounds."""
        self._nodes += 1
        if self._nodes > _MOST_NODES:
            raise self.error_at(
                start, end, f"more than {_MOST_NODES} operations", "split it or name parts of it"
            )
        if degree > _LARGEST_DEGREE:
            raise self.error_at(
                start,
                end,
                f"a power of degree {float(degree):.4g}, above {_LARGEST_DEGREE}",
                "write a bound of lower degree",
            )
        return Part(node=node, value=value, degree=degree, start=start, end=end)

    def constant(self, start: int, end: int, compute: Callable[[], Value]) -> Value:
        """Compute a constant, or underline the part of the text that has no value."""
        try:
            return compute()
        except ConstantError as error:
            shown = self.text[start:end]
            raise self.error_at(start, end, f"`{shown}`: {error}", error.fix) from None

    def binary(self, operator: Literal["+", "-", "*", "/"], left: Part, right: Part) -> Part:
        """Join two operands by ``+ - * /``."""
        start, end = left.start, right.end
        value = None
        a, b = left.value, right.value
        if b is not None and operator == "/":
            # Also x1/0 is refused here, not only 1/0.
            divisor = b
            b = self.constant(start, end, lambda: constants.reciprocal(divisor))
        if a is not None and b is not None:
            first, second = a, b
            if operator in {"*", "/"}:
                value = self.constant(start, end, lambda: constants.multiply(first, second))
            else:
                signed = second if operator == "+" else constants.negate(second)
                value = self.constant(start, end, lambda: constants.add(first, signed))
        if operator in {"*", "/"}:
            degree = left.degree + right.degree
        else:
            degree = max(left.degree, right.degree)
        node = Operation(operator=operator, operands=(left.node, right.node))
        return self.part(node, start, end, degree, value)

    def exponential(self, exponent: Part, start: int, end: int) -> Part:
        """Read ``E**x`` as ``exp(x)``."""
        constant = exponent.value
        value = None
        if constant is not None:
            value = self.constant(start, end, lambda: constants.call("exp", (constant,)))
        node = Call(function="exp", arguments=(exponent.node,))
        return self.part(node, start, end, exponent.degree, value)

    def raised(self, base: Part, exponent: Part) -> Part:
        """Join base and exponent."""
        start, end = base.start, exponent.end
        number = self.exponent(base, exponent)
        constant = base.value
        value = None
        if constant is not None:
            value = self.constant(start, end, lambda: constants.power(constant, number))
        node = Operation(operator="**", operands=(base.node, Number(value=number)))
        size = max(abs(number), Fraction(1))
        return self.part(node, start, end, base.degree * size, value)

    def exponent(self, base: Part, exponent: Part) -> Fraction:
        """Return the exponent as a number, or say why it cannot be one."""
        number = None if exponent.value is None else exponent.value.exact
        shown = self.text[exponent.start : exponent.end]
        if number is None:
            kind = "not a constant" if exponent.value is None else "irrational"
            grown = f"exp({shown}*log({self.text[base.start : base.end]}))"
            raise self.error_at(
                exponent.start,
                exponent.end,
                f"the exponent `{shown}` is {kind}; exponents are rational numbers",
                f"write {grown} if the base is positive",
            )
        if abs(number) > _LARGEST_EXPONENT:
            raise self.error_at(
                exponent.start,
                exponent.end,
                f"the exponent `{shown}` is beyond {_LARGEST_EXPONENT}",
                f"use exponents from -{_LARGEST_EXPONENT} to {_LARGEST_EXPONENT}",
            )
        if number.denominator > _LARGEST_DENOMINATOR:
            raise self.error_at(
                exponent.start,
                exponent.end,
                f"the exponent `{shown}` is {number}, whose denominator is above "
                f"{_LARGEST_DENOMINATOR}",
                "round it to three digits",
            )
        return number

    def require_arity(self, token: Token, closing: Token, function: str, count: int) -> None:
        """Refuse a call with too many or too few arguments."""
        arity = FUNCTIONS[function]
        start, end = token.start, closing.end
        if arity == VARIADIC and not 2 <= count <= MOST_ARGUMENTS:
            raise self.error_at(
                start,
                end,
                f"{token.text} takes 2 to {MOST_ARGUMENTS} arguments, not {count}",
                f"nest one {token.text} in another" if count > 1 else f"write {token.text}(a, b)",
            )
        if arity not in {VARIADIC, count}:
            fix = f"write {token.text}(x)"
            if function == "log" and count == 2:
                fix = "write log(x)/log(b) for the base b"
            raise self.error_at(
                start, end, f"{token.text} takes {arity} argument, not {count}", fix
            )
