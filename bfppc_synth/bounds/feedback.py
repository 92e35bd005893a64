"""The feedback shape and its suprema, for any number type."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from bfppc_synth.model.shapes import GenericShape, Terms

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")


class Numbers(Protocol[T]):
    """What the chain needs beyond + - * / and integer powers.

    ``supremum`` is sup of a function over [0, 1]; ``record`` names an intermediate result
    (the sympy target returns a symbol for it, every other target the value itself).
    """

    def number(self, value: float) -> T:
        """Convert a constant."""

    def tanh(self, value: T) -> T:
        """Return the hyperbolic tangent."""

    def sqrt(self, value: T) -> T:
        """Return the square root."""

    def minimum(self, left: T, right: T) -> T:
        """Return the smaller of two."""

    def maximum(self, left: T, right: T) -> T:
        """Return the larger of two."""

    def supremum(self, function: Callable[[T], T]) -> T:
        """Return the supremum of a function over [0, 1]."""

    def record(self, symbol: str, index: int, value: T) -> T:
        """Name an intermediate result and return what to go on with."""


def feedback(shape: GenericShape[Any], e: Any, numbers: Numbers[T]) -> T:
    """Evaluate phi(e) of (54)-(55).

    Parameters
    ----------
    shape : GenericShape[T]
        Gains of one step.
    e : number
        Error [unit of x_i].
    numbers : Numbers[T]
        Functions of the number type.

    Returns
    -------
    T
        phi(e), odd and increasing in e [unit of x_{i+1}].

    References
    ----------
    docs/theory.md section 0.
    """
    total: Any = numbers.number(0.0)
    if Terms.LINEAR in shape.terms:
        total = total + shape.k * e
    if Terms.TANH in shape.terms:
        total = total + shape.M * numbers.tanh(shape.M * e / shape.epsilon)
    if Terms.POWER in shape.terms:
        total = total + shape.c * e**shape.N
    result: T = total
    return result


def steepness(shape: GenericShape[Any], e: Any, numbers: Numbers[T]) -> T:
    """Evaluate phi'(e) [unit of x_{i+1} per unit of x_i]."""
    total: Any = numbers.number(0.0)
    if Terms.LINEAR in shape.terms:
        total = total + shape.k
    if Terms.TANH in shape.terms:
        bent: Any = numbers.tanh(shape.M * e / shape.epsilon)
        total = total + (shape.M * shape.M / shape.epsilon) * (1 - bent * bent)
    if Terms.POWER in shape.terms:
        total = total + shape.c * shape.N * e ** (shape.N - 1)
    result: T = total
    return result


def largest_slope(shape: GenericShape[Any], p: Any, numbers: Numbers[T]) -> T:
    """L_i = sup phi_i' over [0, p_i].

    tanh falls off and the power grows, so the supremum of their sum is at one of the ends:
    phi'' has at most one change of sign, from - to +.
    """
    total: Any = numbers.number(0.0)
    if Terms.LINEAR in shape.terms:
        total = total + shape.k
    at_zero: Any = numbers.number(0.0)
    at_edge: Any = numbers.number(0.0)
    if Terms.TANH in shape.terms:
        steep = shape.M * shape.M / shape.epsilon
        bent: Any = numbers.tanh(shape.M * p / shape.epsilon)
        at_zero = at_zero + steep
        at_edge = at_edge + steep * (1 - bent * bent)
    if Terms.POWER in shape.terms:
        at_edge = at_edge + shape.c * shape.N * p ** (shape.N - 1)
    if Terms.TANH not in shape.terms:
        return total + at_edge  # type: ignore[no-any-return]
    if Terms.POWER not in shape.terms:
        return total + at_zero  # type: ignore[no-any-return]
    return total + numbers.maximum(at_zero, at_edge)  # type: ignore[no-any-return]


def coupled_rate(
    shape: GenericShape[Any], p: Any, offset: Any, gain: Any, numbers: Numbers[T]
) -> T:
    """B_i = sup over 0 <= s <= p of phi'(s) (offset + gain phi(s)), at one and the same s.

    Parameters
    ----------
    shape : GenericShape[T]
        phi_i.
    p : number
        p_i [unit of x_i].
    offset, gain : number
        D_i + maj g_i* (p_{i+1} + s_{i+1}) and maj g_i*.
    numbers : Numbers[T]
        Functions of the number type.

    Returns
    -------
    T
        Bound on |phi_i'(e_i) de_i| [unit of x_{i+1} per s].

    References
    ----------
    docs/theory.md section 2. Without tanh both factors grow: the corner s = p. For tanh
    alone the product is a cubic in w = tanh(M s / epsilon) with one maximum.
    """
    steep_offset: Any = offset
    if Terms.TANH not in shape.terms:
        edge: Any = steepness(shape, p, numbers)
        return edge * (steep_offset + gain * feedback(shape, p, numbers))  # type: ignore[no-any-return]
    if shape.terms == Terms.TANH:
        scale: Any = gain * shape.M
        # Derivative of (1 - w^2)(offset + scale w): scale - 2 offset w - 3 scale w^2 = 0.
        # The root is written without a difference: scale / (offset + sqrt(..)).
        root: Any = numbers.sqrt(steep_offset * steep_offset + 3 * scale * scale)
        bent: Any = numbers.minimum(
            scale / (steep_offset + root), numbers.tanh(shape.M * p / shape.epsilon)
        )
        return (  # type: ignore[no-any-return]
            (shape.M * shape.M / shape.epsilon) * (1 - bent * bent) * (steep_offset + scale * bent)
        )

    def product(share: Any) -> Any:
        s = share * p
        return steepness(shape, s, numbers) * (steep_offset + gain * feedback(shape, s, numbers))

    return numbers.supremum(product)


def measurement_growth(shape: GenericShape[Any], p: Any, eta: Any, numbers: Numbers[T]) -> T:
    """Lambda_i >= sup |phi(e + d) - phi(e)| over |e| <= p, |d| <= eta.

    The difference of powers is written out by the binomial formula: nothing cancels.

    References
    ----------
    docs/theory.md section 3.
    """
    total: Any = numbers.number(0.0)
    wide: Any = eta
    if Terms.LINEAR in shape.terms:
        total = total + shape.k * wide
    if Terms.TANH in shape.terms:
        total = total + 2 * shape.M * numbers.tanh(shape.M * wide / (2 * shape.epsilon))
    if Terms.POWER in shape.terms:
        growth: Any = numbers.number(0.0)
        binomial = 1
        for power in range(1, shape.N + 1):
            binomial = binomial * (shape.N - power + 1) // power
            growth = growth + binomial * p ** (shape.N - power) * wide**power
        total = total + shape.c * growth
    result: T = total
    return result
