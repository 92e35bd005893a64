"""The feedback shape phi(e) = k e + M tanh(M e / epsilon) + c e^N of (54)-(55)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Flag, auto
from typing import Generic, TypeAlias, TypeVar

T = TypeVar("T")


class Terms(Flag):
    """Which terms a shape has; a missing term is exactly 0."""

    LINEAR = auto()
    TANH = auto()
    POWER = auto()


@dataclass(frozen=True, slots=True, kw_only=True)
class GenericShape(Generic[T]):
    """A shape over any number type; ``terms`` says which of its gains are not 0."""

    k: T
    M: T
    epsilon: T
    c: T
    N: int
    terms: Terms


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """Gains of one step as the binary64 numbers that the generated code contains.

    k [1/s for g = 1], M, epsilon [M times unit of e], c; N odd > 1. M = 0 or c = 0 switches
    that term off.
    """

    k: float
    M: float
    epsilon: float
    c: float
    N: int

    @property
    def generic(self) -> GenericShape[float]:
        """The same shape for the chain."""
        terms = Terms(0)
        for gain, term in ((self.k, Terms.LINEAR), (self.M, Terms.TANH), (self.c, Terms.POWER)):
            if gain != 0.0:
                terms |= term
        return GenericShape(
            k=self.k, M=self.M, epsilon=self.epsilon, c=self.c, N=self.N, terms=terms
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Theorem1Gain:
    """phi(e) = gamma H(rho) e + c e^N of (9), the binary64 numbers of the generated code.

    ``H`` are the coefficients of a polynomial in rho, the constant first, all >= 0; ``H_star``
    is the lower bound of H that only the printed (39) reads. ``k``, ``M``, ``epsilon`` are
    those of the shape at rho = 1, the steepest one.
    """

    gamma: float
    H: tuple[float, ...]
    H_star: float
    c: float
    N: int

    def height(self, rho: float) -> float:
        """H(rho), by Horner's rule as the generated code evaluates it."""
        value = 0.0
        for coefficient in reversed(self.H):
            value = value * rho + coefficient
        return value

    @property
    def k(self) -> float:
        """Gamma H(1), the linear gain at rho = 1 as the generated code rounds it."""
        return self.gamma * self.height(1.0)

    @property
    def M(self) -> float:
        """There is no tanh term."""
        return 0.0

    @property
    def epsilon(self) -> float:
        """There is no tanh term to scale."""
        return 1.0

    @property
    def shape(self) -> Shape:
        """The shape at rho = 1: all there is where H is constant."""
        return Shape(k=self.k, M=self.M, epsilon=self.epsilon, c=self.c, N=self.N)

    @property
    def generic(self) -> GenericShape[float]:
        """The shape at rho = 1 for the chain."""
        return self.shape.generic


Gain: TypeAlias = Shape | Theorem1Gain
"""One step of a finished design; both have k, M, epsilon, c, N and ``generic``."""
