"""Claims of bounds tight against the error's rate on the tube, computed from the plant itself.

Nothing of the package is used to evaluate the plants: e_i and de_i come from its right side, the
center from its definition with mpmath, and points are drawn at random and improved.
"""

from __future__ import annotations

import functools
import math
import os
import random
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import mpmath  # type: ignore[import-untyped]
import numpy as np
import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import judge, produce_certificate
from bfppc_synth.certificate.trees import find_trees
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.tight import TightBounds

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

Number = Any
Path = tuple[list[float], list[float]]  # r_1..r_{n+1} and dr_1..dr_n


def shape(k: float, M: float = 0.0, epsilon: float = 1.0, c: float = 0.0) -> Shape:
    return Shape(k=k, M=M, epsilon=epsilon, c=c, N=3)


@dataclass(frozen=True)
class Case:
    """A plant as a document and as functions of (x, parameters, hidden signs in [-1, 1])."""

    plant: dict[str, Any]
    shapes: tuple[Shape, ...]
    p: tuple[float, ...]
    f: tuple[Callable[..., Number], ...]
    g: tuple[Callable[..., Number], ...]
    starts: tuple[tuple[float, float], ...]
    path: Callable[..., Path]
    last: float
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    duration: float | None = None
    halvings: int = 0
    boxes: int = 60
    apart: float = 0.06

    @property
    def document(self) -> dict[str, Any]:
        plant = {**self.plant, "synthesis": {"bounds": "tight", **self.plant["synthesis"]}}
        return {"format": checker.PLANT_FORMAT, "plant_sha256": "ab" * 32, "plant": plant}


def phi(s: Shape, e: float) -> float:
    return s.k * e + s.M * math.tanh(s.M * e / s.epsilon) + s.c * e**s.N


def phi_slope(s: Shape, e: float) -> float:
    bent = math.tanh(s.M * e / s.epsilon)
    return s.k + s.M**2 / s.epsilon * (1 - bent**2) + s.c * s.N * e ** (s.N - 1)


def rates(case: Case, path: Path, e: Sequence[float], th: Number, h: Number, i: int) -> float:
    """de_{i+1}, with e_{i+2} = phi_{i+1}(e_{i+1}): the state x_{i+2} is at r_{i+2}."""
    (r, dr), before = path, 0.0
    back = [0.0, *map(phi, case.shapes, e)]
    x = [r[j] + e[j] - back[j] for j in range(i + 1)]
    for j in range(i + 1):
        ahead = x[j + 1] if j < i else r[i + 1]
        carried = phi_slope(case.shapes[j - 1], e[j - 1]) * before if j else 0.0
        before = case.f[j](x, th, h[j]) + case.g[j](x, th, h[j]) * ahead - dr[j] + carried
    return before


def gain(case: Case, path: Path, e: Sequence[float], th: Number, h: Number, i: int) -> float:
    back = [0.0, *map(phi, case.shapes, e)]
    x = [path[0][j] + e[j] - back[j] for j in range(i + 1)]
    return float(case.g[i](x, th, h[i]))


def sampled(case: Case, draws: int, seed: int = 7) -> tuple[list[float], float]:
    """Largest s R_i / g_i on the facets and largest |R_n| that were found."""
    rng, n = random.Random(seed), len(case.p)  # noqa: S311
    loads, rate = [-math.inf] * n, 0.0
    for _ in range(draws):
        t = rng.choice((0.0, rng.uniform(0, case.last), rng.uniform(0, case.last / 3)))
        start = [rng.choice((lo, hi, rng.uniform(lo, hi))) for lo, hi in case.starts]
        path = case.path(t, start, rng)
        for i in range(n + 1):
            for side in (1.0, -1.0):
                found = climbed(case, path, min(i, n - 1), side, rng, facet=i < n)
                if i < n:
                    loads[i] = max(loads[i], found)
                else:
                    rate = max(rate, found)
    return loads, rate


