"""One rule per operator: the range over the operands' intervals, for any number type.

Every rule returns the exact range, or an enclosure that is inclusion isotone; so envelopes
contain the expression and are nested (docs/theory.md section 1). Operands are pairs
(lower, upper); ``node`` is the subexpression, for messages.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.majorants.arithmetic import Arithmetic, Sign

if TYPE_CHECKING:
    from collections.abc import Callable

T = TypeVar("T")
Pair: TypeAlias = tuple[T, T]

_AT_LEAST_ZERO = frozenset({Sign.POSITIVE, Sign.NONNEGATIVE, Sign.ZERO})
_AT_MOST_ZERO = frozenset({Sign.NEGATIVE, Sign.NONPOSITIVE})
_ZERO, _ONE, _HALF_TURN, _TURN = sp.S.Zero, sp.S.One, sp.pi, 2 * sp.pi
_POLE = "has a pole: the product of what it divides by at both ends of its argument's range"
# Phases of the upper and of the lower peak.
_SINE_PEAKS = (sp.pi / 2, -sp.pi / 2)
_COSINE_PEAKS = (sp.S.Zero, sp.pi)


def add(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], b: Pair[T]) -> Pair[T]:
    """(l + l', u + u')."""
    del node
    return arithmetic.add(a[0], b[0]), arithmetic.add(a[1], b[1])


def sub(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], b: Pair[T]) -> Pair[T]:
    """(l - u', u - l')."""
    return add(arithmetic, node, a, neg(arithmetic, node, b))


def neg(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T]) -> Pair[T]:
    """(-u, -l)."""
    del node
    return arithmetic.neg(a[1]), arithmetic.neg(a[0])


def scale(
    arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], coefficient: sp.Rational
) -> Pair[T]:
    """Multiply by a number above 0."""
    del node
    factor = arithmetic.number(coefficient)
    return arithmetic.mul(factor, a[0]), arithmetic.mul(factor, a[1])


def mul(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], b: Pair[T]) -> Pair[T]:
    """Minimum and maximum of the four products, as few of them as the signs allow.

    Each formula is the exact range wherever its signs hold, so which one is taken does not
    matter to nesting as long as ``sign_of`` keeps its promise.
    """
    times, smaller, larger = arithmetic.mul, arithmetic.minimum, arithmetic.maximum
    sign_a, sign_b = arithmetic.sign_of(*a), arithmetic.sign_of(*b)
    if Sign.ZERO in (sign_a, sign_b):
        zero = arithmetic.number(_ZERO)
        return zero, zero
    # Reduce to a first operand >= 0: (-a) b = -(a b).
    if sign_a not in _AT_LEAST_ZERO and sign_b in _AT_LEAST_ZERO | _AT_MOST_ZERO:
        a, b, sign_a, sign_b = b, a, sign_b, sign_a
    if sign_a in _AT_MOST_ZERO:
        return neg(arithmetic, node, mul(arithmetic, node, neg(arithmetic, node, a), b))
    (a_low, a_up), (b_low, b_up) = a, b
    if sign_a in _AT_LEAST_ZERO:
        if sign_b in _AT_LEAST_ZERO:
            return times(a_low, b_low), times(a_up, b_up)
        if sign_b in _AT_MOST_ZERO:
            return times(a_up, b_low), times(a_low, b_up)
        if sign_b is Sign.MIXED:
            return times(a_up, b_low), times(a_up, b_up)
        lower = smaller(times(a_low, b_low), times(a_up, b_low))
        return lower, larger(times(a_low, b_up), times(a_up, b_up))
    lower = smaller(times(a_low, b_up), times(a_up, b_low))
    upper = larger(times(a_low, b_low), times(a_up, b_up))
    if Sign.MIXED in (sign_a, sign_b):
        return lower, upper
    lower = smaller(lower, smaller(times(a_low, b_low), times(a_up, b_up)))
    return lower, larger(upper, larger(times(a_low, b_up), times(a_up, b_low)))


def reciprocal(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T]) -> Pair[T]:
    """(1/u, 1/l) where 0 is not in [l, u]."""
    lower, upper = a
    sign = arithmetic.sign_of(lower, upper)
    if sign is Sign.UNKNOWN:
        sign = arithmetic.side_of(lower, upper)
    if sign in _AT_LEAST_ZERO:
        nearest = lower
    elif sign in _AT_MOST_ZERO:
        nearest = arithmetic.neg(upper)
    else:
        raise EnvelopeError(
            f"{node} has a pole: its denominator ranges over [{lower}, {upper}], and 0 is inside",
            subexpression=str(node),
            fix="keep the denominator away from 0, or declare a bound without a pole",
        )
    arithmetic.require_positive(nearest, node, "has a pole: the distance of its denominator from 0")
    return arithmetic.reciprocal(upper), arithmetic.reciprocal(lower)


def odd_power(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], exponent: int) -> Pair[T]:
    """(l^m, u^m) for odd m."""
    del node
    return arithmetic.power(a[0], exponent), arithmetic.power(a[1], exponent)


def signed_power(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], p: int, q: int) -> Pair[T]:
    """(s(l), s(u)) with s(x) = sgn(x) abs(x)**(p/q): odd roots, and x abs(x)."""
    sign = arithmetic.sign_of(*a)
    if sign in _AT_LEAST_ZERO:
        return magnitude_power(arithmetic, node, a, p, q)
    if sign in _AT_MOST_ZERO:
        return neg(arithmetic, node, signed_power(arithmetic, node, neg(arithmetic, node, a), p, q))
    if sign is Sign.MIXED:
        below = _nonnegative_power(arithmetic, arithmetic.neg(a[0]), p, q)
        return arithmetic.neg(below), _nonnegative_power(arithmetic, a[1], p, q)
    return _signed(arithmetic, a[0], p, q), _signed(arithmetic, a[1], p, q)


def magnitude_power(
    arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], p: int, q: int
) -> Pair[T]:
    """(mig**(p/q), mag**(p/q)): even powers and roots of even powers."""
    least, largest = absolute(arithmetic, node, a)
    lower = _nonnegative_power(arithmetic, least, p, q)
    return lower, _nonnegative_power(arithmetic, largest, p, q)


def even_root(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], p: int, q: int) -> Pair[T]:
    """(l**(p/q), u**(p/q)) for even q, where l >= 0."""
    arithmetic.require_nonnegative(a[0], node, "is a root of what may be negative: the lower end")
    return arithmetic.root_power(a[0], p, q), arithmetic.root_power(a[1], p, q)


def absolute(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T]) -> Pair[T]:
    """(mig, mag), mig = max(0, l, -u), mag = max(-l, u)."""
    del node
    lower, upper = a
    sign = arithmetic.sign_of(lower, upper)
    if sign in _AT_LEAST_ZERO:
        return a
    if sign in _AT_MOST_ZERO:
        return arithmetic.neg(upper), arithmetic.neg(lower)
    largest = arithmetic.maximum(arithmetic.neg(lower), upper)
    zero = arithmetic.number(_ZERO)
    if sign is Sign.MIXED:
        return zero, largest
    outside = arithmetic.maximum(lower, arithmetic.neg(upper))
    return arithmetic.maximum(zero, outside), largest


def sign(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T]) -> Pair[T]:
    """(sgn(l), sgn(u)), and the hull of that where a sign is not known."""
    del node
    known = arithmetic.sign_of(*a)
    lower = 1 if known is Sign.POSITIVE else 0 if known in _AT_LEAST_ZERO else -1
    upper = -1 if known is Sign.NEGATIVE else 0 if known in _AT_MOST_ZERO | {Sign.ZERO} else 1
    return arithmetic.number(sp.Integer(lower)), arithmetic.number(sp.Integer(upper))


def cosh(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T]) -> Pair[T]:
    """(cosh mig, cosh mag)."""
    least, largest = absolute(arithmetic, node, a)
    return arithmetic.cosh(least), arithmetic.cosh(largest)


def log(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T]) -> Pair[T]:
    """(log l, log u) where l > 0."""
    arithmetic.require_positive(a[0], node, "is a logarithm down to 0 or below: the lower end")
    return arithmetic.log(a[0]), arithmetic.log(a[1])


def sin(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T]) -> Pair[T]:
    """Take the exact range: 1 only where some pi/2 + 2 k pi lies inside."""
    del node
    return _wave(arithmetic, a, arithmetic.sin, _SINE_PEAKS)


def cos(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T]) -> Pair[T]:
    """Take the exact range: 1 only where some 2 k pi lies inside."""
    del node
    return _wave(arithmetic, a, arithmetic.cos, _COSINE_PEAKS)


def tan(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T]) -> Pair[T]:
    """(tan l, tan u) inside one branch."""
    _require_branch(arithmetic, node, a, arithmetic.cos)
    return arithmetic.tan(a[0]), arithmetic.tan(a[1])


def cotangent(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T]) -> Pair[T]:
    """(cot u, cot l) inside one branch."""
    _require_branch(arithmetic, node, a, arithmetic.sin)
    lower, upper = (
        arithmetic.mul(arithmetic.cos(end), arithmetic.reciprocal(arithmetic.sin(end)))
        for end in (a[1], a[0])
    )
    return lower, upper


def minimum(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], b: Pair[T]) -> Pair[T]:
    """Take the minima of the lower and of the upper ends."""
    del node
    return arithmetic.minimum(a[0], b[0]), arithmetic.minimum(a[1], b[1])


def maximum(arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], b: Pair[T]) -> Pair[T]:
    """Take the maxima of the lower and of the upper ends."""
    del node
    return arithmetic.maximum(a[0], b[0]), arithmetic.maximum(a[1], b[1])


def select(
    arithmetic: Arithmetic[T],
    node: sp.Expr,
    left: Pair[T],
    right: Pair[T],
    then: Pair[T],
    otherwise: Pair[T],
    relation: str,
) -> Pair[T]:
    """Hull of both branches of a Piecewise.

    Which branch a box reaches changes as it grows, so both count, and both need a value on the
    whole envelope.
    """
    del node, left, right, relation
    lower = arithmetic.minimum(then[0], otherwise[0])
    return lower, arithmetic.maximum(then[1], otherwise[1])


def _nonnegative_power(arithmetic: Arithmetic[T], a: T, p: int, q: int) -> T:
    if q != 1:
        return arithmetic.root_power(a, p, q)
    return a if p == 1 else arithmetic.power(a, p)


def _signed(arithmetic: Arithmetic[T], end: T, p: int, q: int) -> T:
    zero = arithmetic.number(_ZERO)
    above = _nonnegative_power(arithmetic, arithmetic.maximum(end, zero), p, q)
    below = arithmetic.maximum(arithmetic.neg(end), zero)
    return arithmetic.add(above, arithmetic.neg(_nonnegative_power(arithmetic, below, p, q)))


def _wave(
    arithmetic: Arithmetic[T], a: Pair[T], wave: Callable[[T], T], peaks: tuple[sp.Expr, sp.Expr]
) -> Pair[T]:
    one = arithmetic.number(_ONE)
    first, last = wave(a[0]), wave(a[1])
    low, high = arithmetic.minimum(first, last), arithmetic.maximum(first, last)
    return (
        arithmetic.contains_phase(*a, peaks[1], _TURN, arithmetic.neg(one), low),
        arithmetic.contains_phase(*a, peaks[0], _TURN, one, high),
    )


def _require_branch(
    arithmetic: Arithmetic[T], node: sp.Expr, a: Pair[T], pole: Callable[[T], T]
) -> None:
    # Narrower than a branch, at most one pole is inside, and then the ends differ in sign.
    # Both conditions are smooth in the ends, as a search needs them.
    width = arithmetic.add(a[1], arithmetic.neg(a[0]))
    room = arithmetic.add(arithmetic.number(_HALF_TURN), arithmetic.neg(width))
    arithmetic.require_positive(
        room, node, "has a pole: pi minus the width of its argument's range"
    )
    same = arithmetic.mul(pole(a[0]), pole(a[1]))
    arithmetic.require_positive(same, node, _POLE)


def _monotone(name: str) -> Callable[..., Any]:
    def rule(arithmetic: Any, node: sp.Expr, a: Pair[Any]) -> Pair[Any]:
        del node
        function = getattr(arithmetic, name)
        return function(a[0]), function(a[1])

    return rule


RULES: dict[str, Callable[..., Any]] = {
    rule.__name__: rule
    for rule in (
        *(add, sub, neg, scale, mul, reciprocal, odd_power, signed_power, magnitude_power),
        *(even_root, absolute, sign, cosh, log, sin, cos, tan, cotangent),
        *(minimum, maximum, select),
    )
} | {name: _monotone(name) for name in ("exp", "sinh", "tanh", "atan", "asinh")}
