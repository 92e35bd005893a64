"""The error bounds of the portable functions: proved from their text, then tried.

The proof reads the Python text that the checker holds. Every rounding is an unknown factor
1 + d, |d| <= 2^-bits; over a cell of arguments each intermediate value and each derivative of the
result by it is enclosed in the checker's integer arithmetic, values with all factors included, so
the mean value theorem bounds what all roundings together can do. What the exact program differs
from the function by is bounded as the comment of section 9b says.
"""

from __future__ import annotations

import ast
import itertools
import math
from fractions import Fraction
from typing import TYPE_CHECKING

import mpmath
import numpy as np
import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.checker import (
    ONE,
    ONE_I,
    ZERO_I,
    Arithmetic,
    Interval,
    absolute,
    add,
    div,
    from_fraction,
    mul,
    neg,
    scale,
    sub,
)
from bfppc_synth.simulation.loading import load_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

DOUBLE, SINGLE = Arithmetic("double", "portable"), Arithmetic("float", "portable")
BOTH = pytest.mark.parametrize("arithmetic", [DOUBLE, SINGLE], ids=["double", "float"])
EXACT_CONSTANTS, ROUNDED_CONSTANTS = 0, 1


def body(name: str, arithmetic: Arithmetic) -> list[ast.Assign]:
    tree = ast.parse(checker.portable_functions(arithmetic)[name]).body[0]
    return [line for line in tree.body if isinstance(line, ast.Assign)]


def lines_from(name: str, arithmetic: Arithmetic, first: str, last: str) -> list[ast.Assign]:
    """Return the assignments from one target to another, both included."""
    found = body(name, arithmetic)
    targets = [line.targets[0].id for line in found]
    return found[targets.index(first) : targets.index(last) + 1]


class Roundings:
    """A straight-line program over one cell: enclosures of values, then of their influence."""

    def __init__(self, arithmetic: Arithmetic, constants: int) -> None:
        unit = ONE >> arithmetic.bits
        self.factor: Interval = (ONE - unit, ONE + unit)
        self.unit = Fraction(1, 1 << arithmetic.bits)
        self.constants = constants
        self.values: list[Interval] = []
        self.slopes: list[list[tuple[int, Interval]]] = []
        self.rounds: list[int] = []
        self.names: dict[str, int] = {}

    def _put(self, value: Interval, slopes: list[tuple[int, Interval]], rounds: int) -> int:
        self.values.append(mul(value, self.factor) if rounds else value)
        if rounds:
            slopes = [(place, mul(slope, self.factor)) for place, slope in slopes]
        self.slopes.append(slopes)
        self.rounds.append(rounds)
        return len(self.values) - 1

    def input(self, name: str, value: Interval) -> None:
        self.names[name] = self._put(value, [], 0)

    def run(self, lines: list[ast.Assign]) -> int:
        for line in lines:
            place = self._visit(line.value)
            self.names[line.targets[0].id] = place
        return place

    def _visit(self, node: ast.expr) -> int:
        if isinstance(node, ast.Name):
            return self.names[node.id]
        if isinstance(node, ast.Constant):
            number = from_fraction(Fraction(node.value))
            whole = float(node.value * 32).is_integer() and abs(node.value) >= 0.03
            return self._put(number, [], 0 if whole else self.constants)
        if isinstance(node, ast.UnaryOp):
            place = self._visit(node.operand)
            return self._put(neg(self.values[place]), [(place, neg(ONE_I))], 0)
        assert isinstance(node, ast.BinOp)
        left, right = self._visit(node.left), self._visit(node.right)
        a, b = self.values[left], self.values[right]
        # Doubling, and a product with a power of two, are exact.
        twice = left == right
        power = isinstance(node.left, ast.Constant) and math.frexp(node.left.value)[0] == 0.5
        if isinstance(node.op, ast.Add):
            slopes = [(left, ONE_I), (right, ONE_I)]
            return self._put(add(a, b), slopes, 0 if twice else 1)
        if isinstance(node.op, ast.Sub):
            return self._put(sub(a, b), [(left, ONE_I), (right, neg(ONE_I))], 1)
        if isinstance(node.op, ast.Mult):
            product = mul(a, b)
            if twice:
                product = (max(product[0], 0), product[1])
            return self._put(product, [(left, b), (right, a)], 0 if power else 1)
        quotient = div(a, b)
        below = div(ONE_I, b)
        return self._put(quotient, [(left, below), (right, neg(mul(quotient, below)))], 1)

    def influence(self, result: int) -> list[Interval]:
        """Enclose the derivative of the result by every value."""
        found: list[Interval] = [ZERO_I] * (result + 1)
        found[result] = ONE_I
        for place in range(result, -1, -1):
            for before, slope in self.slopes[place]:
                found[before] = add(found[before], mul(found[place], slope))
        return found

    def error(self, result: int) -> int:
        """Bound what all roundings do to the result; in units of 2^-P."""
        total = 0
        for place, influence in enumerate(self.influence(result)):
            if self.rounds[place]:
                # x = op (1 + d): dx/dd = x / (1 + d).
                size = absolute(div(mul(influence, self.values[place]), self.factor))[1]
                total += scale(self.unit * self.rounds[place], (size, size))[1] + 1
        return total


