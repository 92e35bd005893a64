"""The certificate checker: one file, standard library only; shipped as ``verify.py``.

    python verify.py            checks the folder that this file lies in
    python verify.py DIR        checks DIR;  --json prints the answer as one JSON object

It reads a plant (plant.json), gains and tube (certificate.json) and the controller's constants,
derives every obligation of docs/theory.md sections 2 to 4, 7 and 8 by itself and proves each one
in outward rounded integer arithmetic. Nothing in the certificate is believed: proofs are hints
where to split a box, enclosures are compared with what is computed here. Exit code 0: proved;
4: refuted (with a witness where there is one) or undecided (named); 2: malformed.

Reading order: kernel (numbers), normal form and parser (expressions), tape (expressions over
boxes), plant, reference, center nominal, chain, obligations, Theorems 1 and 3, verification,
folder, law, command line.
"""

from __future__ import annotations

import argparse
import ast
import builtins
import functools
import hashlib
import heapq
import importlib.abc
import importlib.util
import itertools
import json
import math
import re
import struct
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache, reduce
from pathlib import Path
from typing import Any

PLANT_FORMAT = "bfppc-synth/plant/1"
CERTIFICATE_FORMAT = "bfppc-synth/certificate/1"
REPORT_FORMAT = "bfppc-synth/verification/1"


class Refusal(Exception):  # noqa: N818
    """Whatever keeps the checker from saying "proved"."""


class MalformedError(Refusal):
    """The documents do not say what they must say: exit code 2."""


class UndecidedError(Refusal):
    """A domain, a pole or a size that the arithmetic cannot pass: exit code 4."""


# ---------------------------------------------------------------------------------------------
# 1. Kernel. A number is an integer n and means n / 2^P. An interval is a pair (lo, hi) of such
# numbers. Every operation returns a pair that contains all values of the operation over its
# operands: lower ends are rounded down (//, >>), upper ends up. Inside the transcendental
# functions there are 64 more bits; their error is counted in ulps of 2^-W ("w" below), and a
# count of less than 2^20 w is widened by _SLACK = 2^20 w, which is 2^-44 of the last bit at P.

P = 128
W = P + 64
ONE = 1 << P
_WONE = 1 << W
_SLACK = 1 << 20
_LARGEST = 1 << (P + 4096)
_EXP_LIMIT = 2048 << P

Interval = tuple[int, int]

ZERO_I: Interval = (0, 0)
ONE_I: Interval = (ONE, ONE)


def _ceil_shift(n: int, bits: int) -> int:
    return -((-n) >> bits)