def climbed(
    case: Case, path: Path, i: int, side: float, rng: random.Random, *, facet: bool
) -> float:
    """Random search, then corners and small steps, over e, parameters and what is hidden."""
    names, n = list(case.ranges), len(case.p)
    size = i + 1 + len(names) + 3 * n

    def value(z: Sequence[float]) -> float:
        e = [case.p[j] * z[j] for j in range(i + 1)]
        if facet:
            e[i] = side * case.p[i]
        th = {
            name: lo + (hi - lo) * (z[i + 1 + k] + 1) / 2
            for k, (name, (lo, hi)) in enumerate(case.ranges.items())
        }
        rest = z[i + 1 + len(names) :]
        hidden = [rest[3 * j : 3 * j + 3] for j in range(n)]
        found = side * rates(case, path, e, th, hidden, i)
        return found / gain(case, path, e, th, hidden, i) if facet else found

    best = [rng.choice((-1.0, 1.0)) for _ in range(size)]
    top = value(best)
    for step in range(120):
        z = list(best)
        for _ in range(1 + step % 2):
            k = rng.randrange(size)
            z[k] = rng.choice((-1.0, 1.0, rng.uniform(-1, 1)))
            if step > 80:
                z[k] = min(1.0, max(-1.0, best[k] + rng.gauss(0, 0.1)))
        found = value(z)
        if found > top:
            best, top = z, found
    return top


def cosine(t: float, t_s: float) -> tuple[float, float]:
    if t >= math.pi * t_s:
        return 0.0, 0.0
    return (1 + math.cos(t / t_s)) / 2, -math.sin(t / t_s) / (2 * t_s)


def along_performance(
    signal: Callable[[float, random.Random], tuple[float, float]],
    fade: Callable[[float], tuple[float, float]],
    first: float | None,
    t: float,
    start: Sequence[float],
    rng: random.Random,
) -> Path:
    """r_1 = y_d + rho (x_1(0) - y_d(0)); where y_d is not known, start[0] is that offset."""
    (y, dy), (rho, slope) = signal(t, rng), fade(t)
    offset = start[0] if first is None else start[0] - first
    r = [y + rho * offset, *(rho * x for x in start[1:]), 0.0]
    return r, [dy + slope * offset, *(slope * x for x in start[1:])]


def along_nominal(
    y: Callable[[Any], Any], f: Any, g: Any, duration: float, t: float, start: Any, _: Any
) -> Path:
    """The center of docs/theory.md section 4 from its definition, by numerical differentiation."""
    n = len(f)
    flow = [mpmath.mpf(x) for x in start]

    def lie(h: Callable[[Any], Any]) -> Callable[[Any], Any]:
        def along(x: Any) -> Any:
            ahead = [*x[1:], 0]
            v = [f[j](x) + g[j](x) * ahead[j] for j in range(n)]
            return mpmath.diff(lambda s: h([a + s * b for a, b in zip(x, v, strict=True)]), 0)

        return along

    lies = [lambda x: x[0]]
    for _ in range(n - 1):
        lies.append(lie(lies[-1]))
    beta = [h(flow) - (mpmath.diff(y, 0, j) if j else y(0)) for j, h in enumerate(lies)]
    size = 2 * n + 2
    rows, right = mpmath.zeros(size, size), mpmath.zeros(size, 1)
    for j in range(n):
        rows[j, j] = mpmath.factorial(j)
        right[j] = beta[j]
    for j in range(n + 2):
        for k in range(j, size):
            rows[n + j, k] = mpmath.ff(k, j) * mpmath.mpf(duration) ** (k - j)
    c = list(mpmath.lu_solve(rows, right))

    def b(s: Any) -> Any:
        return mpmath.polyval(c[::-1], s) if t < duration else mpmath.mpf(0)

    centers: list[Callable[[Any], Any]] = [lambda s: y(s) + b(s)]
    for j in range(n):

        def following(s: Any, j: int = j) -> Any:
            r = [centers[m](s) for m in range(j + 1)]
            return (mpmath.diff(centers[j], s) - f[j](r)) / g[j](r)

        centers.append(following)
    r = [float(center(mpmath.mpf(t))) for center in centers]
    return r, [float(mpmath.diff(center, mpmath.mpf(t))) for center in centers[:-1]]


def along_handed(t: float, start: Sequence[float], rng: random.Random) -> Path:
    """n = 1, T_s = 1, y_d, dy_d anything within their bounds: b = (1 - t)^3 (x(0) - y_d(0))."""
    y, dy = rng.choice((-0.5, 0.5, rng.uniform(-0.5, 0.5))), rng.choice((-1.0, 1.0))
    left = max(0.0, 1.0 - t)
    r, rate = y + left**3 * start[0], dy - 3 * left**2 * start[0]
    return [r, (rate + r**2) / (2 + math.sin(r))], [rate]