def cells(start: float, end: float, ratio: float) -> Iterator[Interval]:
    """Cut [start, end] into cells whose ends have a ratio."""
    lower = Fraction(start)
    while lower < Fraction(end):
        upper = min(Fraction(float(lower) * ratio), Fraction(end))
        yield from_fraction(lower)[0], from_fraction(upper)[1]
        lower = upper


def evenly(end: float, count: int) -> Iterator[Interval]:
    ends = [from_fraction(Fraction(end) * j / count)[0] for j in range(-count, count + 1)]
    yield from itertools.pairwise(ends)


def continuants(count: int, z: Interval) -> tuple[Interval, Interval]:
    """Q_count and Q_count+1 of y/(1 + z/(3 + z/(5 + ..))): Q_j = (2j - 1) Q_j-1 + z Q_j-2."""
    before, now = ONE_I, ONE_I
    pairs = [(before, now)]
    for j in range(2, count + 2):
        before, now = now, add(scale(Fraction(2 * j - 1), now), mul(z, before))
        pairs.append((before, now))
    return pairs[-1]


def cut_off(count: int, z: Interval) -> Interval:
    """Bound |C - tanh y| / y for the convergent C = P/Q, Q and Q' the next: z^count / (Q Q')."""
    first, second = continuants(count, z)
    return div(checker.power(z, Fraction(count)), mul(first, second))


def exactly(lines: list[ast.Assign], given: Mapping[str, Fraction]) -> dict[str, Fraction]:
    """Run a straight-line program without any rounding."""
    known = dict(given)

    def value(node: ast.expr) -> Fraction:
        if isinstance(node, ast.BinOp):
            a, b = value(node.left), value(node.right)
            kind = type(node.op)
            if kind is ast.Div:
                return a / b
            return {ast.Add: a + b, ast.Sub: a - b, ast.Mult: a * b}[kind]
        if isinstance(node, ast.UnaryOp):
            return -value(node.operand)
        return known[node.id] if isinstance(node, ast.Name) else Fraction(node.value)

    for line in lines:
        known[line.targets[0].id] = value(line.value)
    return known


def convergent(count: int, y: Fraction) -> Fraction:
    """y/(1 + y^2/(3 + y^2/(5 + ..))) with ``count`` levels, from the inside."""
    below = Fraction(2 * count - 1)
    for j in range(count - 1, 0, -1):
        below = 2 * j - 1 + y * y / below
    return y / below


def units(error: Fraction | float, arithmetic: Arithmetic) -> float:
    return float(error * 2**arithmetic.bits)


def relative(error: int, value: Interval) -> Fraction:
    return Fraction(error, absolute(value)[0])


