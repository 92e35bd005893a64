"""The design problem as data: which logs are free, and how they become shapes and widths."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto
from typing import TYPE_CHECKING, Any, TypeVar

from bfppc_synth.bounds.nominal.residual import NominalResidual
from bfppc_synth.bounds.residual import PerformanceResidual
from bfppc_synth.majorants.targets import FloatArithmetic
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.shapes import GenericShape, Terms

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from bfppc_synth.bounds.chain import Residual
    from bfppc_synth.bounds.feedback import Numbers
    from bfppc_synth.bounds.nominal.center import NominalCenter
    from bfppc_synth.bounds.residual import Placement
    from bfppc_synth.gains.methods.demands import Theorem
    from bfppc_synth.gains.methods.theorem3 import Staging
    from bfppc_synth.majorants.arithmetic import Arithmetic
    from bfppc_synth.model.arithmetic import Arithmetic as CodeArithmetic
    from bfppc_synth.model.bounds import CenterBounds, Conditions, Majorants
    from bfppc_synth.model.plant import Plant
    from bfppc_synth.model.spec import GainSpec

T = TypeVar("T")


class Kind(Enum):
    """What the exponential of a free variable is."""

    WIDTH = auto()  # p_i
    LINEAR = auto()  # k p, the linear term's share of phi(p)
    TANH = auto()  # M tanh(y), the tanh term's share of phi(p)
    BEND = auto()  # y = M p / epsilon
    HEIGHT = auto()  # M itself, where epsilon is fixed
    POWER = auto()  # c p^N, the power term's share of phi(p)


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """One free variable: the log of what ``kind`` says, of step ``step`` (from 0)."""

    kind: Kind
    step: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedGains:
    """Gains that the file fixes, as floats; None is free. N is always fixed."""

    k: float | None
    M: float | None
    epsilon: float | None
    c: float | None
    N: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """Exponents of U and of the slope of phi_n in what is minimized."""

    peak_input: float
    slope: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignProblem:
    """Everything that the search reads.

    ``accuracy`` is p_1; ``half_widths`` p_2.. where fixed; ``limit`` the actuator limit;
    ``margin`` the relative room that every inequality of the rounded design keeps;
    ``staging`` the free stages of theorem3, whose last stage the problem is about; ``nominal``
    is there with center nominal, and ``center`` is then its bounds. ``arithmetic`` is that of
    the code.
    """

    plant: Plant
    majorants: Majorants
    center: CenterBounds
    conditions: Conditions
    theorem: Theorem
    accuracy: float
    half_widths: tuple[float | None, ...]
    gains: tuple[FixedGains, ...]
    weights: Weights
    limit: float | None
    margin: float
    staging: Staging | None = None
    nominal: NominalCenter | None = None
    arithmetic: CodeArithmetic = DEFAULT

    def residual(
        self,
        *,
        arithmetic: Arithmetic[T],
        place: Placement[T],
        constant: Callable[[float], T],
    ) -> Residual[T]:
        """Build W_i, maj g_i* and g_{m,i} of the problem's center in one number type."""
        if self.nominal is not None:
            return NominalResidual(
                self.plant, self.nominal, arithmetic=arithmetic, place=place, constant=constant
            )
        return PerformanceResidual(
            self.plant,
            self.majorants,
            self.center,
            arithmetic=arithmetic,
            place=place,
            constant=constant,
        )

    def float_residual(self) -> Residual[float]:
        """Build the residual in plain floats."""
        return self.residual(arithmetic=FloatArithmetic(), place=_around, constant=float)

    def nominal_residual(self, nominal: NominalCenter) -> NominalResidual[float]:
        """Build the residual of a nominal center in plain floats."""
        return NominalResidual(
            self.plant, nominal, arithmetic=FloatArithmetic(), place=_around, constant=float
        )

    @property
    def order(self) -> int:
        """Number of steps n."""
        return len(self.gains)

    @property
    def exact(self) -> bool:
        """Whether measurement is exact and continuous: then zeta is exactly 0."""
        return self.conditions.hold == 0.0 and not any(self.conditions.delta)


def _around(index: int, lower: float, upper: float, xi: float) -> tuple[float, float]:
    del index
    return lower - xi, upper + xi


def fixed_gains(spec: GainSpec) -> FixedGains:
    """Read the fixed gains of one step as the binary64 numbers that the code will contain."""

    def value(name: str) -> float | None:
        constant = getattr(spec, name)
        return None if constant is None else float(constant.approximate)

    return FixedGains(k=value("k"), M=value("M"), epsilon=value("epsilon"), c=value("c"), N=spec.N)


