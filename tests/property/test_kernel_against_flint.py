"""The checker's arithmetic against FLINT's balls: 100,000 intervals and expressions, no miss."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import TYPE_CHECKING

import flint
import pytest

from bfppc_synth.certificate import checker

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

FUNCTIONS = (
    *("exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "atan", "asinh"),
    *("root2", "root4", "signed4/3"),
)
POWERS = (2, 3, 7, -1, -2, -3, Fraction(1, 3), Fraction(2, 3), Fraction(-5, 3), Fraction(3, 5))
PER_FUNCTION = 4000
PER_POWER = 1800
EXPRESSIONS, BOXES = 300, 100


@pytest.fixture(autouse=True)
def _precision() -> Iterator[None]:
    before = flint.ctx.prec
    flint.ctx.prec = 600
    yield
    flint.ctx.prec = before


def seeded(name: str) -> random.Random:
    return random.Random(name)  # noqa: S311 (repeatable test data)


def exact(n: int) -> flint.arb:
    return flint.arb(flint.fmpq(n, checker.ONE))


def misses(enclosure: tuple[int, int], value: flint.arb) -> bool:
    """Whether a ball lies certainly outside."""
    scaled = value * checker.ONE
    return bool(scaled < enclosure[0]) or bool(scaled > enclosure[1])


def odd_root_power(x: flint.arb, exponent: Fraction) -> flint.arb:
    size = flint.fmpq(exponent.numerator, exponent.denominator)
    if exponent.denominator == 1:
        return x**exponent.numerator
    sign = -1 if x < 0 and exponent.numerator % 2 else 1
    if x == 0:
        return flint.arb(0)
    return sign * abs(x) ** flint.arb(size)


def reference(name: str) -> Callable[[flint.arb], flint.arb]:
    if name.startswith("root"):
        return lambda x: x.root(int(name[4:]))
    if name.startswith("signed"):
        return lambda x: x.sgn() * odd_root_power(abs(x), Fraction(name[6:]))
    return lambda x: getattr(x, name)()


def intervals(count: int, seed: str, *, largest: int, positive: bool) -> Iterator[tuple[int, int]]:
    """Intervals of all widths and sizes, points and zeros among them."""
    source = seeded(seed)
    for j in range(count):
        lo = source.getrandbits(source.randrange(1, largest))
        width = source.getrandbits(source.randrange(1, largest)) * (j % 5 > 0)
        if not positive:
            lo *= source.choice((-1, 1))
            lo *= j % 17 > 0
        yield lo + positive, lo + positive + width


@pytest.mark.parametrize("name", FUNCTIONS)
def test_no_function_value_lies_outside_its_enclosure(name: str) -> None:
    source = seeded(f"points of {name}")
    function = reference(name)
    large = 134 if name in ("exp", "sinh", "cosh", "tanh") else 150
    positive = name == "log" or name.startswith("root")
    checked = 0
    for box in intervals(PER_FUNCTION, name, largest=large, positive=positive):
        try:
            enclosure = checker._call(name, (box,))
        except checker.UndecidedError:
            assert name == "tan"
            continue
        point = source.randint(*box)
        for n in {box[0], box[1], point}:
            assert not misses(enclosure, function(exact(n))), (box, n)
            checked += 1
    assert checked > PER_FUNCTION / 3


@pytest.mark.parametrize("exponent", POWERS)
def test_no_power_lies_outside_its_enclosure(exponent: Fraction) -> None:
    exponent = Fraction(exponent)
    source = seeded(f"points of {exponent}")
    checked = 0
    for box in intervals(PER_POWER, f"power {exponent}", largest=150, positive=False):
        try:
            enclosure = checker.power(box, exponent)
        except checker.UndecidedError:
            # A power of what is next to 0 is 0 in the last place, and has no reciprocal.
            assert exponent < 0
            assert box[0] <= 0 <= box[1] or min(map(abs, box)) < checker.ONE >> 30
            continue
        for n in {box[0], box[1], source.randint(*box)}:
            assert not misses(enclosure, odd_root_power(exact(n), exponent)), (box, n)
            checked += 1
    assert checked > PER_POWER / 2


UNARY = ("exp", "sin", "cos", "tanh", "atan", "asinh", "abs", "sign", "cosh", "sinh")


def random_tree(source: random.Random, depth: int) -> tuple[str, Callable[..., flint.arb]]:
    """Return the text of an expression in x and y, and the same thing in balls."""
    kind = source.randrange(9) if depth else source.randrange(2)
    if kind == 0:
        p, q = source.randrange(-30, 31), source.randrange(1, 9)
        return f"({p}/{q})", lambda _x, _y: flint.arb(flint.fmpq(p, q))
    if kind == 1:
        name = source.choice("xy")
        return name, lambda x, y: x if name == "x" else y
    left, f = random_tree(source, depth - 1)
    if kind in (2, 3):
        name = source.choice(UNARY)
        special = {"abs": abs, "sign": lambda v: v.sgn()}
        call = special.get(name) or (lambda v: getattr(v, name)())
        return f"{name}({left})", lambda x, y: call(f(x, y))
    if kind == 4:
        exponent = source.choice((2, 3, Fraction(1, 3), Fraction(2, 3)))
        return f"({left})**({exponent})", lambda x, y: odd_root_power(f(x, y), Fraction(exponent))
    right, g = random_tree(source, depth - 1)
    if kind in (5, 6):
        return f"({left} + {right})", lambda x, y: f(x, y) + g(x, y)
    if kind == 7:
        return f"({left} * {right})", lambda x, y: f(x, y) * g(x, y)
    return f"({left} - {left} * {right})", lambda x, y: f(x, y) - f(x, y) * g(x, y)


def test_no_expression_value_lies_outside_its_enclosure() -> None:
    source = seeded("expressions")
    names = {"x": checker.sym("x"), "y": checker.sym("y")}
    checked = 0
    for _ in range(EXPRESSIONS):
        text, value = random_tree(source, 4)
        try:
            tape = checker.Tape(checker.parse(text, names), ("x", "y"))
        except checker.UndecidedError:
            continue
        for j in range(BOXES):
            ends = [sorted(source.uniform(-3, 3) for _ in range(2)) for _ in range(2)]
            box = tuple(tuple(int(end * checker.ONE) for end in pair) for pair in ends)
            try:
                enclosure = tape.value(box)
                upper = enclosure[1] if j % 10 else tape.bound(box).upper
            except checker.UndecidedError:
                continue
            found = value(*(exact(source.randint(*pair)) for pair in box))
            assert not misses(enclosure, found), (text, box)
            assert not misses((enclosure[0], upper), found), (text, box)
            checked += 1
    assert checked > EXPRESSIONS * BOXES / 2


def test_gradients_contain_the_slopes_between_points() -> None:
    source = seeded("gradients")
    names = {"x": checker.sym("x"), "y": checker.sym("y")}
    checked = 0
    for _ in range(60):
        text, value = random_tree(source, 3)
        tape = checker.Tape(checker.parse(text, names), ("x", "y"))
        for _ in range(20):
            ends = [sorted(source.uniform(-3, 3) for _ in range(2)) for _ in range(2)]
            box = tuple(tuple(int(end * checker.ONE) for end in pair) for pair in ends)
            try:
                slopes = tape.gradient(box)[1]
            except checker.UndecidedError:
                continue
            y = exact(source.randint(*box[1]))
            a, b = sorted(source.randint(*box[0]) for _ in range(2))
            if a == b:
                continue
            change = (value(exact(b), y) - value(exact(a), y)) / (exact(b) - exact(a))
            assert not misses(slopes.get(0, (0, 0)), change), (text, box)
            checked += 1
    assert checked > 500


@pytest.mark.parametrize(
    ("top", "bottom"),
    [(3893924827815215, 1125899906842624), (1381846513289487, 70368744177664), (-1, 2**53)],
)
def test_the_inputs_of_mpmath_1181_are_enclosed(top: int, bottom: int) -> None:
    # There the upper end of an interval exponential lies below the true value.
    enclosure = checker.exp(checker.from_fraction(Fraction(top, bottom)))
    ball = flint.arb(flint.fmpq(top, bottom)).exp()
    assert not misses(enclosure, ball)
    lower, upper = checker.to_doubles(enclosure)
    assert flint.arb(lower) <= ball <= flint.arb(upper)


def test_constants_are_enclosed_to_a_unit_in_the_last_place() -> None:
    pi = checker.PI_I
    assert not misses(pi, flint.arb.pi())
    assert pi[1] - pi[0] <= 2
    e = checker.exp(checker.ONE_I)
    assert not misses(e, flint.arb.const_e())
    assert e[1] - e[0] <= 2