def performance(
    signal: Any, first: float | None, fade: Any = lambda t: cosine(t, 1.0)
) -> Callable[..., Path]:
    return functools.partial(along_performance, signal, fade, first)


SINE = performance(lambda t, _: (math.sin(t), math.cos(t)), 0.0)
CASES = {
    "square": Case(
        plant={
            "name": "square",
            "states": ["x"],
            "dynamics": {"x": {"f_bound": "x**2"}},
            "reference": "sin(t)",
            "initial": {"x": ["0.1", "0.2"]},
            "performance": {"accuracy": "0.1"},
            "synthesis": {},
        },
        shapes=(shape(40.0),),
        p=(0.1,),
        f=(lambda x, _, h: h[0] * x[0] ** 2,),
        g=(lambda *_: 1.0,),
        starts=((0.1, 0.2),),
        path=SINE,
        last=10.0,
    ),
    "two": Case(
        plant={
            "name": "two",
            "parameters": {"a": ["0.8", "1.2"]},
            "states": ["x", "z"],
            "dynamics": {
                "x": {"f": "-a*x", "g_min": "1", "g_bound": "2 + x**2", "disturbance": "0.1"},
                "z": {"f_bound": "abs(x)*z**2", "g": "2 + a*cos(x)"},
            },
            "reference": "sin(t)/2",
            "initial": {"x": "0.5", "z": ["-0.5", "0.2"]},
            "performance": {
                "accuracy": "0.1",
                "rho": {"kind": "exponential", "rate": "1", "floor": "0.1"},
            },
            "measurement": {"noise": "0.001"},
            "synthesis": {},
        },
        shapes=(shape(10.0, 0.5, 0.25, 20.0), shape(300.0)),
        p=(0.1, 0.5),
        f=(
            # Center performance knows of a derived f* only that |f| is below it.
            lambda x, th, h: th["a"] * x[0] * h[2] + 0.1 * h[0],
            lambda x, _, h: abs(x[0]) * x[1] ** 2 * h[0],
        ),
        g=(
            lambda x, _, h: 1 + (1 + x[0] ** 2) * (1 + h[1]) / 2,
            lambda x, th, _: 2 + th["a"] * math.cos(x[0]),
        ),
        starts=((0.499, 0.501), (-0.501, 0.201)),
        path=performance(
            lambda t, _: (math.sin(t) / 2, math.cos(t) / 2),
            0.0,
            lambda t: (0.9 * math.exp(-t) + 0.1, -0.9 * math.exp(-t)),
        ),
        last=12.0,
        halvings=7,
        ranges={"a": (0.8, 1.2)},
    ),
    "passed": Case(
        plant={
            "name": "passed",
            "states": ["x"],
            "dynamics": {"x": {"f": "x*abs(x) - 2*x"}},
            "reference": {"bounds": ["0.5", "1"]},
            "initial": {"x": "0.1", "offset": "0.2"},
            "performance": {"accuracy": "0.1"},
            "synthesis": {},
        },
        shapes=(shape(40.0),),
        p=(0.1,),
        f=(lambda x, _, h: (x[0] * abs(x[0]) - 2 * x[0]) * h[0],),
        g=(lambda *_: 1.0,),
        starts=((-0.2, 0.2),),
        path=performance(lambda _, rng: (rng.choice((-0.5, 0.5)), rng.choice((-1, 1))), None),
        last=4.0,
    ),
    "tank": Case(
        plant={
            "name": "tank",
            "parameters": {"a": ["0.9", "1.1"]},
            "states": ["x"],
            "dynamics": {"x": {"f": "-a*x**2 - 0.1*x*abs(x)", "g": "2 + sin(x)"}},
            "reference": "sin(t)",
            "initial": {"x": ["0.1", "0.2"]},
            "performance": {"accuracy": "0.1", "transition": "1"},
            "synthesis": {"center": "nominal"},
        },
        shapes=(shape(40.0),),
        p=(0.1,),
        f=(lambda x, th, _: -th["a"] * x[0] ** 2 - 0.1 * x[0] * abs(x[0]),),
        g=(lambda x, *_: 2 + math.sin(x[0]),),
        starts=((0.1, 0.2),),
        path=functools.partial(
            along_nominal,
            mpmath.sin,
            (lambda x: -(x[0] ** 2),),
            (lambda x: 2 + mpmath.sin(x[0]),),
            1.0,
        ),
        last=7.0,
        halvings=6,
        ranges={"a": (0.9, 1.1)},
        duration=1.0,
    ),
    "handed": Case(
        plant={
            "name": "handed",
            "parameters": {"a": ["0.9", "1.1"]},
            "states": ["x"],
            "dynamics": {"x": {"f": "-a*x**2", "g": "2 + sin(x)", "disturbance": "0.01"}},
            "reference": {"bounds": ["0.5", "1", "1"]},
            "initial": {"x": "0.1", "offset": "0.2"},
            "performance": {"accuracy": "0.1", "transition": "1"},
            "measurement": {"noise": "0.001"},
            "synthesis": {"center": "nominal"},
        },
        shapes=(shape(40.0),),
        p=(0.1,),
        f=(lambda x, th, h: -th["a"] * x[0] ** 2 + 0.01 * h[0],),
        g=(lambda x, *_: 2 + math.sin(x[0]),),
        starts=((-0.201, 0.201),),
        path=along_handed,
        last=1.5,
        ranges={"a": (0.9, 1.1)},
        duration=1.0,
        halvings=3,
        boxes=600,
        apart=0.15,
    ),
    "pendulum": Case(
        plant={
            "name": "pendulum",
            "parameters": {"a": ["0.9", "1.1"]},
            "states": ["x", "z"],
            "dynamics": {
                "x": {"f": "0.1*x"},
                "z": {"f": "-a*sin(x) - 0.2*z", "g_min": "1.9", "g_bound": "2.1"},
            },
            "reference": "sin(t)/2 + exp(-2*t)/5",
            "initial": {"x": "0.125", "z": ["-0.1", "0.1"]},
            "performance": {"accuracy": "0.1", "transition": "2"},
            "measurement": {"noise": "0.001"},
            "synthesis": {"center": "nominal"},
        },
        shapes=(shape(1.0, 0.1, 0.05), shape(20.0)),
        p=(0.1, 0.2),
        f=(
            lambda x, *_: 0.1 * x[0],
            lambda x, th, _: -th["a"] * math.sin(x[0]) - 0.2 * x[1],
        ),
        g=(lambda *_: 1.0, lambda _, __, h: 2 + 0.1 * h[0]),
        starts=((0.124, 0.126), (-0.101, 0.101)),
        path=functools.partial(
            along_nominal,
            lambda t: mpmath.sin(t) / 2 + mpmath.exp(-2 * t) / 5,
            (lambda x: x[0] / 10, lambda x: -mpmath.sin(x[0]) - x[1] / 5),
            (lambda _: mpmath.mpf(1), lambda _: mpmath.mpf(2)),
            2.0,
        ),
        last=9.0,
        ranges={"a": (0.9, 1.1)},
        duration=2.0,
    ),
    "third": Case(
        plant={
            "name": "third",
            "parameters": {"a": ["0.9", "1.1"]},
            "states": ["x", "y", "z"],
            "dynamics": {
                "x": {"f": "0"},
                "y": {"f": "-a*sin(x)", "g": "2"},
                "z": {"f": "-a*z - y", "g": "1 + x**2", "disturbance": "0.05"},
            },
            "reference": "sin(t)",
            "initial": {"x": "0.1", "y": "0.5", "z": ["-0.1", "0.1"]},
            "performance": {"accuracy": "0.1", "transition": "2"},
            "synthesis": {"center": "nominal"},
        },
        shapes=(shape(1.0), shape(2.0, 0.2, 0.2), shape(30.0)),
        p=(0.1, 0.15, 0.2),
        f=(
            lambda *_: 0.0,
            lambda x, th, _: -th["a"] * math.sin(x[0]),
            lambda x, th, h: -th["a"] * x[2] - x[1] + 0.05 * h[0],
        ),
        g=(lambda *_: 1.0, lambda *_: 2.0, lambda x, *_: 1 + x[0] ** 2),
        starts=((0.1, 0.1), (0.5, 0.5), (-0.1, 0.1)),
        path=functools.partial(
            along_nominal,
            mpmath.sin,
            (lambda _: mpmath.mpf(0), lambda x: -mpmath.sin(x[0]), lambda x: -x[2] - x[1]),
            (lambda _: mpmath.mpf(1), lambda _: mpmath.mpf(2), lambda x: 1 + x[0] ** 2),
            2.0,
        ),
        last=8.0,
        halvings=6,
        ranges={"a": (0.9, 1.1)},
        duration=2.0,
    ),
}

