"""The controller as a straight-line program over binary64 constants, before any language."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias

from bfppc_synth.model.arithmetic import DEFAULT

if TYPE_CHECKING:
    from bfppc_synth.model.arithmetic import Arithmetic

SHAPE_FORMULA = "phi_i(e) = k_i e + M_i tanh(M_i e / epsilon_i) + c_i e^N_i"


class Operator(StrEnum):
    """Everything that a generated controller may compute with; arity in the name's comment."""

    ADD = "+"  # 2
    SUB = "-"  # 2
    MUL = "*"  # 2
    DIV = "/"  # 2
    NEG = "neg"  # 1
    ABS = "abs"  # 1
    SQRT = "sqrt"  # 1
    EXP = "exp"  # 1
    LOG = "log"  # 1
    SIN = "sin"  # 1
    COS = "cos"  # 1
    TAN = "tan"  # 1
    TANH = "tanh"  # 1
    SINH = "sinh"  # 1
    COSH = "cosh"  # 1
    ATAN = "atan"  # 1
    ASINH = "asinh"  # 1
    POW = "pow"  # 2, base >= 0, exponent a constant that is no integer
    SELECT_LESS = "select<"  # 4: a < b ? c : d
    SELECT_LESS_EQUAL = "select<="  # 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Literal:
    """A binary64 constant, printed as the shortest decimal that reads back to it."""

    value: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """An input, a state member, a certified constant or an earlier result."""

    name: str


Operand: TypeAlias = Literal | Variable


@dataclass(frozen=True, slots=True, kw_only=True)
class Statement:
    """``target = operator(operands)``, every target assigned once."""

    target: str
    operator: Operator
    operands: tuple[Operand, ...]
    comment: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedConstant:
    """A constant of the controller with the name that the files carry.

    ``value`` is the certified binary64 number (an int for N_i); ``used`` is False where no
    statement reads it (N_i, and the gains of a term that is left out).
    """

    name: str
    value: float | int
    used: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """``lower <= variable <= upper``, by the names of constants; no ``lower`` means -upper."""

    variable: str
    upper: str
    lower: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LatchBlock:
    """What center nominal does before its center (docs/theory.md section 4).

    ``signals`` run at every step: y_k = y_d^(k)/k! at ``elapsed``, from the compiled-in
    reference or from the passed y_d_k. ``statements`` run once, at the first accepted sample,
    and read x_i and y_k; ``values`` are what is then latched, one per name in ``latched``.
    """

    signals: tuple[Statement, ...]
    statements: tuple[Statement, ...]
    values: tuple[Operand, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CenterBlock:
    """The center r_1..r_n and the feedforward v of docs/theory.md section 2.

    ``statements`` read ``elapsed`` (t - t_0), ``y_d``, ``offset`` (the latched
    q(x_1(0)) - y_d(0)) and ``start_i``; ``latched`` names those start_i, q(x_i(0)), i >= 2.
    With ``latch`` (center nominal) they read ``elapsed``, y_k and the names in ``latched``.
    """

    statements: tuple[Statement, ...]
    r: tuple[Operand, ...]
    v: Operand
    latched: tuple[str, ...]
    latch: LatchBlock | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceBlock:
    """The compiled-in reference as statements in ``t``, the time since the first sample [s]."""

    statements: tuple[Statement, ...]
    value: Operand


@dataclass(frozen=True, slots=True, kw_only=True)
class FunctionBlock:
    """A function that the generated file contains: statements in its parameters, and a value."""

    name: str
    summary: str
    parameters: tuple[str, ...]
    statements: tuple[Statement, ...]
    value: Operand


@dataclass(frozen=True, slots=True, kw_only=True)
class StageLaw:
    """One stage of a switching law (docs/theory.md section 8).

    ``feedback`` reads x_i and r_i. While every range of ``stays`` holds the law stays in the
    stage; the last one has none. One of ``expected`` failing at the switch means OUTSIDE.
    """

    feedback: tuple[Statement, ...]
    stays: tuple[Range, ...]
    expected: tuple[Range, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Switching:
    """All stages in order; ``anchors`` is K - 1 where a switch makes a new center, else 0.

    The center then also reads ``anchor_l`` (ê_1 at switch l, 0 before), ``since_l`` and
    ``since``, the times since switch l and since the last one [s]; its ``latched`` are those
    of the last switch.
    """

    stages: tuple[StageLaw, ...]
    anchors: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Law:
    """One control step, ready to be printed in any language.

    A step screens ``inputs``, the time and ``reference_ranges`` (of y_d, or of y_d_0..y_d_n
    where it is passed with its derivatives), latches ``offset`` and
    the center's ``latched`` at the first accepted sample, runs ``center`` and ``feedback``
    and clamps ``u`` to U_MAX. ``start`` and ``tube`` failing means OUTSIDE. ``time_limit``
    is the largest power of two below which one ulp of t is at most period/16 (None when
    period is 0); ``elapsed_limit`` bounds t - t_0. Both in seconds. ``formula`` is phi_i in
    words for the comment above the certified constants. With ``switching`` its stages take the
    place of ``feedback``, which is the last of them. Every constant is a number of
    ``arithmetic``; literals of statements are rounded to it where they are printed.
    ``functions`` are those that the statements call and no library provides.
    """

    name: str
    title: str
    order: int
    states: tuple[str, ...]
    units: tuple[tuple[str, str], ...]
    accuracy: float
    period: float
    certified: tuple[NamedConstant, ...]
    limits: tuple[NamedConstant, ...]
    derived: tuple[Statement, ...]
    inputs: tuple[Range, ...]
    reference_ranges: tuple[Range, ...]
    start: tuple[Range, ...]
    tube: tuple[Range, ...]
    time_limit: float | None
    elapsed_limit: float
    reference: ReferenceBlock | None
    center: CenterBlock
    feedback: tuple[Statement, ...]
    formula: str = SHAPE_FORMULA
    switching: Switching | None = None
    arithmetic: Arithmetic = DEFAULT
    functions: tuple[FunctionBlock, ...] = ()

    @property
    def derivatives(self) -> tuple[str, ...]:
        """Names of y_d, dy_d, .. as passed with every sample; empty where y_d is a number."""
        names = tuple(test.variable for test in self.reference_ranges)
        return names if len(names) > 1 else ()

    @property
    def u_max(self) -> float:
        """The clamp, at least the certified peak input U."""
        return next(float(c.value) for c in self.certified if c.name == "U_MAX")


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """What every generated file says about its origin; no dates, no paths.

    ``status`` is the certificate's verdict; ``failures`` are the sentences that the
    NOT CERTIFIED banner lists (empty when certified).
    """

    tool_version: str
    plant_sha256: str
    theorem: str
    status: str
    failures: tuple[str, ...]
    arithmetic: Arithmetic = DEFAULT

    @property
    def certified(self) -> bool:
        """Whether the files may go without the NOT CERTIFIED banner."""
        return self.status == "certified"