def _ceil_div(a: int, b: int) -> int:
    return -((-a) // b)


def checked(lo: int, hi: int) -> Interval:
    """Refuse what is too large to go on with, so that no document can keep the checker busy."""
    if hi > _LARGEST or lo < -_LARGEST:
        raise UndecidedError("a number beyond 2^4096")
    return lo, hi


def from_fraction(value: Fraction) -> Interval:
    """Enclose a rational; exact where its denominator divides 2^128."""
    scaled = value.numerator << P
    return checked(scaled // value.denominator, _ceil_div(scaled, value.denominator))


def add(a: Interval, b: Interval) -> Interval:
    """Sum, exact."""
    return a[0] + b[0], a[1] + b[1]


def total(terms: Iterable[Interval]) -> Interval:
    """Sum of all, exact."""
    ends = tuple(terms)
    return sum(a[0] for a in ends), sum(a[1] for a in ends)


def neg(a: Interval) -> Interval:
    """Negative, exact."""
    return -a[1], -a[0]


def sub(a: Interval, b: Interval) -> Interval:
    """Difference, exact."""
    return a[0] - b[1], a[1] - b[0]


def mul(a: Interval, b: Interval) -> Interval:
    """Product: the least and the largest of the four products of ends."""
    if a[0] >= 0 and b[0] >= 0:
        return checked((a[0] * b[0]) >> P, _ceil_shift(a[1] * b[1], P))
    ends = (a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1])
    return checked(min(ends) >> P, _ceil_shift(max(ends), P))


def scale(weight: Fraction, a: Interval) -> Interval:
    """Product with a rational, rounded once."""
    p, q = weight.numerator, weight.denominator
    lo, hi = (p * a[0], p * a[1]) if p >= 0 else (p * a[1], p * a[0])
    return (lo, hi) if q == 1 else (lo // q, _ceil_div(hi, q))


def div(a: Interval, b: Interval) -> Interval:
    """Quotient; a divisor that may be 0 is refused."""
    if b[0] <= 0 <= b[1]:
        raise UndecidedError("division by an interval that contains 0")
    tops = (a[0] << P, a[1] << P)
    return checked(
        min(top // end for top in tops for end in b),
        max(_ceil_div(top, end) for top in tops for end in b),
    )


def absolute(a: Interval) -> Interval:
    """(mig, mag) of docs/theory.md section 1."""
    return max(0, a[0], -a[1]), max(-a[0], a[1])


def hull(a: Interval, b: Interval) -> Interval:
    """Smallest interval that contains both."""
    return min(a[0], b[0]), max(a[1], b[1])


def _root_floor(n: int, q: int) -> int:
    """Integer part of the q-th root of n >= 0: Newton from above; the answer is checked."""
    if n < 2 or q == 1:
        return n
    if q == 2:
        return math.isqrt(n)
    bits = max(0, n.bit_length() - 60)
    whole, part = divmod((math.log2(n >> bits) + bits) / q, 1.0)
    x = 1 + ((int(2.0**part * 1.000001 * 2**52) << int(whole)) >> 52)
    while (y := ((q - 1) * x + n // x ** (q - 1)) // q) < x:
        x = y
    if not x**q <= n < (x + 1) ** q:
        raise UndecidedError("a root that was not found")
    return x


def _power_point(n: int, p: int, q: int) -> Interval:
    """(n / 2^P)^(p/q) for n >= 0 and p, q >= 1.

    The result times 2^P is the q-th root of n^p 2^(P (q - p)); the floor of a root is the floor
    of the root of the floor, and one more bounds the root from above unless all was exact.
    """
    if n.bit_length() * p > 1 << 18 or q > 1024:
        raise UndecidedError("a power beyond the size that is computed")
    top, bits = n**p, P * (q - p)
    radicand = top << bits if bits >= 0 else top >> -bits
    root = _root_floor(radicand, q)
    exact = root**q == radicand and (bits >= 0 or radicand << -bits == top)
    return root, root if exact else root + 1


def power(a: Interval, exponent: Fraction) -> Interval:
    """a^exponent; for an odd denominator q, sgn(x) abs(x)^(p/q) if p is odd.

    Even numerators use abs(a), even denominators want a >= 0, negative exponents the reciprocal.
    """
    p, q = exponent.numerator, exponent.denominator
    if p < 0:
        return div(ONE_I, power(a, -exponent))
    if p == 0:
        return ONE_I
    if p == q:
        return a
    if q % 2 == 0 and a[0] < 0:
        raise UndecidedError("an even root of an interval with negative numbers")
    if p % 2 == 0:
        a = absolute(a)
    lo, hi = (_power_point(abs(end), p, q) for end in a)
    return checked(lo[0] if a[0] >= 0 else -lo[1], hi[1] if a[1] >= 0 else -hi[0])


def _atanh_reciprocal(m: int, bits: int) -> Interval:
    """atanh(1/m) 2^bits for an integer m >= 3: sum of m^-(2j+1) / (2j+1), all terms positive.

    Each of the J terms is rounded down twice (at most 2 too little) and what follows the first
    term below 1 adds up to less than 1: the sum is within [s, s + 2 J + 1].
    """
    total, term, j = 0, (1 << bits) // m, 0
    while term:
        total, j = total + term // (2 * j + 1), j + 1
        term //= m * m
    return total, total + 2 * j + 1


def _atan_reciprocal(m: int, bits: int) -> Interval:
    """atan(1/m) 2^bits: the same terms with alternating signs, so the error has both."""
    total, term, j = 0, (1 << bits) // m, 0
    while term:
        total, j = total + (-1) ** j * (term // (2 * j + 1)), j + 1
        term //= m * m
    return total - 2 * j - 1, total + 2 * j + 1


def _half_pi(bits: int) -> Interval:
    """pi/2 2^bits from Machin's pi/4 = 4 atan(1/5) - atan(1/239), narrowed to one unit."""
    a, b = _atan_reciprocal(5, bits + 64), _atan_reciprocal(239, bits + 64)
    return (8 * a[0] - 2 * b[1]) >> 64, _ceil_shift(8 * a[1] - 2 * b[0], 64)


_LN2 = tuple(2 * end for end in _atanh_reciprocal(3, W + 64))  # ln 2 = 2 atanh(1/3)
_LN2_LO, _LN2_HI = _LN2[0] >> 64, _ceil_shift(_LN2[1], 64)
_V = W + 128  # bits of pi/2 in argument reduction: 128 more than the argument's 64 need
_HALF_PI = _half_pi(_V)
PI_I: Interval = (_HALF_PI[0] >> (_V - P - 1), _ceil_shift(_HALF_PI[1], _V - P - 1))


def _narrow(value: int, slack: int) -> Interval:
    """From W to P bits, outward, for a value with an error of at most slack w."""
    return (value - slack) >> (W - P), _ceil_shift(value + slack, W - P)


@lru_cache(maxsize=1 << 14)
def _exp_wide(n: int) -> Interval:
    """e^(n / 2^P) 2^W for n >= 0, by e^x = 2^k (e^(r/256))^256, r = x - k ln 2.

    k is the floor of x / (upper end of ln 2), so 0 <= r < 0.7 and r/256 < 0.003. Lower and
    upper end are separate sums of positive terms, each operation rounded in its direction. What
    follows the 18th term t is at most t (0.003/19 + ..) < t: adding t once more bounds it.
    """
    if n > _EXP_LIMIT:
        raise UndecidedError("exp of a number beyond 2048")
    x = n << (W - P)
    k = x // _LN2_HI
    r = ((x - k * _LN2_HI) >> 8, _ceil_shift(x - k * _LN2_LO, 8))
    lo = hi = term_lo = term_hi = _WONE
    for j in range(1, 19):
        term_lo = ((term_lo * r[0]) >> W) // j
        term_hi = _ceil_div(_ceil_shift(term_hi * r[1], W), j)
        lo, hi = lo + term_lo, hi + term_hi
    hi += term_hi
    for _ in range(8):
        lo, hi = (lo * lo) >> W, _ceil_shift(hi * hi, W)
    return lo << k, hi << k


def _exp_point(n: int) -> Interval:
    if n == 0:
        return ONE_I
    if n > 0:
        lo, hi = _exp_wide(n)
        return lo >> (W - P), _ceil_shift(hi, W - P)
    if n < -_EXP_LIMIT:
        return 0, 1  # e^-2048 < 2^-128
    lo, hi = _exp_wide(-n)
    return (1 << (W + P)) // hi, _ceil_div(1 << (W + P), lo)


def _odd_series(z: int, sign: int) -> int:
    """Sum of sign^j z^(2j+1) / (2j+1) for 0 <= z < 0.21 w-scaled: atanh (1) or atan (-1).

    z^2 carries 1 w, each power e' <= 0.05 e + 0.21 + 1 < 2 w, each quotient one more; at most 50
    terms are not 0, and the dropped tail is below 1 w: less than 200 w in all.
    """
    square, term, total, j = (z * z) >> W, z, 0, 0
    while term:
        total += sign**j * (term // (2 * j + 1))
        term, j = (term * square) >> W, j + 1
    return total


def _log_point(n: int) -> Interval:
    """log(n / 2^P), n > 0: n = m 2^(P+k) with 2/3 <= m < 4/3, log = k ln 2 + 2 atanh(z).

    z = (m-1)/(m+1) lies in [-1/5, 1/7] and is one rounding off (its effect on atanh < 1.05 w);
    k ln 2 carries |k| <= 4300 w.
    """
    if n == ONE:
        return ZERO_I
    k = n.bit_length() - P
    if 3 * n < 2 << (P + k):
        k -= 1
    top = n - (1 << (P + k))
    z = (abs(top) << W) // (n + (1 << (P + k)))
    series = 2 * _odd_series(z, 1)
    return _narrow(k * _LN2_LO + (series if top >= 0 else -series), _SLACK)


def _atan_point(n: int) -> Interval:
    """atan: 1/x beyond 1, then twice atan y = 2 atan(y / (1 + sqrt(1 + y^2))), y < 0.2.

    Each step halves an error that it receives and adds at most 3 w; times 4 at the end.
    """
    if n == 0:
        return ZERO_I
    size = abs(n)
    y = (1 << (P + W)) // size if size > ONE else size << (W - P)
    for _ in range(2):
        y = (y << W) // (_WONE + math.isqrt((_WONE + ((y * y) >> W)) << W))
    value = 4 * _odd_series(y, -1)
    if size > ONE:
        value = (_HALF_PI[0] >> (_V - W)) - value
    return _narrow(value if n > 0 else -value, _SLACK)


@lru_cache(maxsize=1 << 14)
def _sin_cos_point(n: int) -> tuple[Interval, Interval]:
    """Sine and cosine, x = q pi/2 + r with |r| < 0.79, Taylor series of r.

    |x| < 2^64, so q < 2^65, and q times the error 2^-_V of pi/2 is far below 1 w: r is within
    2 w. Term j is |r|^j / j!; if one has the error e, the next has at most (0.79 e + 2 + 1) / 2
    + 1 < 5 w; 60 terms and a tail below 1 w: less than 400 w. (Were q off, |r| would be too
    large and the check below would refuse it.)
    """
    whole: Interval = (-ONE, ONE)
    if n == 0:
        return ZERO_I, ONE_I
    if abs(n) >= 1 << (P + 64):
        return whole, whole
    x = n << (_V - P)
    q = (2 * x + _HALF_PI[0]) // (2 * _HALF_PI[0])
    r = (x - q * _HALF_PI[0]) >> (_V - W)
    if 5 * abs(r) > 4 * _WONE:
        raise UndecidedError("argument reduction failed")
    sums = [0, 0]
    term, j = _WONE, 0
    while term:
        sums[j % 2] += -term if j % 4 > 1 else term
        j += 1
        term = ((term * abs(r)) >> W) // j
    sine, cosine = (sums[1] if r >= 0 else -sums[1]), sums[0]
    turned = ((sine, cosine), (cosine, -sine), (-sine, -cosine), (-cosine, sine))[q % 4]
    first, second = (_narrow(value, _SLACK) for value in turned)
    return (
        (max(first[0], -ONE), min(first[1], ONE)),
        (max(second[0], -ONE), min(second[1], ONE)),
    )


def _hits(a: Interval, offset: int, period: int) -> bool:
    """Whether (offset + k period) pi/2 may lie in a for some integer k; "no" is certain.

    With pi/2 in [H, H'], the multiples m with lo <= m pi/2 <= hi are among those from
    ceil(lo / H') (lo / H if lo < 0) to floor(hi / H) (hi / H' if hi < 0); 0 is treated exactly.
    """
    lo, hi = a[0] << (_V - P), a[1] << (_V - P)
    first = _ceil_div(lo, _HALF_PI[1] if lo >= 0 else _HALF_PI[0])
    last = hi // (_HALF_PI[0] if hi >= 0 else _HALF_PI[1])
    return first + (offset - first) % period <= last


def _wave(a: Interval, index: int) -> Interval:
    """Exact range of sin (0) or cos (1): -1 or 1 only where such a point may be inside."""
    first, last = _sin_cos_point(a[0])[index], _sin_cos_point(a[1])[index]
    return (
        -ONE if _hits(a, 3 - index, 4) else min(first[0], last[0]),
        ONE if _hits(a, 1 - index, 4) else max(first[1], last[1]),
    )


def tan(a: Interval) -> Interval:
    """Tangent inside one branch: where cos has no 0, which also bounds the width by pi."""
    cosine = _wave(a, 1)
    if cosine[0] <= 0 <= cosine[1]:
        raise UndecidedError("tan over an interval that contains a pole")
    ends = [div(*_sin_cos_point(end)) if end else ZERO_I for end in a]
    return ends[0][0], ends[1][1]


def log(a: Interval) -> Interval:
    """Natural logarithm of a positive interval."""
    if a[0] <= 0:
        raise UndecidedError("log of an interval with numbers that are not positive")
    return _log_point(a[0])[0], _log_point(a[1])[1]


def _odd(point: Callable[[int], Interval], a: Interval) -> Interval:
    """Increasing odd function from its values at n > 0; exactly 0 at 0."""
    lo, hi = (point(abs(end)) if end else ZERO_I for end in a)
    return max(0, lo[0]) if a[0] >= 0 else -lo[1], hi[1] if a[1] >= 0 else -max(0, hi[0])


def _tanh_point(n: int) -> Interval:
    """1 - 2 / (e^2x + 1), increasing in e^2x; 1 - tanh x < 2 e^-2x < 2^-128 beyond x = 64."""
    if n > 64 * ONE:
        return ONE - 1, ONE
    lo, hi = _exp_wide(2 * n)
    top = 1 << (2 * W + 1)
    return (
        (_WONE - _ceil_div(top, lo + _WONE)) >> (W - P),
        min(ONE, _ceil_shift(_WONE - top // (hi + _WONE), W - P)),
    )


def _sinh_point(n: int) -> Interval:
    """(e^x - e^-x) / 2, increasing in e^x."""
    lo, hi = _exp_wide(n)
    one = 1 << (2 * W)
    return (lo - _ceil_div(one, lo)) >> (W - P + 1), _ceil_shift(hi - one // hi, W - P + 1)


def cosh(a: Interval) -> Interval:
    """(e^|x| + e^-|x|) / 2, increasing in |x|; never below 1."""
    least, most = absolute(a)
    lo, hi = _exp_point(least), _exp_point(most)
    one = 1 << (2 * P)
    return max(ONE, (lo[0] + one // lo[0]) >> 1), _ceil_shift(hi[1] + _ceil_div(one, hi[1]), 1)


def _asinh_point(n: int) -> Interval:
    """log(x + sqrt(x^2 + 1)), increasing in x."""
    root = power(add(mul((n, n), (n, n)), ONE_I), Fraction(1, 2))
    return log(add((n, n), root))


def sign(a: Interval) -> Interval:
    """(sgn lo, sgn hi)."""
    lo, hi = ((end > 0) - (end < 0) for end in a)
    return lo * ONE, hi * ONE


FUNCTIONS: dict[str, Callable[[Interval], Interval]] = {
    "exp": lambda a: (_exp_point(a[0])[0], _exp_point(a[1])[1]),
    "log": log,
    "sin": lambda a: _wave(a, 0),
    "cos": lambda a: _wave(a, 1),
    "tan": tan,
    "sinh": lambda a: _odd(_sinh_point, a),
    "cosh": cosh,
    "tanh": lambda a: _odd(_tanh_point, a),
    "atan": lambda a: _odd(_atan_point, a),
    "asinh": lambda a: _odd(_asinh_point, a),
    "abs": absolute,
    "sign": sign,
}
exp, sin, cos, tanh = (FUNCTIONS[name] for name in ("exp", "sin", "cos", "tanh"))

# Derivatives from the argument x and the value y; abs at its kink has all slopes in [-1, 1],
# which is right for a function that is Lipschitz (Clarke's derivative).
_SLOPES: dict[str, Callable[[Interval, Interval], Interval]] = {
    "exp": lambda _, y: y,
    "log": lambda x, _: div(ONE_I, x),
    "sin": lambda x, _: cos(x),
    "cos": lambda x, _: neg(sin(x)),
    "tan": lambda _, y: add(ONE_I, power(y, Fraction(2))),
    "sinh": lambda x, _: cosh(x),
    "cosh": lambda x, _: FUNCTIONS["sinh"](x),
    "tanh": lambda _, y: sub(ONE_I, power(y, Fraction(2))),
    "atan": lambda x, _: div(ONE_I, add(ONE_I, power(x, Fraction(2)))),
    "asinh": lambda x, _: power(add(ONE_I, power(x, Fraction(2))), Fraction(-1, 2)),
    "abs": lambda x, _: sign(x),
}


def to_doubles(a: Interval) -> tuple[float, float]:
    """Enclose in binary64, outward: int / int rounds to nearest, then one step if inside."""
    largest = int(sys.float_info.max) * ONE
    lo, hi = (min(max(end, -largest), largest) / ONE for end in a)
    if Fraction(lo) * ONE > a[0]:
        lo = math.nextafter(lo, -math.inf)
    if Fraction(hi) * ONE < a[1]:
        hi = math.nextafter(hi, math.inf)
    return lo, hi


# ---------------------------------------------------------------------------------------------
# 2. Normal form. Equal factors are one power, equal terms one term: over a box, x*x is x^2 and
# x - x is 0. What cancels may have had a pole or a smaller domain (x/x, log x - log x): the parser
# keeps every such part, and the chain evaluates each of them over the reachable box as well. A
# symbol whose name begins with "+" is known to be nonnegative.


@dataclass(frozen=True, slots=True)
class Node:
    """An expression; ``text`` is canonical: equal texts are equal expressions.

    kind: num (number) | sym (name) | pi | sum (weights times args) | prod (args to the powers
    weights) | fun (name of args) | piece (relations[i] compares args[2i+1] with 0 for args[2i];
    the last arg is the default).
    """

    kind: str
    text: str
    args: tuple[Node, ...] = ()
    weights: tuple[Fraction, ...] = ()
    number: Fraction = Fraction(0)
    name: str = ""
    relations: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Keep expressions small, so that no document can keep the checker busy."""
        if len(self.text) > 60_000:
            raise UndecidedError("an expression beyond the size that is checked")


def num(value: Fraction | int) -> Node:
    """Rational number."""
    value = Fraction(value)
    if max(value.numerator.bit_length(), value.denominator.bit_length()) > 8192:
        raise UndecidedError("a constant beyond 8192 bits")
    return Node("num", str(value), number=value)


def sym(name: str) -> Node:
    """Symbol."""
    return Node("sym", name, name=name)


UNIT = num(1)
NOTHING = num(0)
PI = Node("pi", "pi")


def combine(terms: Iterable[tuple[Fraction | int, Node]]) -> Node:
    """Linear combination, like terms collected."""
    table: dict[str, tuple[Fraction, Node]] = {}
    for weight, node in terms:
        parts: Iterable[tuple[Fraction, Node]] = ((Fraction(1), node),)
        if node.kind == "sum":
            parts = zip(node.weights, node.args, strict=True)
        elif node.kind == "num":
            parts = ((node.number, UNIT),)
        for inner, core in parts:
            old = table.get(core.text, (Fraction(0), core))[0]
            table[core.text] = (old + weight * inner, core)
    kept = [table[key] for key in sorted(table) if table[key][0]]
    if not kept:
        return NOTHING
    if len(kept) == 1 and (kept[0][0] == 1 or kept[0][1].kind == "num"):
        return kept[0][1] if kept[0][0] == 1 else num(kept[0][0])
    for weight, _ in kept:
        num(weight)
    text = "(" + " + ".join(f"{weight}*{core.text}" for weight, core in kept) + ")"
    return Node("sum", text, tuple(core for _, core in kept), tuple(w for w, _ in kept))


def minus(a: Node, b: Node) -> Node:
    """Return a - b."""
    return combine([(1, a), (-1, b)])


def multiply(factors: Iterable[tuple[Node, Fraction | int]]) -> Node:
    """Product of powers, equal bases collected."""
    queue = [(base, Fraction(exponent)) for base, exponent in factors]
    coefficient = Fraction(1)
    table: dict[str, tuple[Node, Fraction]] = {}
    exponents: list[tuple[Fraction, Node]] = []
    while queue:
        base, e = queue.pop()
        whole = e.denominator == 1
        if e == 0:
            continue
        if base.kind == "num" and (whole or base.number in (0, 1)):
            if base.number == 0 and e < 0:
                raise UndecidedError("division by zero")
            if abs(e) * max(base.number.numerator.bit_length(), 1) > 20_000:
                raise UndecidedError("a constant beyond 8192 bits")
            coefficient *= base.number**e.numerator if whole else base.number
        elif base.kind == "sum" and len(base.args) == 1 and whole:
            queue += [(num(base.weights[0]), e), (base.args[0], e)]
        elif base.kind == "prod" and whole:
            queue += [(b, x * e) for b, x in zip(base.args, base.weights, strict=True)]
        elif base.name == "exp":
            exponents.append((e, base.args[0]))
        elif e.denominator % 2 == 0:
            queue.append((function(f"root{e.denominator}", (base,)), Fraction(e.numerator)))
        else:
            table[base.text] = (base, table.get(base.text, (base, Fraction(0)))[1] + e)
    again = _signed_powers(table)
    for key, (base, e) in list(table.items()):
        composite = base.kind in ("num", "prod") or (base.kind == "sum" and len(base.args) == 1)
        step = 2 if base.name == "abs" else int(base.name[4:] or 1) if _is_root(base) else 0
        if step and e and e % step == 0:
            again.append((base.args[0], e if base.name == "abs" else e / step))
        elif e.denominator == 1 and composite:
            again.append((base, e))
        else:
            continue
        del table[key]
    if again:
        rest = [*table.values(), *again, (num(coefficient), Fraction(1))]
        return multiply([*rest, *((function("exp", (a,)), e) for e, a in exponents)])
    grown = combine(exponents)
    if grown.text != "0":
        table["exp"] = (function("exp", (grown,)), Fraction(1))
    if coefficient == 0:
        return NOTHING
    kept = sorted((entry for entry in table.values() if entry[1]), key=lambda e: e[0].text)
    if not kept:
        return num(coefficient)
    core = kept[0][0]
    if len(kept) > 1 or kept[0][1] != 1:
        text = "*".join(f"{_base_text(base)}^({e})" for base, e in kept)
        core = Node("prod", text, tuple(b for b, _ in kept), tuple(e for _, e in kept))
    return combine([(coefficient, core)])


def _base_text(node: Node) -> str:
    # Without the brackets (x y)^(1/3) and x y^(1/3) would be the same text.
    return f"[{node.text}]" if node.kind in ("num", "prod") else node.text


def _is_root(node: Node) -> bool:
    return node.name.startswith("root") and node.kind == "fun"


def _signed_powers(table: dict[str, tuple[Node, Fraction]]) -> list[tuple[Node, Fraction]]:
    """Take x^m |x|^r sgn(x)^i, m, r >= 0, out of a product: it is one power of |x| or x.

    Odd parity gives sgn(x) |x|^(m+r), the increasing power that odd roots mean, even parity
    |x|^(m+r); so x |x| has the exact range, as docs/theory.md section 1 asks.
    """
    made: list[tuple[Node, Fraction]] = []
    for name, (outer, e) in list(table.items()):
        if outer.name not in ("abs", "sign") or e <= 0 or name not in table:
            continue
        base = outer.args[0]
        partners = [base.text, f"abs({base.text})"][: 1 if outer.name == "abs" else 2]
        found = [table[key] for key in partners if key in table and table[key][1] > 0]
        total = sum((f for _, f in found), e if outer.name == "abs" else Fraction(0))
        if not found or e.denominator > 1 or total.denominator % 2 == 0:
            continue
        odd = e.numerator * (outer.name == "sign")
        odd += sum(f.numerator for inner, f in found if inner.text == base.text)
        for key in [name, *(inner.text for inner, _ in found)]:
            del table[key]
        if odd % 2 == total.numerator % 2:
            made.append((base, total))
        elif odd % 2 == 0:
            made.append((function("abs", (base,)), total))
        else:
            made.append((function(f"signed{total}", (base,)), Fraction(1)))
    return made


_ODD = ("sin", "tan", "sinh", "tanh", "atan", "asinh", "sign")
_EVEN = ("cos", "cosh", "abs")
_AT_ZERO = {**dict.fromkeys(("cos", "cosh", "exp"), 1), **dict.fromkeys((*_ODD, "abs"), 0)}


def is_nonnegative(node: Node) -> bool:
    """Whether the form alone shows that the expression is >= 0 wherever it is defined."""
    if node.kind in ("num", "pi"):
        return node.number >= 0
    if node.kind == "sym":
        return node.name.startswith("+")
    if node.kind == "sum":
        return all(
            w > 0 and is_nonnegative(a) for w, a in zip(node.weights, node.args, strict=True)
        )
    if node.kind == "prod":
        return all(
            (e.numerator % 2 == 0) or is_nonnegative(a)
            for e, a in zip(node.weights, node.args, strict=True)
        )
    if node.name in ("sinh", "tanh", "atan", "asinh"):
        return is_nonnegative(node.args[0])
    return node.name in ("exp", "cosh", "abs") or node.name.startswith("root")


def function(name: str, args: Sequence[Node]) -> Node:
    """Value of a function, odd and even ones with the sign taken out, rational values folded."""
    a = args[0]
    if name in ("min", "max"):
        unique = {arg.text: arg for arg in args}
        values = [arg.number for arg in unique.values() if arg.kind == "num"]
        if len(values) > 1:
            best = min(values) if name == "min" else max(values)
            unique = {k: v for k, v in unique.items() if v.kind != "num"} | {str(best): num(best)}
        args = [unique[key] for key in sorted(unique)]
        if len(args) == 1:
            return args[0]
    elif a.kind == "num" and a.number == 0 and name in _AT_ZERO:
        return num(_AT_ZERO[name])
    elif name == "log" and a.text == "1":
        return NOTHING
    elif name == "sign" and a.kind == "num":
        return num(1 if a.number > 0 else -1)
    elif name in _ODD or name in _EVEN or name.startswith("signed"):
        leading = a.weights[0] if a.kind == "sum" else a.number
        if leading < 0:
            flipped = function(name, (combine([(-1, a)]),))
            return flipped if name in _EVEN else combine([(-1, flipped)])
        if name.startswith("signed") and is_nonnegative(a):
            return multiply([(a, Fraction(name[6:]))])
        if name == "abs":
            if is_nonnegative(a):
                return a
            if a.kind == "sum" and len(a.args) == 1:
                return combine([(abs(a.weights[0]), function("abs", a.args))])
            if a.kind == "prod" and all(e.denominator == 1 for e in a.weights):
                parts = zip(a.args, a.weights, strict=True)
                return multiply([(function("abs", (b,)), e) for b, e in parts])
    elif name.startswith("root") and a.kind == "num" and a.number >= 0:
        q = int(name[4:])
        top, bottom = (_root_floor(n, q) for n in (a.number.numerator, a.number.denominator))
        if (top**q, bottom**q) == (a.number.numerator, a.number.denominator):
            return num(Fraction(top, bottom))
    text = f"{name}({', '.join(arg.text for arg in args)})"
    return Node("fun", text, tuple(args), name=name)


def piecewise(branches: Sequence[tuple[Node, str, Node]], default: Node) -> Node:
    """Branches (value, relation, difference): value where difference relation 0, in order."""
    args = [node for value, _, difference in branches for node in (value, difference)]
    pieces = [f"{value.text} if {diff.text} {rel} 0" for value, rel, diff in branches]
    text = f"piece({', '.join([*pieces, default.text])})"
    relations = tuple(relation for _, relation, _ in branches)
    return Node("piece", text, (*args, default), relations=relations)


def rebuild(node: Node, args: Sequence[Node]) -> Node:
    """Return the node with other arguments, in normal form again."""
    if node.kind == "sum":
        return combine(zip(node.weights, args, strict=True))
    if node.kind == "prod":
        return multiply(zip(args, node.weights, strict=True))
    if node.kind == "fun":
        return function(node.name, args)
    if node.kind == "piece":
        pairs = zip(args[:-1:2], node.relations, args[1::2], strict=True)
        return piecewise(tuple(pairs), args[-1])
    return node


def substitute(node: Node, values: Mapping[str, Node]) -> Node:
    """Replace symbols."""
    if node.kind == "sym":
        return values.get(node.name, node)
    return rebuild(node, [substitute(arg, values) for arg in node.args])


def symbols(node: Node) -> frozenset[str]:
    """Names of the symbols in an expression."""
    if node.kind == "sym":
        return frozenset((node.name,))
    return frozenset().union(*(symbols(arg) for arg in node.args))


def derivative(node: Node, name: str) -> Node:
    """Differentiate; at kinks of abs, min, max any slope between the two sides will do."""
    if node.kind == "sym":
        return UNIT if node.name == name else NOTHING
    if name not in symbols(node):
        return NOTHING
    if node.kind == "sum":
        return combine(
            (w, derivative(a, name)) for w, a in zip(node.weights, node.args, strict=True)
        )
    if node.kind == "prod":
        factors = list(zip(node.args, node.weights, strict=True))
        return combine(
            (e, multiply([*factors[:j], *factors[j + 1 :], (a, e - 1), (derivative(a, name), 1)]))
            for j, (a, e) in enumerate(factors)
        )
    if node.kind == "piece" or node.name == "sign":
        raise UndecidedError(f"no derivative of {node.text}: it may jump")
    if node.name in ("min", "max"):
        first, *others = node.args
        rest = function(node.name, others)
        relation = "<" if node.name == "min" else ">"
        branch = (derivative(first, name), relation, minus(first, rest))
        return piecewise([branch], derivative(rest, name))
    a = node.args[0]
    if node.name.startswith(("root", "signed")):
        r = Fraction(1, int(node.name[4:])) if node.name[0] == "r" else Fraction(node.name[6:])
        base = a if node.name[0] == "r" else function("abs", (a,))
        outer = combine([(r, multiply([(base, r - 1)]))])
    else:
        outer = _outer_derivative(node, a)
    return multiply([(outer, 1), (derivative(a, name), 1)])


def _outer_derivative(node: Node, a: Node) -> Node:
    square = combine([(1, UNIT), (1, multiply([(a, 2)]))])
    table: dict[str, Callable[[], Node]] = {
        "exp": lambda: node,
        "log": lambda: multiply([(a, -1)]),
        "sin": lambda: function("cos", (a,)),
        "cos": lambda: combine([(-1, function("sin", (a,)))]),
        "tan": lambda: combine([(1, UNIT), (1, multiply([(node, 2)]))]),
        "sinh": lambda: function("cosh", (a,)),
        "cosh": lambda: function("sinh", (a,)),
        "tanh": lambda: combine([(1, UNIT), (-1, multiply([(node, 2)]))]),
        "atan": lambda: multiply([(square, -1)]),
        "asinh": lambda: multiply([(square, Fraction(-1, 2))]),
        "abs": lambda: function("sign", (a,)),
    }
    return table[node.name]()


# ---------------------------------------------------------------------------------------------
# 3. Parser: the grammar of the plant file, by recursive descent. Nothing is ever evaluated.

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)|(?P<sign>\*\*|<=|>=|[-+*/^(),<>]))",
    re.ASCII,
)
_ALIASES = {"Abs": "abs", "ln": "log", "Min": "min", "Max": "max", "sqrt": "root2"}


def read_number(text: str) -> Fraction:
    """Exact value of an unsigned decimal, its size judged before it is built."""
    digits = re.sub(r"[eE].*", "", text)
    exponent = text[len(digits) + 1 :]
    if len(digits) > 400 or len(exponent) > 5 or abs(int(exponent or "0")) > 700:
        raise MalformedError(f"a number beyond the size that is read: {text[:40]}")
    return Fraction(text)


class Parser:
    """One text, read once from left to right."""

    def __init__(self, text: str, names: Mapping[str, Node]) -> None:
        if len(text) > 4000:
            raise MalformedError(f"an expression of {len(text)} characters")
        self._text, self._names = text, names
        self.partial: list[Node] = []
        self._at = self._depth = 0
        self._kind = self._word = ""
        self._advance()

    def parse(self) -> Node:
        """Read all of the text."""
        node = self._sum()
        if self._kind != "end":
            raise self._error(f"`{self._word}` is out of place")
        return node

    def _error(self, what: str) -> MalformedError:
        return MalformedError(f"`{self._text[:80]}`: {what}")

    def _advance(self) -> str:
        """Move to the next token; return the one left."""
        left = self._word
        match = _TOKEN.match(self._text, self._at)
        if match is None:
            if self._text[self._at :].strip():
                raise self._error(f"`{self._text[self._at :].strip()[:1]}` is out of place")
            self._kind, self._word = "end", ""
            return left
        self._at = match.end()
        self._kind = match.lastgroup or ""
        self._word = match.group(self._kind)
        return left

    def _accept(self, *signs: str) -> str:
        return self._advance() if self._kind == "sign" and self._word in signs else ""

    def _expect(self, sign: str) -> None:
        if not self._accept(sign):
            raise self._error(f"`{sign}` is missing")

    def _sum(self) -> Node:
        self._depth += 1
        if self._depth > 80:
            raise self._error("nested too deeply")
        terms = [(1, self._product())]
        while accepted := self._accept("+", "-"):
            terms.append((1 if accepted == "+" else -1, self._product()))
        self._depth -= 1
        return combine(terms)

    def _product(self) -> Node:
        factors = [(self._signed(), 1)]
        while accepted := self._accept("*", "/"):
            factors.append((self._signed(), 1 if accepted == "*" else -1))
            if accepted == "/":
                self.partial.append(multiply([factors[-1]]))
        return multiply(factors)

    def _signed(self) -> Node:
        self._depth += 1
        if self._depth > 80:
            raise self._error("nested too deeply")
        if accepted := self._accept("+", "-"):
            node = combine([(1 if accepted == "+" else -1, self._signed())])
        else:
            node = self._power()
        self._depth -= 1
        return node

    def _power(self) -> Node:
        base = self._atom()
        if not self._accept("**", "^"):
            return base
        exponent = self._signed()
        if base.text == "exp(1)":
            return function("exp", (exponent,))
        if exponent.kind != "num":
            raise self._error("an exponent that is no rational number")
        if abs(exponent.number) > 64 or exponent.number.denominator > 1000:
            raise self._error(f"the exponent {exponent.number}")
        self.partial.append(multiply([(base, exponent.number)]))
        return self.partial[-1]

    def _atom(self) -> Node:
        if self._kind == "number":
            return num(read_number(self._advance()))
        if self._accept("("):
            node = self._sum()
            self._expect(")")
            return node
        if self._kind != "name":
            raise self._error(f"`{self._word or 'the end'}` where a number or a name belongs")
        name = self._advance()
        if not self._accept("("):
            if name in ("pi", "E"):
                return PI if name == "pi" else function("exp", (UNIT,))
            if name not in self._names:
                raise self._error(f"the name {name} is not known here")
            return self._names[name]
        node = self._branches() if name == "Piecewise" else self._call(_ALIASES.get(name, name))
        self._expect(")")
        return node

    def _call(self, name: str) -> Node:
        args = [self._sum()]
        while self._accept(","):
            args.append(self._sum())
        if name not in ("min", "max", "root2", *FUNCTIONS):
            raise self._error(f"the function {name} is not known")
        if (len(args) == 1) == (name in ("min", "max")):
            raise self._error(f"{name} with {len(args)} arguments")
        self.partial.append(function(name, args))
        return self.partial[-1]

    def _branches(self) -> Node:
        branches: list[tuple[Node, str, Node]] = []
        while True:
            self._expect("(")
            value = self._sum()
            self._expect(",")
            if self._kind == "name" and self._word == "True":
                self._advance()
                self._expect(")")
                return piecewise(branches, value) if branches else value
            left = self._sum()
            relation = self._accept("<", "<=", ">", ">=")
            if not relation:
                raise self._error("a condition that is no comparison")
            branches.append((value, relation, minus(left, self._sum())))
            self._expect(")")
            self._expect(",")


def parse(text: str, names: Mapping[str, Node]) -> Node:
    """Read an expression of the plant file into normal form."""
    return Parser(text, names).parse()


# ---------------------------------------------------------------------------------------------
# 4. Tape: an expression compiled once and evaluated over many boxes.

Box = tuple[Interval, ...]
Gradient = dict[int, Interval]

# Error and range of the portable functions, with the code that they are about: section 9b.
# name: (roundings in binary64, in binary32, end of the argument in binary64, in binary32)
_PORTABLE_BOUNDS = {
    "tanh": (16, 10, 1 << 1000, 1 << 120),
    "exp": (6, 6, 690, 83),
    "sin": (3, 3, 200_000_000, 6_400),
    "cos": (3, 3, 200_000_000, 6_400),
    "abs": (0, 0, 1 << 1000, 1 << 120),
}


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """What the controllers compute with: double or float, functions of the libm or portable.

    One rounding is at most 2^-bits of its result, 4 ulp are at most 8 of these; what underflows
    is below 2^-149, and 1 in the last place here is far more.
    """

    real: str = "double"
    math: str = "libm"

    @property
    def single(self) -> bool:
        """Whether numbers are binary32."""
        return self.real == "float"

    @property
    def bits(self) -> int:
        """Bits of the significand."""
        return 24 if self.single else 53

    @property
    def largest(self) -> int:
        """Nothing that is computed may come near the end of the range."""
        return 1 << (P + (120 if self.single else 1000))

    def rounded(self, value: Fraction) -> Fraction:
        """Round to the nearest number, for a value that float() takes without doubt."""
        near = float(value)
        if self.single:
            (near,) = struct.unpack("f", struct.pack("f", near))
        return Fraction(near)

    def within(self, size: int) -> None:
        """Refuse what might overflow."""
        if size > self.largest:
            power_of_two = 120 if self.single else 1000
            name = "binary32" if self.single else "binary64"
            raise UndecidedError(f"a number beyond 2^{power_of_two}: {name} could overflow")

    def function(self, name: str, argument: Interval, size: int) -> int:
        """Bound the error of a function itself: roundings times the size that is rounded."""
        root = name.startswith(("root", "signed", "pow"))
        if self.math == "libm":
            return (800 if root else 8) * size
        if name not in _PORTABLE_BOUNDS:
            raise UndecidedError(f"{'a root' if root else name} has no portable form")
        bounds = _PORTABLE_BOUNDS[name]
        end = bounds[2 + self.single]
        low = -(1 << 4096) if name == "exp" else -end
        if not low * ONE <= argument[0] <= argument[1] <= end * ONE:
            raise UndecidedError(f"portable {name} of an argument beyond {end}")
        # Far from 0 a wave may vanish where its error does not; e^v below the range is not 0.
        size = ONE if name in ("sin", "cos") else size
        return bounds[self.single] * size + (8 << self.bits)


_DEFAULT = Arithmetic()


def _call(name: str, args: Sequence[Interval]) -> Interval:
    if name == "min":
        return min(a[0] for a in args), min(a[1] for a in args)
    if name == "max":
        return max(a[0] for a in args), max(a[1] for a in args)
    if name.startswith("root"):
        return power(args[0], Fraction(1, int(name[4:])))
    if name.startswith("signed"):
        lo, hi = (power(absolute((end, end)), Fraction(name[6:])) for end in args[0])
        return (lo[0] if args[0][0] >= 0 else -lo[1], hi[1] if args[0][1] >= 0 else -hi[0])
    return FUNCTIONS[name](args[0])


def _slope(name: str, x: Interval, y: Interval) -> Interval:
    if name == "sign" and x[0] <= 0 <= x[1]:
        raise UndecidedError("sign jumps")
    if name == "sign":
        return ZERO_I
    if name.startswith("root"):
        q = int(name[4:])
        return scale(Fraction(1, q), power(y, Fraction(1 - q)))
    if name.startswith("signed"):
        r = Fraction(name[6:])
        return scale(r, power(absolute(x), r - 1))
    return _SLOPES[name](x, y)


def _reachable(relation: str, difference: Interval) -> tuple[bool, bool]:
    """Whether a condition can be true, and whether it can be false."""
    lo, hi = difference if relation[0] == "<" else neg(difference)
    return (lo <= 0, hi > 0) if relation[1:] else (lo < 0, hi >= 0)


@dataclass(frozen=True, slots=True)
class Bound:
    """Upper bound over a box; ``sample`` is at most the value at ``point``, a point of the box.

    The maximum is on ``face``; ``cuts`` are the dimensions worth cutting, the best one first.
    """

    upper: int
    sample: int
    point: Box
    face: Box
    cuts: tuple[int, ...]


class Tape:
    """Values, gradients and rounding errors of one expression; names give the box's order."""

    def __init__(self, node: Node, names: Sequence[str]) -> None:
        self._index = {name: j for j, name in enumerate(names)}
        self._places: dict[str, int] = {}
        self._code: list[tuple[Node, tuple[int, ...]]] = []
        self._fixed: list[Interval | None] = []
        self._visit(node)

    def _visit(self, node: Node) -> int:
        if node.text not in self._places:
            places = tuple(self._visit(arg) for arg in node.args)
            fixed: Interval | None = None
            args = [arg for arg in (self._fixed[place] for place in places) if arg is not None]
            if node.kind != "sym" and len(args) == len(places):
                fixed = self._operation(node, args, ())
            elif node.kind == "sym" and node.name not in self._index:
                raise MalformedError(f"the name {node.name} is not known here")
            self._places[node.text] = len(self._code)
            self._code.append((node, places))
            self._fixed.append(fixed)
        return self._places[node.text]

    def value(self, box: Box) -> Interval:
        """Natural interval extension."""
        return self._values(box)[-1]

    def size(self, box: Box) -> int:
        """Bound the modulus over a box."""
        return absolute(self.value(box))[1]

    def _values(self, box: Box) -> list[Interval]:
        values: list[Interval] = []
        for (node, places), fixed in zip(self._code, self._fixed, strict=True):
            if fixed is None:
                fixed = self._operation(node, [values[place] for place in places], box)  # noqa: PLW2901
            values.append(fixed)
        return values

    def _operation(self, node: Node, args: list[Interval], box: Box) -> Interval:
        if node.kind == "sym":
            return box[self._index[node.name]]
        if node.kind == "sum":
            return checked(*total(map(scale, node.weights, args)))
        if node.kind == "prod":
            result = power(args[0], node.weights[0])
            for arg, e in zip(args[1:], node.weights[1:], strict=True):
                result = mul(result, arg if e == 1 else power(arg, e))
            return result
        if node.kind == "fun":
            return _call(node.name, args)
        if node.kind == "piece":
            found = None
            for arg in self._branches(node, args):
                found = arg if found is None else hull(found, arg)
            return found or args[-1]
        return PI_I if node.kind == "pi" else from_fraction(node.number)

    @staticmethod
    def _branches(node: Node, args: Sequence[Any], values: Sequence[Interval] = ()) -> list[Any]:
        """Return the args (values, or what belongs to them) of the branches that can be taken."""
        taken: list[Any] = []
        values = values or args
        for j, relation in enumerate(node.relations):
            can_be_true, can_be_false = _reachable(relation, values[2 * j + 1])
            if can_be_true:
                taken.append(args[2 * j])
            if not can_be_false:
                return taken
        return [*taken, args[-1]]

    def gradient(self, box: Box) -> tuple[Interval, Gradient]:
        """Value and enclosure of all slopes over the box (forward mode); absent ones are 0.

        Raises UndecidedError where a slope is unbounded or the expression may jump.
        """
        values = self._values(box)
        slopes: list[Gradient] = []
        for (node, places), y in zip(self._code, values, strict=True):
            args = [values[place] for place in places]
            inner = [slopes[place] for place in places]
            result: Gradient = {}
            if node.kind == "sym":
                result = {self._index[node.name]: ONE_I}
            elif node.kind == "sum":
                for weight, slope in zip(node.weights, inner, strict=True):
                    for j, part in slope.items():
                        result[j] = add(result.get(j, ZERO_I), scale(weight, part))
            elif node.kind == "prod":
                for k, slope in enumerate(inner):
                    if slope:
                        _accumulate(result, slope, self._cofactor(node, args, k))
            elif node.name in ("min", "max"):
                result = _gradient_hull(inner)
            elif node.kind == "piece":
                taken = self._branches(node, inner, args)
                if len(taken) > 1:
                    raise UndecidedError("a Piecewise may jump")
                result = taken[0]
            elif node.kind == "fun" and inner[0]:
                _accumulate(result, inner[0], _slope(node.name, args[0], y))
            slopes.append(result)
        return values[-1], slopes[-1]

    @staticmethod
    def _cofactor(node: Node, args: Sequence[Interval], j: int) -> Interval:
        e = node.weights[j]
        result = scale(e, power(args[j], e - 1))
        for k, (arg, other) in enumerate(zip(args, node.weights, strict=True)):
            if k != j:
                result = mul(result, power(arg, other))
        return result

    def rounding(self, box: Box, errors: Sequence[int], arithmetic: Arithmetic = _DEFAULT) -> int:
        """Bound the error of an evaluation in floating point, in units of 2^-P.

        errors[j] bounds that of input j. Every operation passes on the errors of its operands
        times its largest slope over the widened operands (mean value theorem) and adds its own:
        a constant 1 rounding; a coefficient 2 (itself and a product) and a sum of m terms, in any
        order, m - 1 of at most the sum of sizes; a factor to the power e as products |e| - 1, a
        division or a product 1; pow, whose exponent is rounded too, 4 ulp and |log x| < 746
        roundings; a function as ``Arithmetic.function``. All is doubled for second order.
        """
        values = self._values(box)
        found: list[int] = []
        for (node, places), y in zip(self._code, values, strict=True):
            inner = [found[place] for place in places]
            pairs = zip((values[place] for place in places), inner, strict=True)
            wide = [(a[0] - d, a[1] + d) for a, d in pairs]
            if node.kind == "sym":
                found.append(errors[self._index[node.name]])
                continue
            if node.kind == "piece" or node.name == "sign":
                raise UndecidedError("no rounding error of an expression that may jump")
            size = absolute(self._operation(node, wide, ()) if wide else y)[1]
            passed, count, own, steps = 0, 2, 0, [size]
            if node.kind == "sum":
                parts = list(zip(node.weights, wide, inner, strict=True))
                passed = sum(absolute(scale(w, (d, d)))[1] for w, _, d in parts)
                size = sum(absolute(scale(w, a))[1] for w, a, _ in parts)
                steps += [size, *(absolute(a)[1] for a in wide)]
                count = len(parts) + 2
            elif node.kind == "prod":
                largest = ONE_I
                for a, e in zip(wide, node.weights, strict=True):
                    # A factor below 1 must not hide an overflow of the others, in any order.
                    factor = absolute(power(absolute(a), abs(e)))[1]
                    steps.append(factor)
                    largest = mul(largest, (max(ONE, factor),) * 2)
                steps.append(largest[1])
                for j, d in enumerate(inner):
                    e = node.weights[j]
                    count += int(abs(e)) + 2
                    if e.denominator > 1:
                        own += arithmetic.function("pow", ZERO_I, size)
                    passed += mul((d, d), absolute(self._cofactor(node, wide, j)))[1] if d else 0
            elif node.name in ("min", "max"):
                passed, count = max(inner), 0
            elif node.kind == "fun":
                slope = absolute(_slope(node.name, wide[0], _call(node.name, wide)))
                passed = mul((inner[0], inner[0]), slope)[1] if inner[0] else 0
                count, own = 0, arithmetic.function(node.name, wide[0], size)
            arithmetic.within(max(steps))
            found.append(passed + _ceil_shift(2 * (count * size + own), arithmetic.bits) + 1)
        return found[-1]

    def bound(self, box: Box) -> Bound:
        """Bound the expression over a box from above.

        Where a slope has one sign the maximum is on that face; over what remains also by the
        mean value theorem around the middle (docs/theory.md section 6).
        """
        try:
            value, slopes = self.gradient(box)
        except UndecidedError:
            middle = tuple(((lo + hi) >> 1,) * 2 for lo, hi in box)
            cuts = sorted(range(len(box)), key=lambda j: box[j][0] - box[j][1])
            wide = tuple(j for j in cuts if box[j][0] < box[j][1])
            return Bound(self.value(box)[1], self.value(middle)[0], middle, box, wide)
        face, centre = list(box), list(box)
        open_: list[int] = []
        for j, slope in slopes.items():
            if slope[0] < 0 < slope[1] and box[j][0] < box[j][1]:
                open_.append(j)
                centre[j] = ((box[j][0] + box[j][1]) >> 1,) * 2
            else:
                face[j] = centre[j] = (box[j][slope[0] >= 0],) * 2
        sample = reach = self.value(tuple(centre))
        best = min(value[1], self.value(tuple(face))[1]) if face != list(box) else value[1]
        for j in open_:
            reach = add(reach, mul(slopes[j], sub(box[j], centre[j])))
        # What matters most is cut first.
        open_.sort(key=lambda j: (box[j][0] - box[j][1]) * (slopes[j][1] - slopes[j][0]))
        return Bound(min(best, reach[1]), sample[0], tuple(centre), tuple(face), tuple(open_))


class Steep(Tape):
    """A tape with slopes in reverse, for many symbols.

    Where a box has no value yet, its ``first`` dimensions are cut before the others.
    """

    first = 0

    def gradient(self, box: Box) -> tuple[Interval, Gradient]:
        """Value and enclosure of all slopes over the box: each place's factor on the result.

        An arg of min or max that may be the extreme one has a weight in [0, 1].
        """
        values = self._values(box)
        factors: list[Interval | None] = [None] * len(values)
        factors[-1] = ONE_I
        result: Gradient = {}

        def pass_on(place: int, factor: Interval) -> None:
            before = factors[place]
            factors[place] = factor if before is None else add(before, factor)

        for place in range(len(values) - 1, -1, -1):
            (node, places), factor = self._code[place], factors[place]
            if factor is None or self._fixed[place] is not None:
                continue
            args = [values[inner] for inner in places]
            if node.kind == "sym":
                result[self._index[node.name]] = factor
            elif node.kind == "sum":
                for weight, inner in zip(node.weights, places, strict=True):
                    pass_on(inner, scale(weight, factor))
            elif node.kind == "prod":
                for k, inner in enumerate(places):
                    if self._fixed[inner] is None:
                        pass_on(inner, self._times(node, args, k, factor))
            elif node.name in ("min", "max"):
                side = -1 if node.name == "min" else 1
                ends = [a if side > 0 else neg(a) for a in args]
                worst = max(lo for lo, _ in ends)
                taken = [inner for inner, a in zip(places, ends, strict=True) if a[1] >= worst]
                for inner in taken:
                    pass_on(inner, factor if len(taken) == 1 else hull(factor, ZERO_I))
            elif node.kind == "piece":
                branch = self._branches(node, places, args)
                if len(branch) > 1:
                    raise UndecidedError("a Piecewise may jump")
                pass_on(branch[0], factor)
            else:
                pass_on(places[0], mul(factor, _slope(node.name, args[0], values[place])))
        return values[-1], result

    @staticmethod
    def _times(node: Node, args: Sequence[Interval], j: int, factor: Interval) -> Interval:
        """Return the factor times the slope of a product by one of its args."""
        for k, (arg, e) in enumerate(zip(args, node.weights, strict=True)):
            if k != j:
                factor = mul(factor, arg if e == 1 else power(arg, e))
            elif e != 1:
                factor = mul(factor, scale(e, power(arg, e - 1)))
        return factor

    def bound(self, box: Box) -> Bound:
        """Bound from above; what is known to be on a face is bounded there once more.

        By the mean value theorem around the middle of what is left (docs/theory.md section 6).
        """
        face, value = box, None
        slopes: Gradient = {}
        try:
            while True:
                value, slopes = self.gradient(face)
                steep = [
                    j
                    for j, slope in slopes.items()
                    if (slope[0] >= 0 or slope[1] <= 0) and face[j][0] < face[j][1]
                ]
                if not steep:
                    break
                ends = list(face)
                for j in steep:
                    ends[j] = (face[j][slopes[j][0] >= 0],) * 2
                face = tuple(ends)
        except UndecidedError:
            return self._coarse(box)
        centre = tuple(((lo + hi) >> 1,) * 2 for lo, hi in face)
        sample = reach = self.value(centre)
        open_: list[tuple[int, int]] = []
        for j, slope in slopes.items():
            if face[j][0] < face[j][1]:
                moved = mul(slope, sub(face[j], centre[j]))
                reach = add(reach, moved)
                open_.append(((face[j][0] - face[j][1]) * (slope[1] - slope[0]), j))
        cuts = tuple(j for _, j in sorted(open_))
        return Bound(min(value[1], reach[1]), sample[0], centre, face, cuts)

    def size(self, box: Box) -> int:
        """Modulus in the middle: over all of the box there may be no value yet."""
        return abs(self._coarse(box).sample)

    def _coarse(self, box: Box) -> Bound:
        """Bound without slopes; without a value too, as long as a cut may still give one."""
        middle = tuple(((lo + hi) >> 1,) * 2 for lo, hi in box)
        values: list[Interval] = []
        for part in (box, middle):
            try:
                values.append(self.value(part))
            except UndecidedError:
                values.append((-_LARGEST, _LARGEST))
        wide = [j for j, (lo, hi) in enumerate(box) if lo < hi]
        wide.sort(key=lambda j: (j >= self.first, box[j][0] - box[j][1]))
        return Bound(values[0][1], values[1][0], middle, box, tuple(wide))


def _accumulate(result: Gradient, slopes: Gradient, factor: Interval) -> None:
    for j, slope in slopes.items():
        result[j] = add(result.get(j, ZERO_I), mul(factor, slope))


def _gradient_hull(gradients: Sequence[Gradient]) -> Gradient:
    keys = sorted(set().union(*gradients))
    result: Gradient = {}
    for j in keys:
        slopes = [g.get(j, ZERO_I) for g in gradients]
        result[j] = (min(s[0] for s in slopes), max(s[1] for s in slopes))
    return result


def halves(box: Box, j: int) -> tuple[Box, Box]:
    """Cut a box at the middle of dimension j; both parts contain the cut."""
    lo, hi = box[j]
    cut = (lo + hi) >> 1
    return (*box[:j], (lo, cut), *box[j + 1 :]), (*box[:j], (cut, hi), *box[j + 1 :])


def maximize(tape: Tape, box: Box, known: int | None, boxes: int) -> tuple[Interval, Box]:
    """Enclose max(known, supremum) and name the best point: best first bisection.

    It stops within 2^-33 of the largest size over the box, or when the boxes are used up; the
    upper end is a bound at any time.
    """
    first = tape.bound(box)
    point, best = first.point, first.sample if known is None else max(known, first.sample)
    tolerance = max(tape.size(box) >> 33, 1 << 20)
    heap = [(-first.upper, 0, first)]
    for count in range(1, 2 * boxes, 2):
        top, _, whole = heap[0]
        if -top <= best + tolerance or not whole.cuts:
            break
        heapq.heappop(heap)
        for k, part in enumerate(halves(whole.face, whole.cuts[0])):
            found = tape.bound(part)
            if found.sample > best:
                best, point = found.sample, found.point
            heapq.heappush(heap, (-min(found.upper, -top), count + k, found))
    return (best, max(best, -heap[0][0])), point


def supremum(tape: Tape, box: Box, known: int | None = None, boxes: int = 1000) -> Interval:
    """Enclose max(known, supremum) over a box."""
    return maximize(tape, box, known, boxes)[0]


Extremes = tuple[Interval, Interval]  # enclosures of the infimum and of the supremum


def merge(a: Extremes, b: Extremes) -> Extremes:
    """Return infimum and supremum over the union of two sets."""
    low, high = (_call("min", (a[0], b[0])), _call("max", (a[1], b[1])))
    return low, high


def extremes(
    node: Node, ranges: Mapping[str, Interval], known: Extremes | None = None, boxes: int = 1000
) -> Extremes:
    """Enclose infimum and supremum over the ranges, joined with what is known of other sets."""
    names = sorted(symbols(node))
    box = tuple(ranges[name] for name in names)
    floor, ceiling = (-known[0][1], known[1][0]) if known else (None, None)
    low = supremum(Tape(combine([(-1, node)]), names), box, floor, boxes)
    high = supremum(Tape(node, names), box, ceiling, boxes)
    found = neg(low), high
    return merge(found, known) if known else found


# ---------------------------------------------------------------------------------------------
# 5. Plant: plant.json, every scalar as its source text, with the defaults of the plant file.


@dataclass(frozen=True, slots=True)
class Channel:
    """dx_i = f + g x_{i+1} + d; what the file does not give is None (g is 1 without any bound).

    ``partial`` are the parts of all of them that may not be defined everywhere.
    """

    disturbance: Node
    partial: tuple[Node, ...]
    f: Node | None
    g: Node | None
    f_bound: Node | None
    g_bound: Node | None
    g_min: Node | None


@dataclass(frozen=True, slots=True)
class Rho:
    """Performance function (52) or (53): node in t up to ``end`` (then 0; None: for ever)."""

    node: Node
    end: Interval | None
    floor: Interval
    rate: Interval


Fixed = tuple[tuple[str, Interval], ...]
Chosen = tuple[str, float]  # accuracy, period or resolution; p_1, h [s] or the factor on the steps


@dataclass(frozen=True, slots=True)
class Problem:
    """A plant file as the theorems need it.

    ``fixed`` are the numbers that the design must keep, by the names of its constants; ``free``
    counts the stages of theorem3 below the last one. ``arithmetic`` is the design's, and so is
    ``chosen``: what the file's objective leaves to it, already in the place of the file's value.
    """

    name: str
    method: str
    anchor: str
    handover: str
    free: int
    states: tuple[str, ...]
    ranges: dict[str, Interval]
    channels: tuple[Channel, ...]
    reference: Node | None
    reference_bounds: tuple[Interval, Interval] | None
    starts: tuple[Interval, ...]
    offset: Interval | None
    accuracy: Interval
    rhos: tuple[Rho, ...]
    delta: tuple[Interval, ...]
    period: Interval
    delay: Interval
    actuator_error: Interval
    limit: Interval | None
    fixed: Fixed
    center: str
    bounds: str
    derivatives: tuple[Interval, ...]
    funnel: Node | None
    arithmetic: Arithmetic = _DEFAULT
    chosen: Chosen | None = None

    @property
    def latest(self) -> int:
        """What t - t_0 stays below, in binary32 t too: there one ulp is at most period/16."""
        if not self.arithmetic.single:
            return 10**6 * ONE
        if self.period[1] == 0:
            return 64 * ONE
        ulp = (self.period[0] + self.period[1]) >> 5
        return min(1 << (max(ulp, 1).bit_length() - 1 + 24), ONE << 20)


def fields(value: object, path: str, required: str, optional: str = "") -> dict[str, Any]:
    """Return a mapping whose keys are all known and, where required, present."""
    if not isinstance(value, Mapping):
        raise MalformedError(f"{path}: a mapping is expected")
    known = {*required.split(), *optional.split()}
    for key in value:
        if key not in known:
            raise MalformedError(f"{path}: the key {key!r} is not known to this checker")
    for key in required.split():
        if key not in value:
            raise MalformedError(f"{path}: the key {key!r} is missing")
    return dict(value)


def text_of(value: object, path: str) -> str:
    """Return a scalar as its source text."""
    if not isinstance(value, str):
        raise MalformedError(f"{path}: a scalar as its source text is expected")
    return value


def constant(value: object, path: str) -> Interval:
    """Enclose a number or a constant expression."""
    return Tape(constant_node(value, path), ()).value(())


def constant_node(value: object, path: str) -> Node:
    """Read a number or a constant expression."""
    try:
        parser = Parser(text_of(value, path), {})
        node = parser.parse()
    except MalformedError as error:
        raise MalformedError(f"{path}: {error}") from None
    for part in parser.partial:
        Tape(part, ()).value(())
    return node


def at_least(least: int, value: object, path: str) -> Interval:
    """Enclose a constant that must not be below a number (in units of 2^-P)."""
    result = constant(value, path)
    if result[0] < least:
        raise MalformedError(f"{path}: {value} is too small")
    return result


def interval_of(value: object, path: str) -> Interval:
    """Read a number, or a range [lower, upper]; an empty range is refused."""
    if not isinstance(value, Sequence) or isinstance(value, str):
        return constant(value, path)
    if len(value) != 2:
        raise MalformedError(f"{path}: a range has two ends")
    lo, hi = (constant(end, path) for end in value)
    if lo[0] > hi[1]:
        raise MalformedError(f"{path}: the range is empty")
    return lo[0], hi[1]


def each_state(
    section: Mapping[str, Any], key: str, states: Sequence[str], default: Any
) -> list[Any]:
    """Return one entry per state, from one for all or from a mapping by states."""
    value, path = section.get(key, default), key
    if not isinstance(value, Mapping) or "kind" in value:
        return [value] * len(states)
    by_state = fields(value, path, "", " ".join(states))
    return [by_state.get(state, default) for state in states]


def read_plant(document: object, chosen: Chosen | None = None) -> Problem:
    """Read plant.json, with the value that its objective leaves to the design.

    Raises
    ------
    MalformedError
        If it is no plant, or asks for a promise that this checker cannot prove.
    """
    top = fields(document, "plant.json", "format plant_sha256 plant")
    if top["format"] != PLANT_FORMAT:
        raise MalformedError(f"plant.json: format {top['format']!r}, not {PLANT_FORMAT!r}")
    plant = fields(
        top["plant"],
        "plant",
        "name states dynamics initial performance",
        "title units parameters reference measurement sampling actuator synthesis simulation",
    )
    states = _states(plant["states"])
    synthesis = _synthesis(plant.get("synthesis", {}))
    names, ranges = _parameters(plant.get("parameters", {}), states)
    sought = _sought(synthesis.get("objective", "balanced"))
    if sought != (None if chosen is None else chosen[0]):
        raise MalformedError("design.chosen: not what the objective of the file leaves open")
    value = None if chosen is None else Fraction(chosen[1])
    asked = "accuracy" if sought != "accuracy" else ""
    performance = fields(
        plant["performance"], "performance", asked, "accuracy rho transition funnel"
    )
    initial = fields(plant["initial"], "initial", " ".join(states), "offset")
    reference, bounds = _reference(plant.get("reference", "0"))
    sampling = fields(plant.get("sampling", {}), "sampling", "", "period delay")
    actuator = fields(plant.get("actuator", {}), "actuator", "", "limit error")
    offset = "offset" in initial and "offset" not in states
    if offset and reference is not None:
        raise MalformedError("initial.offset: only with a reference supplied at run time")
    rhos = each_state(performance, "rho", states, {"kind": "cosine", "t_s": "1"})
    stages = _free_stages(synthesis)
    problem = Problem(
        name=_plant_name(plant["name"]),
        method=synthesis["method"],
        anchor=synthesis["anchor"],
        handover=synthesis["handover"],
        free=len(stages),
        states=states,
        ranges=ranges,
        channels=_channels(plant["dynamics"], states, names),
        reference=reference,
        reference_bounds=bounds,
        starts=tuple(interval_of(initial[state], f"initial.{state}") for state in states),
        offset=at_least(0, initial["offset"], "initial.offset") if offset else None,
        accuracy=_accuracy(performance, value if sought == "accuracy" else None),
        rhos=tuple(_rho(rho) for rho in rhos),
        delta=_resolutions(
            plant.get("measurement", {}), states, value if sought == "resolution" else None
        ),
        period=_period(sampling, value if sought == "period" else None),
        delay=at_least(0, sampling.get("delay", "0"), "sampling.delay"),
        actuator_error=at_least(0, actuator.get("error", "0"), "actuator.error"),
        limit=at_least(1, actuator["limit"], "actuator.limit") if "limit" in actuator else None,
        fixed=(
            *_fixed(synthesis, states),
            *_fixed_stages(stages, states),
            *_fixed_duration(synthesis, performance),
        ),
        center=synthesis["center"],
        bounds=synthesis["bounds"],
        derivatives=_derivatives(plant.get("reference", "0")),
        funnel=_over_time(text_of(performance["funnel"], "performance.funnel"))
        if "funnel" in performance
        else None,
        chosen=chosen,
    )
    if problem.center == "nominal":
        _check_nominal(problem)
    timing = (problem.period, problem.delay, problem.actuator_error)
    if problem.method == "theorem2" and any(a[1] for a in (*problem.delta, *timing)):
        raise MalformedError("theorem2 needs exact, continuous measurement and actuation")
    if problem.method == "theorem1":
        _check_theorem1(problem)
    return problem


def _check_theorem1(problem: Problem) -> None:
    """Want plant (1): dx_i = f_i + x_{i+1}, y_d = 0, one rho, continuous measurement."""
    if any(a[1] for a in (problem.period, problem.delay, problem.actuator_error)):
        raise MalformedError("theorem1 needs continuous measurement and exact actuation")
    if problem.reference is None or problem.reference.text != "0" or problem.reference_bounds:
        raise MalformedError("theorem1 needs the reference 0")
    if any(rho != problem.rhos[0] for rho in problem.rhos):
        raise MalformedError("theorem1 needs one rho for all states")
    for channel, state in zip(problem.channels, problem.states, strict=True):
        given = (channel.g, channel.g_bound, channel.g_min)
        if any(node is not None and node.text != "1" for node in given):
            raise MalformedError(f"theorem1 needs g = 1, also of {state}")


def _check_nominal(problem: Problem) -> None:
    """Want Theorem U with latched starts, and a reference whose derivatives are known."""
    if problem.method != "unified" or problem.anchor != "latched":
        raise MalformedError("center nominal needs method unified and anchor latched")
    if problem.reference is not None and problem.reference_bounds is not None:
        raise MalformedError("center nominal needs a reference without declared bounds")
    needed = len(problem.states) + 2
    if problem.reference is None and len(problem.derivatives) < needed:
        raise MalformedError(f"reference.bounds: center nominal needs {needed} of them")


def _derivatives(value: object) -> tuple[Interval, ...]:
    """Bounds on y_d, dy_d, .. of a reference that is supplied at run time."""
    if not isinstance(value, Mapping) or "bounds" not in value:
        return ()
    return tuple(at_least(0, bound, "reference.bounds") for bound in value["bounds"])


def _fixed_duration(synthesis: Mapping[str, Any], performance: Mapping[str, Any]) -> Fixed:
    """Read T_s where center nominal finds it in the file."""
    if synthesis["center"] == "performance" or "transition" not in performance:
        return ()
    return (("T_s", at_least(1, performance["transition"], "performance.transition")),)


def _plant_name(value: object) -> str:
    """Read the name, which is also part of a path."""
    if not re.fullmatch(r"[a-z][a-z0-9_]{0,23}", text_of(value, "name")):
        raise MalformedError("name: [a-z][a-z0-9_]{0,23} is expected")
    return str(value)


_SOUGHT = ("accuracy", "period", "resolution")


def _sought(objective: object) -> str | None:
    """Return what the objective leaves to the design; other words only weigh designs."""
    words = [objective]
    if isinstance(objective, Mapping):
        path = "synthesis.objective"
        weights = fields(objective, path, "", " ".join(("balanced peak-input slope", *_SOUGHT)))
        words = [word for word in weights if constant(weights[word], path) != ZERO_I]
    found = [word for word in _SOUGHT if word in words]
    if len(found) > 1:
        raise MalformedError("synthesis.objective: one requirement can be left to the design")
    return found[0] if found else None


def _near(asked: Interval) -> Interval:
    """Enclose the binary64 number nearest to a decimal of the file."""
    return from_fraction(Fraction((asked[0] + asked[1]) / (2 * ONE)))


def _accuracy(performance: Mapping[str, Any], chosen: Fraction | None) -> Interval:
    """Read p_1: the file's, or the design's, which must not be above the file's."""
    path = "performance.accuracy"
    if chosen is None:
        return at_least(1, performance["accuracy"], path)
    own = from_fraction(chosen)
    if "accuracy" in performance:
        asked = at_least(1, performance["accuracy"], path)
        if own[1] > max(asked[0], _near(asked)[1]):
            raise MalformedError(f"design.chosen: the accuracy is not below {path}")
    if own[0] < 1:
        raise MalformedError("design.chosen: the accuracy is too small")
    return own


def _period(sampling: Mapping[str, Any], chosen: Fraction | None) -> Interval:
    """Read h: the file's, or the design's, which must not be below the file's."""
    asked = at_least(0, sampling.get("period", "0"), "sampling.period")
    if chosen is None:
        return asked
    own = from_fraction(chosen)
    if own[0] < max(1, min(asked[1], _near(asked)[0])):
        raise MalformedError("design.chosen: the period is below sampling.period, or not positive")
    return max(own[0], asked[0]), max(own[1], asked[1])


def _states(value: object) -> tuple[str, ...]:
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        raise MalformedError("states: a list of names is expected")
    states = tuple(text_of(state, "states") for state in value)
    for state in states:
        _identifier(state, "states")
    if len(set(states)) < len(states) or len(states) > 12:
        raise MalformedError("states: at most 12, each once")
    return states


def _identifier(name: str, path: str) -> None:
    reserved = ("t", "u", "y_d", "pi", "E", "Piecewise", "True", *FUNCTIONS, *_ALIASES)
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or name in (*reserved, "min", "max"):
        raise MalformedError(f"{path}: {name!r} is not a name that may be given")


def _synthesis(value: object) -> dict[str, Any]:
    """Read the method; whatever this checker has no theorem for is refused."""
    keys = "method form center bounds anchor objective gains p stages handover theorem1"
    synthesis = fields(value, "synthesis", "", keys)
    allowed = {
        "method": ("unified", "theorem1", "theorem2", "theorem3"),
        "form": ("sound",),
        "center": ("open", "performance", "nominal"),
        "bounds": ("termwise", "tight"),
        "anchor": ("latched", "exact"),
        "handover": ("reanchor", "containment"),
    }
    if synthesis.get("center") == "open":
        raise MalformedError("synthesis.center: performance or nominal is expected")
    for key, values in allowed.items():
        synthesis[key] = text_of(synthesis.get(key, values[0]), f"synthesis.{key}")
        if synthesis[key] not in values:
            raise MalformedError(
                f"synthesis.{key}: {synthesis[key]!r} is not available in this version"
            )
    if synthesis["bounds"] == "tight" and synthesis["method"] != "unified":
        raise MalformedError("synthesis.bounds: tight needs method unified")
    if synthesis["method"] == "theorem1":
        # Its errors are made of the true starts, whatever the file says.
        synthesis["anchor"] = "exact"
    return synthesis


# What the plant file reader accepts and notes where the method does not use it: keys of gains.
_GAINS = "k M epsilon c N gamma H H_star"
_USED = {"theorem1": ("gamma", "c", "N")}
_SHAPE = ("k", "M", "epsilon", "c", "N")
_TALL = ("gamma", "H", "c", "N")
_MOST_STAGES = 8
_MOST_POWERS = 8


def _fixed(synthesis: Mapping[str, Any], states: Sequence[str]) -> Fixed:
    """Collect the numbers that the file fixes, as (design key, value); N defaults to 3."""
    found: list[tuple[str, Interval]] = []
    gains = fields(synthesis.get("gains", {}), "synthesis.gains", "", " ".join(states))
    half_widths = fields(synthesis.get("p", {}), "synthesis.p", "", " ".join(states))
    for i, state in enumerate(states):
        given = fields(gains.get(state, {}), f"gains.{state}", "", _GAINS)
        given.setdefault("N", "3")
        found += [
            (f"{key}_{i + 1}", constant(given[key], f"gains.{state}.{key}"))
            for key in _USED.get(synthesis["method"], _SHAPE)
            if key in given
        ]
        if state in half_widths:
            found.append((f"p_{i + 1}", constant(half_widths[state], f"p.{state}")))
        if synthesis["method"] == "theorem1" and "H" in given:
            path = f"gains.{state}.H"
            heights = [constant(h, path) for h in _list(given["H"], path, _MOST_POWERS)]
            heights += [ZERO_I] * (_MOST_POWERS - len(heights))
            found += [(f"H_{i + 1}_{j}", value) for j, value in enumerate(heights)]
    if synthesis["method"] == "theorem1":
        found += _fixed_rooms(synthesis.get("theorem1", {}), states, half_widths)
    return tuple(found)


def _fixed_rooms(
    value: object, states: Sequence[str], half_widths: Mapping[str, Any]
) -> list[tuple[str, Interval]]:
    """Read c_0 and the rooms eps_i of theorem1; a half-width that is fixed too wins."""
    given = fields(value, "synthesis.theorem1", "", "c_0 epsilon H")
    if given.get("H", "constant") not in ("constant", "scheduled"):
        raise MalformedError("synthesis.theorem1.H: constant or scheduled is expected")
    found = [("c_0", constant(given["c_0"], "theorem1.c_0"))] if "c_0" in given else []
    rooms = fields(given.get("epsilon", {}), "theorem1.epsilon", "", " ".join(states[1:]))
    return found + [
        (f"room_{i + 1}", constant(rooms[state], f"theorem1.epsilon.{state}"))
        for i, state in enumerate(states)
        if state in rooms and state not in half_widths
    ]


def _free_stages(synthesis: Mapping[str, Any]) -> list[Any]:
    """List the free stages of theorem3; the other methods do not use them."""
    if synthesis["method"] != "theorem3":
        return []
    stages = _list(synthesis.get("stages", ()), "synthesis.stages", _MOST_STAGES)
    if not stages:
        raise MalformedError("synthesis.stages: theorem3 needs at least one free stage")
    return stages


def _fixed_stages(stages: Sequence[Any], states: Sequence[str]) -> Fixed:
    """Collect every number of the free stages: absent gains are 0."""
    found: list[tuple[str, Interval]] = []
    names = " ".join(states)
    for number, stage in enumerate(stages, start=1):
        path = f"synthesis.stages.{number - 1}"
        given = fields(stage, path, "p gains")
        half_widths = fields(given["p"], f"{path}.p", names)
        gains = fields(given["gains"], f"{path}.gains", names)
        for i, state in enumerate(states):
            place = f"{path}.gains.{state}"
            gain = {"k": "0", "M": "0", "c": "0", "N": "3"}
            gain |= fields(gains[state], place, "", " ".join(_SHAPE))
            found += [
                (f"stage{number}_{key}_{i + 1}", constant(gain[key], f"{place}.{key}"))
                for key in _SHAPE
                if key in gain
            ]
            width = constant(half_widths[state], f"{path}.p.{state}")
            found.append((f"stage{number}_p_{i + 1}", width))
    return tuple(found)


def _list(value: object, path: str, most: int) -> list[Any]:
    if not isinstance(value, (list, tuple)) or len(value) > most:
        raise MalformedError(f"{path}: a list of at most {most} entries is expected")
    return list(value)


def _parameters(
    value: object, states: Sequence[str]
) -> tuple[dict[str, Node], dict[str, Interval]]:
    """Read parameters: exact ones are put into the expressions, ranges are variables."""
    if not isinstance(value, Mapping):
        raise MalformedError("parameters: a mapping is expected")
    names: dict[str, Node] = {}
    ranges: dict[str, Interval] = {}
    for name, given in value.items():
        _identifier(text_of(name, "parameters"), "parameters")
        if name in states:
            raise MalformedError(f"parameters.{name}: a state has this name")
        if isinstance(given, str):
            names[name] = constant_node(given, f"parameters.{name}")
        else:
            names[name], ranges[name] = sym(name), interval_of(given, f"parameters.{name}")
    return names, ranges


def _channels(
    value: object, states: Sequence[str], names: Mapping[str, Node]
) -> tuple[Channel, ...]:
    dynamics = fields(value, "dynamics", " ".join(states))
    known = dict(names)
    channels: list[Channel] = []
    for state in states:
        known[state] = sym(state)
        partial: list[Node] = []
        path = f"dynamics.{state}"
        given = fields(dynamics[state], path, "", "f g f_bound g_bound g_min disturbance")
        nodes: dict[str, Node] = {}
        for key, text in given.items():
            try:
                parser = Parser(text_of(text, f"{path}.{key}"), known)
                nodes[key] = parser.parse()
                partial += parser.partial
            except MalformedError as error:
                raise MalformedError(f"{path}.{key}: {error}") from None
        if "f" not in nodes and "f_bound" not in nodes:
            raise MalformedError(f"{path}: f or f_bound is needed")
        if "g" not in nodes and ("g_bound" in nodes) != ("g_min" in nodes):
            raise MalformedError(f"{path}: an unknown g needs both g_bound and g_min")
        if "g" not in nodes and "g_bound" not in nodes:
            nodes["g"] = UNIT
        disturbance = nodes.get("disturbance", NOTHING)
        channels.append(Channel(disturbance, tuple(partial), *map(nodes.get, _CHANNEL)))
    return tuple(channels)


_CHANNEL = ("f", "g", "f_bound", "g_bound", "g_min")


def _over_time(text: str) -> Node:
    """Read an expression in t whose every part is defined wherever the controller runs."""
    parser = Parser(text, {"t": sym("t")})
    node = parser.parse()
    ends = [0, *(ONE << j for j in range(20)), 10**6 * ONE]
    for part in parser.partial:
        tape = Tape(part, ("t",))
        for left, right in itertools.pairwise(ends):
            tape.value(((left, right),))
    return node


def _above(node: Node, bound: Interval) -> Fraction | None:
    """Return a time of 400, spread from 0 to 1e6 s, at which an expression exceeds a bound."""
    tape = Tape(node, ("t",))
    times = [Fraction(j, 10) for j in range(200)]
    times += [Fraction(21 * 11**j, 10**j) for j in range(1, 113)]
    for t in times:
        if absolute(tape.value((from_fraction(t),)))[0] > bound[1]:
            return t
    return None


def _reference(value: object) -> tuple[Node | None, tuple[Interval, Interval] | None]:
    """Expression (and declared bounds, if any); None when it is supplied at run time."""
    if isinstance(value, str):
        return _over_time(value), None
    if isinstance(value, Mapping) and "bounds" in value:
        given = fields(value, "reference", "bounds")["bounds"]
        if not isinstance(given, Sequence) or isinstance(given, str) or len(given) < 2:
            raise MalformedError("reference.bounds: at least two numbers are expected")
        first, second = (at_least(0, bound, "reference.bounds") for bound in given[:2])
        return None, (first, second)
    given = fields(value, "reference", "value bound rate")
    node = _over_time(text_of(given["value"], "reference.value"))
    bounds = [at_least(0, given[key], f"reference.{key}") for key in ("bound", "rate")]
    for key, part, most in zip(
        ("bound", "rate"), (node, derivative(node, "t")), bounds, strict=True
    ):
        witness = _above(part, most)
        if witness is not None:
            raise MalformedError(f"reference.{key}: {given[key]} is exceeded at t = {witness}")
    return node, (bounds[0], bounds[1])


def _rho(value: object) -> Rho:
    """(52): (1 + cos(t/t_s))/2 until pi t_s, then 0. (53): (1 - floor) e^(-rate t) + floor."""
    given = fields(value, "rho", "kind", "t_s rate floor rate_bound")
    t = sym("t")
    if given["kind"] == "cosine":
        given = fields(value, "rho", "kind", "t_s rate_bound")
        t_s = constant_node(given.get("t_s", "1"), "rho.t_s")
        length = at_least(1, given.get("t_s", "1"), "rho.t_s")
        wave = function("cos", (multiply([(t, 1), (t_s, -1)]),))
        node = combine([(Fraction(1, 2), UNIT), (Fraction(1, 2), wave)])
        return Rho(node, mul(PI_I, length), ZERO_I, div(ONE_I, scale(Fraction(2), length)))
    if given["kind"] != "exponential":
        raise MalformedError(f"rho.kind: {given['kind']!r} is not known")
    given = fields(value, "rho", "kind rate", "floor rate_bound")
    rate = constant_node(given["rate"], "rho.rate")
    floor = constant_node(given.get("floor", "0"), "rho.floor")
    at_least(1, given["rate"], "rho.rate")
    bottom = at_least(0, given.get("floor", "0"), "rho.floor")
    if bottom[1] >= ONE:
        raise MalformedError("rho.floor: it must be below 1")
    decay = function("exp", (combine([(-1, multiply([(rate, 1), (t, 1)]))]),))
    node = combine([(1, floor), (1, multiply([(minus(UNIT, floor), 1), (decay, 1)]))])
    speed = mul(constant(given["rate"], "rho.rate"), sub(ONE_I, bottom))
    return Rho(node, None, bottom, speed)


def _resolutions(
    value: object, states: Sequence[str], factor: Fraction | None
) -> tuple[Interval, ...]:
    """Bound |q(x) - x| plus noise for every state; a factor scales every length of q."""
    if factor is not None and from_fraction(factor)[0] < 1:
        raise MalformedError("design.chosen: the factor is not positive")
    measurement = fields(value, "measurement", "", "quantizer noise")
    quantizers = each_state(measurement, "quantizer", states, {"kind": "none"})
    noises = each_state(measurement, "noise", states, "0")
    return tuple(
        add(
            scale(Fraction(1) if factor is None else factor, _quantization(quantizer)),
            at_least(0, noise, "measurement.noise"),
        )
        for quantizer, noise in zip(quantizers, noises, strict=True)
    )


def _quantization(value: object) -> Interval:
    keys = {
        "none": ("", ""),
        "uniform": ("step", "dead_zone"),
        "hysteresis-uniform": ("step hysteresis", ""),
        "logarithmic-uniform": ("minimum density threshold step", ""),
    }
    kind = fields(value, "quantizer", "kind", " ".join(" ".join(k) for k in keys.values()))["kind"]
    if kind not in keys:
        raise MalformedError(f"quantizer.kind: {kind!r} is not known")
    given = fields(value, "quantizer", f"kind {keys[kind][0]}", keys[kind][1])
    parts = {k: at_least(0, v, f"quantizer.{k}") for k, v in given.items() if k != "kind"}
    half = scale(Fraction(1, 2), parts.get("step", ZERO_I))
    if kind == "uniform":
        return _call("max", (half, parts.get("dead_zone", ZERO_I)))
    if kind == "hysteresis-uniform":
        if parts["hysteresis"][0] > half[1]:
            raise MalformedError("quantizer.hysteresis: it must not be above half the step")
        return add(half, parts["hysteresis"])
    if kind == "logarithmic-uniform":
        if parts["density"][1] >= ONE or parts["minimum"][0] > parts["threshold"][1]:
            raise MalformedError(
                "quantizer: a density below 1, a minimum up to the threshold are needed"
            )
        widest = mul(parts["density"], parts["threshold"])
        return _call("max", (parts["minimum"], widest, half))
    return ZERO_I


# ---------------------------------------------------------------------------------------------
# 6. Reference: extremes of a signal over all t >= 0. A finite stretch is bisected. Beyond it
# (t >= T) every t inside sin or cos of a t + b becomes a phase over one common period of the
# frequencies with rational ratios, and every other part without a phase is written as
# t^d v(t) E(t), v in an interval, 0 <= E(t) <= exp(-b t^m), and enclosed from that.


@dataclass(frozen=True, slots=True)
class Growth:
    """t^degree v E for all t >= T; decay is (b, m) or None for E = 1."""

    degree: Fraction
    range: Interval
    decay: tuple[int, Fraction] | None = None


class Tail:
    """Enclosures for all t >= T >= 1; ``ranges`` holds every other symbol."""

    def __init__(self, start: int, ranges: Mapping[str, Interval]) -> None:
        self.start: Interval = (start, start)
        self.ranges = dict(ranges)

    def _power(self, degree: Fraction) -> Interval:
        return power(self.start, degree)

    def settle(self, growth: Growth) -> Interval:
        """Enclose a growth over all t >= T, or refuse it as unbounded."""
        degree = growth.degree
        if growth.decay is not None:
            b, m = growth.decay
            # t^d exp(-b t^m) decreases where t^m >= d / (b m).
            if degree > 0 and mul(scale(m, (b, b)), self._power(m))[0] < degree * ONE:
                raise UndecidedError("a decaying term has not begun to decay")
            decayed = exp(neg(mul((b, b), self._power(m))))
            return mul(growth.range, (0, mul(self._power(degree), decayed)[1]))
        if degree > 0:
            raise UndecidedError("unbounded for large t")
        return growth.range if degree == 0 else mul(growth.range, (0, self._power(degree)[1]))

    def growth(self, node: Node) -> Growth:
        """How an expression without phases behaves."""
        if "t" not in symbols(node):
            names = sorted(symbols(node))
            value = Tape(node, names).value(tuple(self.ranges[name] for name in names))
            return Growth(Fraction(0), value)
        if node.kind == "sym":
            return Growth(Fraction(1), ONE_I)
        parts = [self.growth(arg) for arg in node.args]
        if node.kind == "sum":
            parts = [Growth(Fraction(0), self.settle(p)) if p.decay else p for p in parts]
            degree = max(p.degree for p in parts)
            total = ZERO_I
            for weight, part in zip(node.weights, parts, strict=True):
                factor = ONE_I
                if part.degree < degree:
                    factor = (0, self._power(part.degree - degree)[1])
                total = add(total, scale(weight, mul(part.range, factor)))
            return Growth(degree, total)
        if node.kind == "prod":
            result = Growth(Fraction(0), ONE_I)
            for part, e in zip(parts, node.weights, strict=True):
                result = self._product(result, part, e)
            return result
        if node.kind != "fun" or node.name == "sign":
            raise UndecidedError("an expression in t that may jump")
        return self._function(node, parts)

    def _product(self, a: Growth, b: Growth, e: Fraction) -> Growth:
        if b.decay and e < 0:
            raise UndecidedError("unbounded for large t")
        decays = [
            d for d in (a.decay, b.decay and (scale(e, (b.decay[0],) * 2)[0], b.decay[1])) if d
        ]
        decay = max(decays, key=lambda d: d[1]) if decays else None
        ranges = mul(a.range, power(b.range, e))
        if len(decays) == 2:
            # Of two decays the faster one is kept; the other is a factor in [0, 1].
            ranges = hull(ranges, ZERO_I)
        return Growth(a.degree + e * b.degree, ranges, decay)

    def _function(self, node: Node, parts: Sequence[Growth]) -> Growth:
        a = parts[0]
        unbounded = a.decay is None and a.degree > 0
        if node.name == "exp" and unbounded and a.range[1] < 0:
            return Growth(Fraction(0), (0, ONE), (-a.range[1], a.degree))
        if node.name == "abs":
            return Growth(a.degree, absolute(a.range), a.decay)
        if node.name.startswith("root") and a.decay is None:
            r = Fraction(1, int(node.name[4:]))
            return Growth(a.degree * r, power(a.range, r))
        if unbounded and node.name in ("sin", "cos"):
            return Growth(Fraction(0), (-ONE, ONE))
        if node.name in ("min", "max"):
            return Growth(Fraction(0), self._extremum(parts, 1 if node.name == "max" else -1))
        if unbounded and node.name in ("tanh", "atan"):
            limit = ONE if node.name == "tanh" else _ceil_shift(PI_I[1], 1)
            least = mul(a.range, (self._power(a.degree)[0],) * 2)
            ends = _call(node.name, (least,))
            lo = ends[0] if a.range[0] >= 0 else -limit
            return Growth(Fraction(0), (lo, ends[1] if a.range[1] <= 0 else limit))
        return Growth(Fraction(0), _call(node.name, [self.settle(part) for part in parts]))

    def _extremum(self, parts: Sequence[Growth], side: int) -> Interval:
        """Enclose max (side 1) or min (-1) of arguments, of which some may leave the others.

        t^d v <= T^d sup v where v < 0: as a max is not below its other arguments, that counts.
        """
        ends, bounded = [], []
        for part in parts:
            v = part.range if side > 0 else neg(part.range)
            if part.decay is None and part.degree > 0 and v[1] < 0:
                ends.append(mul((v[1], v[1]), self._power(part.degree))[1])
            else:
                settled = self.settle(part)
                bounded.append(settled if side > 0 else neg(settled))
        if not bounded:
            raise UndecidedError("unbounded for large t")
        low, high = _call("max", bounded)
        found = low, max([high, *ends])
        return found if side > 0 else neg(found)

    def _fresh(self, value: Interval) -> Node:
        name = f"#{len(self.ranges)}"
        self.ranges[name] = value
        return sym(name)

    def abstract(self, node: Node) -> Node:
        """Replace every part without a phase by a symbol that ranges over its enclosure."""
        names = symbols(node)
        if "t" not in names:
            return node
        if not any(name.startswith("#p") for name in names):
            return self._fresh(self.settle(self.growth(node)))
        if node.kind in ("sum", "prod"):
            pairs = list(zip(node.args, node.weights, strict=True))
            plain = [(a, w) for a, w in pairs if not _has_phase(a)]
            mixed = [(self.abstract(a), w) for a, w in pairs if _has_phase(a)]
            if node.kind == "sum":
                rest = self.abstract(combine((w, a) for a, w in plain))
                return combine([(1, rest), *((w, a) for a, w in mixed)])
            return multiply([(self.abstract(multiply(plain)), 1), *mixed])
        if node.name in ("sin", "cos"):
            return self._fresh((-ONE, ONE))
        if node.kind != "fun" or node.name == "sign":
            raise UndecidedError("an expression in t that may jump")
        return function(node.name, [self.abstract(arg) for arg in node.args])


def _has_phase(node: Node) -> bool:
    return any(name.startswith("#p") for name in symbols(node))


def _frequency(argument: Node) -> tuple[str, Fraction, Node, Node] | None:
    """Write a t + b as (class, rational part of a, irrational part of a, b); else None."""
    weights = argument.weights if argument.kind == "sum" else (Fraction(1),)
    terms = argument.args if argument.kind == "sum" else (argument,)
    pairs = list(zip(weights, terms, strict=True))
    moving = [(w, a) for w, a in pairs if "t" in symbols(a)]
    if len(moving) != 1:
        return None
    weight, core = moving[0]
    rest = UNIT
    if core.kind == "prod":
        factors = list(zip(core.args, core.weights, strict=True))
        if [e for a, e in factors if a.text == "t"] != [1]:
            return None
        rest = multiply([(a, e) for a, e in factors if a.text != "t"])
    elif core.text != "t":
        return None
    if symbols(rest):
        return None
    return rest.text, weight, rest, combine((w, a) for w, a in pairs if "t" not in symbols(a))


def _waves(node: Node) -> list[Node]:
    found = [wave for arg in node.args for wave in _waves(arg)]
    if node.name in ("sin", "cos") and _frequency(node.args[0]):
        found.append(node)
    return found


def _divisor(rates: Sequence[Fraction]) -> Fraction:
    bottom = math.lcm(*(q.denominator for q in rates))
    return Fraction(math.gcd(*(int(q * bottom) for q in rates)), bottom)


def phases(node: Node) -> tuple[Node, dict[str, Interval]]:
    """Replace a t + b inside sin and cos by phases."""
    found, turns = common_phases([node])
    return found[0], turns


def common_phases(nodes: Sequence[Node]) -> tuple[list[Node], dict[str, Interval]]:
    """Replace a t + b inside sin and cos by phases, one for each class of frequencies.

    Frequencies q K with one K and rational q have the common period 2 pi / (K g), g their
    greatest common divisor: with theta = K g t in [0, 2 pi], q K t = (q/g) theta. Phases of
    different classes are taken as independent, which only enlarges the set.
    """
    classes: dict[str, list[Fraction]] = {}
    for wave in itertools.chain.from_iterable(map(_waves, nodes)):
        found = _frequency(wave.args[0])
        if found:
            classes.setdefault(found[0], []).append(found[1])
    kept = sorted(classes)[:3]
    common = {key: _divisor(classes[key]) for key in kept}

    def replace(part: Node) -> Node:
        if part.name in ("sin", "cos"):
            found = _frequency(part.args[0])
            if found and found[0] in common:
                key, rate, _, shift = found
                phase = sym(f"#p{kept.index(key)}")
                angle = combine([(rate / common[key], phase), (1, shift)])
                return function(part.name, (angle,))
        return rebuild(part, [replace(arg) for arg in part.args])

    turn = (0, 2 * PI_I[1])
    return list(map(replace, nodes)), {f"#p{j}": turn for j in range(len(kept))}


def over_time(node: Node, ranges: Mapping[str, Interval], start: int) -> Extremes:
    """Enclose infimum and supremum of an expression in t over t >= start."""
    if "t" not in symbols(node):
        return extremes(node, ranges)
    phased, turns = phases(node)
    if "t" not in symbols(phased):
        return extremes(phased, {**ranges, **turns})
    found: Extremes | None = None
    reason, right = "", max(ONE, 2 * start)
    tape, names = Tape(node, ["t", *ranges]), list(ranges.values())
    known = (tape.value(((start, start), *names)),) * 2
    for _ in range(24):
        for j in range(1, 17):
            t = right - j * (right - start) // 32
            known = merge(known, (tape.value(((t, t), *names)),) * 2)
        try:
            tail = Tail(right, {**ranges, **turns})
            last, found = found, extremes(tail.abstract(phased), tail.ranges, known, 150)
        except UndecidedError as error:
            reason = str(error)
        else:
            # This tail is taken if it adds nothing to some samples, or the next one no change.
            inside = known[0][0] <= found[0][0] and found[1][1] <= known[1][1]
            width, tolerance = found[1][1] - found[0][0], max(-found[0][0], found[1][1]) >> 33
            if inside or (last and last[1][1] - last[0][0] <= width + tolerance):
                break
        right *= 2
    if found is None:
        raise UndecidedError(f"the reference cannot be enclosed: {reason}")
    return extremes(node, {**ranges, "t": (start, right)}, found)


@dataclass(frozen=True, slots=True)
class Center:
    """r_1..r_n over all t and starts: enclosures of inf, sup and sup|dr|; a is the offset.

    ``moved`` bounds what ``switches`` handovers have added to r_1 (docs/theory.md section 8).
    """

    low: tuple[Interval, ...]
    high: tuple[Interval, ...]
    rate: tuple[Interval, ...]
    offset: Interval
    moved: Interval = ZERO_I
    switches: int = 0
    following: Following | None = None

    def size(self, i: int) -> Interval:
        """Return sup|r_i|."""
        return _call("max", (neg(self.low[i]), self.high[i]))


def performance_center(problem: Problem) -> Center:
    """Enclose r_1 = y_d + rho_1 a and r_i = rho_i x_i(0) (docs/theory.md sections 2 and 3)."""
    starts, bounds = widened_starts(problem), problem.reference_bounds
    offset = first_offset(problem, starts[0])
    rho = problem.rhos[0]
    reference = problem.reference if problem.reference is not None else NOTHING
    if bounds is not None:
        largest = absolute(offset)
        size = add(bounds[0], (largest[1], largest[1]))
        low, high = neg(size), size
        rate = add(bounds[1], mul(rho.rate, (largest[1], largest[1])))
    else:
        low, high = _joint(reference, rho.node, offset, rho.end)
        slope = derivative(reference, "t")
        ends = _joint(slope, derivative(rho.node, "t"), offset, rho.end)
        rate = _call("max", (neg(ends[0]), ends[1]))
    lows, highs, rates = [low], [high], [rate]
    for start, other in zip(starts[1:], problem.rhos[1:], strict=True):
        reach_i = mul(start, (other.floor[0], ONE))
        most = absolute(start)[1]
        lows.append((reach_i[0], reach_i[0]))
        highs.append((reach_i[1], reach_i[1]))
        rates.append(mul(other.rate, (most, most)))
    return Center(tuple(lows), tuple(highs), tuple(rates), offset)


def widened_starts(problem: Problem) -> list[Interval]:
    """Every start that the center may have: with the latched anchor, that can be measured."""
    if problem.anchor != "latched":
        return list(problem.starts)
    return [(a[0] - d[1], a[1] + d[1]) for a, d in zip(problem.starts, problem.delta, strict=True)]


def first_offset(problem: Problem, start: Interval) -> Interval:
    """Enclose a = r_1(0) - y_d(0)."""
    if problem.reference is None:
        return run_time_offset(problem, start)
    return sub(start, Tape(problem.reference, ("t",)).value((ZERO_I,)))


def run_time_offset(problem: Problem, start: Interval) -> Interval:
    """Enclose r_1(0) - y_d(0) for a reference that is supplied at run time."""
    if problem.offset is not None:
        reach = problem.offset[1] + (problem.delta[0][1] if problem.anchor == "latched" else 0)
        return -reach, reach
    bound = problem.derivatives[0][1]
    return sub(start, (-bound, bound))


def _joint(base: Node, fade: Node, offset: Interval, end: Interval | None) -> Extremes:
    """Extremes of base + fade a over t >= 0 and a; from ``end`` on of base alone."""
    joint = combine([(1, base), (1, multiply([(fade, 1), (sym("a"), 1)]))])
    ranges = {"a": offset}
    if end is None:
        return over_time(joint, ranges, 0)
    # The two stretches overlap by the width of the enclosure of pi t_s.
    head = extremes(joint, {**ranges, "t": (0, end[1])})
    return merge(head, over_time(base, {}, end[0]))


# ---------------------------------------------------------------------------------------------
# 6b. Center nominal (docs/theory.md section 4): r_1 = y_d + b, r_{i+1} = (dr_i - f^_i) / g^_i,
# v = r_{n+1}, by truncated Taylor series in t. A series is a list of coefficients x^(k) / k!; what
# it does not list is 0. Coefficients are intervals, or intervals with the rounding error of
# binary64: the recurrences are those of the generated code, sums and products in any order.

Series = list[Any]


class Exact:
    """Numbers that are intervals."""

    def input(self, value: Interval, error: int, size: int) -> Any:
        """Take a number that is given."""
        del error, size
        return value

    def settle(self, a: Any) -> Any:
        """Take a number that the code stores: nothing is reordered across it."""
        return a

    def constant(self, value: Fraction) -> Any:
        """Enclose a rational."""
        return from_fraction(value)

    def total(self, terms: Sequence[Any]) -> Any:
        """Sum."""
        return total(terms)

    def mul(self, a: Any, b: Any) -> Any:
        """Product."""
        return mul(a, b)

    def div(self, a: Any, b: Any) -> Any:
        """Quotient."""
        return div(a, b)

    def power(self, a: Any, exponent: int) -> Any:
        """Integer power, at least 1."""
        return power(a, Fraction(exponent))

    def call(self, name: str, a: Any) -> Any:
        """Value of a function."""
        return _call(name, (a,))


class Rounded(Exact):
    """Numbers (value, error, size): |computed - value| <= error, every partial sum <= size.

    A sum of m terms in any order errs by m roundings of the sum of sizes, a product or quotient
    by 1, a constant by 1, a function as ``Arithmetic.function``; all is doubled for what is of
    second order.
    """

    def __init__(self, arithmetic: Arithmetic = _DEFAULT) -> None:
        self.arithmetic = arithmetic

    def input(self, value: Interval, error: int, size: int) -> Any:
        """Take a number that is given with an error."""
        return value, error, size

    def settle(self, a: Any) -> Any:
        """Take a number that the code stores: its size is its own from here on."""
        return a[0], a[1], absolute(a[0])[1] + a[1]

    def constant(self, value: Fraction) -> Any:
        """Enclose a rational and its conversion."""
        found = from_fraction(value)
        return self._made(found, 0, absolute(found)[1], 1)

    def _made(self, value: Interval, passed: int, size: int, count: int, own: int = 0) -> Any:
        self.arithmetic.within(size)
        rounded = _ceil_shift(2 * (count * size + own), self.arithmetic.bits)
        return value, passed + rounded + 1, size

    def total(self, terms: Sequence[Any]) -> Any:
        """Sum."""
        value = super().total([term[0] for term in terms])
        passed, size = sum(term[1] for term in terms), sum(term[2] for term in terms)
        return self._made(value, passed, size, len(terms))

    def mul(self, a: Any, b: Any) -> Any:
        """Product: |a b - a' b'| <= |a'| db + |b| da."""
        passed = ((a[2] + a[1]) * b[1] + b[2] * a[1] >> P) + 1
        size = ((a[2] + a[1]) * (b[2] + b[1]) >> P) + 1
        return self._made(mul(a[0], b[0]), passed, size, 1)

    def div(self, a: Any, b: Any) -> Any:
        """Quotient: |a/b - a'/b'| <= (da + |a/b| db) / |b'|."""
        value = div(a[0], b[0])
        least = absolute((b[0][0] - b[1], b[0][1] + b[1]))[0]
        if least <= 0 or b[0][0] < 0 < b[0][1]:
            raise UndecidedError("division by an interval that contains 0")
        passed = a[1] + (absolute(value)[1] * b[1] >> P) + 1
        size = _ceil_div((a[2] + a[1]) << P, least)
        return self._made(value, _ceil_div(passed << P, least), size, 1)

    def power(self, a: Any, exponent: int) -> Any:
        """Power as products: error and size of the product, value of the power."""
        found = a
        for _ in range(exponent - 1):
            found = self.mul(found, a)
        return power(a[0], Fraction(exponent)), found[1], found[2]

    def call(self, name: str, a: Any) -> Any:
        """Value of a function; its slope over the widened argument passes the error on."""
        wide = (a[0][0] - a[1], a[0][1] + a[1])
        value, far = _call(name, (a[0],)), _call(name, (wide,))
        steep = absolute(_slope(name, wide, far))[1]
        passed = (a[1] * steep >> P) + 1
        size = absolute(far)[1]
        return self._made(value, passed, size, 0, self.arithmetic.function(name, wide, size))


class Sloped(Exact):
    """Numbers (value, slopes): slopes over the whole box of starts; () means all are 0."""

    def input(self, value: Interval, error: int, size: int) -> Any:
        """Take a number that does not depend on the start."""
        del error, size
        return value, ()

    def constant(self, value: Fraction) -> Any:
        """Enclose a rational."""
        return from_fraction(value), ()

    @staticmethod
    def _weighted(pairs: Sequence[tuple[Interval, tuple[Interval, ...]]]) -> Any:
        """Sum of factor times slopes."""
        found = [[mul(factor, slope) for slope in slopes] for factor, slopes in pairs if slopes]
        return tuple(total(column) for column in zip(*found, strict=True))

    def total(self, terms: Sequence[Any]) -> Any:
        """Sum."""
        value = super().total([term[0] for term in terms])
        return value, self._weighted([(ONE_I, term[1]) for term in terms])

    def mul(self, a: Any, b: Any) -> Any:
        """Product."""
        return mul(a[0], b[0]), self._weighted([(a[0], b[1]), (b[0], a[1])])

    def div(self, a: Any, b: Any) -> Any:
        """Quotient: (da - q db) / b."""
        value, below = div(a[0], b[0]), div(ONE_I, b[0])
        return value, self._weighted([(below, a[1]), (neg(mul(value, below)), b[1])])

    def power(self, a: Any, exponent: int) -> Any:
        """Integer power."""
        steep = scale(Fraction(exponent), power(a[0], Fraction(exponent - 1)))
        return power(a[0], Fraction(exponent)), self._weighted([(steep, a[1])])

    def call(self, name: str, a: Any) -> Any:
        """Value of a function."""
        value = _call(name, (a[0],))
        steep = _slope(name, a[0], value) if a[1] else ZERO_I
        return value, self._weighted([(steep, a[1])])


class Taylor:
    """Series arithmetic over one kind of number, cut off after ``length`` coefficients."""

    def __init__(self, numbers: Exact, length: int) -> None:
        self.numbers, self.length = numbers, length
        self.zero = numbers.constant(Fraction(0))
        self.one = numbers.constant(Fraction(1))

    def _scaled(self, weight: Fraction | int, a: Any) -> Any:
        return a if weight == 1 else self.numbers.mul(self.numbers.constant(Fraction(weight)), a)

    def _sum(self, terms: Sequence[Any]) -> Any:
        if len(terms) < 2:
            return terms[0] if terms else self.zero
        return self.numbers.total(terms)

    def combine(self, parts: Sequence[tuple[Fraction | int, Series]]) -> Series:
        """Linear combination."""
        count = min(self.length, max(len(a) for _, a in parts))
        return [
            self._sum([self._scaled(w, a[k]) for w, a in parts if k < len(a)]) for k in range(count)
        ]

    def mul(self, a: Series, b: Series) -> Series:
        """Product."""
        product = self.numbers.mul
        return [
            self._sum(
                [product(a[j], b[k - j]) for j in range(max(0, k - len(b) + 1), min(k + 1, len(a)))]
            )
            for k in range(min(self.length, len(a) + len(b) - 1))
        ]

    def div(self, a: Series, b: Series) -> Series:
        """Quotient q: a = q b, solved for one coefficient after the other."""
        found: Series = []
        for k in range(self.length if len(b) > 1 else min(len(a), self.length)):
            carried = [
                self._scaled(-1, self.numbers.mul(b[j], found[k - j]))
                for j in range(1, min(k, len(b) - 1) + 1)
            ]
            top = self._sum([*carried, *a[k : k + 1]])
            found.append(self.numbers.div(top, b[0]))
        return found

    def power(self, a: Series, exponent: int) -> Series:
        """Integer power, at least 1; its value is the exact range of the power."""
        found, square, left = [self.one], a[: self.length], exponent
        while left:
            found = self.mul(found, square) if left % 2 else found
            left //= 2
            square = self.mul(square, square) if left else square
        return [self.numbers.power(a[0], exponent), *found[1:]]

    def _integral(self, a: Series, factor: Series, k: int) -> Any:
        """Coefficient k of the integral of factor a'."""
        terms = [
            self.numbers.mul(self._scaled(j, a[j]), factor[k - j])
            for j in range(1, min(k, len(a) - 1) + 1)
            if k - j < len(factor)
        ]
        return self.over(self._sum(terms), k)

    def over(self, a: Any, k: int) -> Any:
        """Return a / k."""
        return a if k == 1 else self.numbers.div(a, self.numbers.constant(Fraction(k)))

    def call(self, name: str, a: Series) -> Series:
        """Series of a function from y' = F'(a) a'."""
        a = a[: self.length]
        found: Series = [self.numbers.call(name, a[0])]
        orders = range(1, self.length if len(a) > 1 else 1)
        if name in ("sin", "cos", "sinh", "cosh"):
            partner = {"sin": "cos", "cos": "sin", "sinh": "cosh", "cosh": "sinh"}[name]
            signs = {"sin": (1, -1), "cos": (-1, 1)}.get(name, (1, 1))
            other = [self.numbers.call(partner, a[0])]
            for k in orders:
                up, down = self._integral(a, other, k), self._integral(a, found, k)
                found.append(self._scaled(signs[0], up))
                other.append(self._scaled(signs[1], down))
        elif name == "exp":
            for k in orders:
                found.append(self._integral(a, found, k))
        elif name in ("tan", "tanh"):
            bend = 1 if name == "tan" else -1
            for k in orders:
                square = self.mul(found, found)
                slope = self.combine([(1, [self.one]), (bend, square)])
                found.append(self._integral(a, slope, k))
        elif name in ("log", "atan", "asinh"):
            below = a
            if name != "log":
                below = self.combine([(1, [self.one]), (1, self.power(a, 2))])
            if name == "asinh":
                below = self.root(below, 1, 2)
            for k in orders:
                found.append(self._quotient(a, below, found, k))
        else:
            raise UndecidedError(f"{name} has no series")
        return found

    def _quotient(self, a: Series, below: Series, found: Series, k: int) -> Any:
        """Coefficient k of the y with below y' = a'."""
        terms = [
            self.numbers.mul(self._scaled(j, found[j]), below[k - j])
            for j in range(max(1, k - len(below) + 1), k)
        ]
        carried = [self._scaled(-1, self.over(self._sum(terms), k))] if terms else []
        return self.numbers.div(self._sum([*carried, *a[k : k + 1]]), below[0])

    def root(self, a: Series, p: int, q: int) -> Series:
        """a^(p/q) for a > 0: a w' = (p/q) a' w; a square root from a = w w."""
        a = a[: self.length]
        first = self.numbers.call(f"root{q}", a[0])
        found: Series = [first if p == 1 else self.numbers.power(first, p)]
        for k in range(1, self.length if len(a) > 1 else 1):
            if q == 2:
                terms = [self.numbers.mul(found[j], found[k - j]) for j in range(1, k)]
                rest = self._sum([*(self._scaled(-1, term) for term in terms), *a[k : k + 1]])
                found.append(self.numbers.div(rest, self._scaled(2, first)))
                continue
            terms = [
                self.numbers.mul(self._scaled(Fraction(p * j, q) - (k - j), a[j]), found[k - j])
                for j in range(1, min(k, len(a) - 1) + 1)
            ]
            bottom = self._scaled(k, a[0])
            found.append(self.numbers.div(self._sum(terms), bottom))
        return found

    def slope(self, a: Series) -> Series:
        """Return the derivative."""
        return [self._scaled(k, a[k]) for k in range(1, min(len(a), self.length + 1))] or [
            self.zero
        ]

    def evaluate(self, node: Node, values: Mapping[str, Series]) -> Series:
        """Series of an expression; ``values`` also keeps what was evaluated before."""
        known = dict(values)

        def visit(part: Node) -> Series:
            if part.text not in known:
                args = [visit(arg) for arg in part.args]
                if part.kind == "num":
                    found = [self.numbers.constant(part.number)]
                elif part.kind == "pi":
                    found = [self._pi()]
                elif part.kind == "sum":
                    found = self.combine(list(zip(part.weights, args, strict=True)))
                elif part.kind == "prod":
                    pairs = zip(part.args, args, part.weights, strict=True)
                    found = self._product([(self._factor(*pair, visit), pair[2]) for pair in pairs])
                elif part.kind == "fun" and part.name.startswith("root"):
                    found = self.root(args[0], 1, int(part.name[4:]))
                elif part.kind == "fun":
                    found = self.call(part.name, args[0])
                else:
                    raise UndecidedError(f"{part.text} has no series")
                known[part.text] = found
            return known[part.text]

        return visit(node)

    def _pi(self) -> Any:
        return self.numbers.input(PI_I, _ceil_shift(PI_I[1], 52), PI_I[1])

    def _factor(
        self, node: Node, a: Series, e: Fraction, visit: Callable[[Node], Series]
    ) -> Series:
        """a^|e|; the code takes any power of a root but the square root in one step."""
        if e.denominator > 1:
            raise UndecidedError("an odd root has no series")
        p = abs(e.numerator)
        if p > 1 and _is_root(node) and node.name != "root2":
            return self.root(visit(node.args[0]), p, int(node.name[4:]))
        return a if p == 1 else self.power(a, p)

    def _product(self, factors: Sequence[tuple[Series, Fraction]]) -> Series:
        found, below = (
            reduce(self.mul, [a for a, e in factors if (e > 0) == over] or [[self.one]])
            for over in (True, False)
        )
        return found if all(e > 0 for _, e in factors) else self.div(found, below)


IRREGULAR = ("abs", "sign", "min", "max", "signed")


def is_regular(node: Node) -> bool:
    """Whether a term may stand in f^ or g^: no kink, no jump, no odd root."""
    if node.kind == "piece" or (node.kind == "fun" and node.name.startswith(IRREGULAR)):
        return False
    odd = node.kind == "prod" and any(e.denominator > 1 for e in node.weights)
    return not odd and all(map(is_regular, node.args))


@dataclass(frozen=True, slots=True)
class Follower:
    """The nominal plant: f^, g^; ``smooth`` is f with parameters, without ``left``.

    ``guards`` must be positive all along the center.
    """

    states: tuple[str, ...]
    f: tuple[Node, ...]
    g: tuple[Node, ...]
    smooth: tuple[Node, ...]
    left: tuple[Node, ...]
    duration: Fraction
    guards: tuple[Node, ...]


def follower(problem: Problem, duration: Fraction) -> Follower:
    """Leave out of f what lacks the regularity, and take every parameter in its middle.

    abs in a g is followed by the branch that it starts in; the guards say where that is right.
    A g that is known by its bounds only is followed in their middle.
    """
    middle = {name: num(Fraction(lo + hi, 2 * ONE)) for name, (lo, hi) in problem.ranges.items()}
    begin = {
        state: num(Fraction(lo + hi, 2 * ONE))
        for state, (lo, hi) in zip(problem.states, problem.starts, strict=True)
    }
    rows: list[tuple[Node, Node, Node, Node]] = []
    guards: list[Node] = []
    for channel, state in zip(problem.channels, problem.states, strict=True):
        terms = [(Fraction(1), channel.f or NOTHING)]
        if not is_regular(terms[0][1]):
            terms = _expanded(terms[0][1])
        kept = combine((w, a) for w, a in terms if is_regular(a))
        rest = combine((w, a) for w, a in terms if not is_regular(a))
        if channel.f is None:
            rest = channel.f_bound or NOTHING
        g = channel.g
        if g is None:
            ends = (channel.g_min or UNIT, channel.g_bound or UNIT)
            g = combine((Fraction(1, 2), end) for end in ends)
        g = _one_branch(substitute(g, middle), begin, guards)
        if not is_regular(g):
            raise UndecidedError(f"center nominal needs a g of {state} without kinks and jumps")
        rows.append((substitute(kept, middle), g, kept, rest))
    f, g_all, smooth, left = zip(*rows, strict=True)
    return Follower(problem.states, f, g_all, smooth, left, duration, tuple(guards))


def _one_branch(node: Node, begin: Mapping[str, Node], guards: list[Node]) -> Node:
    """Replace abs(y) by y or -y, as y is at the middle start."""
    args = [_one_branch(arg, begin, guards) for arg in node.args]
    if node.name != "abs":
        return rebuild(node, args)
    side = 1 if Tape(substitute(args[0], begin), ()).value(())[0] > 0 else -1
    guards.append(combine([(side, args[0])]))
    return guards[-1]


def _expanded(node: Node) -> list[tuple[Fraction, Node]]:
    """List the terms of a sum; a product with sums in it is multiplied out."""
    if node.kind == "sum":
        return [
            (weight * inner, part)
            for weight, arg in zip(node.weights, node.args, strict=True)
            for inner, part in _expanded(arg)
        ]
    if node.kind == "prod":
        factors = list(zip(node.args, node.weights, strict=True))
        sums = [a for a, e in factors if e == 1 and a.kind == "sum"]
        if sums:
            rest = [(a, e) for a, e in factors if a is not sums[0]]
            parts = [
                (weight, multiply([*rest, (a, 1)]))
                for weight, a in zip(sums[0].weights, sums[0].args, strict=True)
            ]
            return [(weight * w, a) for weight, part in parts for w, a in _expanded(part)]
    return [(Fraction(1), node)]


def follow_nominal(model: Follower, taylor: Taylor, first: Series) -> list[Series]:
    """r_1..r_n and v from the series of r_1."""
    found, values = [first], {}
    for i, (f, g) in enumerate(zip(model.f, model.g, strict=True)):
        inner = Taylor(taylor.numbers, taylor.length - 1 - i)
        values[model.states[i]] = found[i]
        ahead = inner.slope(found[i])
        if f.text != "0":
            ahead = inner.combine([(1, ahead), (-1, inner.evaluate(f, values))])
        if g.text != "1":
            ahead = inner.div(ahead, inner.evaluate(g, values))
        found.append([taylor.numbers.settle(a) for a in ahead])
    return found


def lead_in(
    model: Follower, numbers: Exact, start: Sequence[Any], y: Series, offset: Any = None
) -> Series:
    """Q_0..Q_{n-1} of b = (1 - s)^(n+2) Q(s), s = t / T_s, from the latched start.

    x_1^(j)(0) follow from x_i' = f^_i + g^_i x_{i+1}; minus those of y_d they are b^(j)(0). Q is
    the part below s^n of (1 - s)^-(n+2) sum b^(j)(0) / j! (T_s s)^j: n conditions at 0 and n+2
    at 1 determine the polynomial of degree 2n+1, and this one fulfils them.
    """
    n = len(start)
    x: list[Series] = [[value] for value in start]
    for k in range(n - 1):
        taylor = Taylor(numbers, k + 1)
        values = dict(zip(model.states, x, strict=True))
        rates = []
        for i in range(n - 1 - k):
            rate = taylor.mul(taylor.evaluate(model.g[i], values), x[i + 1])
            rates.append(taylor.combine([(1, taylor.evaluate(model.f[i], values)), (1, rate)]))
        for i, rate in enumerate(rates):
            value = rate[k] if k < len(rate) else taylor.zero
            x[i] = [*x[i], taylor.over(value, k + 1)]
    taylor, t_s = Taylor(numbers, n), numbers.constant(model.duration)
    scaled = taylor.combine([(1, x[0]), (-1, y)])
    scaled += [taylor.zero] * (n - len(scaled))
    if offset is not None:
        scaled[0] = offset
    for j in range(1, n):
        for _ in range(j):
            scaled[j] = numbers.mul(scaled[j], t_s)
    weights = [[math.comb(n + 1 + m - j, m - j) for j in range(m + 1)] for m in range(n)]
    return [
        numbers.settle(
            numbers.total(
                [numbers.mul(numbers.constant(Fraction(w)), scaled[j]) for j, w in enumerate(row)]
            )
        )
        for row in weights
    ]


def fade(model: Follower, taylor: Taylor, weights: Series, t: Any) -> Series:
    """Series of b in t, for t in [0, T_s]."""
    numbers, n = taylor.numbers, len(weights)
    t_s = numbers.constant(model.duration)
    s = numbers.div(t, t_s)
    step = numbers.div(taylor.one, t_s)
    rest = numbers.settle(
        numbers.total([taylor.one, numbers.mul(numbers.constant(Fraction(-1)), s)])
    )
    fall = taylor.power([rest, numbers.mul(numbers.constant(Fraction(-1)), step)], n + 2)
    total: Series = [weights[-1]]
    for weight in reversed(weights[:-1]):
        total = taylor.combine([(1, taylor.mul(total, [s, step])), (1, [weight])])
    return [numbers.settle(a) for a in taylor.mul(fall, total)]


_SLICES = 256  # of [0, T_s], and of one period of the reference


class Trajectory:
    """The center over stretches of time, for every declared start."""

    def __init__(self, problem: Problem, duration: Fraction) -> None:
        self.problem, self.n = problem, len(problem.states)
        self.model = follower(problem, duration)
        if problem.reference is not None and not is_regular(problem.reference):
            raise UndecidedError("center nominal needs a reference without kinks and jumps")
        # One coefficient beyond dv centers it, where the reference has that derivative.
        self.length = self.n + (2 if problem.reference is None else 3)

    def latched(self, numbers: Exact, start: Sequence[Any], offset: Any = None) -> Series:
        """Q_0..Q_{n-1} from q(x(0)); ``offset`` is q(x_1(0)) - y_d(0) where y_d is unknown."""
        y = self.reference(numbers, numbers.constant(Fraction(0)), self.n)
        return lead_in(self.model, numbers, start, y, offset)

    def reference(self, numbers: Exact, t: Any, length: int) -> Series:
        """Series of y_d; one that is supplied at run time is anything within its bounds."""
        if self.problem.reference is not None:
            taylor = Taylor(numbers, length)
            return taylor.evaluate(self.problem.reference, {"t": [t, taylor.one]})
        sizes = [
            scale(Fraction(1, math.factorial(k)), bound)[1]
            for k, bound in enumerate(self.problem.derivatives[:length])
        ]
        # Passed in, and divided by k!, which is exact up to 2!.
        bits, single = self.problem.arithmetic.bits, self.problem.arithmetic.single
        errors = [_ceil_shift((single + (k > 2)) * size, bits) for k, size in enumerate(sizes)]
        return [
            numbers.input((-size, size), error, size)
            for size, error in zip(sizes, errors, strict=True)
        ]

    def series(
        self, numbers: Exact, t: Any, weights: Series | None, y: Series | None = None
    ) -> list[Series]:
        """Series of r_1..r_n and v; without weights b is over."""
        length = self.length if y is None else max(len(y), self.n + 1)
        taylor = Taylor(numbers, length)
        first = self.reference(numbers, t, length) if y is None else y
        if weights is not None:
            first = taylor.combine([(1, first), (1, fade(self.model, taylor, weights, t))])
        first = [numbers.settle(a) for a in first]
        return follow_nominal(self.model, taylor, first)

    def at(
        self,
        time: Fraction,
        start: Sequence[float],
        references: tuple[Sequence[float], Sequence[float]] | None,
    ) -> tuple[list[Interval], Interval]:
        """Enclose r_1..r_n and v at one time after one latched start.

        references are y_d, dy_d, .. at this time and at the latch, where they are passed in.
        """
        x = [from_fraction(Fraction(value)) for value in start]
        now, first = None, self.reference(Exact(), ZERO_I, self.n)
        if references is not None:
            now, first = (
                [
                    scale(Fraction(1, math.factorial(k)), from_fraction(Fraction(value)))
                    for k, value in enumerate(given)
                ]
                for given in references
            )
        else:
            now = self.reference(Exact(), from_fraction(time), self.n + 1)
        weights = None
        if time < self.model.duration:
            weights = lead_in(self.model, Exact(), x, first[: self.n])
        found = self.series(Exact(), from_fraction(time), weights, now)
        return [a[0] for a in found[:-1]], found[-1][0]

    def stretches(self, cells: int) -> list[Stretch]:
        """Cut all t >= 0: [0, T_s] where b acts, then what the reference does for ever."""
        start, end = from_fraction(self.model.duration)
        node = self.problem.reference
        found = [Stretch(cell, fading=True) for cell in _cut(0, end, cells)]
        if node is None or "t" not in symbols(node):
            return [*found, Stretch((start, end), fading=False, latest=end)]
        phased, turns = phases(node)
        if "t" not in symbols(phased) and len(turns) == 1:
            length = div((2 * PI_I[0], 2 * PI_I[1]), _turning(node))[1]
            cut = _cut(start, end + length, cells)
            latest = self.problem.latest
            return [*found, *(Stretch(cell, fading=False, latest=latest) for cell in cut)]
        signal = _Signal(self.problem, node, self.length)
        late, at, last = self.problem.delay[1], start, None
        while last is None:
            # Octaves of time, as many as it takes until what fades has hardly anything left.
            if at > late:
                last = signal.settled(at, None)
            if last is None:
                later = max(2 * max(at, ONE), late + 1)
                # What the delay reaches is wanted by its time.
                covered = signal.octave if at > late else signal.direct
                found += covered(at, later, cells)
                at = later
        return [*found, *signal.torus(last, self.problem.latest, cells)]


_PHASES = ("#p1", "#p2")  # those beside the first one


@dataclass(frozen=True, slots=True)
class Stretch:
    """Times t, at most ``latest`` where they stand for later periods too.

    If ``settled``, t is the phase of all the times that it covers, and ``others`` are further
    phases, of waves whose periods have nothing in common with the first one.
    """

    t: Interval
    fading: bool
    latest: int = 0
    settled: _Settled | None = None
    others: Box = ()


@dataclass(frozen=True, slots=True)
class _Settled:
    """A reference from a time on as y_k(phases, rest): series coefficients, the rest in intervals.

    ``turned`` are the derivatives by the first phase, ``across`` those by each of the others:
    phases and rest are taken as independent, so that the mean value theorem may be used in the
    phases. ``errors`` and ``sizes`` bound rounding and partial sums of every coefficient in
    binary64.
    """

    values: tuple[Tape, ...]
    turned: tuple[Tape, ...]
    across: tuple[tuple[Tape, ...], ...]
    boxes: tuple[Box, ...]
    errors: tuple[int, ...]
    sizes: tuple[int, ...]

    def series(self, numbers: Exact, phases: Box) -> Series:
        """Coefficients over a box of phases, with slopes by these where numbers have any."""
        found: Series = []
        for k, (tape, box) in enumerate(zip(self.values, self.boxes, strict=True)):
            value = tape.value((*phases, *box))
            if isinstance(numbers, Sloped):
                slopes = (self.turned[k], *(tapes[k] for tapes in self.across))
                found.append((value, tuple(slope.value((*phases, *box)) for slope in slopes)))
                continue
            size = max(self.sizes[k], absolute(value)[1])
            found.append(numbers.input(value, self.errors[k], size))
        return found


class _Span(Tail):
    """Enclosures over [T, T'] of what has no phase."""

    def __init__(self, start: int, end: int, ranges: Mapping[str, Interval]) -> None:
        super().__init__(start, ranges)
        self.end = end

    def growth(self, node: Node) -> Growth:
        """Enclose an expression over the span."""
        ranges = {**self.ranges, "t": (self.start[0], self.end)}
        low, high = extremes(node, ranges, None, 40)
        return Growth(Fraction(0), (low[0], high[1]))


class _Signal:
    """A reference with its derivatives, whose waves with a frequency have become phases."""

    def __init__(self, problem: Problem, node: Node, length: int) -> None:
        self.problem, self.nodes = problem, [node]
        while len(self.nodes) < length:
            order = len(self.nodes)
            slope = derivative(self.nodes[-1], "t")
            self.nodes.append(combine([(Fraction(1, order), slope)]))
        self.phased, turns = common_phases(self.nodes)
        self.turns = turns or {"#p0": ZERO_I}
        self.speed = _turning(self.nodes[0]) if len(turns) == 1 else ZERO_I
        if len(turns) > 1:
            rates = [a[1:3] for a in (_frequency(wave.args[0]) for wave in _waves(node)) if a]
            found = [scale(weight, Tape(rest, ()).value(())) for weight, rest in rates]
            self.speed = _call("max", [absolute(a) for a in found])

    def settled(self, start: int, end: int | None) -> _Settled | None:
        """Cover [start, end], or all later times; None where that says too little as yet."""
        try:
            spans = [
                Tail(start, self.turns) if end is None else _Span(start, end, self.turns)
                for _ in self.nodes
            ]
            rest = [span.abstract(node) for span, node in zip(spans, self.phased, strict=True)]
            errors, sizes = self._rounding(start, end or self.problem.latest)
        except UndecidedError as error:
            if end is None and start >= self.problem.latest:
                raise UndecidedError(f"the reference cannot be enclosed: {error}") from None
            return None
        boxes = [
            tuple(a for name, a in span.ranges.items() if name not in self.turns) for span in spans
        ]
        moves = max((a[1] - a[0] for box in boxes for a in box), default=0)
        if end is None and moves >= ONE >> 20 and start < self.problem.latest:
            return None
        names = [list(span.ranges) for span in spans]
        first, *others = self.turns
        return _Settled(
            tuple(map(Tape, rest, names)),
            tuple(Tape(derivative(a, first), own) for a, own in zip(rest, names, strict=True)),
            tuple(
                tuple(Tape(derivative(a, name), own) for a, own in zip(rest, names, strict=True))
                for name in others
            ),
            tuple(boxes),
            tuple(errors),
            tuple(sizes),
        )

    def _rounding(self, start: int, end: int) -> tuple[list[int], list[int]]:
        """Bound rounding and partial sums of every coefficient in binary64."""
        errors, sizes = [0] * len(self.nodes), [0] * len(self.nodes)
        numbers = Rounded(self.problem.arithmetic)
        taylor = Taylor(numbers, len(self.nodes))
        while start < end:
            later = min(max(2 * start, ONE >> 20), end)
            t = numbers.input((start, later), clock_error(self.problem, later), later)
            for k, a in enumerate(taylor.evaluate(self.nodes[0], {"t": [t, taylor.one]})):
                errors[k], sizes[k] = max(errors[k], a[1]), max(sizes[k], a[2])
            start = later
        return errors, sizes

    def octave(self, start: int, end: int, cells: int) -> list[Stretch]:
        """Cut a finite time, where a phase turns often into phases."""
        turns = mul((end - start,) * 2, self.speed)[1] // (2 * PI_I[0])
        many = len(self.turns) > 1 or turns > 3
        settled = self.settled(start, end) if many and start >= ONE else None
        if settled is not None:
            return self.torus(settled, end, max(1, cells // 4))
        return self.direct(start, end, cells)

    def direct(self, start: int, end: int, cells: int) -> list[Stretch]:
        """Cut a finite time itself."""
        turns = mul((end - start,) * 2, self.speed)[1] // (2 * PI_I[0])
        count = max(1, cells // 8) * (1 + turns)
        return [Stretch(a, fading=False, latest=a[1]) for a in _cut(start, end, count)]

    def torus(self, settled: _Settled, latest: int, cells: int) -> list[Stretch]:
        """Cut the phases."""
        wide = [a for a in self.turns.values() if a[1]]
        count = round(cells ** (1 / len(wide))) if wide else 1
        axes = [_cut(*a, count) if a[1] else [a] for a in self.turns.values()]
        return [
            Stretch(t, fading=False, latest=latest, settled=settled, others=tuple(others))
            for t, *others in itertools.product(*axes)
        ]


def _rate(a: Series) -> Interval:
    return a[1] if len(a) > 1 else ZERO_I


def _meet(a: Interval, b: Interval) -> Interval:
    return max(a[0], b[0]), min(a[1], b[1])


def _cut(start: int, end: int, count: int) -> list[Interval]:
    ends = [start + (end - start) * j // count for j in range(count + 1)]
    return list(itertools.pairwise(ends))


def _turning(node: Node) -> Interval:
    """Enclose K g: the phase of ``phases`` is K g t, for waves of one class."""
    found = filter(None, (_frequency(wave.args[0]) for wave in _waves(node)))
    rates = [(weight, rest) for _, weight, rest, _ in found]
    common = _divisor([weight for weight, _ in rates])
    speed = absolute(scale(common, Tape(rates[0][1], ()).value(())))
    if speed[0] <= 0:
        raise UndecidedError("a wave that hardly turns")
    return speed


class _Starts:
    """All latched starts: as a box with slopes, and its middle."""

    def __init__(self, path: Trajectory) -> None:
        problem = path.problem
        box = widened_starts(problem)
        if problem.reference is None:
            box.append(run_time_offset(problem, box[0]))
        middle = [((lo + hi) >> 1,) * 2 for lo, hi in box]
        self.reach = [sub(a, b) for a, b in zip(box, middle, strict=True) if a[0] < a[1]]
        wide = [k for k, a in enumerate(box) if a[0] < a[1]]
        self.numbers = Sloped()
        seeds = [
            (a, tuple(ONE_I if k == j else ZERO_I for j in wide) if k in wide else ())
            for k, a in enumerate(box)
        ]
        self.weights = path.latched(self.numbers, seeds[: path.n], *seeds[path.n :])
        self.middle = path.latched(Exact(), middle[: path.n], *middle[path.n :])


def _centered(path: Trajectory, starts: _Starts, stretch: Stretch) -> tuple[list[Interval], ...]:
    """Enclose r_1..r_n, v over a stretch of time, their rates, and both at one point of it.

    Values are met with the mean value form around middle time (or phases) and start, rates too
    where the series has the second derivative.
    """
    t, settled, numbers = stretch.t, stretch.settled, starts.numbers
    middle = ((t[0] + t[1]) >> 1,) * 2
    moved, reach = sub(t, middle), starts.reach
    if settled is None:
        weights = (starts.weights, starts.middle) if stretch.fading else (None, None)
        whole = path.series(numbers, numbers.input(t, 0, 0), weights[0])
        point = path.series(Exact(), middle, weights[1])
    else:
        box = (t, *stretch.others)
        at: Box = tuple(((a[0] + a[1]) >> 1,) * 2 for a in box)
        reach, moved = list(map(sub, box, at)), ZERO_I
        whole = path.series(numbers, None, None, settled.series(numbers, box))
        point = path.series(Exact(), None, None, settled.series(Exact(), at))
    values, rates = [], []
    for a, b in zip(whole, point, strict=True):
        slope = a[1] if len(a) > 1 else (ZERO_I, ())
        rate = slope[0]
        if path.problem.reference is not None:
            bent = scale(Fraction(2), a[2][0]) if len(a) > 2 else ZERO_I
            near = add(add(_rate(b), mul(bent, moved)), _moved(slope, reach))
            rate = _meet(rate, near)
        rates.append(rate)
        near = add(add(b[0], mul(rate, moved)), _moved(a[0], reach))
        values.append(_meet(a[0][0], near))
    return values, rates, [b[0] for b in point], [_rate(b) for b in point]


def _moved(a: Any, reach: Sequence[Interval]) -> Interval:
    """Return what a number with slopes can differ from its value in the middle."""
    return total(map(mul, a[1], reach))


class _ModelError:
    """Bounds on d_i = f + g r_next - dr_i: along the center, and away from it.

    Along the center it is F(r; th) - F(r; nominal) with F = f + g r_next, at most the sum over
    the parameters of sup|dF/dth| times half the range; away from it F(x; th) - F(r; th) is at
    most the sum over the states of sup|dF/dx_j| xi_j (mean value theorem, th fixed).
    """

    def __init__(self, problem: Problem, model: Follower, i: int) -> None:
        self.i, self.ranges, states = i, problem.ranges, problem.states[: i + 1]
        names = [*states, "#next", *problem.ranges]
        ahead = multiply([(problem.channels[i].g or NOTHING, 1), (sym("#next"), 1)])
        whole = combine([(1, model.smooth[i]), (1, ahead)])
        self.unknown = [
            (Tape(derivative(whole, name), names), ((hi - lo) >> 1) + 1)
            for name, (lo, hi) in problem.ranges.items()
            if name in symbols(whole)
        ]
        self.slopes = [Tape(derivative(whole, state), names) for state in states]

    def along(self, r: Sequence[Interval]) -> Interval:
        """Bound the effect of the parameters for r_1..r_n, v in these intervals."""
        box = (*r[: self.i + 2], *self.ranges.values())
        return total(mul(absolute(tape.value(box)), (d, d)) for tape, d in self.unknown)

    def away(self, x: Sequence[Interval], ahead: Interval, xi: Sequence[Interval]) -> Interval:
        """Bound the effect of the deviation from the center, x_1..x_i in these intervals."""
        box = (*x, ahead, *self.ranges.values())
        pairs = zip(self.slopes, xi, strict=True)
        return total(mul(absolute(tape.value(box)), reach) for tape, reach in pairs)


class _Survey:
    """Suprema along the center: of -r_i, -v, r_i, v, of the rates, and of the model errors.

    Stretches that may hold one of them are cut in two as long as that lowers the bounds.
    """

    def __init__(self, path: Trajectory) -> None:
        self.path, self.starts = path, _Starts(path)
        problem = path.problem
        self.errors = tuple(_ModelError(problem, path.model, i) for i in range(path.n))
        self.guards = [Tape(guard, problem.states) for guard in path.model.guards]
        self.early = ZERO_I
        judged = [(stretch, self._judge(stretch)) for stretch in path.stretches(_SLICES)]
        self.found = _largest([bounds for _, bounds in judged])
        # A cell of several phases is cut in each of them, and there are few to begin with.
        for _ in range(4 if judged[-1][0].others else 3):
            judged, last = self._cut(judged), self.found
            self.found = _largest([bounds for _, bounds in judged])
            pairs = zip(last, self.found, strict=True)
            if all(a[1] - b[1] <= abs(b[1]) >> 13 for a, b in pairs):
                break

    def _judge(self, stretch: Stretch) -> list[Interval]:
        """Enclose each supremum over a stretch: from below at a point, from above."""
        values, rates, points, slopes = _centered(self.path, self.starts, stretch)
        if any(guard.value(tuple(values[:-1]))[0] <= 0 for guard in self.guards):
            raise UndecidedError("an abs in some g may change its branch along the center")
        pairs = list(zip(points, values, strict=True))
        found = [(-b[1], -a[0]) for b, a in pairs] + [(b[0], a[1]) for b, a in pairs]
        pairs = list(zip(slopes, rates, strict=True))
        found += [(absolute(b)[0], absolute(a)[1]) for b, a in pairs]
        found += [(e.along(points)[0], e.along(values)[1]) for e in self.errors]
        late = self.path.problem.delay[1]
        if late and stretch.settled is None and stretch.t[0] <= late:
            # The middle of the stretch may be later than the delay.
            self.early = 0, max(self.early[1], absolute(values[-1])[1])
        return found

    def _cut(self, judged: list[tuple[Stretch, list[Interval]]]) -> list[Any]:
        kept: list[Any] = []
        for stretch, bounds in judged:
            pairs = zip(bounds, self.found, strict=True)
            # Cells of several phases are wide: whatever may exceed what is reached is cut.
            if all(
                a[1] < (b[0] + (abs(b[1]) >> 8) if stretch.others else b[1] - (abs(b[1]) >> 10))
                or b[1] - b[0] <= abs(b[1]) >> 13
                for a, b in pairs
            ):
                kept.append((stretch, bounds))
                continue
            for part in _halved(stretch):
                inner = self._judge(part)
                pairs = zip(inner, bounds, strict=True)
                kept.append((part, [(a[0], min(a[1], b[1])) for a, b in pairs]))
        return kept


def _halved(stretch: Stretch) -> list[Stretch]:
    boxes: list[Box] = [(stretch.t, *stretch.others)]
    for j, a in enumerate(boxes[0]):
        if a[0] < a[1]:
            boxes = [half for box in boxes for half in halves(box, j)]
    return [replace(stretch, t=t, others=tuple(others)) for t, *others in boxes]


def _largest(bounds: Sequence[Sequence[Interval]]) -> list[Interval]:
    return [_call("max", column) for column in zip(*bounds, strict=True)]


def nominal_center(problem: Problem, duration: Fraction) -> Center:
    """Enclose the center, v and the model error along them over all t and starts."""
    path = Trajectory(problem, duration)
    survey, n = _Survey(path), path.n
    least, most = survey.found[: n + 1], survey.found[n + 1 : 2 * n + 2]
    rates, unknown = survey.found[2 * n + 2 : 3 * n + 3], survey.found[3 * n + 3 :]
    following = Following(path, survey.errors, tuple(unknown), rates[n], survey.early)
    return Center(
        tuple(neg(a) for a in least), tuple(most), tuple(rates[:n]), ZERO_I, following=following
    )


@dataclass(frozen=True, slots=True)
class Following:
    """What a center has that the nominal plant can follow; low and high end with those of v."""

    path: Trajectory
    errors: tuple[_ModelError, ...]
    unknown: tuple[Interval, ...]
    v_rate: Interval
    v_start: Interval

    def rounding(self, cells: int = 64) -> list[int]:
        """Bound the rounding of r_1..r_n and v as long as the controller accepts samples."""
        problem, numbers = self.path.problem, Rounded(self.path.problem.arithmetic)
        sizes = [absolute(a)[1] for a in widened_starts(problem)]
        starts = [
            numbers.input(a, passed_error(problem, size), size)
            for a, size in zip(widened_starts(problem), sizes, strict=True)
        ]
        offset = None
        if problem.reference is None:
            reach = run_time_offset(problem, starts[0][0])
            # The code subtracts y_d(0): one rounding, which a sum counts.
            bound = sizes[0] + problem.derivatives[0][1]
            error = passed_error(problem, bound)
            offset = numbers.total([numbers.input(reach, error, absolute(reach)[1])])
        weights = self.path.latched(numbers, starts, offset)
        worst = [0] * (self.path.n + 1)
        for stretch in self.path.stretches(cells):
            # t - t_0 is rounded once; a period later the same point has a larger t.
            t, latest = stretch.t, max(stretch.latest, stretch.t[1])
            if stretch.settled is not None:
                y = stretch.settled.series(numbers, (t, *stretch.others))
                found = self.path.series(numbers, None, None, y)
            else:
                time = numbers.input(t, clock_error(problem, latest), latest)
                found = self.path.series(numbers, time, weights if stretch.fading else None)
            worst = [max(error, a[0][1]) for error, a in zip(worst, found, strict=True)]
        return worst


# ---------------------------------------------------------------------------------------------
# 7. Chain of bounds (docs/theory.md sections 2 and 3). Every constant is an interval: its upper
# end (for g_min its lower end) is what the theorem uses and is rigorous.


@dataclass(frozen=True, slots=True)
class Gain:
    """phi(e) = k e + M tanh(M e / epsilon) + c e^N, exact."""

    k: Fraction
    M: Fraction
    epsilon: Fraction
    c: Fraction
    N: int

    @property
    def powers(self) -> int:
        """Degree in rho of the linear term's factor."""
        return 0

    def phi(self, e: Interval, rho: Interval = ONE_I) -> Interval:
        """Range of phi, which does not depend on rho: every term is nondecreasing."""
        del rho
        total = add(scale(self.k, e), scale(self.c, power(e, Fraction(self.N))))
        if self.M:
            total = add(total, scale(self.M, tanh(scale(self.M / self.epsilon, e))))
        return total

    def spread(self, p: Interval, eta: Interval) -> Interval:
        """Lambda of section 3: sup |phi(e + d) - phi(e)| over |e| <= p, |d| <= eta."""
        wide = power(add(p, eta), Fraction(self.N))
        total = add(scale(self.k, eta), scale(self.c, sub(wide, power(p, Fraction(self.N)))))
        if self.M:
            half = tanh(scale(self.M / (2 * self.epsilon), eta))
            total = add(total, scale(2 * self.M, half))
        return total

    def slope_at_most(self, p: Interval) -> Interval:
        """L: sup phi' over [0, p], where phi'' changes sign at most once, from - to +."""
        flat, curved = ZERO_I, scale(self.c * self.N, power(p, Fraction(self.N - 1)))
        if self.M:
            steep = self.M * self.M / self.epsilon
            bent = tanh(scale(self.M / self.epsilon, p))
            flat = from_fraction(steep)
            curved = add(curved, scale(steep, sub(ONE_I, power(bent, Fraction(2)))))
        return add(from_fraction(self.k), _call("max", (flat, curved)))

    def coupled(self, p: Interval, load: Interval, gain: Interval, ahead: Interval) -> Interval:
        """B: sup over 0 <= s <= p of phi'(s) (D + G (p_next + s_next + phi(s))).

        The supremum grows with p, D, G and p_next + s_next: it is bisected at their upper ends,
        and its lower end is scaled down by what their lower ends can change it.
        """
        s = sym("s")
        pull = combine([(1, sym("ahead")), (1, self.of(s))])
        form = multiply(
            [
                (self.slope_of(s), 1),
                (combine([(1, sym("load")), (1, multiply([(sym("gain"), 1), (pull, 1)]))]), 1),
            ]
        )
        tape = Tape(form, ("ahead", "gain", "load", "s"))
        top = supremum(tape, ((ahead[1],) * 2, (gain[1],) * 2, (load[1],) * 2, (0, p[1])))
        shrink = ONE
        for part in (ahead, gain, load):
            shrink = min(shrink, (part[0] << P) // part[1] if part[1] > 0 else ONE)
        return mul((top[0], top[1]), (mul((shrink, shrink), (shrink, shrink))[0], ONE))

    def of(self, e: Node) -> Node:
        """Phi of an expression."""
        terms = [(self.k, e), (self.c, multiply([(e, self.N)]))]
        if self.M:
            terms.append((self.M, function("tanh", (combine([(self.M / self.epsilon, e)]),))))
        return combine(terms)

    def slope_of(self, e: Node) -> Node:
        """Phi' of an expression."""
        slope: list[tuple[Fraction, Node]] = [(self.k, UNIT)]
        if self.M:
            bent = function("tanh", (combine([(self.M / self.epsilon, e)]),))
            flat = minus(UNIT, multiply([(bent, 2)]))
            slope.append((self.M * self.M / self.epsilon, flat))
        slope.append((self.c * self.N, multiply([(e, self.N - 1)])))
        return combine(slope)

    def jump(self, shift: Interval, earlier: Gain, reach: Interval) -> Interval:
        """Delta of section 8: sup |phi(e + d) - phi_earlier(e)|, |e| <= reach, |d| <= shift.

        Both are odd, so the modulus is reached with a positive sign, and phi increases, so
        d = shift: one dimension is left. The lower end allows for the width of the shift.
        """
        e, d = sym("e"), sym("d")
        moved = combine([(1, e), (1, d)]) if shift[1] else e
        tape = Tape(minus(self.of(moved), earlier.of(e)), ("d", "e"))
        low, high = supremum(tape, ((shift[1],) * 2, (-reach[1], reach[1])))
        slack = (shift[1] - shift[0], reach[1] - reach[0])
        steep = [gain.slope_at_most(add(reach, shift))[1] for gain in (self, earlier)]
        lost = mul((slack[0] + slack[1],) * 2, (sum(steep),) * 2)[1]
        return max(0, low - lost), max(0, high)


@dataclass(frozen=True, slots=True)
class Tall:
    """phi(e) = gamma H(rho) e + c e^N of Theorem 1, exact.

    ``H`` are coefficients >= 0, the constant first: H and its slope are nondecreasing in rho.
    At rho = 1 it is the steepest, a ``Gain`` with k = gamma H(1).
    """

    gamma: Fraction
    H: tuple[Fraction, ...]
    c: Fraction
    N: int

    @property
    def powers(self) -> int:
        """Degree of H."""
        return len(self.H) - 1

    @property
    def k(self) -> Fraction:
        """The linear gain at rho = 1."""
        return self.gamma * sum(self.H)

    @property
    def M(self) -> Fraction:
        """There is no tanh."""
        return Fraction(0)

    @property
    def epsilon(self) -> Fraction:
        """There is no tanh to scale."""
        return Fraction(1)

    def steepest(self) -> Gain:
        """Return phi at rho = 1."""
        return Gain(self.k, self.M, self.epsilon, self.c, self.N)

    def height(self, rho: Interval) -> Interval:
        """H(rho) by Horner's rule."""
        return _horner(self.H, rho)

    def bend(self, rho: Interval) -> Interval:
        """H'(rho)."""
        return _horner([j * h for j, h in enumerate(self.H)][1:], rho)

    def phi(self, e: Interval, rho: Interval = ONE_I) -> Interval:
        """Range of phi."""
        linear = mul(scale(self.gamma, self.height(rho)), e)
        return add(linear, scale(self.c, power(e, Fraction(self.N))))

    def slope_at_most(self, p: Interval, rho: Interval = ONE_I) -> Interval:
        """L: phi' at the corner e = p, where it is largest."""
        curved = scale(self.c * self.N, power(p, Fraction(self.N - 1)))
        return add(scale(self.gamma, self.height(rho)), curved)


def _horner(coefficients: Sequence[Fraction], rho: Interval) -> Interval:
    value = ZERO_I
    for coefficient in reversed(coefficients):
        value = add(mul(value, rho), from_fraction(coefficient))
    return value


def tall_of(values: Sequence[Any], path: str) -> Tall:
    """Check (gamma, H, c, N): phi must be odd and strictly increasing at every rho."""
    gamma, c, N = Fraction(values[0]), Fraction(values[2]), int(values[3])
    H = tuple(Fraction(h) for h in values[1])
    if not 1 <= len(H) <= _MOST_POWERS or min(H) < 0 or H[0] <= 0:
        raise MalformedError(f"{path}: H needs 1 to {_MOST_POWERS} coefficients >= 0, H(0) > 0")
    if min(gamma, c) < 0 or gamma + c == 0:
        raise MalformedError(f"{path}: gamma, c >= 0, not both 0, are needed")
    if N < 3 or N % 2 == 0 or N > 63:
        raise MalformedError(f"{path}: N = {N} is no odd number from 3 to 63")
    return Tall(gamma, H, c, N)


def gain_of(values: Sequence[float | int | Fraction], path: str) -> Gain:
    """Check (k, M, epsilon, c, N): phi must be odd, continuous and strictly increasing."""
    k, M, epsilon, c = (Fraction(value) for value in values[:4])
    N = int(values[4])
    if min(k, M, c) < 0 or k + M + c == 0 or (M > 0 and epsilon <= 0):
        raise MalformedError(f"{path}: k, M, c >= 0, not all 0, and epsilon > 0 are needed")
    if N < 3 or N % 2 == 0 or N > 63:
        raise MalformedError(f"{path}: N = {N} is no odd number from 3 to 63")
    return Gain(k, M, epsilon if M > 0 else Fraction(1), c, N)


@dataclass(frozen=True, slots=True)
class Goal:
    """``node <= 0`` over a box: what a pointwise claim falls into.

    ``plain`` is what must not be positive; ``node`` the same without a factor >= 0. ``signs``
    says which state each "+" symbol stands for, and with which sign.
    """

    node: Node
    plain: Node
    ranges: tuple[tuple[str, Interval], ...]
    signs: tuple[tuple[str, int], ...] = ()

    @property
    def leaf(self) -> Any:
        """Return the tree that is one leaf."""
        return [-1]

    def tape(self, node: Node) -> tuple[Tape, Box]:
        """Return a compiled expression and its box."""
        names = self.names(node)
        return Tape(node, names), tuple(interval for name, interval in self.ranges if name in names)

    def names(self, node: Node) -> list[str]:
        """List the symbols of an expression in the box's order."""
        present = symbols(node)
        return [name for name, _ in self.ranges if name in present]

    def witness(self, boxes: int) -> dict[str, float] | None:
        """Search a point where ``plain`` is certainly positive; names with their values."""
        tape, box = self.tape(self.plain)
        try:
            found, point = maximize(tape, box, None, boxes)
        except UndecidedError:
            return None
        if found[0] <= 0:
            return None
        signs = dict(self.signs)
        names = self.names(self.plain)
        return {
            name.lstrip("+#"): signs.get(name, 1) * ((lo + hi) / (2 * ONE))
            for name, (lo, hi) in zip(names, point, strict=True)
        }


@dataclass(frozen=True, slots=True)
class Facet(Goal):
    """``steep <= 0`` over a box: what a claim of a load or of the rate falls into."""

    steep: Steep = field(default_factory=lambda: Steep(NOTHING, ()))

    @property
    def leaf(self) -> Any:
        """Return the tree that is one leaf."""
        return "."

    def tape(self, node: Node) -> tuple[Tape, Box]:
        """Return what is bounded, and its box."""
        del node
        return self.steep, tuple(interval for _, interval in self.ranges)

    def names(self, node: Node) -> list[str]:
        """List the symbols of the box."""
        del node
        return [name for name, _ in self.ranges]


@dataclass(frozen=True, slots=True)
class Comparison:
    """lhs > rhs, or lhs >= rhs where not strict."""

    lhs: Interval
    rhs: Interval
    relation: str = ">"

    def verdict(self) -> str:
        """Judge by the ends that are apart; overlapping enclosures are undecided."""
        if self.lhs[0] > self.rhs[1] or (self.relation == ">=" and self.lhs[0] == self.rhs[1]):
            return "proved"
        if self.lhs[1] < self.rhs[0] or (self.relation == ">" and self.lhs[1] == self.rhs[0]):
            return "refuted"
        return "undecided"


@dataclass(frozen=True, slots=True)
class Obligation:
    """One claim that the certificate must contain.

    ``comparisons`` must all hold; the first is the one that is reported. ``pointwise`` are
    goals over the box, ``corner`` those of the weaker form, against the number that the chain
    used: it is all that the theorem needs.
    """

    id: str
    statement: str
    uses: tuple[str, ...]
    comparisons: tuple[Comparison, ...] = ()
    pointwise: tuple[Goal, ...] = ()
    corner: tuple[Goal, ...] = ()
    proof: str = "eval"


@dataclass(frozen=True, slots=True)
class Obligations:
    """Everything that must hold for these gains, and the constants it was made of.

    ``claims`` are in the order in which a certificate must list them. ``alternative`` is U2'
    in place of the claim U2 at the same place, if the method has it. ``box`` is the reachable
    box; ``rounding`` bounds the rounding of each measured error and of u (the last entry).
    ``laws`` are the stages of theorem3 in order, of which the last is this one, or it alone;
    ``gains`` are those of the last one, where they depend on rho the steepest.
    """

    problem: Problem
    gains: tuple[Gain, ...]
    half_widths: tuple[Fraction, ...]
    center: Center
    enclosures: dict[str, Interval]
    claims: tuple[Obligation, ...]
    alternative: Obligation | None
    box: dict[str, Interval]
    rounding: tuple[int, ...]
    assumptions: tuple[str, ...]
    laws: tuple[StageLaw, ...]


@dataclass(frozen=True, slots=True)
class StageLaw:
    """One law: it is left where a measured error is beyond ``stays`` (None: never).

    ``widths`` bound its errors, at the switch too; ``limit`` is more than they are measured to be
    there.
    """

    gains: tuple[Gain | Tall, ...]
    stays: tuple[Fraction, ...] | None
    widths: tuple[Fraction, ...]
    limit: tuple[int, ...]
    reach: tuple[int, ...]
    rounding: tuple[int, ...]


def passed_error(problem: Problem, size: int) -> int:
    """Bound what a number of this size loses where it is passed in: binary64 takes it whole."""
    return _ceil_shift(size, 24) if problem.arithmetic.single else 0


def clock_error(problem: Problem, elapsed: int) -> int:
    """Bound the error of t - t_0: its own rounding, in binary32 also those of t and t_0."""
    own = _ceil_shift(elapsed, problem.arithmetic.bits)
    return own + 2 * passed_error(problem, problem.latest)


def rounding_errors(
    problem: Problem, gains: Sequence[Gain | Tall], p: Sequence[Fraction], center: Center
) -> tuple[int, ...]:
    """Bound the rounding of each measured error and of u, for |ê_i| <= 2 p_i.

    (U0 gives |ê_i| <= p_i + eta_i < 2 p_i inside Omega.) Each operation rounds by at most one
    unit, 2^-53 or 2^-24 of its result, tanh and the function in rho by at most C units; counts
    below are rounded up generously, which covers all terms of second order:

    y_d(t): ``Tape.rounding`` over [0, 1], [1, 2], [2, 4] .. the last time (1e6 s in binary64);
    the controller refuses later ones, and t - t_0 itself is rounded once. rho: at most 3 roundings
    of an argument y with |rho'(y) y| < 1.6, C for the function, 3 more: 16 + 2 C cover it. r_1 =
    y_d + rho a with a = x_1(0) - y_d(0). phi: k e one; M e / epsilon three, times y sech^2 y <=
    min(|y|, 1/2); tanh C (of at most min(|y|, 1)), a product 1; c e^N N; two additions. H(rho) by
    Horner's rule: 2 roundings a power, and those of rho times H' <= (number of powers) H(1).

    A handover adds rho times what was measured, and one addition; t - t_l has three roundings
    of times up to the last, which rho passes on times its rate. Center nominal has its
    own bounds, for r and v.

    In binary32 also what is passed in is rounded: x and x(0), which the four units of every sum
    have room for, y_d, and the two times, which rho passes on times its rate.
    """
    arithmetic, latest = problem.arithmetic, Fraction(problem.latest, ONE)
    unit = Fraction(1, 1 << arithmetic.bits)
    bent, faded = (
        max(arithmetic.function(name, ZERO_I, ONE) >> P for name in names)
        for names in (("tanh",), ("exp", "cos"))
    )
    late = 4 * latest if arithmetic.single else Fraction(0)
    reference = at_zero = 0
    following = center.following.rounding() if center.following is not None else None
    if problem.reference is not None and following is None:
        tape = Tape(problem.reference, ("t",))
        at_zero = tape.rounding((ZERO_I,), (0,), arithmetic)
        ends = [0, *(ONE << j for j in range(20) if ONE << j < problem.latest), problem.latest]
        for left, right in itertools.pairwise(ends):
            box, error = ((left, right),), clock_error(problem, right)
            reference = max(reference, tape.rounding(box, (error,), arithmetic))
        # In place of the compiled-in value that of the file may be passed in.
        low, high = over_time(problem.reference, {}, 0) if arithmetic.single else (ZERO_I, ZERO_I)
        passed = passed_error(problem, max(-low[0], high[1]))
        reference, at_zero = reference + passed, at_zero + passed
    elif problem.reference_bounds is not None:
        reference = at_zero = passed_error(problem, problem.reference_bounds[0][1])
    offset = absolute(center.offset)[1]
    errors: list[int] = []
    phi = phi_error = 0
    for i, (gain, half_width) in enumerate(zip(gains, p, strict=True)):
        size = scale(2 * half_width, ONE_I)
        r = center.size(i)[1]
        fading = offset if i == 0 else r
        terms = (24 + 2 * faded) * fading + 4 * (r + offset * (i == 0) + size[1] + phi)
        terms += scale(late, mul(problem.rhos[i].rate, (fading, fading)))[1]
        if center.switches:
            moved = center.moved[1] if i == 0 else r
            terms += (24 + 2 * faded) * moved + 2 * center.switches * (r + 2 * offset + 2 * moved)
            moving = mul(problem.rhos[i].rate, (moved, moved))
            terms += scale(4 * latest + 2 * late, moving)[1]
        own = (reference + at_zero) * (i == 0)
        if following is not None:
            own, terms = following[i], 4 * (r + size[1] + phi)
        errors.append(own + phi_error + scale(unit, (0, terms))[1] + 1)
        bend = min(scale(gain.M / gain.epsilon, size)[1], ONE)
        parts = (
            ((6 + 40 * gain.powers) * gain.k, size[1]),
            ((12 + bent) * gain.M, bend),
            ((gain.N + 6) * gain.c, power(size, Fraction(gain.N))[1]),
        )
        phi_error = sum(scale(unit * weight, (0, part))[1] for weight, part in parts) + 1
        phi = gain.phi(size)[1]
        quotient = scale(gain.M / gain.epsilon * max(2 * half_width, Fraction(1)), ONE_I)[1]
        arithmetic.within(max(quotient, phi, *(part for _, part in parts)))
    if following is not None:
        phi_error += following[-1] + scale(4 * unit, (0, center.size(len(p))[1] + phi))[1]
    return (*errors, phi_error)


def derive(
    document: object,
    gains: Sequence[Sequence[Any]],
    half_widths: Sequence[Any],
    c_0: float | Fraction | None = None,
    stages: Sequence[Sequence[Any]] = (),
    duration: float | Fraction | None = None,
    tight: tuple[Sequence[float | Fraction], float | Fraction] | None = None,
    arithmetic: tuple[str, str] = ("double", "libm"),
    chosen: Chosen | None = None,
) -> Obligations:
    """Derive every obligation from the plant, the gains and the tube.

    Parameters
    ----------
    document : object
        plant.json.
    gains : Sequence[Sequence[Any]]
        (k, M, epsilon, c, N) of phi_1..phi_n, for theorem1 (gamma, H, c, N); binary64 numbers
        are taken exactly.
    half_widths : Sequence[Any]
        p_1..p_n.
    c_0 : float or Fraction, optional
        For theorem1: what the power terms may add to the error of alpha.
    stages : Sequence[Sequence[Any]]
        For theorem3: (gains, p, widened p) of the stages below the last one.
    duration : float or Fraction, optional
        For center nominal: T_s [s].
    tight : tuple, optional
        For bounds tight: the claimed loads and rate.
    arithmetic : tuple[str, str]
        What the controllers compute with: double or float, libm or portable.
    chosen : Chosen, optional
        What the objective of the file leaves to the design, and its value.

    Returns
    -------
    Obligations
        Claims in order, constants, reachable box, assumptions.

    Raises
    ------
    MalformedError
        If the plant or the gains are none.
    UndecidedError
        If a bound meets a pole, a domain or a reference that cannot be enclosed.

    References
    ----------
    docs/theory.md sections 1 to 4 and 6 to 8.
    """
    more = (c_0, stages, duration, tight, arithmetic, chosen)
    question = repr((document, gains, half_widths, *more))
    if question not in _ANSWERED:
        _ANSWERED.clear()
        _ANSWERED[question] = _derived(
            document,
            gains,
            half_widths,
            c_0,
            stages,
            duration,
            tight,
            Arithmetic(*arithmetic),
            chosen,
        )
    return _ANSWERED[question]


_ANSWERED: dict[str, Obligations] = {}  # the last one: a folder asks for it more than once


def _derived(
    document: object,
    gains: Sequence[Sequence[Any]],
    half_widths: Sequence[Any],
    c_0: float | Fraction | None,
    stages: Sequence[Sequence[Any]],
    duration: float | Fraction | None,
    tight: tuple[Sequence[float | Fraction], float | Fraction] | None,
    arithmetic: Arithmetic,
    chosen: Chosen | None,
) -> Obligations:
    problem = replace(read_plant(document, chosen), arithmetic=arithmetic)
    if arithmetic.single and problem.method in ("theorem1", "theorem2"):
        raise UndecidedError(f"{problem.method} neglects rounding: float needs method unified")
    if (c_0 is not None) != (problem.method == "theorem1") or len(stages) != problem.free:
        raise MalformedError(f"design: not one of {problem.method} with {problem.free} free stages")
    p = _widths(problem, half_widths)
    problem = _with_center(problem, "performance" if duration is None else "nominal")
    if duration is not None:
        _check_nominal(problem)
    if c_0 is not None and tight is None:
        tall = tuple(tall_of(g, f"gains[{i}]") for i, g in enumerate(_each(problem, gains)))
        return _Theorem1(problem, tall, p, Fraction(c_0)).obligations()
    shapes = _shapes(problem, gains)
    if (tight is not None) != (problem.bounds == "tight"):
        raise MalformedError("design: tight belongs to bounds tight, and only there")
    claimed = None
    if tight is not None:
        claimed = Tight(tuple(map(Fraction, _each(problem, tight[0]))), Fraction(tight[1]))
    if duration is not None:
        if not Fraction(1, 10**6) <= duration <= 10**6:
            raise MalformedError("design.T_s: from 1e-6 to 1e6 s")
        center = nominal_center(problem, Fraction(duration))
        return _Chain(problem, shapes, p, center, (), claimed).obligations()
    center = performance_center(problem)
    free: list[_FreeStage] = []
    for given in stages:
        stage = _FreeStage(
            problem,
            _shapes(problem, given[0]),
            _widths(problem, given[2]),
            center_after(center, free),
            free,
        )
        stage.watch(_widths(problem, given[1]))
        free.append(stage)
    return _Chain(problem, shapes, p, center_after(center, free), free, claimed).obligations()


def at_period(found: Obligations, tight: Tight | None, period: Fraction) -> Obligations:
    """Derive what must hold with another time between samples: center and tube stay.

    For method unified in binary64; nothing that is verified rests on this.
    """
    problem = replace(found.problem, period=from_fraction(period))
    return _Chain(problem, found.gains, found.half_widths, found.center, (), tight).obligations()


def _with_center(problem: Problem, chosen: str) -> Problem:
    """Take the center of the design, where the file leaves it open.

    Either theorem is about such a plant: without declared bounds f* and g* are made of f and g.
    """
    bounded = any(c.f_bound is not None or c.g_bound is not None for c in problem.channels)
    asked = "performance" if problem.center == "open" and bounded else problem.center
    if asked not in (chosen, "open"):
        raise MalformedError("design: T_s belongs to center nominal, and only there")
    kept = tuple(pair for pair in problem.fixed if chosen == "nominal" or pair[0] != "T_s")
    return replace(problem, center=chosen, fixed=kept)


def _each(problem: Problem, values: Sequence[Any]) -> Sequence[Any]:
    if len(values) != len(problem.states):
        raise MalformedError(f"{len(problem.states)} gains and half-widths are needed")
    return values


def _shapes(problem: Problem, gains: Sequence[Any]) -> tuple[Gain, ...]:
    return tuple(gain_of(g, f"gains[{i}]") for i, g in enumerate(_each(problem, gains)))


def _widths(problem: Problem, half_widths: Sequence[Any]) -> tuple[Fraction, ...]:
    p = tuple(Fraction(half_width) for half_width in _each(problem, half_widths))
    if min(p) <= 0:
        raise MalformedError("a half-width that is not positive")
    return p


_NEVER = (_LARGEST + 1,) * 2


@dataclass(frozen=True, slots=True)
class Tight:
    """What bounds tight claims: loads of the facets, and the rate of e_n without the input."""

    load: tuple[Fraction, ...]
    rate: Fraction


def performance_cover(problem: Problem) -> list[tuple[dict[str, Node], dict[str, Interval]]]:
    """r_i = "#r{i}" and dr_i = "#d{i}" of center performance over pieces that cover all t >= 0.

    Each piece has nodes and the ranges of their symbols: t, or phases and what belongs to them;
    a = "#a1" and the starts "#a{i}"; y_d and dy_d where only bounds of them are known. rho_i is
    0 from its end on; pieces overlap by the widths of the enclosures of the ends.
    """
    starts, bounds = widened_starts(problem), problem.reference_bounds
    ranges = {f"#a{k + 1}": start for k, start in enumerate(starts)}
    ranges["#a1"] = first_offset(problem, starts[0])
    y, dy = sym("#y"), sym("#dy")
    if bounds is not None:
        ranges |= {"#y": (-bounds[0][1], bounds[0][1]), "#dy": (-bounds[1][1], bounds[1][1])}
    elif problem.reference is not None:
        y, dy = problem.reference, derivative(problem.reference, "t")
    ends = sorted({rho.end for rho in problem.rhos if rho.end is not None})
    if any(a[1] >= b[0] for a, b in itertools.pairwise(ends)):
        raise UndecidedError("performance functions that end at almost the same time")

    def path(end: Interval | None) -> dict[str, Node]:
        found: dict[str, Node] = {}
        for k, rho in enumerate(problem.rhos):
            over = rho.end is not None and (end is None or rho.end < end)
            fading = NOTHING if over else rho.node
            for key, fade, own in (("r", fading, y), ("d", derivative(fading, "t"), dy)):
                part = multiply([(fade, 1), (sym(f"#a{k + 1}"), 1)])
                found[f"#{key}{k + 1}"] = combine([(1, part), (int(k == 0), own)])
        return found

    pieces: list[tuple[dict[str, Node], dict[str, Interval]]] = []
    begin = 0
    for end in ends:
        pieces.append((path(end), {**ranges, "t": (begin, end[1])}))
        begin = end[0]
    last = path(None)
    nodes, turns = common_phases(list(last.values()))
    if not any("t" in symbols(node) for node in nodes):
        return [*pieces, (dict(zip(last, nodes, strict=True)), {**ranges, **turns})]
    right, reason = max(ONE, 2 * begin), ""
    for _ in range(12):
        try:
            tail = Tail(right, {**ranges, **turns})
            settled = dict(zip(last, map(tail.abstract, nodes), strict=True))
        except UndecidedError as error:
            reason = str(error)
        else:
            own = [a for name, a in tail.ranges.items() if name not in {**ranges, **turns}]
            if right >= ONE << 8 or all(hi - lo <= ONE >> 8 for lo, hi in own):
                pieces.append((last, {**ranges, "t": (begin, right)}))
                return [*pieces, (settled, tail.ranges)]
        right *= 2
    raise UndecidedError(f"the reference cannot be enclosed: {reason}")


class _Signals:
    """r_1..r_n and v of center nominal over parts of a stretch, with slopes.

    Coordinates, where they are no points: time (or phase), every start, the offset and y_d,
    dy_d, .. where they are passed in.
    """

    def __init__(self, path: Trajectory, stretch: Stretch) -> None:
        self.path, self.stretch, problem = path, stretch, path.problem
        phases = zip(_PHASES, stretch.others, strict=False)
        self.inputs: dict[str, Interval] = {"t": stretch.t, **dict(phases)}
        self.passed: list[str] = []
        if stretch.fading:
            starts = widened_starts(problem)
            self.inputs |= {f"#a{k + 1}": start for k, start in enumerate(starts)}
            if problem.reference is None:
                self.inputs["#offset"] = run_time_offset(problem, starts[0])
        if problem.reference is None:
            y = path.reference(Exact(), ZERO_I, path.n + 1)
            self.passed = [f"#y{k}" for k in range(len(y))]
            self.inputs |= dict(zip(self.passed, y, strict=True))
        self.wide = [name for name, (lo, hi) in self.inputs.items() if lo < hi]
        self._known: dict[Box, tuple[list[Interval], list[tuple[Interval, ...]]]] = {}
        self._weights: dict[Any, Series] = {}

    def over(self, box: Box) -> tuple[list[Interval], list[tuple[Interval, ...]]]:
        """Enclose r_1..r_n, v and their slopes by the coordinates over a part."""
        if box not in self._known:
            if len(self._known) > 20_000:
                self._known.clear()
            self._known[box] = self._enclosed(box)
        return self._known[box]

    def _enclosed(self, box: Box) -> tuple[list[Interval], list[tuple[Interval, ...]]]:
        if all(lo == hi for lo, hi in box):
            return [a[0] for a in self._series(Exact(), box)], []
        middle = tuple(((lo + hi) >> 1,) * 2 for lo, hi in box)
        moved = list(map(sub, box, middle))
        values, slopes = [], []
        for a, point in zip(self._series(Sloped(), box), self.over(middle)[0], strict=True):
            value, slope = a[0]
            values.append(_meet(value, add(point, total(map(mul, slope, moved)))))
            slopes.append(slope)
        return values, slopes

    def _series(self, numbers: Exact, box: Box) -> list[Series]:
        path, settled = self.path, self.stretch.settled
        whole = {**self.inputs, **dict(zip(self.wide, box, strict=True))}
        seeds: dict[str, Any] = {name: numbers.input(a, 0, 0) for name, a in whole.items()}
        if isinstance(numbers, Sloped):
            for name in self.wide:
                slope = tuple(ONE_I if other == name else ZERO_I for other in self.wide)
                seeds[name] = whole[name], slope
        weights = None
        if self.stretch.fading:
            begin = [name for name in seeds if name[:2] in ("#a", "#o")]
            key = (type(numbers), *(whole[name] for name in begin))
            if key not in self._weights:
                starts = [seeds[name] for name in begin]
                self._weights[key] = path.latched(numbers, starts[: path.n], *starts[path.n :])
            weights = self._weights[key]
        if settled is not None:
            y = settled.series(numbers, tuple(whole.values()))
            if isinstance(numbers, Sloped):
                # Slopes by the phases that are no points.
                wide = [name in self.wide for name in whole]
                y = [(a, tuple(itertools.compress(by, wide))) for a, by in y]
        elif self.passed:
            y = [seeds[name] for name in self.passed]
        else:
            y = path.reference(numbers, seeds["t"], path.n + 1)
        return path.series(numbers, seeds["t"], weights, y[: path.n + 1])


class _Followed(Steep):
    """An expression in r_1..r_n, v ("#r{i}"), errors and parameters, along center nominal.

    A box begins with the coordinates of the signals.
    """

    def __init__(self, node: Node, signals: _Signals, names: Sequence[str]) -> None:
        count = signals.path.n + 1
        super().__init__(node, [*(f"#r{k + 1}" for k in range(count)), *names])
        self.signals, self.first, self.count = signals, len(signals.wide), count

    def _values(self, box: Box) -> list[Interval]:
        return super()._values((*self.signals.over(box[: self.first])[0], *box[self.first :]))

    def gradient(self, box: Box) -> tuple[Interval, Gradient]:
        """Value and slopes, those of the signals passed on to their coordinates."""
        value, inner = super().gradient(box)
        result = {j + self.first - self.count: s for j, s in inner.items() if j >= self.count}
        for k, slopes in enumerate(self.signals.over(box[: self.first])[1]):
            if k in inner:
                _accumulate(result, dict(enumerate(slopes)), inner[k])
        return value, result


class _Residual:
    """R_i of docs/theory.md section 9 over facets and tube, for every t, start and parameter.

    Made of true states: x_j = r_j + e_j - phi_{j-1}(e_{j-1}); along center nominal dr_j =
    f^_j(r) + g^_j(r) r_{j+1}. What is bounded only has a factor of known sign and is kept apart.
    At one time all of it belongs together: no inequality is used on the way, so damping helps.

    Truth is what the termwise chain takes for it: along center nominal f and g where they are
    given; with center performance |f| <= f_bound where that is given, else f with its
    parameters, and g from g_min (else g) to g_bound (else g).

    r and v are those of real arithmetic, from the start that was latched, whatever it is: the
    true errors are made of these. What the code computes instead differs by what eta and
    delta_u contain (``rounding_errors``); d e_i / dt on the tube has no part of it but u, and
    u - v stands apart in (U2), (U2') and V_n. So the rounding counts as for termwise bounds.

    A facet is taken with a thickness of 2^-40 p_i: the layer in which Theorem U wants |e_i| to
    decrease is a part of it, and f may jump at the facet itself.
    """

    def __init__(
        self, problem: Problem, gains: Sequence[Gain], p: Sequence[Interval], center: Center
    ) -> None:
        self.problem, self.gains, self.p, self.n = problem, gains, p, len(gains)
        self.following = center.following
        self.r = [sym(f"#r{k + 1}") for k in range(self.n + 1)]
        if self.following is None:
            self.r[-1] = NOTHING
        self.e = [sym(f"#e{k + 1}") for k in range(self.n)]
        self.values: dict[str, Node] = {}
        self.ahead: list[Node] = []
        for k, state in enumerate(problem.states):
            back = [(-1, gains[k - 1].of(self.e[k - 1]))] if k else []
            self.ahead.append(combine([(1, self.r[k]), (1, self.e[k]), *back]))
            self.values[state] = self.ahead[k]

    @functools.cached_property
    def stretches(self) -> list[_Signals]:
        """Pieces of time along center nominal."""
        path = self.following.path if self.following is not None else None
        return [_Signals(path, stretch) for stretch in path.stretches(1)] if path else []

    @functools.cached_property
    def cover(self) -> list[tuple[dict[str, Node], dict[str, Interval]]]:
        """Pieces of time of center performance."""
        return performance_cover(self.problem)

    def _at(self, node: Node | None) -> Node:
        return substitute(node, self.values) if node is not None else NOTHING

    def _gain(self, j: int) -> tuple[Node, Node]:
        """Middle and half the width of g_j; no width where g is known."""
        channel = self.problem.channels[j]
        least, most = channel.g_min or channel.g or UNIT, channel.g_bound or channel.g or UNIT
        if self.following is not None and channel.g is not None:
            least = most = channel.g
        low, high = self._at(least), self._at(most)
        half = Fraction(1, 2)
        return combine([(half, low), (half, high)]), combine([(half, high), (-half, low)])

    def _forces(self, j: int) -> tuple[Node, Node]:
        """f_j - dr_j, along center nominal by f^ and g^; then what is bounded only."""
        channel = self.problem.channels[j]
        f, bound = channel.f, channel.f_bound
        if self.following is None:
            # Center performance takes f*, declared or |f| itself, for all that is known of f.
            f, bound = None, f if bound is None else bound
            moved = sym(f"#d{j + 1}")
        else:
            model = self.following.path.model
            bound = bound if f is None else None
            r = dict(zip(self.problem.states, self.r, strict=False))
            carried = multiply([(substitute(model.g[j], r), 1), (self.r[j + 1], 1)])
            moved = combine([(1, substitute(model.f[j], r)), (1, carried)])
        unknown = [function("abs", (self._at(part),)) for part in (bound, channel.disturbance)]
        return minus(self._at(f), moved), combine((1, part) for part in unknown)

    def _moved(self, j: int, ahead: Node) -> tuple[Node, Node]:
        """de_j with a given x_{j+1}: what is known, and what is bounded only."""
        force, unknown = self._carried(j)
        middle, half = self._gain(j)
        size = function("abs", (ahead,))
        return (
            combine([(1, force), (1, multiply([(middle, 1), (ahead, 1)]))]),
            combine([(1, unknown), (1, multiply([(half, 1), (size, 1)]))]),
        )

    def _carried(self, i: int) -> tuple[Node, Node]:
        """R_i without g_i r_{i+1}."""
        force, unknown = self._forces(i)
        if i:
            slope = self.gains[i - 1].slope_of(self.e[i - 1])
            before, more = self._moved(i - 1, self.ahead[i])
            force = combine([(1, force), (1, multiply([(slope, 1), (before, 1)]))])
            unknown = combine([(1, unknown), (1, multiply([(slope, 1), (more, 1)]))])
        return force, unknown

    def facets(self, i: int, load: Fraction) -> tuple[Facet, ...]:
        """Where s e_i = p_i, and a little inside: s R_i - load g_i <= 0, with g_i > 0."""
        force, unknown = self._carried(i)
        middle, half = self._gain(i)
        goals: list[Facet] = []
        p = self.p[i]
        for side in (1, -1):
            rest = combine([(side, self.r[i + 1]), (-load, UNIT)])
            pull = multiply([(half, 1), (function("abs", (rest,)), 1)])
            middling = multiply([(middle, 1), (rest, 1)])
            node = combine([(side, force), (1, unknown), (1, middling), (1, pull)])
            near = (p[0] - (p[1] >> 40), p[1])
            goals += self._goals(node, i, near if side > 0 else neg(near))
        return tuple(goals)

    def rates(self, rate: Fraction) -> tuple[Facet, ...]:
        """On all of the tube: s R_n - rate <= 0."""
        last = self.n - 1
        known, unknown = self._moved(last, self.r[self.n])
        goals: list[Facet] = []
        for side in (1, -1):
            node = combine([(side, known), (1, unknown), (-rate, UNIT)])
            goals += self._goals(node, last, (-self.p[last][1], self.p[last][1]))
        return tuple(goals)

    def _goals(self, node: Node, i: int, facet: Interval) -> list[Facet]:
        tube = {f"#e{k + 1}": (-p[1], p[1]) for k, p in enumerate(self.p[:i])}
        tube |= {f"#e{i + 1}": facet, **self.problem.ranges}
        if self.following is None:
            goals = []
            for nodes, ranges in self.cover:
                whole = substitute(node, nodes)
                names = [name for name in {**ranges, **tube} if name in symbols(whole)]
                kept = tuple((name, {**ranges, **tube}[name]) for name in names)
                goals.append(Facet(whole, whole, kept, (), Steep(whole, names)))
            return goals
        names = [name for name in tube if name in symbols(node)]
        found = []
        for signals in self.stretches:
            kept = tuple((name, signals.inputs[name]) for name in signals.wide)
            kept += tuple((name, tube[name]) for name in names)
            found.append(Facet(node, node, kept, (), _Followed(node, signals, names)))
        return found


class _Chain:
    """The recursion from X_1 to U, and the claims on its way.

    ``free`` are the chains of the stages before this one; ``mark`` tells their names apart.
    """

    mark = ""

    def __init__(
        self,
        problem: Problem,
        gains: tuple[Gain | Tall, ...],
        half_widths: tuple[Fraction, ...],
        center: Center,
        free: Sequence[_FreeStage] = (),
        tight: Tight | None = None,
    ) -> None:
        self.problem, self.gains, self.half_widths = problem, gains, half_widths
        self.tight = tight
        self.shapes = tuple(g if isinstance(g, Gain) else g.steepest() for g in gains)
        self.center, self.free = center, tuple(free)
        self.unified = problem.method in ("unified", "theorem3")
        self.n = len(gains)
        self.p = [from_fraction(width) for width in half_widths]
        self.rounding = rounding_errors(problem, gains, half_widths, self.center)
        # With H scheduled f_bound is evaluated on smaller boxes too: one number will not do.
        self.weaker = not any(gain.powers for gain in gains)
        if tight is not None and center.following is None:
            # The residual is made of f_bound, g_min, g_bound at every point, not of numbers.
            self.weaker = False
        self.tapes: dict[str, tuple[tuple[str, ...], Tape]] = {}
        self.table: dict[str, Interval] = {}
        self.plain: dict[int, Interval] = {}
        self.outer: dict[str, Interval] = dict(problem.ranges)
        self.inner: dict[str, Interval] = dict(problem.ranges)
        self.checks: list[Obligation] = []
        self.steps: list[Obligation] = []

    def _put(self, key: str, i: int, value: Interval) -> Interval:
        self.table[f"{key}{self.mark}[{self.problem.states[i]}]"] = value
        return value

    def _get(self, key: str, i: int) -> Interval:
        return self.table[f"{key}{self.mark}[{self.problem.states[i]}]"]

    def _extension(self, node: Node, ranges: Mapping[str, Interval]) -> Interval:
        if node.text not in self.tapes:
            names = tuple(sorted(symbols(node)))
            self.tapes[node.text] = names, Tape(node, names)
        names, tape = self.tapes[node.text]
        return tape.value(tuple(ranges[name] for name in names))

    def _majorant(
        self, node: Node, boxes: Sequence[Mapping[str, Interval]] | None = None
    ) -> Interval:
        """Sup of |node| as the natural interval extension over the reachable box gives it.

        The extension over the smaller, inner box is below it and encloses it from there.
        """
        small, large = (self._extension(node, box) for box in boxes or (self.inner, self.outer))
        return absolute(small)[1], absolute(large)[1]

    def walk(self) -> None:
        """Run the chain once from the first state to the last."""
        for i in range(self.n):
            try:
                self._constants(i)
                self._assumptions(i)
            except UndecidedError as error:
                place = self.problem.states[i] + self.mark.replace(".stage", " in stage ")
                raise UndecidedError(f"over the reachable box of {place}: {error}") from None

    def obligations(self) -> Obligations:
        """Walk, and collect everything that must hold."""
        self.walk()
        self._finish()
        alternative = None
        if self.unified:
            handovers = self._handovers()
            self.steps += handovers
            self.steps += self._tightened()
            for i in range(self.n):
                self._step_unified(i)
            # A late command of an earlier stage need not push inward, as U2' counts on.
            if not (handovers and self.problem.delay[1]):
                alternative = self._last("U2'")
            self.steps.append(self._last("U2"))
        else:
            for i in range(self.n):
                self._step_theorem2(i)
        return self._collect(alternative)

    def _collect(self, alternative: Obligation | None) -> Obligations:
        chains = (*self.free, self)
        claims = [claim for chain in chains for claim in (*chain.checks, *chain.steps)]
        table = {key: value for chain in chains for key, value in chain.table.items()}
        return Obligations(
            problem=self.problem,
            gains=self.shapes,
            half_widths=self.half_widths,
            center=self.center,
            enclosures=table,
            claims=(*self._promises(), *claims, *self._limit()),
            alternative=alternative,
            box=self.outer,
            rounding=self.rounding,
            assumptions=_assumed(self.problem),
            laws=tuple(chain.law() for chain in chains),
        )

    def law(self) -> StageLaw:
        """Return what a test of the controller's law needs."""
        steps = range(self.n)
        return StageLaw(
            gains=self.gains,
            stays=self.stays(),
            widths=self.half_widths,
            limit=tuple(self.p[i][0] + self._get("eta", i)[0] for i in steps),
            reach=tuple(self._get("X", i)[1] for i in steps),
            rounding=self.rounding,
        )

    def stays(self) -> tuple[Fraction, ...] | None:
        """Return what measured errors must stay below for the law to be kept: nothing."""
        return None

    def _constants(self, i: int) -> None:
        """X_i, A_i, L_i, W_i, G_i, g_min_i, D_i, B_i, F*_i, eta_i and Lambda_i."""
        channel, gain, center = self.problem.channels[i], self.shapes[i], self.center
        state = self.problem.states[i]
        xi = self.p[i] if i == 0 else add(self.p[i], self._get("A", i - 1))
        low, high = center.low[i], center.high[i]
        self.outer[state] = (low[0] - xi[1], high[1] + xi[1])
        # The inner ends may pass each other by a few units of 2^-P where both are points.
        inner = (low[1] - xi[0], high[0] + xi[0])
        self.inner[state] = inner if inner[0] <= inner[1] else self.outer[state]
        self._put("xi", i, xi)
        self._put("X", i, add(center.size(i), xi))
        self._put("r_lower", i, low)
        self._put("r_upper", i, high)
        self._put("A", i, gain.phi(self.p[i]))
        self._put("L", i, gain.slope_at_most(self.p[i]))
        for node in channel.partial:
            self._extension(node, self.outer)
        self._put("rate", i, center.rate[i])
        largest = channel.g_bound if channel.g_bound is not None else channel.g
        self._put("G", i, self._majorant(largest if largest is not None else UNIT))
        least = channel.g_min if channel.g_min is not None else channel.g
        least = least if least is not None else UNIT
        smallest = (self._extension(least, self.outer)[0], self._extension(least, self.inner)[0])
        self._put("g_min", i, (smallest[0], max(smallest)))
        ahead = ZERO_I
        if i + 1 < self.n:
            feed = ZERO_I if center.following is not None else center.size(i + 1)
            ahead = add(self.p[i + 1], self._put("s", i, feed))
        try:
            self._termwise(i, ahead)
        except UndecidedError:
            if self.tight is None:
                raise
        if self.tight is not None:
            claimed = self._put("load", i, from_fraction(self.tight.load[i]))
            self._put("F_star", i, add(claimed, self.p[i + 1] if i + 1 < self.n else ZERO_I))
        inherited = ZERO_I if i == 0 else self._get("Lambda", i - 1)
        factor = 2 if self.problem.anchor == "exact" else 1
        measured = scale(Fraction(factor), self.problem.delta[i])
        if self.unified:
            measured = add(measured, (0, self.rounding[i]))
        eta = self._put("eta", i, add(measured, inherited))
        self._put("Lambda", i, gain.spread(self.p[i], eta))

    def _termwise(self, i: int, ahead: Interval) -> None:
        """W_i, D_i, F*_i and B_i, each factor bounded apart."""
        channel, center = self.problem.channels[i], self.center
        if center.following is not None:
            load = self._residual(i, center.following)
        else:
            bounded = channel.f_bound if channel.f_bound is not None else channel.f
            force = self._majorant(bounded if bounded is not None else NOTHING)
            load = add(self._put("f_star", i, force), center.rate[i])
        load = self._put("W", i, add(load, self._majorant(channel.disturbance)))
        coupled = self.table.get(f"B{self.mark}[{self.problem.states[i - 1]}]") if i else ZERO_I
        if coupled is None:
            raise UndecidedError("no termwise bound of the state before")
        load = self._put("D", i, add(load, coupled))
        least = self._get("g_min", i)
        if least[0] > 0:
            demand = self._put("F_star", i, add(div(load, least), ahead))
            own = self.p[i + 1] if i + 1 < self.n else ZERO_I
            self.plain[i] = sub(demand, own)
        if i + 1 < self.n:
            gain = self.shapes[i]
            self._put("B", i, gain.coupled(self.p[i], load, self._get("G", i), ahead))

    def _residual(self, i: int, center: Following) -> Interval:
        """W_i without the disturbance: model error, deviation, and what f^ leaves out."""
        states = self.problem.states[: i + 1]
        (lowest, low), (high, highest) = self.center.low[i + 1], self.center.high[i + 1]
        reach = [self._get("xi", j) for j in range(i + 1)]
        small, large = (
            center.errors[i].away([box[state] for state in states], ahead, reach)
            for box, ahead in (
                (self.inner, (min(low, high), max(low, high))),
                (self.outer, (lowest, highest)),
            )
        )
        away = self._put("away", i, (min(small[0], large[1]), large[1]))
        unknown = self._put("unknown", i, center.unknown[i])
        left = self._put("left_out", i, self._majorant(center.path.model.left[i]))
        return add(add(away, unknown), add(left, self._unknown_gain(i, center)))

    def _unknown_gain(self, i: int, center: Following) -> Interval:
        """Bound (g - g^) r_next where g is known by its bounds only, in whose middle g^ is."""
        channel, states = self.problem.channels[i], self.problem.states
        if channel.g is not None:
            return ZERO_I
        box = {s: (self.center.low[j][0], self.center.high[j][1]) for j, s in enumerate(states)}
        followed = self._extension(center.path.model.g[i], box)
        above = self._extension(channel.g_bound or UNIT, self.outer)[1] - followed[0]
        below = followed[1] - self._extension(channel.g_min or UNIT, self.outer)[0]
        most = max(above, below, 0)
        return 0, mul((most, most), self.center.size(i + 1))[1]

    def _assumptions(self, i: int) -> None:
        """f_bound, g_min and g_bound of the file against its f and g, over the reachable box."""
        channel, state = self.problem.channels[i], self.problem.states[i]
        # Center nominal takes f, where it is given, for the truth, and uses no bound of it.
        used = self.center.following is None
        if used and channel.f is not None and channel.f_bound is not None:
            pair = [
                (channel.f, channel.f_bound),
                (combine([(-1, channel.f)]), channel.f_bound),
            ]
            most = self.table.get(f"f_star{self.mark}[{state}]", ZERO_I)[1]
            self._check("f_bound", i, f"|f| <= f_bound of {state}", pair, most)
        positive = Comparison(self._get("g_min", i), ZERO_I)
        pair = []
        if channel.g is not None and channel.g_min is not None:
            pair = [(channel.g_min, channel.g)]
        least = self._get("g_min", i)[0]
        self._check("g_min", i, f"g >= g_min > 0 of {state}", pair, -least, (positive,))
        if channel.g is not None and channel.g_bound is not None:
            most = self._get("G", i)[1]
            statement = f"g <= g_bound of {state}"
            self._check("g_bound", i, statement, [(channel.g, channel.g_bound)], most)

    def _check(
        self,
        name: str,
        i: int,
        statement: str,
        pairs: Sequence[tuple[Node, Node]],
        number: int,
        comparisons: tuple[Comparison, ...] = (),
    ) -> None:
        """Claim a <= b for pairs (a, b); the weaker form is against the number in W or F*."""
        goals = [goal for a, b in pairs for goal in self._orthants(minus(a, b))]
        weak: list[Goal] = []
        bound = num(Fraction(number, ONE))
        for a, b in pairs if self.weaker else ():
            # For g_min the number is on the other side: -g <= -number.
            node = combine([(-1, b)]) if name == "g_min" else a
            weak.append(self._goal(minus(node, bound), {}, {}))
        place = f"{name}{self.mark}[{self.problem.states[i]}]"
        self.checks.append(Obligation(place, statement, (), comparisons, tuple(goals), tuple(weak)))

    def _goal(self, plain: Node, renamed: Mapping[str, Interval], signs: Mapping[str, int]) -> Goal:
        ranges = {**self.outer, **renamed}
        kept = tuple((name, ranges[name]) for name in sorted(symbols(plain)))
        return Goal(without_common_power(plain), plain, kept, tuple(sorted(signs.items())))

    def _orthants(self, node: Node) -> list[Goal]:
        """One goal for each sign pattern of the states: with x = +-y, y >= 0, moduli vanish.

        A common power of a y >= 0 is divided out; what remains is claimed for y = 0 too.
        """
        present = [name for name in self.problem.states if name in symbols(node)]
        choices: list[list[tuple[int, Interval]]] = []
        for name in present:
            lo, hi = self.outer[name]
            sides = [(1, (max(lo, 0), hi))] if hi >= 0 else []
            choices.append(sides + ([(-1, (max(-hi, 0), -lo))] if lo < 0 else []))
        if math.prod(map(len, choices)) > 64:
            return [self._goal(node, {}, {})]
        goals: list[Goal] = []
        for pattern in itertools.product(*choices):
            values = {
                name: combine([(side, sym(f"+{name}"))])
                for name, (side, _) in zip(present, pattern, strict=True)
            }
            renamed = {
                f"+{name}": interval for name, (_, interval) in zip(present, pattern, strict=True)
            }
            signs = {f"+{name}": side for name, (side, _) in zip(present, pattern, strict=True)}
            goal = self._goal(substitute(node, values), renamed, signs)
            if goal.node.kind != "num" or goal.node.number > 0:
                goals.append(goal)
        return goals

    def _finish(self) -> None:
        """V_n, zeta, U and what the held input adds to the last inequality.

        The commands of the stages before count in U, and with a delay in V: they may still act.
        """
        last = self.n - 1
        gain, p, eta = self.gains[last], self.p[last], self._get("eta", last)
        error, rounded = self.problem.actuator_error, (0, self.rounding[-1] if self.unified else 0)
        force = gain.phi(add(p, eta)) if self.unified else gain.phi(p)
        command = add(force, rounded)
        largest = _call("max", [command, *(stage.peak for stage in self.free)])
        self.table["delta_u"] = add(error, rounded)
        hold = add(self.problem.period, self.problem.delay)
        held = largest if self.problem.delay[1] else command
        self.table["delta_v"] = ZERO_I
        if self.center.following is not None:
            following = self.center.following
            v = self.table["v"] = self.center.size(self.n)
            late = self.table["delta_v"] = mul(hold, following.v_rate)
            held, largest = _call("max", (add(held, late), following.v_start)), add(v, command)
        self.table["U"] = add(largest, error)
        speed = add(self._drift(), mul(self._get("G", last), add(held, error)))
        self.table["hold"], self.table["V"] = hold, speed
        self.table["zeta"] = add(eta, mul(hold, speed))

    def _drift(self) -> Interval:
        """Bound |de_n| without the input: D_n, or what is claimed of it."""
        if self.tight is None:
            return self._get("D", self.n - 1)
        return from_fraction(self.tight.rate)

    def _tightened(self) -> list[Obligation]:
        """Claims of loads and rate (docs/theory.md section 9), where they are below termwise."""
        if self.tight is None:
            return []
        if len(self.tight.load) != self.n:
            raise MalformedError(f"design.tight: {self.n} loads are needed")
        residual = _Residual(self.problem, self.shapes, self.p, self.center)
        claims: list[Obligation] = []
        for i, (state, load) in enumerate(zip(self.problem.states, self.tight.load, strict=True)):
            name = f"tight[{state}]"
            if self.plain.get(i, _NEVER)[1] <= from_fraction(load)[0]:
                comparison = Comparison(from_fraction(load), self.plain[i], ">=")
                statement = f"load_{i + 1} is at least the termwise D_{i + 1} / g_m + s_{i + 2}"
                claims.append(Obligation(name, statement, self._uses(i), (comparison,)))
                continue
            statement = f"s R_{i + 1} / g_{i + 1} <= load_{i + 1} on the facets of {state}"
            goals = residual.facets(i, load)
            claims.append(Obligation(name, statement, self._uses(i), pointwise=goals))
        return [*claims, self._rate(residual, self.tight.rate)]

    def _loads(self, i: int) -> tuple[str, ...]:
        """Ids of the claims that F*_i is made of; for i = n of the rate in V_n too."""
        if self.tight is None:
            return ()
        state = self.problem.states[i]
        rate = (f"tight.rate[{state}]",) if i + 1 == self.n else ()
        return (f"tight[{state}]", *rate)

    def _rate(self, residual: _Residual, rate: Fraction) -> Obligation:
        last, state = self.n - 1, self.problem.states[-1]
        name, uses, claimed = f"tight.rate[{state}]", self._uses(last), from_fraction(rate)
        drift = self.table.get(f"D[{state}]", _NEVER)
        if drift[1] <= claimed[0]:
            statement = f"rate is at least the termwise D_{self.n}"
            comparison = Comparison(claimed, drift, ">=")
            return Obligation(name, statement, uses, (comparison,))
        statement = f"|R_{self.n}| <= rate on the tube"
        return Obligation(name, statement, uses, pointwise=residual.rates(rate))

    def _handovers(self) -> list[Obligation]:
        """Theorem 3, containment: the tube contains every jump out of every earlier stage."""
        if self.problem.handover != "containment":
            return []
        late = mul(self.problem.delay, self.table["V"])
        return [
            claim
            for stage in self.free
            for claim in stage.handovers(self.shapes, self.half_widths, late)
        ]

    def _uses(self, i: int) -> tuple[str, ...]:
        """Ids of the checks of the channels up to i, which W, G and g_min rest on.

        The center, or what the last tube contains, rests on the stage before.
        """
        names = [f"[{state}]" for state in self.problem.states[: i + 1]]
        before = [claim for stage in self.free[-1:] for claim in stage.steps]
        before += [claim for claim in self.steps if claim.id.startswith("T3.handover")]
        own = [c for c in self.checks if c.id[c.id.index("[") :] in names]
        return tuple(claim.id for claim in (*before, *own))

    def _demand(self, i: int) -> Interval:
        """F*_i; without a positive g_min nothing suffices."""
        return self.table.get(f"F_star[{self.problem.states[i]}]", (0, _LARGEST))

    def _step_unified(self, i: int) -> None:
        state = self.problem.states[i]
        before = (f"U0[{self.problem.states[i - 1]}]",) if i else ()
        room = Comparison(self.p[i], self._get("eta", i))
        statement = f"p_{i + 1} > eta_{i + 1}"
        self.steps.append(Obligation(f"U0[{state}]", statement, before, (room,)))
        if i + 1 < self.n:
            force = Comparison(self._get("A", i), self._demand(i))
            statement = f"phi_{i + 1}(p_{i + 1}) > F*_{i + 1}"
            uses = (*self._uses(i), *self._loads(i), f"U0[{state}]")
            self.steps.append(Obligation(f"U1[{state}]", statement, uses, (force,)))

    def _last(self, name: str) -> Obligation:
        last, n = self.n - 1, self.n
        gain, p, eta = self.gains[last], self.p[last], self._get("eta", last)
        hold = self.table["hold"]
        # A held v is an error of the input too.
        error = add(self.table["delta_u"], self.table["delta_v"])
        if name == "U2":
            late, rest = self.table["zeta"], sub(p, self.table["zeta"])
            statement = f"p_{n} > zeta and phi_{n}(p_{n} - zeta) > F*_{n} + delta_u"
        else:
            late = add(eta, scale(Fraction(2), mul(hold, self.table["V"])))
            drift = add(self._drift(), mul(self._get("G", last), error))
            rest = sub(sub(p, eta), mul(hold, drift))
            statement = (
                f"p_{n} > eta_{n} + 2 (h + tau) V and phi_{n}(p_{n} - eta_{n} - (h + tau) "
                f"(D_{n} + G_{n} delta_u)) > F*_{n} + delta_u"
            )
        demand = add(self._demand(last), error)
        main = Comparison(gain.phi(rest), demand)
        state = self.problem.states[last]
        uses = (*self._uses(last), *self._loads(last), f"U0[{state}]")
        return Obligation(f"{name}[{state}]", statement, uses, (main, Comparison(p, late)))

    def _step_theorem2(self, i: int) -> None:
        """(65), (71): k p + M + c p^N > F* + 0.2785 eps/p, as |s| - s tanh(s/eps) < 0.2785 eps."""
        state, gain, p = self.problem.states[i], self.gains[i], self.half_widths[i]
        left = from_fraction(gain.k * p + gain.M + gain.c * p**gain.N)
        extra = from_fraction(Fraction(2785, 10000) * gain.epsilon / p) if gain.M else ZERO_I
        main = Comparison(left, add(self._demand(i), extra))
        j = i + 1
        statement = f"k p + M + c p^N > F*_{j} + 0.2785 eps/p, i = {j}"
        self.steps.append(Obligation(f"T2[{state}]", statement, self._uses(i), (main,)))

    def _promises(self) -> list[Obligation]:
        """Claim what the file asks of the design: accuracy, and the numbers that it fixes."""
        asked = self.problem.accuracy
        # The promise is made for the binary64 number nearest to the file's decimal.
        comparison = Comparison((max(asked[0], _near(asked)[1]),) * 2, self.p[0], ">=")
        # A file that names no center may be certified with either: what is promised says which.
        statement = f"p_1 <= performance.accuracy, center {self.problem.center}"
        if self.center.following is not None:
            statement += f", T_s = {float(self.center.following.path.model.duration)!r}"
        if self.problem.chosen is not None:
            word, found = self.problem.chosen
            statement += f", {word} {found!r} chosen by its objective"
        if self.free:
            before = ", ".join(f"{float(stage.half_widths[0])!r}" for stage in self.free)
            statement += f" in the last stage; |e_1| <= {before} before it"
        claims = [Obligation("accuracy", statement, (), (comparison,), proof="rational")]
        held: list[Comparison] = []
        own = self._numbers()
        for stage in self.free:
            own |= stage._numbers()  # noqa: SLF001 (a chain like this one)
        for key, value in self.problem.fixed:
            if "epsilon_" in key and own[key.replace("epsilon", "M")] == ZERO_I:
                continue
            distance = absolute(sub(own.get(key, ZERO_I), value))
            close = 22 if self.problem.arithmetic.single else 50
            allowed = scale(Fraction(1, 1 << close), absolute(value))
            if key.startswith("room"):
                # eps_i is no constant of the controller but what p_i leaves beside D_i.
                allowed = scale(Fraction(1, 1 << 30), self.p[int(key[5:]) - 1])
            held.append(Comparison(allowed, (distance[1],) * 2, ">="))
        if held:
            statement = "the numbers that synthesis fixes are kept"
            claims.append(Obligation("fixed", statement, (), tuple(held), proof="rational"))
        return [*claims, *_funnel_claims(self.problem, self.center)]

    def _numbers(self) -> dict[str, Interval]:
        """Return the numbers of the design, by the names that the controllers give them."""
        found: dict[str, Interval] = {}
        prefix = self.mark[1:] + "_" if self.mark else ""
        for i, (gain, p) in enumerate(zip(self.gains, self.widths(), strict=True), start=1):
            values = {key: Fraction(getattr(gain, key)) for key in _SHAPE} | {"p": p}
            found |= {f"{prefix}{key}_{i}": from_fraction(v) for key, v in values.items()}
        if self.center.following is not None:
            found["T_s"] = from_fraction(self.center.following.path.model.duration)
        return found

    def widths(self) -> tuple[Fraction, ...]:
        """Return the half-widths that the controller contains."""
        return self.stays() or self.half_widths

    def _limit(self) -> list[Obligation]:
        if self.problem.limit is None:
            return []
        comparison = Comparison(self.problem.limit, self.table["U"], ">=")
        uses = tuple(step.id for step in self.steps if step.id.startswith(("U0", "T1.c")))
        return [Obligation("limit", "U <= actuator.limit", uses, (comparison,))]


def center_after(first: Center, free: Sequence[_FreeStage]) -> Center:
    """Bound the center of the law that follows these stages (docs/theory.md section 8).

    Reanchored: r_1 = y_d + rho_1 a + the sum of rhobar r_1^(l), where |r_1^(l)| is a measured
    error of stage l, at most p^_1 + eta_1; r_i = rhobar r_i^(m), a measured state of the stage
    just left; 0 <= rhobar <= 1. With containment the center stays.
    """
    if not free or free[0].problem.handover == "containment":
        return first
    problem, last = free[-1].problem, free[-1]
    moved = ZERO_I
    for stage in free:
        law = stage.table[f"eta{stage.mark}[{problem.states[0]}]"]
        moved = add(moved, add(stage.p[0], law))
    low, high = [sub(first.low[0], moved)], [add(first.high[0], moved)]
    rate = [add(first.rate[0], mul(problem.rhos[0].rate, moved))]
    factor = Fraction(2 if problem.anchor == "exact" else 1)
    for state, delta, rho in zip(
        problem.states[1:], problem.delta[1:], problem.rhos[1:], strict=True
    ):
        latched = add(last.table[f"X{last.mark}[{state}]"], scale(factor, delta))
        low.append(neg(latched))
        high.append(latched)
        rate.append(mul(rho.rate, latched))
    return Center(tuple(low), tuple(high), tuple(rate), first.offset, moved, len(free))


def _funnel_claims(problem: Problem, center: Center) -> list[Obligation]:
    """Claim that |y - y_d| <= |r_1 - y_d| + p_1 stays below the funnel of the file for ever.

    r_1 - y_d is b, or rho_1 a and what handovers add. The numbers are those nearest in binary64:
    what the file writes as equal is equal.
    """
    if problem.funnel is None:
        return []
    try:
        if center.following is not None:
            room, when = _clearance(center.following.path, problem.funnel)
            moved = f"|b(t)| + p_1 <= funnel(t) for all t >= 0, tightest {when}"
        else:
            room = sub(_beside_rho(problem, center, problem.funnel), center.moved)
            more = " + what handovers add" * (center.switches > 0)
            moved = f"rho_1(t) (a_0 + delta_0) + p_1{more} <= funnel(t) for all t >= 0"
    except UndecidedError as error:
        reason = str(error).rpartition(": ")[2]
        raise UndecidedError(f"the funnel cannot be enclosed: {reason}") from None
    needed = scale(1 - Fraction(1, 1 << 52), problem.accuracy)
    return [Obligation("funnel", moved, ("accuracy",), (Comparison(room, needed, ">="),))]


def _beside_rho(problem: Problem, center: Center, funnel: Node) -> Interval:
    """Enclose the infimum over t of funnel - rho_1 (a_0 + delta_0)."""
    rho, most = problem.rhos[0], absolute(center.offset)[1]
    if problem.anchor != "latched":
        most += problem.delta[0][1]
    node = combine([(1, funnel), (Fraction(-most, ONE), rho.node)])
    if rho.end is None:
        return over_time(node, {}, 0)[0]
    # From pi t_s on rho is 0; the two stretches overlap by the width of its enclosure.
    head = extremes(node, {"t": (0, rho.end[1])})
    return _call("min", (head[0], over_time(funnel, {}, rho.end[0])[0]))


class _Clearance(Tape):
    """|b(t)| - funnel(t) over a box of t, latched starts and, if y_d is unknown, what it may be."""

    def __init__(self, path: Trajectory, funnel: Node) -> None:
        super().__init__(funnel, ("t",))
        self.path, problem = path, path.problem
        box = widened_starts(problem)
        if problem.reference is None:
            box.append(run_time_offset(problem, box[0]))
            box += [a[0] for a in path.reference(Sloped(), ZERO_I, path.n)[1:]]
        self.box: Box = ((0, from_fraction(path.model.duration)[1]), *box)
        self.wide = [j for j, a in enumerate(self.box) if j and a[0] < a[1]]
        self.known: dict[Box, Series] = {}

    def _fade(self, box: Box) -> Series:
        """Return b and db/dt with their slopes by the coordinates that are wide."""
        path, numbers = self.path, Sloped()
        if box[1:] not in self.known:
            seeds = [
                (a, tuple(ONE_I if j == k else ZERO_I for j in self.wide) if k in self.wide else ())
                for k, a in enumerate(box)
            ]
            start, rest = seeds[1 : path.n + 1], seeds[path.n + 1 :]
            y, offset = path.reference(numbers, (ZERO_I, ()), path.n), None
            if rest:
                offset, *later = rest
                y = [y[0], *later]
            self.known[box[1:]] = lead_in(path.model, numbers, start, y, offset)
        return fade(path.model, Taylor(numbers, 2), self.known[box[1:]], (box[0], ()))

    def value(self, box: Box) -> Interval:
        """Enclose |b| - funnel."""
        return sub(absolute(self._fade(box)[0][0]), super().value(box[:1]))

    def gradient(self, box: Box) -> tuple[Interval, Gradient]:
        """Value and slopes."""
        (b, by_start), (rate, _) = self._fade(box)
        funnel, slopes = super().gradient(box[:1])
        side = sign(b) if b[0] > 0 or b[1] < 0 else (-ONE, ONE)
        found = {j: mul(side, slope) for j, slope in zip(self.wide, by_start, strict=False)}
        return sub(absolute(b), funnel), {
            0: sub(mul(side, rate), slopes.get(0, ZERO_I)),
            **found,
        }


def _clearance(path: Trajectory, funnel: Node) -> tuple[Interval, str]:
    """Enclose the infimum of funnel - |b| over all times and starts; say when it is reached."""
    tape = _Clearance(path, funnel)
    worst, point = maximize(tape, tape.box, None, 400)
    early, late = neg(worst), over_time(funnel, {}, from_fraction(path.model.duration)[0])[0]
    when = f"near t = {to_doubles(point[0])[0]:.6g} s" if early[1] <= late[1] else "after T_s"
    return _call("min", (early, late)), when


class _FreeStage(_Chain):
    """A stage of theorem3 below the last one: its chain on the widened tube p^.

    It proves nothing but that |e_i| <= p^_i as long as it is kept, and at the switch: at the
    samples |ê_i| <= p_i, so |e_i| <= p_i + eta_i, and between two of them |de_i| <= V_i.
    """

    def __init__(
        self,
        problem: Problem,
        gains: tuple[Gain, ...],
        half_widths: tuple[Fraction, ...],
        center: Center,
        free: Sequence[_FreeStage],
    ) -> None:
        super().__init__(problem, gains, half_widths, center, free)
        self.mark = f".stage{len(self.free) + 1}"
        self.watched: tuple[Fraction, ...] = ()
        self.peak = ZERO_I

    def stays(self) -> tuple[Fraction, ...]:
        """Return p_i, what the measured errors are watched against."""
        return self.watched

    def watch(self, half_widths: tuple[Fraction, ...]) -> None:
        """Claim p^_i > p_i + eta_i + h V_i for the watched p; every command so far may act."""
        self.watched = half_widths
        self.walk()
        last, number = self.n - 1, len(self.free) + 1
        force = self.gains[last].phi(from_fraction(half_widths[last]))
        self.peak = self.table[f"U{self.mark}"] = add(force, (0, self.rounding[-1]))
        largest = _call("max", [stage.peak for stage in (*self.free, self)])
        for i in range(self.n):
            if i < last:
                pull = add(add(self.p[i + 1], self._get("s", i)), self._get("A", i))
            else:
                pull = add(largest, self.problem.actuator_error)
            speed = self._put("V", i, add(self._get("D", i), mul(self._get("G", i), pull)))
            drift = mul(self.problem.period, speed)
            needed = add(from_fraction(half_widths[i]), add(self._get("eta", i), drift))
            j = i + 1
            self.steps.append(
                Obligation(
                    f"T3.stage{number}[{self.problem.states[i]}]",
                    f"p^_{j} > p_{j} + eta_{j} + h V_{j} in stage {number}",
                    self._uses(i),
                    (Comparison(self.p[i], needed),),
                )
            )

    def handovers(
        self, later: Sequence[Gain], half_widths: Sequence[Fraction], late: Interval
    ) -> list[Obligation]:
        """Claim p_i > p^_i + Delta_i of a switch into the last stage, with what is late at x_n.

        A switch passes over every stage whose tube the errors are outside of, so each stage is
        followed by the last one at the same sample.
        """
        jump, last, number = ZERO_I, self.n - 1, len(self.free) + 1
        claims: list[Obligation] = []
        for i in range(self.n):
            reached = add(self.p[i], self._put("Delta", i, jump))
            reached = add(reached, late) if i == last else reached
            j = i + 1
            claims.append(
                Obligation(
                    f"T3.handover{number}[{self.problem.states[i]}]",
                    f"p_{j} > p^_{j} + Delta_{j}{' + tau V' * (i == last)} out of stage {number}",
                    tuple(claim.id for claim in self.steps),
                    (Comparison(from_fraction(half_widths[i]), reached),),
                )
            )
            if i < last:
                jump = later[i].jump(jump, self.shapes[i], self.p[i])
        return claims


@dataclass(frozen=True, slots=True)
class Level:
    """The constants of one step of Theorem 1 over an interval of rho (docs/theory.md section 7).

    D bounds |ê_i - e_i|, delta what that does to alpha_i; load is |f_i + d_i - drho x_i(0)
    - d alpha_{i-1} + rho x_{i+1}(0)|, needed what H must be, coupled |d alpha_i|; D_slope and
    delta_slope are derivatives in rho. All of them grow with rho.
    """

    p: Interval
    D: Interval
    D_slope: Interval
    xi: Interval
    A: Interval
    L: Interval
    force: Interval
    W: Interval
    load: Interval
    needed: Interval
    H: Interval
    delta: Interval
    delta_slope: Interval


_CELLS = 3000


class _Theorem1(_Chain):
    """Theorem 1, sound form: dx_i = f_i + x_{i+1}, errors made of the true starts.

    phi_i = gamma_i H_i(rho) e + c_i e^N_i, |e_i| <= p_i(rho) = D_i(rho) + eps_i. At that wall
    sgn(e_i) de_i <= load + p_{i+1} - phi_i(p_i), i < n, which must be below the motion
    dp_i/dt >= -rhoM dD_i/drho of the wall; p_{i+1} = 2 delta_{i+1} + gamma_i H_i D_i + c_0 +
    eps_{i+1}, so with H_i >= load + rhoM dD_i/drho it suffices that

        gamma_i H_i eps_i + c_i p_i^N > H_i + c_0 + 2 delta_{i+1} + eps_{i+1}.

    For i = n the law's |phi_n(ê_n) - phi_n(e_n)| <= gamma_n H_n D_n + c_0 stands for p_{n+1}.
    The inequality is affine in H_i, and p_i is least at the least rho: the two ends of rho are
    enough. That H_i dominates is proved on cells of rho, H_i at the lower end of each against
    the rest at its upper end; the tables are those at rho = 1 over all starts and times.
    """

    def __init__(
        self,
        problem: Problem,
        gains: tuple[Tall, ...],
        half_widths: tuple[Fraction, ...],
        c_0: Fraction,
    ) -> None:
        super().__init__(problem, gains, half_widths, performance_center(problem))
        self.tall, self.c_0 = gains, c_0
        self.rooms: list[Interval] = []
        self.levels: list[Level] = []

    def _before(self, i: int, levels: Sequence[Level]) -> tuple[Interval, Interval]:
        """D_i and its derivative in rho: the measurement, and what it did to alpha_{i-1}."""
        measured = scale(Fraction(2), self.problem.delta[i])
        if i == 0:
            return measured, ZERO_I
        return add(measured, levels[i - 1].delta), levels[i - 1].delta_slope

    def _coupled(self, i: int, p: Interval, levels: Sequence[Level], rho: Interval) -> Interval:
        """|d alpha_{i-1}| <= L (load + p_i + A) + gamma H' rhoM p, everything of step i - 1."""
        if i == 0:
            return ZERO_I
        level, gain = levels[i - 1], self.tall[i - 1]
        motion = mul(scale(gain.gamma, gain.bend(rho)), mul(self.problem.rhos[0].rate, level.p))
        return add(mul(level.L, add(add(level.load, p), level.A)), motion)

    def _level(
        self,
        i: int,
        rho: Interval,
        levels: Sequence[Level],
        reach: tuple[Interval, Interval],
        boxes: Sequence[dict[str, Interval]],
    ) -> Level:
        """One step; reach are the ends of r_i = rho x_i(0), boxes the inner and the outer one."""
        gain, channel, state = self.tall[i], self.problem.channels[i], self.problem.states[i]
        D, D_slope = self._before(i, levels)
        p = add(D, self.rooms[i]) if i < len(self.rooms) else self.p[i]
        coupled = self._coupled(i, p, levels, rho)
        xi = p if i == 0 else add(p, levels[i - 1].A)
        low, high = reach
        inner, outer = boxes
        outer[state] = (low[0] - xi[1], high[1] + xi[1])
        narrow = (low[1] - xi[0], high[0] + xi[0])
        inner[state] = narrow if narrow[0] <= narrow[1] else outer[state]
        bounded = channel.f_bound if channel.f_bound is not None else channel.f
        force = self._majorant(bounded if bounded is not None else NOTHING, boxes)
        W = add(add(force, self._majorant(channel.disturbance, boxes)), self.center.rate[i])
        ahead = ZERO_I
        if i + 1 < self.n:
            most = absolute(self.problem.starts[i + 1])[1]
            ahead = mul(rho, (most, most))
        load = add(add(W, coupled), ahead)
        H = gain.height(rho)
        moved = add(mul(gain.bend(rho), D), mul(H, D_slope))
        return Level(
            p=p,
            D=D,
            D_slope=D_slope,
            xi=xi,
            A=gain.phi(p, rho),
            L=gain.slope_at_most(p, rho),
            force=force,
            W=W,
            load=load,
            needed=add(load, mul(self.problem.rhos[0].rate, D_slope)),
            H=H,
            delta=add(mul(scale(gain.gamma, H), D), from_fraction(self.c_0)),
            delta_slope=scale(gain.gamma, moved),
        )

    def _constants(self, i: int) -> None:
        """Everything at rho = 1, over all times and starts."""
        reach = (self.center.low[i], self.center.high[i])
        level = self._level(i, ONE_I, self.levels, reach, (self.inner, self.outer))
        for node in self.problem.channels[i].partial:
            self._extension(node, self.outer)
        for key, value in (
            ("xi", level.xi),
            ("X", add(self.center.size(i), level.xi)),
            ("r_lower", reach[0]),
            ("r_upper", reach[1]),
            ("A", level.A),
            ("L", level.L),
            ("f_star", level.force),
            ("W", level.W),
            ("D", add(level.W, self._coupled(i, level.p, self.levels, ONE_I))),
            ("eta", level.D),
            ("Lambda", level.delta),
            ("H", level.H),
            ("H_needed", level.needed),
            ("epsilon", sub(level.p, level.D)),
            ("g_min", ONE_I),
            ("G", ONE_I),
        ):
            self._put(key, i, value)
        if i:
            self._put("B", i - 1, self._coupled(i, level.p, self.levels, ONE_I))
        self.levels.append(level)

    def _cell(self, rho: Interval) -> list[Level]:
        """All steps for every rho in an interval; its boxes are parts of the reachable one."""
        levels: list[Level] = []
        boxes = (dict(self.problem.ranges), dict(self.problem.ranges))
        for i, start in enumerate(self.problem.starts):
            low, high = mul(rho, start)
            reach = ((low, low + 2), (high - 2, high))
            levels.append(self._level(i, rho, levels, reach, boxes))
        return levels

    def _dominates(self) -> list[Comparison]:
        """H_i against what it must be: the cell of rho with the least room, for every i."""
        if self.weaker:
            return [_domination(level) for level in self.levels]
        worst: dict[int, Comparison] = {}
        refuted: dict[int, Comparison] = {}
        cells = [(self.problem.rhos[0].floor[0], ONE)]
        for _ in range(_CELLS):
            if not cells:
                break
            rho = cells.pop()
            found = dict(enumerate(_domination(level) for level in self._cell(rho)))
            if any(found[i].verdict() != "proved" for i in found.keys() - refuted.keys()):
                # At a single rho both sides are numbers: there it may be refuted.
                middle = (rho[0] + rho[1]) >> 1
                at_one = enumerate(_domination(level) for level in self._cell((middle, middle)))
                refuted |= {i: entry for i, entry in at_one if entry.verdict() == "refuted"}
                cells += [(middle, rho[1]), (rho[0], middle)]
                continue
            for i in found.keys() - refuted.keys():
                if i not in worst or _room(found[i]) < _room(worst[i]):
                    worst[i] = found[i]
        if cells:
            # The cells are used up: what is not refuted is undecided.
            worst = {i: Comparison((-1, a.H[1]), a.needed, ">=") for i, a in enumerate(self.levels)}
        return [(worst | refuted)[i] for i in range(self.n)]

    def obligations(self) -> Obligations:
        """Walk at rho = 1, then claim T1.p, T1.H, T1.c and T1.gamma of every step."""
        self.walk()
        self.rooms = [self._get("epsilon", i) for i in range(self.n)]
        least = self.problem.rhos[0].floor[0]
        first = self.levels if self.weaker else self._cell((least, least))
        last, top = self.tall[-1], self.levels[-1]
        self.table["U"] = last.phi(add(top.p, top.D))
        c_0 = from_fraction(self.c_0)
        dominated = self._dominates()
        for i, (gain, level) in enumerate(zip(self.tall, self.levels, strict=True)):
            N, j, state = Fraction(gain.N), i + 1, self.problem.states[i]
            swing = scale(gain.c, sub(power(add(level.p, level.D), N), power(level.p, N)))
            credit = scale(gain.c, power(first[i].p, N))
            ahead = c_0
            if j < self.n:
                ahead = add(add(c_0, scale(Fraction(2), self.problem.delta[j])), self.rooms[j])
            walls = [
                Comparison(
                    add(mul(scale(gain.gamma, height), self.rooms[i]), credit), add(height, ahead)
                )
                for height in ([first[i].H, level.H] if gain.powers else [level.H])
            ]
            before = (f"T1.c[{self.problem.states[i - 1]}]",) if i else ()
            inside, beside = f"T1.p[{state}]", f"T1.c[{state}]"
            wall = f"gamma_{j} H_{j} eps_{j} + c_{j} p_{j}^N > H_{j} + c_0"
            wall += f" + 2 delta_{j + 1} + eps_{j + 1}" if j < self.n else ""
            swings = f"c_{j} ((p_{j} + D_{j})^N - p_{j}^N) <= c_0"
            covers = f"H_{j}(rho) >= H0_{j}(rho) for every rho"
            claims = {
                "p": (f"p_{j} > D_{j}", before, [Comparison(level.p, level.D)]),
                "H": (covers, (*self._uses(i), inside), [dominated[i]]),
                "c": (swings, (inside,), [Comparison(c_0, swing, ">=")]),
                "gamma": (wall, (f"T1.H[{state}]", beside), walls),
            }
            for name, (statement, uses, comparisons) in claims.items():
                place = f"T1.{name}[{state}]"
                self.steps.append(Obligation(place, statement, uses, tuple(comparisons)))
        return self._collect(None)

    def _numbers(self) -> dict[str, Interval]:
        found = {"c_0": from_fraction(self.c_0)}
        for i, (gain, p) in enumerate(zip(self.tall, self.half_widths, strict=True), start=1):
            values = {"gamma": gain.gamma, "c": gain.c, "N": Fraction(gain.N), "p": p}
            found |= {f"{key}_{i}": from_fraction(value) for key, value in values.items()}
            found |= {f"H_{i}_{j}": from_fraction(h) for j, h in enumerate(gain.H)}
            found[f"room_{i}"] = self.rooms[i - 1]
        return found


def _domination(level: Level) -> Comparison:
    return Comparison(level.H, level.needed, ">=")


def _room(comparison: Comparison) -> Fraction:
    """Distance of the two sides relative to the larger one."""
    return Fraction(comparison.lhs[0] - comparison.rhs[1], max(1, comparison.rhs[1]))


def without_common_power(node: Node) -> Node:
    """Divide a sum by the largest power of every y >= 0 that all its terms contain."""
    if node.kind == "prod":
        node = combine([(2, node)])  # a sum with one term
    if node.kind != "sum":
        return node
    while True:
        factors = [
            dict(zip((b.text for b in a.args), a.weights, strict=True))
            if a.kind == "prod"
            else {a.text: Fraction(1)}
            for a in node.args
        ]
        common = [
            name
            for name in sorted(symbols(node))
            if name.startswith("+") and all(f.get(name, 0) > 0 for f in factors)
        ]
        if not common:
            return node
        name = common[0]
        least = min(f[name] for f in factors)
        terms = []
        for weight, a in zip(node.weights, node.args, strict=True):
            pairs = zip(a.args, a.weights, strict=True) if a.kind == "prod" else [(a, Fraction(1))]
            left = [(b, e - least if b.text == name else e) for b, e in pairs]
            terms.append((weight, multiply(left)))
        node = combine(terms)
        if node.kind != "sum":
            return node


def _instead(chosen: Chosen | None) -> str:
    """Say what holds in the place of a declaration that the objective leaves to the design."""
    if chosen is None or chosen[0] == "accuracy":
        return ""
    if chosen[0] == "period":
        return f"; samples are at most {chosen[1]!r} s apart"
    return f"; every length of every quantizer is {chosen[1]!r} times the declared one"


def _assumed(problem: Problem) -> tuple[str, ...]:
    """List what no computation can prove; printed at the end of every verification."""
    real = "binary32" if problem.arithmetic.single else "binary64"
    computed = f"{real} is IEEE 754: + - * / are rounded to nearest, subnormal numbers are kept"
    if problem.arithmetic.math == "libm":
        computed = (
            f"{real} is IEEE 754; tanh, sin, cos, exp, log of the libm (and others) keep to 4 ulp"
        )
    lines = [
        "the plant is as declared: f, g, their bounds, disturbances, parameters, initial states",
        "measurement and actuation are as declared: quantizer, noise, period, delay, error"
        + _instead(problem.chosen),
        computed,
        "the theorem itself (docs/theory.md) and this file",
        "the C source computes the law of controller.py (its constants and limits were compared)",
    ]
    if problem.reference_bounds is not None:
        bound, rate = (to_doubles(b)[1] for b in problem.reference_bounds)
        lines.append(
            f"the reference obeys its declared bounds: |y_d| <= {bound!r}, |dy_d| <= {rate!r}"
        )
        if problem.center == "nominal":
            more = ", ".join(repr(to_doubles(b)[1]) for b in problem.derivatives[2:])
            lines.append(f"its further derivatives exist, are passed exactly, and obey {more}")
    else:
        lines.append("a reference passed to the controller is the declared expression")
    for channel, state in zip(problem.channels, problem.states, strict=True):
        if channel.f is None:
            lines.append(
                f"|f| of {state} stays below its f_bound (no f is declared to compare with)"
            )
        if channel.g is None:
            lines.append(f"g of {state} stays between g_min and g_bound (no g is declared)")
    if problem.method in ("theorem1", "theorem2"):
        measured = "measurement is continuous and actuation exact"
        if problem.method == "theorem2":
            measured = "measurement and actuation are exact and continuous"
        lines.append(
            f"the rounding of the controller's own arithmetic is neglected ({problem.method})"
        )
        lines.append(f"{measured} ({problem.method})")
    return tuple(lines)


# ---------------------------------------------------------------------------------------------
# 8. Verification: every obligation against its claim.

THEOREMS = {
    "unified": "Theorem U (docs/theory.md sections 2 to 4)",
    "theorem1": "Theorem 1, sound form (docs/theory.md section 7)",
    "theorem2": "Theorem 2, sound form (docs/theory.md section 2)",
    "theorem3": "Theorem 3, sound form (docs/theory.md section 8)",
}


@dataclass(frozen=True, slots=True)
class Result:
    """The answer to one claim; lhs and rhs are doubles rounded outward."""

    id: str
    statement: str
    verdict: str
    proof: str = ""
    lhs: tuple[float, float] | None = None
    rhs: tuple[float, float] | None = None
    detail: str = ""
    witness: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Report:
    """The answer: proved, refuted, undecided or malformed."""

    verdict: str
    claims: tuple[Result, ...] = ()
    failures: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    enclosures: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    tests: tuple[str, ...] = ()

    @property
    def exit_code(self) -> int:
        """0 proved, 4 refuted or undecided, 2 malformed."""
        return {"proved": 0, "malformed": 2}.get(self.verdict, 4)

    def document(self) -> dict[str, Any]:
        """Return the report as JSON data."""
        return {
            "format": REPORT_FORMAT,
            "verdict": self.verdict,
            "claims": [
                {
                    "id": claim.id,
                    "statement": claim.statement,
                    "verdict": claim.verdict,
                    "proof": claim.proof,
                    "lhs": claim.lhs,
                    "rhs": claim.rhs,
                    "detail": claim.detail,
                    "witness": dict(claim.witness),
                }
                for claim in self.claims
            ],
            "failures": list(self.failures),
            "tests": list(self.tests),
            "assumptions": list(self.assumptions),
        }


def hex_pair(a: Interval) -> list[str]:
    """Return an enclosure as a certificate writes it."""
    return [end.hex() for end in to_doubles(a)]


def read_double(value: object, path: str) -> float:
    """Read a binary64 number in hexadecimal, in the one spelling that float.hex writes."""
    text = text_of(value, path)
    try:
        number = float.fromhex(text)
    except (ValueError, OverflowError):
        raise MalformedError(f"{path}: {text[:40]!r} is no hexadecimal binary64 number") from None
    if not math.isfinite(number) or number.hex() != text:
        raise MalformedError(f"{path}: {text[:40]!r} is no finite number as float.hex writes it")
    return number


Gains = tuple[tuple[Any, ...], ...]


@dataclass(frozen=True, slots=True)
class Design:
    """What the certificate is about: the numbers that the controller contains.

    ``gains`` are (k, M, epsilon, c, N), with c_0 (gamma, H, c, N). ``stages`` are (gains, p,
    widened p) of the free stages of theorem3, ``tight`` the claimed loads and rate; neither c_0
    nor the widened p nor these are in the code.
    """

    gains: Gains
    p: tuple[float, ...]
    u_max: float
    c_0: float | None = None
    stages: tuple[tuple[Gains, tuple[float, ...], tuple[float, ...]], ...] = ()
    duration: float | None = None
    tight: tuple[tuple[float, ...], float] | None = None
    arithmetic: Arithmetic = _DEFAULT
    chosen: Chosen | None = None

    def constants(self) -> dict[str, float | int]:
        """Return the numbers by the names that the controllers give them."""
        found = _constants("", self.gains, self.p)
        for number, (gains, p, _) in enumerate(self.stages, start=1):
            found |= _constants(f"stage{number}_", gains, p)
        if self.duration is not None:
            found["T_s"] = self.duration
        return {**found, "U_MAX": self.u_max}

    def obligations(self, plant: object) -> Obligations:
        """Derive what must hold for this design of a plant."""
        kind = (self.arithmetic.real, self.arithmetic.math)
        more = (self.c_0, self.stages, self.duration, self.tight, kind, self.chosen)
        return derive(plant, self.gains, self.p, *more)


def _constants(prefix: str, gains: Gains, p: Sequence[float]) -> dict[str, float | int]:
    found: dict[str, float | int] = {}
    for i, (gain, width) in enumerate(zip(gains, p, strict=True), start=1):
        values = dict(zip(_SHAPE, gain, strict=False))
        if len(gain) == len(_TALL):
            values = dict(zip(_TALL, gain, strict=True))
            found |= {f"{prefix}H_{i}_{j}": h for j, h in enumerate(values.pop("H"))}
        found |= {f"{prefix}{name}_{i}": value for name, value in values.items()}
        found[f"{prefix}p_{i}"] = width
    return found


def read_design(value: object) -> Design:
    """Read gains, tube and clamp; c_0 of theorem1, the stages of theorem3."""
    design = fields(value, "design", "p gains U_MAX", "c_0 stages T_s tight real math chosen")
    arithmetic = Arithmetic(design.get("real", "double"), design.get("math", "libm"))
    if arithmetic.real not in ("double", "float") or arithmetic.math not in ("libm", "portable"):
        raise MalformedError("design: real is double or float, math is libm or portable")
    keys = _TALL if "c_0" in design else _SHAPE
    stages = []
    for j, given in enumerate(_list(design.get("stages", []), "design.stages", _MOST_STAGES)):
        path = f"design.stages[{j}]"
        stage = fields(given, path, "p gains widened")
        p, widened = (_read_doubles(stage[key], f"{path}.{key}") for key in ("p", "widened"))
        stages.append((_read_gains(stage["gains"], f"{path}.gains", _SHAPE), p, widened))
    gains, p = _read_gains(design["gains"], "design.gains", keys), _read_doubles(design["p"], "p")
    c_0 = read_double(design["c_0"], "design.c_0") if "c_0" in design else None
    if any(len(own) != len(gains) for own in (p, *(part for s in stages for part in s))):
        raise MalformedError("design: not one gain and one p for every state")
    duration = read_double(design["T_s"], "design.T_s") if "T_s" in design else None
    peak = read_double(design["U_MAX"], "design.U_MAX")
    tight = None
    if "tight" in design:
        given = fields(design["tight"], "design.tight", "load rate")
        tight = (
            _read_doubles(given["load"], "design.tight.load"),
            read_double(given["rate"], "design.tight.rate"),
        )
        if any(x == 0 and math.copysign(1, x) < 0 for x in (*tight[0], tight[1])):
            raise MalformedError("design.tight: a zero with a sign")
    chosen = None
    if "chosen" in design:
        given = fields(design["chosen"], "design.chosen", "objective value")
        word = text_of(given["objective"], "design.chosen.objective")
        chosen = (word, read_double(given["value"], "design.chosen.value"))
    found = Design(gains, p, peak, c_0, tuple(stages), duration, tight, arithmetic, chosen)
    for key, constant in found.constants().items():
        if arithmetic.rounded(Fraction(constant)) != Fraction(constant):
            raise MalformedError(f"design: {key} is no number of the type {arithmetic.real}")
    return found


def _read_gains(value: object, path: str, keys: Sequence[str]) -> Gains:
    gains: list[tuple[Any, ...]] = []
    for i, given in enumerate(_list(value, path, 12)):
        gain = fields(given, f"{path}[{i}]", " ".join(keys))
        if type(gain["N"]) is not int:
            raise MalformedError(f"{path}[{i}].N: an integer is expected")
        numbers: dict[str, Any] = {"N": gain["N"]}
        for key in keys:
            if key == "H":
                numbers[key] = _read_doubles(gain[key], f"{path}[{i}].H")
            elif key != "N":
                numbers[key] = read_double(gain[key], f"{path}[{i}]")
        gains.append(tuple(numbers[key] for key in keys))
    return tuple(gains)


def _read_doubles(value: object, path: str) -> tuple[float, ...]:
    return tuple(read_double(item, path) for item in _list(value, path, 12))


def check_documents(plant: object, certificate: object) -> Report:
    """Verify a certificate against a plant; no file is read.

    Parameters
    ----------
    plant, certificate : object
        Contents of plant.json and certificate.json.

    Returns
    -------
    Report
        "proved" only if every derived obligation is claimed and its proof holds.
    """
    return _answer(lambda: _checked_documents(plant, certificate)[0])


def _answer(verify: Callable[[], Report]) -> Report:
    try:
        return verify()
    except UndecidedError as error:
        return Report("undecided", failures=(str(error),))
    except MalformedError as error:
        return Report("malformed", failures=(str(error),))
    except Exception as error:  # noqa: BLE001 (whatever it is, it is no proof)
        return Report("malformed", failures=(f"{type(error).__name__}: {error}",))


def _checked_documents(plant: object, certificate: object) -> tuple[Report, Obligations, Design]:
    keys = "format tool plant_sha256 theorem design enclosures claims"
    top = fields(certificate, "certificate.json", keys)
    if top["format"] != CERTIFICATE_FORMAT:
        raise MalformedError(f"certificate.json: format {top['format']!r}")
    text_of(top["tool"], "tool")
    design = read_design(top["design"])
    obligations = design.obligations(plant)
    if not isinstance(plant, Mapping) or top["plant_sha256"] != plant["plant_sha256"]:
        raise MalformedError("plant_sha256: the certificate is about another plant file")
    if top["theorem"] != THEOREMS[obligations.problem.method]:
        raise MalformedError("theorem: not the one that the plant file asks for")
    claims = _claims(top["claims"])
    expected = expected_claims(obligations, list(claims))
    _check_structure(claims, expected)
    results = [
        check_claim(obligation, claims[obligation.id]["proof"])
        if obligation.id in claims
        else Result(obligation.id, obligation.statement, "undecided", detail="no proof is given")
        for obligation in expected
    ]
    peak, clamp = obligations.enclosures["U"][1], Fraction(design.u_max) * ONE
    room = Fraction(1, 1 << (22 if design.arithmetic.single else 30))
    if not peak <= clamp <= peak * (1 + room):
        raise MalformedError("design.U_MAX: not the peak input U rounded up")
    report = _report(results, obligations)
    if report.verdict == "proved":
        _compare_enclosures(top["enclosures"], obligations, claims, expected)
    return report, obligations, design


def _claims(value: object) -> dict[str, dict[str, Any]]:
    claims: dict[str, dict[str, Any]] = {}
    for j, given in enumerate(_list(value, "claims", 200)):
        claim = fields(given, f"claims[{j}]", "id uses proof", "lhs rhs")
        name = text_of(claim["id"], f"claims[{j}].id")
        if name in claims:
            raise MalformedError(f"claims[{j}]: {name} is claimed twice")
        claims[name] = claim
    return claims


def expected_claims(obligations: Obligations, names: Sequence[str]) -> list[Obligation]:
    """Return the obligations, with U2' in place of U2 where that is what is claimed."""
    other = obligations.alternative
    if other is None or other.id not in names:
        return list(obligations.claims)
    return [
        other if claim.id == other.id.replace("'", "") else claim for claim in obligations.claims
    ]


def _check_structure(claims: Mapping[str, Mapping[str, Any]], expected: list[Obligation]) -> None:
    by_id = {obligation.id: obligation for obligation in expected}
    seen: list[str] = []
    for name, claim in claims.items():
        if name not in by_id:
            raise MalformedError(f"claims: {name} is not an obligation of this plant")
        uses = [text_of(use, f"{name}.uses") for use in _list(claim["uses"], name, 200)]
        late = [use for use in uses if use in claims and use not in seen]
        if late:
            raise MalformedError(f"claims: {name} uses {late[0]}, which is not before it")
        if tuple(uses) != by_id[name].uses:
            raise MalformedError(f"claims: {name} rests on {', '.join(by_id[name].uses) or 'none'}")
        seen.append(name)


def _compare_enclosures(
    stated: object,
    obligations: Obligations,
    claims: Mapping[str, Mapping[str, Any]],
    expected: Sequence[Obligation],
) -> None:
    """Compare the informative numbers; integer arithmetic leaves no room for a difference."""
    found = {key: hex_pair(value) for key, value in obligations.enclosures.items()}
    listed = fields(stated, "enclosures", " ".join(found))
    for key, pair in found.items():
        if listed[key] != pair:
            raise MalformedError(f"enclosures: {key} is stated as {listed[key]}, computed {pair}")
    for obligation in expected:
        claim = claims[obligation.id]
        for side in ("lhs", "rhs"):
            computed = None
            if obligation.comparisons:
                computed = hex_pair(getattr(obligation.comparisons[0], side))
            if claim.get(side) != computed:
                raise MalformedError(
                    f"claims: {side} of {obligation.id} is stated as {claim.get(side)}, "
                    f"computed {computed}"
                )


def _report(results: Sequence[Result], obligations: Obligations) -> Report:
    verdicts = {result.verdict for result in results}
    verdict = next((v for v in ("refuted", "undecided") if v in verdicts), "proved")
    failures = tuple(
        f"{result.id}: {result.verdict}: {result.statement}"
        + (f" ({result.detail})" if result.detail else "")
        for result in results
        if result.verdict != "proved"
    )
    doubles = {key: to_doubles(value) for key, value in obligations.enclosures.items()}
    return Report(verdict, tuple(results), failures, obligations.assumptions, doubles)


def check_claim(obligation: Obligation, proof: object) -> Result:
    """Check one proof: comparisons by their enclosures, goals by the trees that are hinted."""
    hint = fields(proof, f"{obligation.id}.proof", "kind", "trees")
    kind = hint["kind"]
    allowed = {obligation.proof} | ({"bisect"} if obligation.pointwise else set())
    allowed |= {"corner"} if obligation.pointwise and obligation.corner else set()
    if kind not in allowed or ("trees" in hint) == (kind in ("eval", "rational")):
        raise MalformedError(f"{obligation.id}: a proof by {kind!r} with these fields")
    first = obligation.comparisons[0] if obligation.comparisons else None
    lhs, rhs = (to_doubles(first.lhs), to_doubles(first.rhs)) if first else (None, None)
    failed = [c for c in obligation.comparisons if c.verdict() != "proved"]
    verdict = next(
        (v for v in ("refuted", "undecided") if v in map(Comparison.verdict, failed)), ""
    )
    verdict, detail, witness = verdict or "proved", "", None
    if failed:
        sides = (to_doubles(failed[0].lhs), to_doubles(failed[0].rhs))
        detail = f"{sides[0]} {failed[0].relation} {sides[1]} does not hold"
    elif obligation.pointwise:
        verdict, detail, witness = _check_goals(obligation, kind, hint.get("trees"))
    point = tuple(sorted(witness.items())) if witness else ()
    return Result(obligation.id, obligation.statement, verdict, kind, lhs, rhs, detail, point)


def _check_goals(
    obligation: Obligation, kind: str, trees: object
) -> tuple[str, str, dict[str, float] | None]:
    goals = obligation.corner if kind == "corner" else obligation.pointwise
    leaf = [goal.leaf for goal in goals]
    hints = leaf if trees is None else _list(trees, "trees", len(goals))
    if len(hints) != len(goals):
        raise MalformedError(f"{obligation.id}: {len(goals)} trees are needed")
    if sum(len(tree) for tree in hints if isinstance(tree, str)) > _MOST_LETTERS:
        raise MalformedError(f"{obligation.id}: trees of more than {_MOST_LETTERS} letters")
    held = all(check_tree(goal, tree) for goal, tree in zip(goals, hints, strict=True))
    if held and kind != "corner":
        return "proved", "", None
    # The weaker form must not hide that the declared bound is false.
    for goal in obligation.pointwise:
        witness = goal.witness(40 if held else 200)
        if witness is not None:
            shown = ", ".join(f"{name} = {value!r}" for name, value in sorted(witness.items()))
            return "refuted", f"false at {shown}", witness
    if held:
        return "proved", "in the weaker form: against the number that the chain used", None
    return "undecided", "the hinted subdivision does not prove it", None


_MOST_LETTERS = 12_000
LETTERS = ".0123456789abcdefghijklmnopqrstuvwxyz"


def check_tree(goal: Goal, tree: object) -> bool:
    """Walk a bisection tree in pre-order: a dimension to cut at the middle, or -1 for a leaf.

    For a facet it is a text: "." is a leaf, digits and letters are the dimensions.
    """
    tape, box = goal.tape(goal.node)
    stack, held = [box], True
    entries: Sequence[Any]
    if isinstance(goal, Facet):
        if not isinstance(tree, str) or len(tree) > 4_000:
            raise MalformedError("trees: a text of at most 4000 letters is expected")
        entries = [LETTERS.find(letter) - 1 for letter in tree]
        if -2 in entries:
            raise MalformedError("trees: a letter that is not known")
    else:
        entries = _list(tree, "trees", 4_000)
    for entry in entries:
        if not stack:
            raise MalformedError("trees: entries are left over")
        part = stack.pop()
        if type(entry) is not int or not -1 <= entry < len(box):
            raise MalformedError("trees: an entry that is neither a dimension nor -1")
        if entry == -1:
            held = held and tape.bound(part).upper <= 0
        else:
            stack += reversed(halves(part, entry))
    if stack:
        raise MalformedError("trees: a part of the box is not covered")
    return held


# ---------------------------------------------------------------------------------------------
# 9. Folder: the files around the two documents.

_LONGEST_FILE = 4_000_000


def _read(path: Path) -> bytes:
    try:
        data = path.read_bytes()
    except OSError:
        raise MalformedError(f"{path.name}: cannot be read") from None
    if len(data) > _LONGEST_FILE:
        raise MalformedError(f"{path.name}: larger than any file of a generated folder")
    return data


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise MalformedError("JSON: a key is given twice")
    return found


def _no_float(text: str) -> Any:
    raise MalformedError(f"JSON: the decimal number {text}; numbers are texts here")


def read_json(path: Path) -> Any:
    """Read JSON without decimal numbers, NaN or repeated keys."""
    try:
        return json.loads(
            _read(path).decode("utf-8"),
            object_pairs_hook=_unique,
            parse_float=_no_float,
            parse_constant=_no_float,
        )
    except (ValueError, RecursionError):
        raise MalformedError(f"{path.name}: not JSON") from None


def verify_folder(folder: Path) -> Report:
    """Verify a generated folder: hashes, certificate, constants and law of the controllers.

    Parameters
    ----------
    folder : Path
        The folder; its controller.py is screened, imported and run.

    Returns
    -------
    Report
        As ``check_documents``, with one line in ``tests`` for each further check.
    """
    return _answer(lambda: _verified_folder(folder))


def _verified_folder(folder: Path) -> Report:
    manifest = fields(
        read_json(folder / "manifest.json"), "manifest.json", "format name status files"
    )
    plant = read_json(folder / "plant.json")
    report, obligations, design = _checked_documents(plant, read_json(folder / "certificate.json"))
    if hashlib.sha256(_read(folder / "plant.yaml")).hexdigest() != plant["plant_sha256"]:
        raise MalformedError("plant.yaml: not the file that plant.json was made from")
    name = obligations.problem.name
    sources = ("controller.py", f"c/src/{name}.c")
    _check_manifest(
        folder,
        manifest,
        name,
        ("plant.yaml", "plant.json", "certificate.json", f"c/include/{name}.h", *sources),
    )
    limits = screening_limits(obligations)
    if manifest["status"] != "certified":
        raise MalformedError("manifest.json: the status is not `certified`")
    for source in sources:
        text = _read(folder / source).decode("utf-8", "replace")
        _check_constants(source, text, name, design)
        _check_screening(source, text, name, limits, design.arithmetic)
    pair = [
        _read(folder / path).decode("utf-8", "replace")
        for path in (f"c/include/{name}.h", sources[1])
    ]
    _check_c(pair, name, len(design.p), [*design.constants(), *limits], design.arithmetic)
    tests = [
        f"manifest: {len(manifest['files'])} files have the hashes that it lists",
        "constants: controller.py and the C source contain the certified binary64 numbers",
    ]
    if report.verdict != "proved":
        return report
    text = _read(folder / "controller.py").decode("utf-8", "replace")
    screen(text, [*design.constants(), *limits])
    _check_python_arithmetic(text, design.arithmetic)
    _check_places(text, design.constants())
    _check_promises(text, obligations.problem)
    count = check_controller(folder / "controller.py", obligations, design)
    tests.append(f"law: controller.py gave {count} commands, each inside its enclosure")
    return Report(
        report.verdict,
        report.claims,
        report.failures,
        report.assumptions,
        report.enclosures,
        tuple(tests),
    )


def _check_manifest(
    folder: Path, manifest: Mapping[str, Any], name: str, needed: Sequence[str]
) -> None:
    listed = manifest["files"]
    if manifest["name"] != name or not isinstance(listed, Mapping):
        raise MalformedError("manifest.json: another plant, or no list of files")
    for path in needed:
        if path not in listed:
            raise MalformedError(f"manifest.json: {path} is not listed")
    for path, digest in sorted(listed.items()):
        parts = Path(path).parts
        if Path(path).is_absolute() or ".." in parts or not parts:
            raise MalformedError(f"manifest.json: the path {path!r} leaves the folder")
        if hashlib.sha256(_read(folder / path)).hexdigest() != digest:
            raise MalformedError(f"{path}: changed after the folder was made")


def _check_constants(path: str, source: str, name: str, design: Design) -> None:
    """Read the marked constants back: each certified number once, nothing else between."""
    lines = [line.strip() for line in source.splitlines()]
    starts = [j for j, line in enumerate(lines) if "CERTIFIED CONSTANTS BEGIN" in line]
    ends = [j for j, line in enumerate(lines) if "CERTIFIED CONSTANTS END" in line]
    if len(starts) != 1 or len(ends) != 1 or ends[0] < starts[0]:
        raise MalformedError(f"{path}: no block of certified constants")
    wanted = design.constants()
    form = r"(\w+) = (\S+)"
    if path.endswith(".c"):
        form = rf"(?:/\* |static const {name}_real ){name}_(\w+) = (\S+);(?: \*/)?"
    found: dict[str, str] = {}
    for line in filter(None, lines[starts[0] + 1 : ends[0]]):
        match = re.fullmatch(form, line)
        if not match or match.group(1) in found:
            raise MalformedError(f"{path}: {line[:60]!r} among the certified constants")
        key = match.group(1)
        # What the law does not use (an exponent, a gain of 0) may stand in a comment.
        exponent = re.fullmatch(r"(stage\d+_)?N_\d+", key)
        if line.startswith("/*") and not (exponent or _unused(key, wanted)):
            raise MalformedError(f"{path}: {key} stands in a comment only")
        found[key] = match.group(2)
    rest = "\n".join([*lines[: starts[0]], *lines[ends[0] :]])
    for key in wanted:
        again = rf"\b{name}_{key}\s*=[^=]|#\s*\w+\s+{name}_{key}\b"
        if path.endswith(".c") and re.search(again, rest):
            raise MalformedError(f"{path}: {key} is defined once more")
    for key in sorted(wanted.keys() | found.keys()):
        if key not in found or key not in wanted:
            raise MalformedError(f"{path}: {key} is not among both certified and emitted constants")
        if _literal(found[key], design.arithmetic, path) != Fraction(wanted[key]):
            raise MalformedError(f"{path}: {key} = {found[key]}, certified {wanted[key]!r}")


def _check_places(source: str, keys: Iterable[str]) -> None:
    """Want each constant assigned by a statement inside the block, not by text that looks so."""
    lines = source.splitlines()
    start = next(j for j, line in enumerate(lines, 1) if "CERTIFIED CONSTANTS BEGIN" in line)
    end = next(j for j, line in enumerate(lines, 1) if "CERTIFIED CONSTANTS END" in line)
    inside = {
        item.targets[0].id
        for item in ast.parse(source).body
        if isinstance(item, ast.Assign)
        and isinstance(item.targets[0], ast.Name)
        and start < item.lineno < end
    }
    for key in sorted(set(keys) - inside):
        raise MalformedError(f"controller.py: {key} is not assigned inside the block")


def _check_promises(source: str, problem: Problem) -> None:
    """Want the members that tell a caller what is proved: order, p_1 and the longest period."""
    wanted = {
        "ORDER": from_fraction(Fraction(len(problem.states))),
        "ACCURACY": problem.accuracy,
        "PERIOD": problem.period,
    }
    stored: list[str] = []
    values: dict[str, Any] = {}
    given: Any
    for item in ast.walk(ast.parse(source)):
        if isinstance(item, ast.Name) and isinstance(item.ctx, ast.Store):
            stored.append(item.id)
        elif isinstance(item, (ast.FunctionDef, ast.ClassDef)):
            stored.append(item.name)
        if isinstance(item, ast.ClassDef) and item.name == "Controller":
            for line in item.body:
                if isinstance(line, ast.Assign) and isinstance(line.value, ast.Constant):
                    values |= {
                        target.id: line.value.value
                        for target in line.targets
                        if isinstance(target, ast.Name)
                    }
    close = 22 if problem.arithmetic.single else 50
    for key, value in wanted.items():
        given = values.get(key)
        if stored.count(key) != 1 or type(given) not in (int, float) or not math.isfinite(given):
            raise MalformedError(f"controller.py: {key} is not one number of the class Controller")
        distance = absolute(sub(from_fraction(Fraction(given)), value))
        if distance[1] > scale(Fraction(1, 1 << close), absolute(value))[1] + 2:
            raise MalformedError(f"controller.py: {key} = {given!r} is not what is proved")


_C_TOKEN = re.compile(r"/\*.*?\*/|//[^\n]*|(\"[^\"\n]*\")", re.DOTALL)
_GUARDS = """#if defined(__FAST_MATH__)
#if defined(__FINITE_MATH_ONLY__) && (__FINITE_MATH_ONLY__ > 0)
#if !defined(FLT_EVAL_METHOD) || (FLT_EVAL_METHOD != 0)
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#ifdef __cplusplus
#endif
#include <float.h>
#include <math.h>
#include <stdbool.h>"""


def _check_c(
    texts: Sequence[str], name: str, n: int, keys: Iterable[str], arithmetic: Arithmetic
) -> None:
    """Want a header and a source whose preprocessor only guards, and each constant once."""
    own = (f"#ifndef {name}_H", f"#define {name}_H", f"#define {name}_ORDER {n}")
    allowed = {*_GUARDS.splitlines(), *own, f'#include "{name}.h"'}
    kept: list[str] = []
    opened = 0
    for text in texts:
        depth = 0
        for line in _C_TOKEN.sub(lambda token: token.group(1) or " ", text).splitlines():
            word = line.strip()
            if any(sign in word for sign in ("\\", "%:", "??", "'", "<%")):
                raise MalformedError(f"the C code: {word[:60]!r}: no controller needs that")
            if word.startswith("#"):
                if word not in allowed and not word.startswith("#error "):
                    raise MalformedError(f"the C code: {word[:60]!r}: no controller needs that")
                depth += word.startswith("#if") - word.startswith("#endif")
            elif depth == (text is texts[0]):
                # Inside braces nothing is the constant of the file.
                kept.append(f"{{ {word}" if opened else word)
                opened += word.count("{") - word.count("}")
            elif word not in ("", 'extern "C" {', "}"):
                raise MalformedError(f"the C code: {word[:60]!r} for some compilers only")
    if kept.count(f"typedef {arithmetic.real} {name}_real;") != 1:
        wanted = "binary32" if arithmetic.single else "binary64"
        raise MalformedError(f"{name}.h: {name}_real is not {wanted}")
    _check_c_arithmetic(" ".join(_C_TOKEN.sub(" ", text) for text in texts), name, arithmetic)
    if len(re.findall(r"\b(enum|union|goto|asm)\b", " ".join(kept))) > 1:
        raise MalformedError(f"{name}.c: a second enum, or what no controller needs")
    types = (
        rf"\b(const|volatile|static|double|float|int|long|short|char|{name}_(real|state|status))"
    )
    for key in sorted(keys):
        uses = [line for line in kept if re.search(rf"\b{name}_{key}\b", line)]
        form = f"static const {name}_real {name}_{key} = "
        made = [line for line in uses if re.search(rf"{types}[\s*]+{name}_{key}\b", line)]
        if uses and [line.startswith(form) for line in made] != [True]:
            raise MalformedError(f"{name}.c: {key} is not one constant of the file")


def screening_limits(obligations: Obligations) -> dict[str, int]:
    """Return what the controllers must accept at least: every sample that Omega allows."""
    problem = obligations.problem
    if problem.reference_bounds is not None:
        largest = problem.reference_bounds[0][1]
    else:
        low, high = over_time(problem.reference or NOTHING, {}, 0)
        largest = max(-low[0], high[1])
    limits = {"y_d_limit": largest, "elapsed_limit": problem.latest}
    if problem.arithmetic.single:
        limits["time_limit"] = problem.latest
    if problem.center == "nominal" and problem.reference is None:
        for k, bound in enumerate(problem.derivatives[1 : len(problem.states) + 1], start=1):
            limits[f"y_d_limit_{k}"] = bound[1]
    laws = obligations.laws
    for i, delta in enumerate(problem.delta):
        limits[f"x_limit_{i + 1}"] = max(law.reach[i] for law in laws) + delta[1]
    # Without a new center one sample may pass over a stage whose errors nothing is known of.
    left = laws[:-1] if problem.handover == "reanchor" else laws[:-1][:1]
    for number, law in enumerate(left, start=1):
        for i, limit in enumerate(law.limit):
            # Computed in binary64 by who made the folder: a few ulp are no difference.
            limits[f"stage{number}_limit_{i + 1}"] = limit - (limit >> 30)
    return limits


def _check_screening(
    path: str, source: str, name: str, limits: Mapping[str, int], arithmetic: Arithmetic
) -> None:
    prefix = f"{name}_" if path.endswith(".c") else ""
    for key, least in limits.items():
        found = re.findall(
            rf"^(?:static const \w+ )?{prefix}{key} = ([^;\s]+);?$", source, re.MULTILINE
        )
        value = _literal(found[0], arithmetic, path) if len(found) == 1 else None
        if value is None or value * ONE < least:
            raise MalformedError(f"{path}: {key} turns away samples that the theorem needs")
        if key in ("elapsed_limit", "time_limit") and value * ONE != least:
            raise MalformedError(f"{path}: {key} is later than the rounding is bounded for")


def _unused(key: str, wanted: Mapping[str, float | int]) -> bool:
    return wanted.get(key.replace("epsilon", "M")) == 0


def _literal(text: str, arithmetic: Arithmetic, path: str) -> Fraction | None:
    """Value of a decimal or hexadecimal floating literal as a compiler reads it.

    In C a binary32 number ends in F, and is nearer to the decimal than a quarter of a unit in
    the last place, so that it does not matter who rounds how often.
    """
    decimal = r"[0-9]+(\.[0-9]*)?([eE][-+]?[0-9]{1,4})?"
    try:
        if arithmetic.single and path.endswith(".c"):
            if not re.fullmatch(decimal + "F", text):
                return None
            near = arithmetic.rounded(Fraction(text[:-1]))
            apart = abs(Fraction(text[:-1]) - near) * (1 << 26)
            return near if apart < Fraction(2) ** math.frexp(near)[1] else None
        if re.fullmatch(decimal, text):
            return Fraction(float(text))
        if re.fullmatch(r"0x[0-9a-f.]+p[-+][0-9]{1,4}", text):
            return Fraction(float.fromhex(text))
    except (ValueError, OverflowError):
        return None
    return None


# 9b. What the code computes with. The portable functions, in Python as the generated file has
# them but for the rounding to binary32; the C source must say the same.
#
# tanh: y = v / 2^d; y above / below is Lambert's continued fraction y / (1 + y^2 / (3 + ..)), cut
# off. Its convergents for real y alternate around tanh y, so the error is less than the distance
# to the next one. Then d times tanh 2 y = 2 t / (1 + t^2), t = tanh y, which is exact, increasing
# for t < 1 and turns a relative error r into less than r. Every sum is of positive numbers.
# exp: v = k ln 2 + r with ln 2 in two pieces, of which the first times k is exact; e^r =
# (1 + t) / (1 - t), t = tanh(r/2) by the same fraction; times 2^k from powers of two, exact.
# wave: v = k pi/2 + r with pi/2 in three pieces, of which the first two times k, and the first two
# differences, are exact (at most 2^27 or 2^12 times 26 or 12 bits); Taylor series of sine and
# cosine of r, whose terms alternate and fall: the error is less than the first term left out.
# The proof of the numbers in _PORTABLE_BOUNDS is carried out, from this text and in this
# arithmetic, by tests/property/test_portable_functions.py: every rounding is an unknown factor
# 1 + d, |d| <= 2^-bits, and the mean value theorem bounds what all of them do together.


def portable_functions(arithmetic: Arithmetic) -> dict[str, str]:
    """Return the Python text of each portable function."""
    single, lines = arithmetic.single, list[str]()

    def clamp(target: str, value: str, end: float) -> None:
        lines.append(f"{target}_low = {-end} if {value} < {-end} else {value}")
        lines.append(f"{target} = {end} if {end} < {target}_low else {target}_low")

    def horner(target: str, numbers: Sequence[Fraction | int]) -> None:
        values = [float(arithmetic.rounded(Fraction(number))) for number in numbers]
        product = f"z * {values[-1]}" if values[-1] != 1 else "z"
        for j in range(len(values) - 2, -1, -1):
            name = f"{target}_{j}" if j else target
            lines.append(f"{name} = {values[j]} + {product}")
            product = f"z * {name}"

    def whole(target: str, value: str, factor: float) -> None:
        large = 1.5 * 2.0 ** (arithmetic.bits - 1)
        lines.append(f"{target}_far = {value} * {factor} + {large}")
        lines.append(f"{target} = {target}_far - {large}")

    def reduced(value: str, constant: Interval, bits: int, places: Sequence[int]) -> None:
        exact, near = (Fraction(end, 1 << bits) for end in constant)
        factor = float(arithmetic.rounded(1 / exact))
        if float(arithmetic.rounded(1 / near)) != factor:
            raise UndecidedError("a constant that is not known well enough")
        whole("k", value, factor)
        for j, place in enumerate(places, 1):
            piece = Fraction(math.floor(exact * 2**place), 2**place)
            lines.append(f"r_{j} = {value} - k * {float(piece)}")
            exact, value = exact - piece, f"r_{j}"
        rest = float(arithmetic.rounded(exact))
        lines.append(f"r_{len(places) + 1} = {value} - k * {rest}")

    def text(head: str, value: str) -> str:
        body = "".join(f"\n    {line}" for line in lines)
        lines.clear()
        return f"def portable_{head} -> float:{body}\n    return {value}\n"

    clamp("inner", "v", 9.25 if single else 20.0)
    lines.append(f"y = {0.25 if single else 0.125} * inner")
    lines.append("z = y * y")
    horner("above", (945, 105, 1) if single else (34459425, 4729725, 135135, 990, 1))
    horner("below", (945, 420, 15) if single else (34459425, 16216200, 945945, 13860, 45))
    lines.append("t_0 = y * above / below")
    count = 2 if single else 3
    lines.extend(f"t_{j + 1} = (t_{j} + t_{j}) / (1.0 + t_{j} * t_{j})" for j in range(count))
    clamp("outer", f"t_{count}", 1.0)
    found = {"tanh": text("tanh(v: float)", "outer")}

    clamp("inner", "v", 87.0 if single else 700.0)
    reduced("inner", (_LN2_LO, _LN2_HI), W, (15,) if single else (42,))
    lines.extend(("y = 0.5 * r_2", "z = y * y"))
    horner("above", (105, 10) if single else (10395, 1260, 21))
    horner("below", (105, 45, 1) if single else (10395, 4725, 210, 1))
    lines.extend(("t = y * above / below", "e = (1.0 + t) / (1.0 - t)", "n_0 = abs(k)"))
    n, power_of_two = "n_0", ""
    for j in range(6 if single else 9, -1, -1):
        size, factor = 2.0**j, 2.0 ** (2.0**j)
        grown, kept = (
            (f"{power_of_two} * {factor}", power_of_two) if power_of_two else (factor, 1.0)
        )
        lines.append(f"power_{j} = {kept} if {n} < {size} else {grown}")
        if j:
            lines.append(f"rest_{j} = {n} if {n} < {size} else {n} - {size}")
        n, power_of_two = f"rest_{j}", f"power_{j}"
    lines.append("value = e / power_0 if k < 0.0 else e * power_0")
    found["exp"] = text("exp(v: float)", "value")

    reduced("v", _HALF_PI, _V, (11, 23) if single else (25, 51))
    lines.append("z = r_3 * r_3")
    odd, even = (4, 5) if single else (8, 8)
    horner("odd", [Fraction((-1) ** j, math.factorial(2 * j + 1)) for j in range(1, odd + 1)])
    lines.append("sine = r_3 + r_3 * z * odd")
    horner("even", [Fraction((-1) ** j, math.factorial(2 * j)) for j in range(2, even + 1)])
    lines.extend(("fall = z * (0.5 - z * even)", "cosine = 0.75 - fall + 0.25"))
    lines.append("turns = k + shift")
    whole("full", "turns", 0.25)
    lines.extend(("place = turns - 4.0 * full", "square = place * place"))
    lines.append("far = cosine if square < 2.0 else sine")
    lines.append("size = sine if square < 0.5 else far")
    lines.extend(("minus = -size", "left = minus if place < -0.5 else size"))
    lines.append("right = minus if 1.5 < place else left")
    found["wave"] = text("wave(v: float, shift: float)", "right")
    return found


def _plain(function: ast.FunctionDef) -> str:
    """Text of a function without docstring and without rounding to binary32."""

    class Unrounded(ast.NodeTransformer):
        def visit_Call(self, node: ast.Call) -> ast.AST:
            self.generic_visit(node)
            rounds = isinstance(node.func, ast.Name) and node.func.id == "single"
            return node.args[0] if rounds and len(node.args) == 1 else node

    if isinstance(function.body[0], ast.Expr):
        function.body.pop(0)
    return ast.unparse(Unrounded().visit(function))


def _check_portable(path: str, texts: Sequence[str], arithmetic: Arithmetic) -> None:
    """Want the functions of a file to be those that were proved, and no other."""
    proved = {
        name: ast.unparse(ast.parse(text)) for name, text in portable_functions(arithmetic).items()
    }
    found: list[str] = []
    for text in texts:
        try:
            function = ast.parse(text).body[0]
        except SyntaxError:
            raise MalformedError(f"{path}: a portable function that cannot be read") from None
        name = getattr(function, "name", "").removeprefix("portable_")
        if (
            not isinstance(function, ast.FunctionDef)
            or name in found
            or _plain(function) != proved.get(name)
        ):
            raise MalformedError(f"{path}: portable {name} is not the function that was proved")
        found.append(name)
    if found and arithmetic.math == "libm":
        raise MalformedError(f"{path}: functions of its own, where those of the libm are certified")


_LIBM = "acos acosh asin asinh atan atanh atan2 cbrt ceil cos cosh erf erfc exp exp2 expm1 fabs"
_LIBM += " fdim floor fma fmax fmin fmod hypot ldexp lgamma log log10 log1p log2 nearbyint pow"
_LIBM += " remainder rint round scalbn sin sinh sqrt tan tanh tgamma trunc"


def _check_c_arithmetic(code: str, name: str, arithmetic: Arithmetic) -> None:
    """Want every literal and every function call of the C code to be of the certified type."""
    suffix = "f" if arithmetic.single else ""
    for literal in re.findall(
        r"(?<![\w.])(?:\d+\.\d*|\.\d+|\d+(?=[eE]))(?:[eE][-+]?\d+)?\w*", code
    ):
        if literal.endswith("F") != arithmetic.single or literal[-1] not in "0123456789.F":
            raise MalformedError(
                f"{name}.c: the literal {literal} is not of type {arithmetic.real}"
            )
    if re.search(r"\b0[xX][\w.]*[pP]", code):
        raise MalformedError(f"{name}.c: a hexadecimal literal: no controller needs that")
    if arithmetic.single and re.search(r"\bdouble\b", code):
        raise MalformedError(f"{name}.c: a double where everything is certified as float")
    for word in _LIBM.split():
        for end in ("", "f", "l"):
            allowed = end == suffix and (arithmetic.math == "libm" or word == "fabs")
            if not allowed and re.search(rf"\b{word}{end}\b", code):
                raise MalformedError(f"{name}.c: {word}{end} is not what the certificate is about")
    # What compilers have beside these: types of other widths, builtins, libraries of their own.
    strange = set(re.findall(r"\b(?:_\w*|double_t|float_t)\b", code))
    strange -= set(re.findall(r"\b_\w*", f"{_GUARDS} _Bool"))
    called = {*_LIBM.split(), "copysign"} if arithmetic.math == "libm" else {"fabs"}
    called = {word + suffix for word in called} | {"if", "return", "defined", "isfinite"}
    for word in re.findall(r"\b([A-Za-z]\w*)\s*\(", code):
        if word not in called and not word.startswith(f"{name}_"):
            strange.add(word)
    if strange:
        raise MalformedError(f"{name}.c: {min(strange)} is not what the certificate is about")

    def binary64(literal: re.Match[str]) -> str:
        value = _literal(literal.group(), arithmetic, ".c")
        return "unreadable" if value is None else repr(float(value))

    form = rf"static {name}_real {name}_(tanh|exp|wave)\(([^)]*)\)\s*{{(.*?)}}"
    functions = []
    for head, parameters, body in re.findall(form, code, re.DOTALL):
        lines = [" ".join(line.split()) for line in body.split(";") if line.strip()]
        given = re.sub(rf"{name}_real (\w+)", r"\1: float", parameters)
        text = [f"def portable_{head}({given}) -> float:"]
        for line in lines:
            plain = re.sub(rf"^const {name}_real ", "", line)
            plain = re.sub(r"[\d.][\d.e+-]*F\b", binary64, plain).replace(f"fabs{suffix}(", "abs(")
            plain = re.sub(r"= \((.+?)\) \? (.+) : (.+)$", r"= (\2) if (\1) else (\3)", plain)
            text.append(f"    {plain}")
        functions.append("\n".join(text))
    if len(re.findall(rf"\b{name}_real {name}_(?:tanh|exp|wave)\b", code)) != len(functions):
        raise MalformedError(f"{name}.c: a portable function that cannot be read")
    _check_portable(f"{name}.c", functions, arithmetic)


def _check_python_arithmetic(source: str, arithmetic: Arithmetic) -> None:
    """Want the functions of controller.py to be of the certified kind."""
    own: list[str] = []
    for item in ast.walk(ast.parse(source)):
        bound = getattr(item, "name", getattr(item, "id", getattr(item, "arg", "")))
        stored = not isinstance(item, ast.Name) or not isinstance(item.ctx, ast.Load)
        if isinstance(bound, str) and bound.startswith("portable_") and stored:
            own.append(ast.unparse(item))
        reads = isinstance(item, ast.ImportFrom) and item.module == "math"
        reads = reads or (isinstance(item, ast.Attribute) and item.attr in _LIBM.split())
        if reads and arithmetic.math == "portable":
            raise MalformedError("controller.py: a function of the libm is not portable")
    if ("from struct import" in source) != arithmetic.single:
        raise MalformedError(f"controller.py: not rounded as numbers of type {arithmetic.real}")
    _check_portable("controller.py", own, arithmetic)


_IMPORTED = {
    "__future__": {"annotations"},
    "struct": {"pack", "unpack"},
    "enum": {"IntEnum"},
    "typing": {"TYPE_CHECKING"},
    "collections.abc": {"Sequence"},
    "math": {name for name in dir(math) if not name.startswith("_")},
}
_BUILTINS = {"abs", "bool", "float", "int", "len", "staticmethod", "property", "tuple"}
_BUILTINS |= {"OverflowError", "ValueError", "ZeroDivisionError"}


def screen(source: str, constants: Iterable[str]) -> None:
    """Refuse a controller that could do anything but compute, or that changes a constant.

    Running a file must not be able to talk this checker into an answer. So only a plain module
    is run: named imports from four modules, attributes of math and of self only (its own begin
    with one underscore), no builtin that reaches further, nothing with two underscores.
    """
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise MalformedError("controller.py: not Python") from None
    stored: list[str] = []
    for item in ast.walk(tree):
        reason = _reason(item)
        if reason:
            raise MalformedError(f"controller.py: {reason}: no controller needs that")
        if isinstance(item, ast.Name) and isinstance(item.ctx, ast.Store):
            stored.append(item.id)
        elif isinstance(item, (ast.FunctionDef, ast.ClassDef)):
            stored.append(item.name)
        elif isinstance(item, ast.arg):
            stored.append(item.arg)
    # U_MAX is also a member of the class.
    repeated = [name for name in constants if stored.count(name) != (2 if name == "U_MAX" else 1)]
    if repeated:
        raise MalformedError(f"controller.py: {min(repeated)} is not assigned exactly once")


def _reason(item: ast.AST) -> str:
    if isinstance(item, ast.Import):
        return "" if all(a.name == "math" and not a.asname for a in item.names) else "an import"
    if isinstance(item, ast.ImportFrom):
        allowed = _IMPORTED.get(item.module or "", set())
        # pow is a builtin's name too, so the generated code calls math.pow by another.
        plain = all(
            a.name in allowed and (not a.asname or (a.name, a.asname) == ("pow", "power"))
            for a in item.names
        )
        return "" if plain and not item.level else f"an import from {item.module}"
    if isinstance(item, ast.Attribute):
        owner = item.value.id if isinstance(item.value, ast.Name) else ""
        own = item.attr in ("status", "stage", "reset")
        own = own or bool(re.fullmatch(r"_[a-z][a-z0-9_]*", item.attr))
        reads = owner == "math" and item.attr in _IMPORTED["math"]
        if (owner == "self" and own) or (reads and isinstance(item.ctx, ast.Load)):
            return ""
        return f"the attribute {item.attr}"
    if isinstance(item, ast.Name):
        foreign = item.id in dir(builtins) and item.id not in _BUILTINS
        special = item.id.startswith("__") and item.id != "__slots__"
        return f"the name {item.id}" if foreign or special else ""
    if isinstance(item, ast.ExceptHandler):
        return "a named exception" if item.name else ""
    kinds = (ast.Global, ast.Nonlocal, ast.Delete, ast.Await, ast.Yield, ast.With, ast.Lambda)
    return (
        type(item).__name__ if isinstance(item, (*kinds, ast.Match, ast.AsyncFunctionDef)) else ""
    )


References = tuple[Any, Any]  # what is passed as y_d at a sample, and at the latch


@dataclass(frozen=True, slots=True)
class Memory:
    """What a correct controller has latched: a start, and the switches since then.

    ``moves`` are (time, measured error of x_1) of each handover that made a new center, and
    ``renewed`` the time of the last one; all times are t - t_0.
    """

    start: tuple[float, ...]
    stage: int = 0
    moves: tuple[tuple[Fraction, Interval], ...] = ()
    renewed: Fraction = Fraction(0)


@dataclass(frozen=True, slots=True)
class Step:
    """Enclosures of u and of the measured errors, of the centers r_i, and the performance rho_i."""

    u: Interval
    errors: tuple[Interval, ...]
    centers: tuple[Interval, ...]
    levels: tuple[Interval, ...]


def _level_at(rho: Rho, time: Fraction) -> Interval:
    s = from_fraction(time)
    if rho.end is None or s[0] < rho.end[1]:
        return Tape(rho.node, ("t",)).value((s,))
    return ZERO_I


def law_enclosure(
    obligations: Obligations,
    time: Fraction,
    x: Sequence[float],
    memory: Memory,
    references: References | None,
) -> Step:
    """Enclose what a correct controller computes in the stage that it is in.

    time is t - t_0, x the sample, references (y_d, y_d at the latch) if they are passed in. The
    rounding that the certificate allows is added step by step.
    """
    problem, law = obligations.problem, obligations.laws[memory.stage]
    following = obligations.center.following
    if following is not None:
        return _nominal_law(law, following, time, x, memory.start, references)
    if references is not None:
        y, y_0 = (from_fraction(Fraction(value)) for value in references)
    else:
        tape = Tape(problem.reference or NOTHING, ("t",))
        y, y_0 = tape.value((from_fraction(time),)), tape.value((ZERO_I,))
    phi: Interval = ZERO_I
    errors, centers, levels = [], [], []
    for i, (rho, gain) in enumerate(zip(problem.rhos, law.gains, strict=True)):
        level = _level_at(rho, time if i == 0 else time - memory.renewed)
        latched = from_fraction(Fraction(memory.start[i]))
        r = add(y, mul(level, sub(latched, y_0))) if i == 0 else mul(level, latched)
        for moment, moved in memory.moves if i == 0 else ():
            r = add(r, mul(_level_at(rho, time - moment), moved))
        slack = law.rounding[i]
        e = add(sub(from_fraction(Fraction(x[i])), r), phi)
        e = (e[0] - slack, e[1] + slack)
        phi = gain.phi(e, level)
        errors.append(e)
        centers.append(r)
        levels.append(level)
    slack = law.rounding[-1]
    u = (-phi[1] - slack, -phi[0] + slack)
    return Step(u, tuple(errors), tuple(centers), tuple(levels))


def _nominal_law(
    law: StageLaw,
    following: Following,
    time: Fraction,
    x: Sequence[float],
    start: Sequence[float],
    references: Any,
) -> Step:
    centers, v = following.path.at(time, start, references)
    phi: Interval = ZERO_I
    errors = []
    for r, gain, value, slack in zip(centers, law.gains, x, law.rounding, strict=False):
        e = add(sub(from_fraction(Fraction(value)), r), phi)
        errors.append((e[0] - slack, e[1] + slack))
        phi = gain.phi(errors[-1], ONE_I)
    slack = law.rounding[-1]
    u = (v[0] - phi[1] - slack, v[1] - phi[0] + slack)
    return Step(u, tuple(errors), tuple(centers), tuple(ONE_I for _ in errors))


def follow(
    obligations: Obligations,
    time: Fraction,
    x: Sequence[float],
    memory: Memory,
    references: References | None,
) -> tuple[Step, Memory]:
    """Leave every stage whose half-widths the sample is outside of, as docs/theory.md section 8."""
    while True:
        step = law_enclosure(obligations, time, x, memory, references)
        stays = obligations.laws[memory.stage].stays
        if stays is None:
            return step, memory
        widths = [from_fraction(p) for p in stays]
        pairs = list(zip(step.errors, widths, strict=True))
        if all(-p[0] <= e[0] and e[1] <= p[0] for e, p in pairs):
            return step, memory
        if not any(e[0] > p[1] or e[1] < -p[1] for e, p in pairs):
            raise UndecidedError("a sample on the border between two stages")
        if obligations.problem.handover == "containment":
            memory = replace(memory, stage=memory.stage + 1)
            continue
        # x_1(0) belongs to the offset, which stays; the others start anew.
        memory = Memory(
            start=(memory.start[0], *x[1:]),
            stage=memory.stage + 1,
            moves=(*memory.moves, (time, step.errors[0])),
            renewed=time,
        )


class _Screened(importlib.abc.InspectLoader):
    """Runs the very text that was screened: bytecode beside the file is never looked at."""

    def __init__(self, text: str) -> None:
        self._text = text

    def get_source(self, fullname: str) -> str:
        """Return the text."""
        del fullname
        return self._text


def check_controller(path: Path, obligations: Obligations, design: Design) -> int:
    """Run controller.py on 200 samples inside the tube; each u must be in its enclosure.

    Eight starts, 25 samples each, from a fixed sequence; the times reach from 0 to 9e5 s (of
    center nominal every second start has eight below T_s) and a sample is made from errors chosen
    inside the tube. A law with another sign, gain or formula is far outside. Of a law in stages
    seven starts are driven out of every stage, three of them late; its stage must be the right one
    at each sample. After each start come samples that no law may be applied to, and one that is
    outside the tube: the status must say so.
    """
    sys.dont_write_bytecode = True
    loader = _Screened(_read(path).decode())
    spec = importlib.util.spec_from_loader("controller_under_test", loader)
    if spec is None or spec.loader is None:
        raise MalformedError("controller.py: cannot be loaded")
    module = importlib.util.module_from_spec(spec)
    state = 20_260_101

    def draw(lo: float, hi: float) -> float:
        nonlocal state
        state = (state * 6_364_136_223_846_793_005 + 1_442_695_040_888_963_407) % (1 << 64)
        return lo + (hi - lo) * (state / (1 << 64))

    problem = obligations.problem
    span = problem.latest / ONE
    count, last = 0, len(obligations.laws)
    try:
        spec.loader.exec_module(module)
        for run in range(8):
            controller = module.Controller()
            t_0 = draw(0.0, min(10.0, span / 16.0))
            bound = problem.reference_bounds if problem.reference is None else None
            start = [draw(lo / ONE, hi / ONE) for lo, hi in problem.starts]
            first: float | list[float] = 0.0
            previous, memory = t_0, Memory(tuple(start))
            # Every second sample from here on leaves a stage.
            leaves = (0, 3, 13)[(run > 0) + (run > 4)]
            if bound:
                first = _possible_reference(problem, start[0], draw(-1.0, 1.0))
                first = _with_derivatives(problem, first, draw)
            for j in range(25):
                late = 0.9 * span * 10.0 ** ((j - 24) / 2.0) * draw(0.5, 1.0)
                early = draw(20.0, 40.0) if 0 < j < 13 else 0.0
                early = min(early, 0.5 * span)
                if design.duration is not None and run % 2:
                    early = min(early, 8.0 * design.duration)
                t = t_0 + ((j / 24.0) ** 2 * early if j < 13 else late) if j else t_0
                previous = t = max(t, previous)
                y = first
                if bound and j:
                    y = draw(-1.0, 1.0) * (bound[0][0] / ONE)
                    y = _with_derivatives(problem, y, draw)
                references = (y, first) if bound else None
                elapsed = Fraction(t) - Fraction(t_0)
                x = list(start)
                if j:
                    leaving = run + j if leaves and j >= leaves and (j - leaves) % 2 == 0 else None
                    x = _sample(obligations, elapsed, memory, references, draw, leaving)
                u = controller.step(t, x, y) if bound else controller.step(t, x)
                expected, memory = follow(obligations, elapsed, x, memory, references)
                _judge_command(u, controller.status, expected.u, design.u_max)
                if last > 1:
                    _judge_stage(controller.stage, memory.stage + 1)
                count += 1
            widths = obligations.laws[memory.stage].widths
            _judge_refusals(controller, (t_0, t, span), (x, u), (y,) if bound else (), widths[-1])
    except MalformedError:
        raise
    except Exception as error:  # noqa: BLE001
        raise MalformedError(f"controller.py: {type(error).__name__} at sample {count}") from None
    return count


def _judge_refusals(
    controller: Any,
    times: tuple[float, float, float],
    last: tuple[Sequence[float], float],
    references: Sequence[Any],
    width: Fraction,
) -> None:
    """Pass samples after the last one that no law may be applied to, or that left the tube."""
    (t_0, t, span), (x, u) = times, last
    # Less than any other number of the type below t, and beyond what is accepted.
    before = math.nextafter(t, -math.inf) if span > 10**5 else t * (1.0 - 2.0**-22)
    for bad_t, bad_x, wanted in (
        (before, x[0], 3),
        (t_0 + 1.1 * span, x[0], 3),
        (math.nan, x[0], 2),
        (t, math.nan, 2),
        (t, -math.inf, 2),
    ):
        held = controller.step(bad_t, [bad_x, *x[1:]], *references)
        if type(held) is not float or held != u or int.__add__(controller.status, 0) != wanted:
            raise MalformedError("controller.py: a bad sample is not answered by holding u")
    # Further out by more than p_n + eta_n < 2 p_n, to the side where e_n is already.
    beyond = math.copysign(2.1 * float(width), -u)
    controller.step(t, [*x[:-1], x[-1] + beyond], *references)
    if int.__add__(controller.status, 0) not in (1, 2):
        raise MalformedError("controller.py: a sample outside the tube is answered with OK")


def _with_derivatives(
    problem: Problem, y: float, draw: Callable[[float, float], float]
) -> float | list[float]:
    """Return what is passed as the reference: center nominal wants y_d, dy_d, .. up to order n."""
    if problem.center == "performance":
        return y
    bounds = problem.derivatives[1 : len(problem.states) + 1]
    return [y, *(draw(-1.0, 1.0) * (bound[0] / ONE) for bound in bounds)]


def _possible_reference(problem: Problem, x: float, share: float) -> float:
    """Return a start of the reference that the declared offset and bound allow."""
    bound = problem.reference_bounds[0][0] / ONE if problem.reference_bounds else 0.0
    if problem.offset is None:
        return share * bound
    return min(max(x + share * (problem.offset[0] / ONE), -bound), bound)


def _sample(
    obligations: Obligations,
    elapsed: Fraction,
    memory: Memory,
    references: References | None,
    draw: Callable[[float, float], float],
    leaving: int | None,
) -> list[float]:
    """Build a measured state from errors inside the tube, one beyond it to leave a stage.

    ``leaving`` says which error that is (modulo n); it stays within the widened tube.
    """
    law = obligations.laws[memory.stage]
    now = law_enclosure(obligations, elapsed, memory.start, memory, references)
    x: list[float] = []
    phi = 0.0
    inside = law.stays or law.widths
    for i, (center, level) in enumerate(zip(now.centers, now.levels, strict=True)):
        e = draw(-0.999, 0.999) * float(inside[i])
        if leaving is not None and law.stays is not None and i == leaving % len(inside):
            e = math.copysign(float((inside[i] + 9 * law.widths[i]) / 10), e)
        x.append((center[0] + center[1]) / (2 * ONE) + e - phi)
        lo, hi = law.gains[i].phi(from_fraction(Fraction(e)), level)
        phi = (lo + hi) / (2 * ONE)
    return x


def _judge_stage(stage: object, expected: int) -> None:
    if type(stage) is not int or stage != expected:
        raise MalformedError(f"controller.py: stage {stage!r} where {expected} is in force")


def _judge_command(u: object, status: object, expected: Interval, u_max: float) -> None:
    # Exactly these types: a subclass could answer comparisons as it likes.
    if type(u) is not float or not math.isfinite(u):
        raise MalformedError(f"controller.py: the command {u!r}")
    limit = from_fraction(Fraction(u_max))[1]
    lo, hi = (min(max(end, -limit), limit) for end in expected)
    if not lo <= from_fraction(Fraction(u))[1] or not from_fraction(Fraction(u))[0] <= hi:
        raise MalformedError(
            f"controller.py: u = {u!r} is outside {to_doubles((lo, hi))}: not the certified law"
        )
    if not isinstance(status, int) or int.__add__(status, 0) != 0:
        raise MalformedError("controller.py: a sample inside the tube is not answered with OK")


# ---------------------------------------------------------------------------------------------
# 10. Command line.


def render(report: Report) -> str:
    """Return the report as text for people."""
    lines = [
        f"{claim.verdict:9} {claim.id:14} {claim.statement}"
        + (f"   [{claim.detail}]" if claim.detail else "")
        for claim in report.claims
    ]
    lines += [f"checked   {test}" for test in report.tests]
    lines += [f"{report.verdict}: {failure}" for failure in report.failures]
    if report.assumptions:
        lines += ["", "What stays assumed:", *(f"  - {line}" for line in report.assumptions)]
    return "\n".join([*lines, "", f"verdict: {report.verdict}"])


def main(argv: Sequence[str] | None = None) -> int:
    """Verify a folder; see the head of this file for the exit codes."""
    parser = argparse.ArgumentParser(description="Verify a generated controller folder.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path(__file__).resolve().parent)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    arguments = parser.parse_args(argv)
    report = verify_folder(arguments.folder)
    if arguments.json:
        print(json.dumps(report.document(), indent=1))
    else:
        print(render(report))
    return report.exit_code


if __name__ == "__main__":
    sys.exit(main())
