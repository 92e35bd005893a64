"""What the checker encloses of center nominal, against sampled centers of random plants.

The samples are made by expressions/nominal.py in floats: other code than the checker's, which the
generated controllers are printed from.
"""

from __future__ import annotations

import json
import math
import os
import random
from fractions import Fraction
from typing import TYPE_CHECKING

import mpmath
import pytest
import sympy as sp

from bfppc_synth.bounds.nominal.model import nominal_model, smooth_part
from bfppc_synth.certificate import checker
from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.expressions.nominal import center_series, start_series, transition_series
from bfppc_synth.expressions.parse import parse_expression
from bfppc_synth.expressions.symbolic import build_plant, to_sympy
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec

if TYPE_CHECKING:
    from pathlib import Path

    from bfppc_synth.model.plant import Plant

EVERY = os.environ.get("BFPPC_TESTS") == "all"
SAMPLES = 2000 if EVERY else 200
REFERENCES = [
    "sin(t)",
    "sin(pi*t + 0.3)",
    "sin(t) + 0.3*cos(2*t/3)",
    "{bounds: [0.5, 0.4, 0.3, 0.7]}",
    "tanh(t)",
    "cos(sqrt(2)*t - 1)",
    "exp(-t)*sin(3*t)",
    "0.4",
    "(pi/2)*sin(t)*(1 - exp(-0.1*t**2))",
    "sin(t)*tanh(t)",
    # Periods without a common one; what settles slowly, alone and beside a wave.
    "sin(t) + 0.4*cos(pi*t)",
    "1/(1 + t)",
    "sin(t)*atan(t)/2",
    "sin(t)/(1 + t) + cos(sqrt(2)*t)*exp(-t/40)/3 + 0.2*sin(sqrt(3)*t)",
    "0.3*sin(t + 0.5*sin(t)) + 1/(1 + t**2)",
    "exp(-t/1000)*cos(2*t)",
]
TERMS = ["-a*x1", "b*sin(x1)", "-a*x1**3/3", "0.3*exp(-x1**2)", "a*x1*abs(x1)", "b*tanh(2*x1)"]
MORE = ["-b*x2", "a*x1*x2", "-0.2*x2*abs(x2)", "b*cos(x2)", "atan(x2)/2", "sqrt(2 + x1**2)*x2"]
GAINS = ["1", "2 + sin(x1)", "a", "1 + x1**2/4", "abs(3 + b*x1)"]


def written(case: int) -> tuple[str, float]:
    """Return a random plant file with one or two states, and a T_s."""
    draw = random.Random(case)  # noqa: S311
    n = draw.choice([1, 1, 2])
    duration = draw.choice([0.5, 1.0, 2.0, 3.0])
    # Ends and middles of ranges that binary64 does not hold, and one number that no decimal is.
    lines = ["name: drawn", "parameters: {a: [0.9, 1.1], b: [pi/60, 0.3]}"]
    lines += [f"states: [{', '.join(f'x{i + 1}' for i in range(n))}]", "dynamics:"]
    terms = [*TERMS, *([] if n == 1 else MORE)]
    chosen = [draw.sample(TERMS if i == 0 else terms, 2) for i in range(n)]
    lines += [
        f"  x{i + 1}: {{f: '{' + '.join(terms)}', g: '{draw.choice(GAINS)}'}}"
        for i, terms in enumerate(chosen)
    ]
    lows = [draw.choice([-0.2, 0.1]) for _ in range(n)]
    starts = [draw.choice([f"{low}", f"[{low}, {low + 0.3}]"]) for low in lows]
    starts = [f"x{i + 1}: {start}" for i, start in enumerate(starts)]
    reference = REFERENCES[case % len(REFERENCES)]
    if "bounds" in reference and draw.random() < 0.5:
        starts.append("offset: 0.1")
    lines += [f"reference: {reference}", f"initial: {{{', '.join(starts)}}}"]
    lines += [f"performance: {{accuracy: 0.1, transition: {duration}}}"]
    lines += ["measurement: {noise: 0.01}", "sampling: {period: 0.001, delay: 0.3}"]
    return "\n".join([*lines, "synthesis: {center: nominal}", ""]), duration


