"""Which operations Python refuses where C returns infinity or NaN.

``math.exp(1000.0)`` and ``1.0 / 0.0`` raise in Python and are IEEE values in C. Where an operation
might come to that, the Python printer calls a helper that answers as C does, so that both
controllers hold the last command on the same samples.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from bfppc_synth.model.law import Literal, Operator

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from bfppc_synth.model.law import Law, Operand, Statement

_Range = tuple[float, float]
_ANYTHING: Final[_Range] = (-math.inf, math.inf)
#: e**x and cosh x stay finite below it.
_LARGEST_EXPONENT: Final = 700.0
_BOUNDED: Final[Mapping[Operator, _Range]] = {
    Operator.SIN: (-1.0, 1.0),
    Operator.COS: (-1.0, 1.0),
    Operator.TANH: (-1.0, 1.0),
    Operator.ATAN: (-1.6, 1.6),
}


def raising(statements: Iterable[Statement], inputs: Mapping[str, _Range]) -> frozenset[str]:
    """Find the statements that may raise in Python.

    Parameters
    ----------
    statements : Iterable[Statement]
        A straight-line program.
    inputs : Mapping[str, tuple[float, float]]
        Ranges of the variables that it reads; others may be any number.

    Returns
    -------
    frozenset[str]
        Targets of the statements that need a helper. Ranges are widened by a relative 1e-9,
        far more than their own rounding.
    """
    ranges = dict(inputs)
    found: set[str] = set()
    for statement in statements:
        operands = [_range(operand, ranges) for operand in statement.operands]
        if not _total(statement.operator, operands):
            found.add(statement.target)
        ranges[statement.target] = _reach(statement, operands)
    return frozenset(found)


def latched_ranges(law: Law) -> dict[str, _Range]:
    """Say where everything is that the programs of center nominal read and latch.

    Parameters
    ----------
    law : Law
        With a latch block.

    Returns
    -------
    dict[str, tuple[float, float]]
        Certified constants, screened inputs, ``elapsed``, every result of the first two
        programs, and what is latched.
    """
    values = {c.name: float(c.value) for c in (*law.certified, *law.limits)}
    ranges: dict[str, _Range] = {name: (value, value) for name, value in values.items()}
    for test in (*law.inputs, *law.reference_ranges):
        upper = values[test.upper]
        ranges[test.variable] = (-upper if test.lower is None else values[test.lower], upper)
    ranges["elapsed"] = (0.0, law.elapsed_limit)
    latch = law.center.latch
    if latch is None:
        return ranges
    for statement in (*latch.signals, *latch.statements):
        operands = [_range(operand, ranges) for operand in statement.operands]
        ranges[statement.target] = _reach(statement, operands)
    for name, value in zip(law.center.latched, latch.values, strict=True):
        ranges[name] = _range(value, ranges)
    return ranges


def _reach(statement: Statement, operands: list[_Range]) -> _Range:
    """Range of a result; squares and the smaller one of two are known better than by operand."""
    found = _result(statement.operator, operands)
    match statement.operator, statement.operands:
        case Operator.MUL, (left, right) if left == right:
            return max(found[0], 0.0), found[1]
        case Operator.SELECT_LESS, (left, right, then, otherwise) if (left, right) == (
            then,
            otherwise,
        ):
            return found[0], min(operands[0][1], operands[1][1])
    return found


def _range(operand: Operand, ranges: Mapping[str, _Range]) -> _Range:
    if isinstance(operand, Literal):
        return operand.value, operand.value
    return ranges.get(operand.name, _ANYTHING)


def _total(operator: Operator, operands: list[_Range]) -> bool:
    """Whether every operand is inside what Python's function takes."""
    lower, upper = operands[0]
    match operator:
        case Operator.EXP:
            return upper < _LARGEST_EXPONENT
        case Operator.SINH | Operator.COSH:
            return max(-lower, upper) < _LARGEST_EXPONENT
        case Operator.LOG:
            return lower > 0.0
        case Operator.SQRT:
            return lower >= 0.0
        case Operator.SIN | Operator.COS | Operator.TAN:
            return math.isfinite(lower) and math.isfinite(upper)
        case Operator.DIV:
            return operands[1][0] > 0.0 or operands[1][1] < 0.0
        case Operator.POW:
            exponent = operands[1][0]
            return lower >= 0.0 and upper < 1e100 and 0.0 < exponent < 3.0
    return True


def _result(operator: Operator, operands: list[_Range]) -> _Range:
    if any(not math.isfinite(end) for pair in operands for end in pair):
        return _BOUNDED.get(operator, _ANYTHING)
    (lower, upper), *rest = operands
    match operator:
        case Operator.ADD:
            return _widened(lower + rest[0][0], upper + rest[0][1])
        case Operator.SUB:
            return _widened(lower - rest[0][1], upper - rest[0][0])
        case Operator.MUL:
            return _hull(a * b for a in operands[0] for b in rest[0])
        case Operator.DIV if rest[0][0] > 0.0 or rest[0][1] < 0.0:
            return _hull(a / b for a in operands[0] for b in rest[0])
        case Operator.NEG:
            return -upper, -lower
        case Operator.ABS:
            return 0.0, max(-lower, upper)
        case Operator.SQRT if lower >= 0.0:
            return _widened(math.sqrt(lower), math.sqrt(upper))
        case Operator.EXP if upper < _LARGEST_EXPONENT:
            # Underflow: exp may return 0, and a reciprocal of it would raise.
            return _widened(math.exp(lower), math.exp(upper))
        case Operator.SELECT_LESS | Operator.SELECT_LESS_EQUAL:
            return _hull((*rest[1], *rest[2]))
    return _BOUNDED.get(operator, _ANYTHING)


def _hull(values: Iterable[float]) -> _Range:
    known = tuple(values)
    return _widened(min(known), max(known))


def _widened(lower: float, upper: float) -> _Range:
    # A product may overflow to infinity, or to NaN where it meets 0.
    if math.isnan(lower) or math.isnan(upper):
        return _ANYTHING
    return lower - 1e-9 * abs(lower), upper + 1e-9 * abs(upper)