EVERY = os.environ.get("BFPPC_TESTS") == "all"
NAMES = list(CASES) if EVERY else ["square", "passed", "pendulum"]


def derived(case: Case, loads: Sequence[float], rate: float) -> checker.Obligations:
    gains = [(s.k, s.M, s.epsilon, s.c, s.N) for s in case.shapes]
    return checker.derive(
        case.document, gains, case.p, duration=case.duration, tight=(tuple(loads), rate)
    )


def goals(case: Case, loads: Sequence[float], rate: float) -> dict[str, Any]:
    found = derived(case, loads, rate).claims
    return {claim.id: claim.pointwise for claim in found if claim.id.startswith("tight")}


def enclosed(case: Case, boxes: int) -> tuple[list[float], float]:
    """Claims: sup s R - L g decreases with L; where g varies its root is found by halving."""
    states = case.plant["states"]
    zero = goals(case, [0.0] * len(states), 0.0)
    tops = {
        name: max(
            (checker.maximize(*goal.tape(goal.node), None, boxes)[0][1] for goal in parts),
            default=0,
        )
        / checker.ONE
        for name, parts in zero.items()
    }
    table = derived(case, [0.0] * len(states), 0.0).enclosures
    rate = tops.pop(f"tight.rate[{states[-1]}]")
    loads = [
        max(0.0, tops[f"tight[{state}]"]) * checker.ONE / table[f"g_min[{state}]"][0]
        for state in states
    ]
    low = [0.0] * len(states)
    for _ in range(case.halvings):
        middle = [(a + b) / 2 for a, b in zip(low, loads, strict=True)]
        for i, state in enumerate(states):
            parts = goals(case, middle, rate)[f"tight[{state}]"]
            if find_trees(parts, 1000) is None:
                low[i] = middle[i]
            else:
                loads[i] = middle[i]
    return [load * (1 + 1e-3) + 1e-9 for load in loads], rate * (1 + 1e-3) + 1e-9


