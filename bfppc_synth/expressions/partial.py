"""The parts of an expression that are not defined everywhere.

Simplifying loses domains: ``0*log(x1)`` becomes 0 and ``x1/x1`` becomes 1. The generated code and
the plant compute what is written, so each of these parts is judged by itself.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Final

from bfppc_synth.model.expression import Branches, Call, Number, Operation

if TYPE_CHECKING:
    from bfppc_synth.model.expression import Node

_PARTIAL_FUNCTIONS: Final = frozenset({"log", "sqrt", "tan"})
_MINUS_ONE: Final = Number(value=Fraction(-1))


def partial_parts(tree: Node) -> tuple[Node, ...]:
    """List quotients, roots and logarithms, in the order of the text.

    Parameters
    ----------
    tree : Node
        As ``expressions.parse`` makes it.

    Returns
    -------
    tuple of Node
        ``1/b`` for each division by b, each power with a negative exponent or an even root, each
        call of log, sqrt or tan; those in the branches of a Piecewise too.

    References
    ----------
    docs/theory.md section 6.
    """
    parts: list[Node] = []
    # A loop, because a sum of two hundred terms is two hundred levels deep on its left.
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        part = _partial(node)
        if part is not None:
            parts.append(part)
        waiting.extend(reversed(operands(node)))
    return tuple(parts)


def _partial(node: Node) -> Node | None:
    match node:
        case Operation(operator="/", operands=(_, divisor)):
            return Operation(operator="**", operands=(divisor, _MINUS_ONE))
        case Operation(operator="**", operands=(_, Number(value=exponent))):
            return node if exponent < 0 or exponent.denominator % 2 == 0 else None
        case Call(function=function):
            return node if function in _PARTIAL_FUNCTIONS else None
        case _:
            return None


def operands(node: Node) -> tuple[Node, ...]:
    """List the direct parts of a node, conditions of a Piecewise included."""
    match node:
        case Operation(operands=operands):
            return operands
        case Call(arguments=arguments):
            return arguments
        case Branches(branches=branches):
            return tuple(
                part
                for value, when in branches
                for part in ((value,) if when is None else (value, when.left, when.right))
            )
        case _:
            return ()
