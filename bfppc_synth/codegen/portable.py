"""tanh, sin, cos and exp made of + - * / and comparisons: the same bits everywhere.

Each is a straight-line program over the numbers of the code, printed like the law. The checker
(section 9b) compares what was printed with its own text and states the error bounds; the proof
of the bounds is there, and tests/property/test_portable_functions.py carries it out.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING, Final

from bfppc_synth.codegen.statements import StatementBuilder
from bfppc_synth.errors import UsageError
from bfppc_synth.model.law import FunctionBlock, Literal, Operator, Variable

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.law import Law, Operand, Statement

_V = Variable(name="v")
_ONE, _HALF = Literal(value=1.0), Literal(value=0.5)
#: The program that computes a function, and what is passed to it besides the argument.
CALLS: Final = {
    Operator.TANH: ("tanh", ()),
    Operator.EXP: ("exp", ()),
    Operator.SIN: ("wave", (0.0,)),
    Operator.COS: ("wave", (1.0,)),
}
#: What needs no function: these are single operations of IEEE 754.
_PLAIN: Final = frozenset(
    {
        Operator.ADD,
        Operator.SUB,
        Operator.MUL,
        Operator.DIV,
        Operator.NEG,
        Operator.ABS,
        Operator.SELECT_LESS,
        Operator.SELECT_LESS_EQUAL,
    }
)
# Numerator and denominator of tanh(y) / y in z = y^2: Lambert's continued fraction, cut off.
_TANH: Final = {
    53: ((34459425, 4729725, 135135, 990, 1), (34459425, 16216200, 945945, 13860, 45)),
    24: ((945, 105, 1), (945, 420, 15)),
}
_HALVED: Final = {
    53: ((10395, 1260, 21), (10395, 4725, 210, 1)),
    24: ((105, 10), (105, 45, 1)),
}
# ln 2 and pi/2 in pieces: all but the last times a whole number are exact.
_LN_2: Final = {53: (42,), 24: (15,)}
_LN_2_DIGITS = Fraction("0.693147180559945309417232121458176568075500134360255254120680009")
_HALF_PI_DIGITS = Fraction("1.570796326794896619231321691639751442098584699687552910487472296")
_HALF_PI: Final = {53: (25, 51), 24: (11, 23)}


def require_portable(blocks: Iterable[tuple[str, Iterable[Statement]]]) -> None:
    """Refuse a function that is not one of the four.

    Parameters
    ----------
    blocks : Iterable[tuple[str, Iterable[Statement]]]
        Where each program comes from, in the words of the plant file, and the program.

    Raises
    ------
    UsageError
        Naming the function and the place.
    """
    for place, statements in blocks:
        for statement in statements:
            if statement.operator not in CALLS and statement.operator not in _PLAIN:
                raise UsageError(refusal(str(statement.operator), place))


def refusal(function: str, place: str) -> str:
    """Say that a function has no portable form."""
    return (
        f"--math portable: {function} in {place} has no portable form: only tanh, sin, cos and"
        " exp have\n  fix: write it by these, or use --math libm"
    )


def functions_of(law: Law) -> tuple[FunctionBlock, ...]:
    """Return the functions that a law calls, by name."""
    if not law.arithmetic.portable:
        return ()
    wanted = {CALLS[s.operator][0] for s in every_statement(law) if s.operator in CALLS}
    made = {"exp": _exp, "tanh": _tanh, "wave": _wave}
    return tuple(made[name](law.arithmetic) for name in sorted(wanted))


def every_statement(law: Law) -> tuple[Statement, ...]:
    """Collect the statements of all programs of a law."""
    latch, reference = law.center.latch, law.reference
    return (
        *law.center.statements,
        *law.feedback,
        *(() if reference is None else reference.statements),
        *(() if latch is None else (*latch.signals, *latch.statements)),
        *(() if law.switching is None else (s for g in law.switching.stages for s in g.feedback)),
    )


def _tanh(arithmetic: Arithmetic) -> FunctionBlock:
    """Return tanh as the fraction at v/8 (v/4), doubled three times (twice), at most 1."""
    end, share, doublings = (9.25, 0.25, 2) if arithmetic.single else (20.0, 0.125, 3)
    program = _Program()
    y = program.name("y", Operator.MUL, Literal(value=share), program.clamped("inner", _V, end))
    z = program.name("z", Operator.MUL, y, y)
    above, below = (
        program.polynomial(name, z, numbers)
        for name, numbers in zip(("above", "below"), _TANH[arithmetic.bits], strict=True)
    )
    t = program.name("t_0", Operator.DIV, program.emit(Operator.MUL, y, above), below)
    for j in range(1, doublings + 1):
        twice = program.emit(Operator.ADD, t, t)
        rest = program.emit(Operator.ADD, _ONE, program.emit(Operator.MUL, t, t))
        t = program.name(f"t_{j}", Operator.DIV, twice, rest)
    value = program.clamped("outer", t, 1.0)
    return program.block("tanh", "Return tanh v.", value)


def _exp(arithmetic: Arithmetic) -> FunctionBlock:
    """Return e^v = 2^k e^r, |r| < 0.36, with e^r = (1 + t) / (1 - t), t = tanh(r/2)."""
    end = 87.0 if arithmetic.single else 700.0
    program = _Program()
    inner = program.clamped("inner", _V, end)
    k = program.whole("k", inner, float(1 / _LN_2_DIGITS), arithmetic)
    r: Operand = inner
    for j, piece in enumerate(_pieces(_LN_2_DIGITS, _LN_2[arithmetic.bits], arithmetic), 1):
        product = program.emit(Operator.MUL, k, Literal(value=piece))
        r = program.name(f"r_{j}", Operator.SUB, r, product)
    y = program.name("y", Operator.MUL, _HALF, r)
    z = program.name("z", Operator.MUL, y, y)
    above, below = (
        program.polynomial(name, z, numbers)
        for name, numbers in zip(("above", "below"), _HALVED[arithmetic.bits], strict=True)
    )
    t = program.name("t", Operator.DIV, program.emit(Operator.MUL, y, above), below)
    grown = program.emit(Operator.ADD, _ONE, t)
    e = program.name("e", Operator.DIV, grown, program.emit(Operator.SUB, _ONE, t))
    n: Operand = program.name("n_0", Operator.ABS, k)
    power: Operand = _ONE
    for j in range(6 if arithmetic.single else 9, -1, -1):
        size = Literal(value=2.0**j)
        factor = Literal(value=2.0 ** (2.0**j))
        grown = program.emit(Operator.MUL, power, factor)
        power = program.name(f"power_{j}", Operator.SELECT_LESS, n, size, power, grown)
        if j > 0:
            less = program.emit(Operator.SUB, n, size)
            n = program.name(f"rest_{j}", Operator.SELECT_LESS, n, size, n, less)
    small = program.emit(Operator.DIV, e, power)
    large = program.emit(Operator.MUL, e, power)
    value = program.name("value", Operator.SELECT_LESS, k, Literal(value=0.0), small, large)
    return program.block("exp", "Return e to the power v.", value)


def _wave(arithmetic: Arithmetic) -> FunctionBlock:
    """Return sin(v + shift pi/2) for a shift of 0 or 1, from v = k pi/2 + r, |r| < 0.79."""
    program = _Program()
    k = program.whole("k", _V, float(1 / _HALF_PI_DIGITS), arithmetic)
    r: Operand = _V
    pieces = _pieces(_HALF_PI_DIGITS, _HALF_PI[arithmetic.bits], arithmetic)
    for j, piece in enumerate(pieces, 1):
        product = program.emit(Operator.MUL, k, Literal(value=piece))
        r = program.name(f"r_{j}", Operator.SUB, r, product)
    z = program.name("z", Operator.MUL, r, r)
    odd, even = (4, 5) if arithmetic.single else (8, 8)
    factors = [Fraction((-1) ** j, math.factorial(2 * j + 1)) for j in range(1, odd + 1)]
    inner = program.polynomial("odd", z, factors, arithmetic)
    cubed = program.emit(Operator.MUL, r, z)
    sine = program.name("sine", Operator.ADD, r, program.emit(Operator.MUL, cubed, inner))
    factors = [Fraction((-1) ** j, math.factorial(2 * j)) for j in range(2, even + 1)]
    inner = program.polynomial("even", z, factors, arithmetic)
    # Not 1 - fall: for x in [2^-33, 2^-32) the software subtraction of libgcc for ARM rounds
    # 1 - x to the wrong side. The sum is exact or rounded once more, far below the error bound.
    bent = program.emit(Operator.SUB, _HALF, program.emit(Operator.MUL, z, inner))
    fall = program.name("fall", Operator.MUL, z, bent)
    most = program.emit(Operator.SUB, Literal(value=0.75), fall)
    cosine = program.name("cosine", Operator.ADD, most, Literal(value=0.25))
    turns = program.name("turns", Operator.ADD, k, Variable(name="shift"))
    full = program.whole("full", turns, 0.25, arithmetic)
    four = program.emit(Operator.MUL, Literal(value=4.0), full)
    place = program.name("place", Operator.SUB, turns, four)
    square = program.name("square", Operator.MUL, place, place)
    far = program.name("far", Operator.SELECT_LESS, square, Literal(value=2.0), cosine, sine)
    size = program.name("size", Operator.SELECT_LESS, square, _HALF, sine, far)
    minus = program.name("minus", Operator.NEG, size)
    left = program.name("left", Operator.SELECT_LESS, place, Literal(value=-0.5), minus, size)
    right = program.name("right", Operator.SELECT_LESS, Literal(value=1.5), place, minus, left)
    summary = "Return sin(v + shift pi/2): sin v for shift 0, cos v for shift 1."
    return program.block("wave", summary, right, "v", "shift")


def _pieces(value: Fraction, places: Sequence[int], arithmetic: Arithmetic) -> tuple[float, ...]:
    """Cut a number at these binary places; the last piece is what remains, rounded."""
    found = []
    for place in places:
        piece = Fraction(math.floor(value * 2**place), 2**place)
        found.append(float(piece))
        value -= piece
    return (*found, arithmetic.nearest(float(value)))


class _Program(StatementBuilder):
    """A builder with the few shapes that the functions are made of."""

    def __init__(self) -> None:
        super().__init__("part")

    def clamped(self, target: str, value: Operand, end: float) -> Variable:
        """Move a value into [-end, end]; NaN stays."""
        least, most = Literal(value=-end), Literal(value=end)
        low = self.name(f"{target}_low", Operator.SELECT_LESS, value, least, least, value)
        return self.name(target, Operator.SELECT_LESS, most, low, most, low)

    def whole(self, target: str, value: Operand, factor: float, arithmetic: Arithmetic) -> Variable:
        """Round value times factor to a whole number: no fraction survives this addition."""
        large = Literal(value=1.5 * 2.0 ** (arithmetic.bits - 1))
        scaled = self.emit(Operator.MUL, value, Literal(value=arithmetic.nearest(factor)))
        far = self.name(f"{target}_far", Operator.ADD, scaled, large)
        return self.name(target, Operator.SUB, far, large)

    def polynomial(
        self,
        target: str,
        z: Operand,
        coefficients: Sequence[Fraction | int],
        arithmetic: Arithmetic | None = None,
    ) -> Operand:
        """Horner's rule, the constant first; one line for each step."""
        values = [float(c) for c in coefficients]
        if arithmetic is not None:
            values = [arithmetic.nearest(value) for value in values]
        found: Operand = Literal(value=values[-1])
        for j, value in reversed(list(enumerate(values[:-1]))):
            product = self.emit(Operator.MUL, z, found)
            name = target if j == 0 else f"{target}_{j}"
            found = self.name(name, Operator.ADD, Literal(value=value), product)
        return found

    def block(self, name: str, summary: str, value: Operand, *parameters: str) -> FunctionBlock:
        return FunctionBlock(
            name=name,
            summary=summary,
            parameters=parameters or ("v",),
            statements=self.statements,
            value=value,
        )