def judged(case: Case, loads: Sequence[float], rate: float) -> dict[str, bool]:
    made = produce_certificate(
        case.document,
        case.shapes,
        case.p,
        tool="test",
        transition=case.duration,
        tight=TightBounds(load=tuple(loads), rate=rate),
    )
    answer = judge(case.document, made)
    assert answer.inequalities, answer.failures
    return {i.id: i.holds for i in answer.inequalities if i.id.startswith("tight")}


@functools.cache
def both(name: str) -> tuple[tuple[list[float], float], tuple[list[float], float]]:
    case = CASES[name]
    return enclosed(case, case.boxes), sampled(case, 120)


@pytest.mark.parametrize("name", NAMES)
def test_no_sample_is_above_a_claim_that_is_proved(name: str) -> None:
    (loads, rate), (seen, fastest) = both(name)
    assert all(judged(CASES[name], loads, rate).values())
    assert all(np.array(seen) <= np.array(loads))
    assert fastest <= rate


@pytest.mark.parametrize("name", NAMES)
def test_claims_are_found_close_to_the_samples(name: str) -> None:
    (loads, rate), (seen, fastest) = both(name)
    apart = CASES[name].apart
    for load, found in zip(loads, seen, strict=True):
        assert load - found <= apart * abs(load) + 1e-6
    assert rate - fastest <= apart * rate


@pytest.mark.parametrize("name", NAMES)
def test_a_claim_below_a_sample_is_never_proved(name: str) -> None:
    _, (seen, fastest) = both(name)
    below = [found - 1e-9 - 1e-3 * abs(found) for found in seen]
    answers = judged(CASES[name], below, fastest * (1 - 1e-3))
    assert answers
    assert not any(answers.values())