def proved_tanh(arithmetic: Arithmetic) -> Fraction:
    """Relative error of tanh for every argument of at least 2^-60 (by odd symmetry of both signs).

    Below 2^-60 every sum rounds to its first term and at most 10 roundings remain.
    """
    end, count = (9.25, 5) if arithmetic.single else (20.0, 9)
    share, doublings = (Fraction(1, 4), 2) if arithmetic.single else (Fraction(1, 8), 3)
    lines = lines_from("tanh", arithmetic, "y", f"t_{doublings}")
    for j in range(1, 12):
        run = exactly(lines, {"inner": Fraction(j)})
        assert run["t_0"] == convergent(count, share * j)
        assert run["t_1"] == 2 * run["t_0"] / (1 + run["t_0"] ** 2)
    worst = Fraction(0)
    parts = itertools.chain(cells(2.0**-60, 2.0**-6, 1.1), cells(2.0**-6, end, 1.005))
    for v in parts:
        program = Roundings(arithmetic, EXACT_CONSTANTS)
        program.input("inner", v)
        result = program.run(lines)
        own = relative(program.error(result), program.values[result])
        # The convergent, then its distance from tanh doubled as often: rho (1 - a b) / (1 + a^2).
        y = scale(share, v)
        z = mul(y, y)
        t = checker.tanh(y)
        ratio = div(cut_off(count, z), div(t, y))
        for _ in range(doublings):
            a = mul(t, (ONE - ratio[1], ONE + ratio[1]))
            room = (0, absolute(sub(ONE_I, mul(a, t)))[1])
            ratio = (0, div(mul((0, ratio[1]), room), add(ONE_I, mul(a, a)))[1])
            y = (2 * y[0], 2 * y[1])
            t = checker.tanh(y)
        worst = max(worst, own + Fraction(ratio[1], ONE))
    last = checker.tanh(from_fraction(Fraction(end)))
    return worst + 1 - Fraction(last[0], ONE)


def proved_exp(arithmetic: Arithmetic) -> Fraction:
    """Relative error of exp from the error of r, the roundings after it, and the cut."""
    bits, pieces, count = (24, 15, 4) if arithmetic.single else (53, 42, 6)
    largest = 126 if arithmetic.single else 1010
    text = checker.portable_functions(arithmetic)["exp"]
    first, second = (Fraction(float(x)) for x in numbers_of(text, "r_1", "r_2"))
    assert (first * 2**pieces).denominator == 1
    # k times the first piece fits: exact. v - k ln 2 then has two roundings of at most 0.36, one
    # of k times the second piece, and what the pieces leave of ln 2.
    assert largest * first * 2**pieces < 2**bits
    ln_2 = Fraction(checker._LN2_LO, 1 << checker.W)
    left = largest * (abs(ln_2 - first - second) + Fraction(1, 1 << 180))
    shifted = left + Fraction(1, 1 << bits) * (Fraction(72, 100) + largest * second)
    # The rounded quotient is within 3 roundings of v / ln 2, so |r| < 0.36.
    assert (Fraction(1, 2) + Fraction(3 * largest, 2**bits)) * ln_2 < Fraction(36, 100)
    lines = lines_from("exp", arithmetic, "y", "e")
    for j in range(1, 9):
        run = exactly(lines, {"r_2": Fraction(j, 9)})
        assert run["t"] == convergent(count, Fraction(j, 18))
        assert run["e"] == (1 + run["t"]) / (1 - run["t"])
    worst = Fraction(0)
    for r in evenly(0.36, 120):
        program = Roundings(arithmetic, EXACT_CONSTANTS)
        program.input("r_2", r)
        result = program.run(lines)
        own = relative(program.error(result), program.values[result])
        y = scale(Fraction(1, 2), r)
        # d log((1 + t) / (1 - t)) = 2 dt / (1 - t^2), and |y|, |t| < 0.18.
        cut = cut_off(count, (0, absolute(mul(y, y))[1]))[1]
        worst = max(worst, own + Fraction(cut, ONE) * Fraction(2 * 18, 100) * Fraction(11, 10))
    return worst + shifted * Fraction(1001, 1000)


def numbers_of(text: str, *targets: str) -> list[float]:
    """Return the last number in the lines that assign these."""
    found = {}
    for line in ast.walk(ast.parse(text)):
        if isinstance(line, ast.Assign):
            constants = [n.value for n in ast.walk(line.value) if isinstance(n, ast.Constant)]
            found[line.targets[0].id] = constants[-1] if constants else 0.0
    return [found[target] for target in targets]