class Sampler:
    """Draws centers in floats: r_1..r_n, v, dv, and the model error of each channel."""

    def __init__(self, plant: Plant, problem: checker.Problem, duration: float, seed: int) -> None:
        self.plant, self.problem, self.duration = plant, problem, duration
        self.model = nominal_model(plant, duration)
        self.draw = random.Random(seed)  # noqa: S311
        self.box = checker.widened_starts(problem)
        ahead = sp.Symbol("ahead")
        names = [*plant.states, ahead, *plant.parameters]
        self.forces = [
            sp.lambdify(names, smooth_part(channel.f) + channel.g * ahead, "math")
            for channel in plant.channels
        ]
        self.ranges = [(float(low), float(high)) for low, high in plant.ranges]

    def within(self, low: float, high: float) -> float:
        return self.draw.choice([low, high, self.draw.uniform(low, high)])

    def references(self, t: float) -> tuple[tuple[float, ...], tuple[float, ...], list[float]]:
        """Series of y_d now and at the latch, and a start."""
        n = len(self.box)
        x = [self.within(a[0] / checker.ONE, a[1] / checker.ONE) for a in self.box]
        if self.plant.reference is not None:
            time = next(iter(self.plant.reference.free_symbols), sp.Symbol("t"))
            now, first = (
                evaluate(
                    self.plant.reference,
                    {time: (moment, 1.0)},
                    TaylorFunctions(FLOAT_FUNCTIONS, n + 2),
                )
                for moment in (t, 0.0)
            )
        else:
            sizes = [
                bound[1] / checker.ONE / math.factorial(k)
                for k, bound in enumerate(self.problem.derivatives)
            ]
            now, first = (tuple(self.within(-a, a) for a in sizes) for _ in range(2))
            if self.problem.offset is not None:
                low, high = checker.run_time_offset(self.problem, self.box[0])
                first = (x[0] - self.within(low / checker.ONE, high / checker.ONE), *first[1:])
        return now, (*first, *[0.0] * n)[:n], x

    def center(self, t: float) -> tuple[list[float], float]:
        """r_1..r_n, v and dv at t after a random start."""
        n = len(self.box)
        now, first, x = self.references(t)
        course = (*start_series(self.model, FLOAT_FUNCTIONS, tuple(x)), *[0.0] * n)[:n]
        beta = tuple(a - b for a, b in zip(course, first, strict=True))
        fading: tuple[float, ...] = (0.0,)
        if t < self.duration:
            share = t / self.duration
            fading = transition_series(FLOAT_FUNCTIONS, beta, share, self.duration, length=n + 2)
        r, v = center_series(self.model, FLOAT_FUNCTIONS, now, fading, length=n + 2)
        return [*(a[0] for a in r), v[0]], v[1] if len(v) > 1 else 0.0

    def errors(self, values: list[float]) -> list[float]:
        """|F(r; th) - F(r; nominal)| for random parameters."""
        drawn = [self.within(low, high) for low, high in self.ranges]
        middle = [(low + high) / 2.0 for low, high in self.ranges]
        states = values[:-1]
        return [
            abs(force(*states, ahead, *drawn) - force(*states, ahead, *middle))
            for force, ahead in zip(self.forces, values[1:], strict=True)
        ]


@pytest.mark.parametrize("case", range(160) if EVERY else [*range(6), 10, 12])
def test_sampled_centers_stay_inside_the_enclosures(tmp_path: Path, case: int) -> None:
    text, duration = written(case)
    path = tmp_path / "drawn.yaml"
    path.write_text(text, encoding="utf-8")
    spec = load_spec(path)
    problem = checker.read_plant(json.loads(plant_json(spec)))
    center = checker.nominal_center(problem, Fraction(duration))
    following = center.following
    assert following is not None
    sampler = Sampler(build_plant(spec), problem, duration, case)
    lows = [a[0] / checker.ONE for a in center.low]
    highs = [a[1] / checker.ONE for a in center.high]
    unknown = [a[1] / checker.ONE for a in following.unknown]
    rate, early = following.v_rate[1] / checker.ONE, following.v_start[1] / checker.ONE
    draw, widest = random.Random(case), 0.0  # noqa: S311
    for _ in range(SAMPLES):
        t = draw.choice(
            [draw.uniform(0.0, duration), draw.uniform(0.0, 0.3), draw.uniform(0.0, 30.0), 900.0]
        )
        values, v_rate = sampler.center(t)
        for low, value, high in zip(lows, values, highs, strict=True):
            slack = 1e-9 * (1.0 + abs(value))
            assert low - slack <= value <= high + slack, (text, t)
        assert abs(v_rate) <= rate * (1.0 + 1e-9) + 1e-9, (text, t)
        if t <= 0.3:
            assert abs(values[-1]) <= early * (1.0 + 1e-9) + 1e-9, (text, t)
        for error, most in zip(sampler.errors(values), unknown, strict=True):
            assert error <= most * (1.0 + 1e-9) + 1e-9, (text, t)
        widest = max(widest, abs(values[0]))
    # The enclosure of the output is no wider than it has to be: nothing of r_1 is uncertain.
    assert max(-lows[0], highs[0]) <= 1.3 * widest + 0.1


FUNCTIONS = ["sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "atan", "asinh", "sqrt"]
COMPOSED = ["x^(3/2)", "x^(-3/4)", "y*x^(5/6)", "x^5", "y/x^2", "sin(x)*y^2/(1 + x^2)", "pi*x/7"]


@pytest.mark.parametrize("text", [*(f"{name}(x)" for name in FUNCTIONS), *COMPOSED])
def test_series_to_order_six_are_those_of_mpmath(text: str) -> None:
    draw = random.Random(text)  # noqa: S311
    node = checker.parse(text, {name: checker.sym(name) for name in "xy"})
    x, y = sp.symbols("x y", real=True)
    tree = parse_expression(text, names=("x", "y")).tree
    function = sp.lambdify([x, y], to_sympy(tree, {"x": x, "y": y}), "mpmath")
    series = [
        [Fraction(draw.randint(1, 90), 64), *(Fraction(draw.randint(-90, 90), 64) for _ in "123")]
        for _ in "xy"
    ]
    with mpmath.workdps(60):
        polynomials = [
            [mpmath.mpf(a.numerator) / a.denominator for a in given[::-1]] for given in series
        ]
        wanted = mpmath.taylor(
            lambda t: function(*(mpmath.polyval(p, t) for p in polynomials)), 0, 6
        )
        wanted = [int(value * checker.ONE) for value in wanted]
    for numbers in (checker.Exact(), checker.Rounded(), checker.Sloped()):
        taylor = checker.Taylor(numbers, 7)
        given = [
            [numbers.input(checker.from_fraction(a), 0, 2 * checker.ONE) for a in own]
            for own in series
        ]
        found = taylor.evaluate(node, dict(zip("xy", given, strict=True)))
        found += [taylor.zero] * (7 - len(found))
        for exact, value in zip(wanted, found, strict=True):
            low, high = value if type(numbers) is checker.Exact else value[0]
            room = (checker.ONE + abs(exact)) >> 90
            assert low - room <= exact <= high + room
            assert high - low <= room