def patterns(gains: FixedGains) -> tuple[Terms, ...]:
    """Which free terms a step may use, best first; always at least the empty pattern.

    One free term a step keeps the program well conditioned; tanh contains the linear shape
    as its limit y -> 0, so it stands first.
    """
    free = [
        term
        for term, gain in (
            (Terms.TANH, gains.M),
            (Terms.LINEAR, gains.k),
            (Terms.POWER, gains.c),
        )
        if gain is None
    ]
    if gains.M not in (None, 0.0) and gains.epsilon is None:
        # M is fixed and only its epsilon is free: it belongs to every pattern.
        return tuple(term | Terms.TANH for term in free[:2]) or (Terms.TANH,)
    return tuple(free[:2]) or (Terms(0),)


def is_free(problem: DesignProblem) -> bool:
    """Whether anything is left to the search."""
    pattern = tuple(patterns(gains)[0] for gains in problem.gains)
    return bool(slots(problem, pattern))


def slots(problem: DesignProblem, pattern: tuple[Terms, ...]) -> tuple[Slot, ...]:
    """List the free variables of one pattern, step by step."""
    out: list[Slot] = []
    for step, (terms, gains) in enumerate(zip(pattern, problem.gains, strict=True)):
        if step > 0 and problem.half_widths[step] is None:
            out.append(Slot(kind=Kind.WIDTH, step=step))
        if Terms.TANH in terms:
            if gains.M is None and gains.epsilon is None:
                out.append(Slot(kind=Kind.TANH, step=step))
                out.append(Slot(kind=Kind.BEND, step=step))
            elif gains.M is None:
                out.append(Slot(kind=Kind.HEIGHT, step=step))
            else:
                out.append(Slot(kind=Kind.BEND, step=step))
        if Terms.LINEAR in terms:
            out.append(Slot(kind=Kind.LINEAR, step=step))
        if Terms.POWER in terms:
            out.append(Slot(kind=Kind.POWER, step=step))
    return tuple(out)


def assemble(
    problem: DesignProblem, values: Mapping[Slot, T], numbers: Numbers[T]
) -> tuple[tuple[GenericShape[T], ...], tuple[T, ...]]:
    """Turn positive values of the free variables into shapes and half-widths.

    Parameters
    ----------
    problem : DesignProblem
        What is fixed.
    values : Mapping[Slot, T]
        The exponential of every free log.
    numbers : Numbers[T]
        Functions of the number type.

    Returns
    -------
    tuple
        phi_1..phi_n and p_1..p_n.
    """
    widths: list[Any] = []
    shapes: list[Any] = []
    for step, gains in enumerate(problem.gains):
        fixed = problem.accuracy if step == 0 else problem.half_widths[step]
        if fixed is None:
            p: Any = values[Slot(kind=Kind.WIDTH, step=step)]
        else:
            p = numbers.number(fixed)
        widths.append(p)
        shapes.append(_shape(gains, step, p, values, numbers))
    return tuple(shapes), tuple(widths)


def _shape(
    gains: FixedGains, step: int, p: Any, values: Mapping[Slot, Any], numbers: Numbers[Any]
) -> GenericShape[Any]:
    def free(kind: Kind) -> Any:
        return values.get(Slot(kind=kind, step=step))

    zero = numbers.number(0.0)
    terms = Terms(0)
    k, M, epsilon, c = zero, zero, numbers.number(1.0), zero
    if free(Kind.LINEAR) is not None:
        k, terms = free(Kind.LINEAR) / p, terms | Terms.LINEAR
    elif gains.k:
        k, terms = numbers.number(gains.k), terms | Terms.LINEAR
    bend, level, height = free(Kind.BEND), free(Kind.TANH), free(Kind.HEIGHT)
    if level is not None:
        M, terms = level / numbers.tanh(bend), terms | Terms.TANH
        epsilon = M * p / bend
    elif height is not None:
        M, terms = height, terms | Terms.TANH
        epsilon = numbers.number(gains.epsilon or 1.0)
    elif gains.M:
        M, terms = numbers.number(gains.M), terms | Terms.TANH
        epsilon = M * p / bend if bend is not None else numbers.number(gains.epsilon or 1.0)
    elif gains.epsilon is not None:
        epsilon = numbers.number(gains.epsilon)
    if free(Kind.POWER) is not None:
        c, terms = free(Kind.POWER) / p**gains.N, terms | Terms.POWER
    elif gains.c:
        c, terms = numbers.number(gains.c), terms | Terms.POWER
    return GenericShape(k=k, M=M, epsilon=epsilon, c=c, N=gains.N, terms=terms)


def log_limits(slot: Slot) -> tuple[float, float]:
    """Box of one log variable: wide in the units, narrow in the bend of the tanh.

    y below 1e-2 is linear to 1e-5; a large y is what a tube hardly wider than zeta needs. The
    rest is far from what binary64 overflows at, so that a long chain is answered by its numbers.
    """
    if slot.kind is Kind.BEND:
        return math.log(1e-2), math.log(1e8)
    return -300.0, 300.0