def proved_wave(arithmetic: Arithmetic) -> Fraction:
    """Absolute error of sine and cosine."""
    bits, places, top = (24, (11, 23), 12) if arithmetic.single else (53, (25, 51), 27)
    end = checker._PORTABLE_BOUNDS["sin"][2 + arithmetic.single]
    text = checker.portable_functions(arithmetic)["wave"]
    pieces = [Fraction(x) for x in numbers_of(text, "r_1", "r_2", "r_3")]
    half_pi = Fraction(checker._HALF_PI[0], 1 << checker._V)
    k = math.ceil(Fraction(end) / half_pi)
    assert k <= 2**top
    assert (Fraction(1, 2) + Fraction(3 * k, 2**bits)) * half_pi < Fraction(79, 100)
    for piece, place in zip(pieces, places, strict=False):
        # k times the piece is a multiple of 2^-place and has no more than the bits: exact.
        assert (piece * 2**place).denominator == 1
        assert k * piece * 2**place < 2**bits
    # The last place of v is no coarser than that of the first product, and |v| > 1/2 where k is
    # not 0: v - k p_1 is a multiple of the last place of v, and smaller than the next power of
    # two above v; the second difference is below 1 and a multiple of 2^-bits. Both are exact.
    assert Fraction(end) <= 2 ** (bits - places[0])
    assert Fraction(79, 100) + k * (half_pi - pieces[0]) < max(1, Fraction(k))
    assert Fraction(79, 100) + k * (half_pi - pieces[0] - pieces[1]) < 1
    assert places[1] <= bits
    left = (k + 1) * (abs(half_pi - sum(pieces)) + Fraction(1, 1 << 180))
    shifted = left + Fraction(1, 1 << bits) * (Fraction(79, 100) + k * pieces[2])
    odd, even = (4, 5) if arithmetic.single else (8, 8)
    worst = Fraction(0)
    for last, degree in (("sine", 2 * odd + 3), ("cosine", 2 * even + 2)):
        lines = lines_from("wave", arithmetic, "z", "cosine")
        lines = lines[: [line.targets[0].id for line in lines].index(last) + 1]
        cut = Fraction(79, 100) ** degree / math.factorial(degree)
        near = exactly(lines, {"r_3": Fraction(1, 2)})[last]
        series = sum(
            Fraction((-1) ** (j // 2), 2**j * math.factorial(j))
            for j in range(last == "sine", degree, 2)
        )
        assert abs(near - series) < Fraction(1, 2 ** (bits + 1))
        for r in evenly(0.79, 60):
            program = Roundings(arithmetic, ROUNDED_CONSTANTS)
            program.input("r_3", r)
            result = program.run(lines)
            worst = max(worst, Fraction(program.error(result), ONE) + cut)
    return worst + shifted


@BOTH
def test_the_error_bounds_of_the_checker_are_proved(arithmetic: Arithmetic) -> None:
    bounds, single = checker._PORTABLE_BOUNDS, arithmetic.single
    found = {
        "tanh": proved_tanh(arithmetic),
        "exp": proved_exp(arithmetic),
        "sin": proved_wave(arithmetic),
    }
    for name, error in found.items():
        # And none is stated without need.
        assert bounds[name][single] / 2 < units(error, arithmetic) <= bounds[name][single], name
    assert bounds["cos"] == bounds["sin"]


def functions(arithmetic: Arithmetic) -> dict[str, Callable[..., np.ndarray]]:
    """Run the texts on arrays: numpy rounds + - * / of both types as IEEE 754 says."""
    kind = np.float32 if arithmetic.single else np.float64

    class Typed(ast.NodeTransformer):
        def visit_Constant(self, node: ast.Constant) -> ast.AST:
            return ast.Call(ast.Name("kind", ast.Load()), [node], [])

        def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
            self.generic_visit(node)
            return ast.Call(ast.Name("where", ast.Load()), [node.test, node.body, node.orelse], [])

    found = {}
    for name, text in checker.portable_functions(arithmetic).items():
        typed = ast.unparse(ast.fix_missing_locations(Typed().visit(ast.parse(text))))
        head = f"from numpy import {kind.__name__} as kind, where\n"
        module = load_text(head + typed, name=name, origin=name)
        found[name] = getattr(module, f"portable_{name}")
    return found


def draw(arithmetic: Arithmetic, ends: float, count: int = 4_000) -> np.ndarray:
    random = np.random.default_rng(3)
    parts = [
        random.uniform(-ends, ends, count),
        random.uniform(-3.0, 3.0, count),
        10.0 ** random.uniform(-25.0, 0.0, count),
        np.array([0.0, -0.0, ends, -ends]),
        (random.integers(-4_000, 4_000, count) * math.pi / 2).clip(-ends, ends),
    ]
    return np.concatenate(parts).astype(np.float32 if arithmetic.single else np.float64)


def errors(
    got: np.ndarray, v: np.ndarray, true: Callable[[mpmath.mpf], mpmath.mpf], bits: int
) -> tuple[float, float]:
    """Return the largest relative and the largest absolute error in roundings."""
    worst = [0.0, 0.0]
    with mpmath.workprec(200):
        for a, x in zip(got.tolist(), v.tolist(), strict=True):
            exact = true(mpmath.mpf(x))
            apart = abs(mpmath.mpf(a) - exact) * 2**bits
            worst[1] = max(worst[1], float(apart))
            if exact:
                worst[0] = max(worst[0], float(apart / abs(exact)))
    return worst[0], worst[1]


@BOTH
def test_no_sample_exceeds_the_bounds(arithmetic: Arithmetic) -> None:
    bounds, own = checker._PORTABLE_BOUNDS, functions(arithmetic)
    bits, index = arithmetic.bits, arithmetic.single
    v = draw(arithmetic, 30.0)
    assert 3.0 < errors(own["tanh"](v), v, mpmath.tanh, bits)[0] <= bounds["tanh"][index]
    v = draw(arithmetic, float(bounds["exp"][2 + index]))
    assert 1.0 < errors(own["exp"](v), v, mpmath.exp, bits)[0] <= bounds["exp"][index]
    v = draw(arithmetic, float(bounds["sin"][2 + index]))
    for shift, true in ((0.0, mpmath.sin), (1.0, mpmath.cos)):
        worst = errors(own["wave"](v, v.dtype.type(shift)), v, true, bits)[1]
        assert 1.0 < worst <= bounds["sin"][index]


@BOTH
def test_the_functions_are_odd_even_and_bounded_and_hold_nan_back(arithmetic: Arithmetic) -> None:
    own = functions(arithmetic)
    v = draw(arithmetic, 6_000.0)
    v = np.concatenate([v, np.array([np.inf, 1e30], v.dtype)])
    one, zero = v.dtype.type(1), v.dtype.type(0)
    tanh = own["tanh"](v)
    assert (tanh == -own["tanh"](-v)).all()
    assert np.abs(tanh).max() == 1.0
    assert (np.sign(tanh) == np.sign(v)).all()
    finite = v[:-2]
    assert (own["wave"](finite, zero) == -own["wave"](-finite, zero)).all()
    assert (own["wave"](finite, one) == own["wave"](-finite, one)).all()
    bits = 2.0**-arithmetic.bits
    assert np.abs(own["wave"](finite, zero)).max() <= 1.0 + 3 * bits
    assert (own["exp"](v) > 0.0).all()
    assert np.isfinite(own["exp"](v)).all()
    assert own["exp"](np.zeros(1, v.dtype))[0] == 1.0
    assert own["wave"](np.zeros(1, v.dtype), zero)[0] == 0.0
    assert own["wave"](np.zeros(1, v.dtype), one)[0] == 1.0
    nan = np.array([np.nan], v.dtype)
    assert all(np.isnan(f(*((nan, zero)[: 1 + (n == "wave")])))[0] for n, f in own.items())


@BOTH
def test_tanh_and_exp_never_fall_by_more_than_their_error(arithmetic: Arithmetic) -> None:
    own, bits = functions(arithmetic), 2.0**-arithmetic.bits
    for name, end in (("tanh", 22.0), ("exp", 80.0)):
        v = np.sort(draw(arithmetic, end, 40_000))
        found = own[name](v).astype(np.float64)
        bound = checker._PORTABLE_BOUNDS[name][arithmetic.single] * bits
        falls = found[:-1] - found[1:]
        assert (falls <= 2.0 * bound * np.abs(found[1:])).all()
