"""The room that a funnel leaves, against sampled transitions of random plants.

The samples are made by a Hermite interpolation in rationals: code of neither side.
"""

from __future__ import annotations

import json
import math
import os
import random
from fractions import Fraction
from typing import TYPE_CHECKING

import pytest
import sympy as sp

from bfppc_synth.bounds.funnel import require_funnel
from bfppc_synth.bounds.nominal.funnel import transition_room
from bfppc_synth.certificate import checker
from bfppc_synth.errors import PlantFileError
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec

if TYPE_CHECKING:
    from pathlib import Path

    from bfppc_synth.model.plant import Plant

EVERY = os.environ.get("BFPPC_TESTS") == "all"
T, X = sp.Symbol("t", real=True), sp.symbols("x1:4", real=True)
FUNNELS = [
    "0.3 + {a}*exp(-t)",
    "max({a}, 1.2 - t)",
    "0.2 + {a}/(1 + t**2)",
    "{a}",
    "0.4 + {a}*exp(-t/2) + 0.1*sin(3*t)",
    "min({a} + 1, 0.3 + 2/(1 + t))",
    "abs({a} - 0.2*t*exp(-t))",
]
DRIFTS = [["x1/3", "sin(x1)", "0"], ["-x2 + x1**2", "0.5*x2*x1", "cos(x2)"], ["-x3", "x1*x3", "0"]]
REFERENCES = ["sin(t)", "0.5*cos(2*t)", "0.2", "t*exp(-t)"]


class Drawn:
    """A random plant file with one to three states, and its transition by hand."""

    def __init__(self, case: int) -> None:
        draw = self.draw = random.Random(case)  # noqa: S311
        self.n, self.duration = draw.choice([1, 2, 3]), draw.choice([0.5, 1.0, 2.0])
        self.f = [draw.choice(DRIFTS[i]) for i in range(self.n)]
        self.reference = draw.choice(REFERENCES)
        self.funnel = draw.choice(FUNNELS).format(a=draw.choice(["0.5", "0.9", "1.7"]))
        lows = [draw.choice([-0.2, 0.1, 0.3]) for _ in self.f]
        self.box = [(low, low + draw.choice([0.0, 0.0, 0.2])) for low in lows]
        names = [f"x{i + 1}" for i in range(self.n)]
        pairs = zip(names, self.f, strict=True)
        lines = ["name: drawn", f"states: [{', '.join(names)}]", "dynamics:"]
        lines += [f"  {name}: {{f: '{f}'}}" for name, f in pairs]
        starts = (f"{x}: [{a}, {b}]" for x, (a, b) in zip(names, self.box, strict=True))
        lines += [f"reference: {self.reference}", f"initial: {{{', '.join(starts)}}}"]
        lines += [f"performance: {{accuracy: 0.01, transition: {self.duration},"]
        lines += [f"  funnel: '{self.funnel}'}}", "synthesis: {center: nominal}", ""]
        self.text = "\n".join(lines)

    def read(self, folder: Path) -> tuple[Plant, checker.Problem]:
        path = folder / "drawn.yaml"
        path.write_text(self.text, encoding="utf-8")
        spec = load_spec(path)
        return build_plant(spec), checker.read_plant(json.loads(plant_json(spec)))

    def height(self, t: float) -> float:
        names = {"max": max, "min": min, "exp": math.exp, "sin": math.sin, "abs": abs, "t": t}
        return float(eval(self.funnel, names))  # noqa: S307 (a text of this file)

    def transitions(self):
        """Coefficients in t of b from the Hermite conditions, as a function of the start."""
        n, duration = self.n, sp.Rational(self.duration)
        names = {"t": T, **{f"x{i + 1}": X[i] for i in range(3)}}
        f = [sp.sympify(text, locals=names) for text in self.f]
        rates = [f[i] + (X[i + 1] if i + 1 < n else 0) for i in range(n)]
        y, values = X[0], []
        reference = sp.sympify(self.reference, locals=names)
        for j in range(n):
            values.append(y - reference.diff(T, j).subs(T, 0))
            y = sum(sp.diff(y, X[i]) * rates[i] for i in range(n))
        order = 2 * n + 2
        # Rows: derivative j at 0 (n of them), then at T_s (n + 2).
        rows = [(sp.Integer(0), j) for j in range(n)] + [(duration, j) for j in range(n + 2)]
        conditions = sp.Matrix(
            order,
            order,
            lambda i, k: (
                sp.ff(k, rows[i][1]) * rows[i][0] ** max(k - rows[i][1], 0)
                if k >= rows[i][1]
                else 0
            ),
        )
        inverse = conditions.inv()
        found = [sum(inverse[k, j] * values[j] for j in range(n)) for k in range(order)]
        return sp.lambdify(X[:n], found, "math")

    def least(self, count: int) -> float:
        """Smallest funnel - |b| over samples of times and starts."""
        coefficients = self.transitions()
        worst = math.inf
        for _ in range(count):
            start = [self.draw.choice([a, b, self.draw.uniform(a, b)]) for a, b in self.box]
            polynomial = coefficients(*start)
            for k in range(81):
                t = self.duration * k / 80
                b = sum(c * t**power for power, c in enumerate(polynomial))
                worst = min(worst, self.height(t) - abs(b))
        later = [self.duration + k / 7 for k in range(300)] + [1e2, 1e4, 1e6]
        return min(worst, *map(self.height, later))


@pytest.mark.parametrize("case", range(120 if EVERY else 8))
def test_the_room_is_below_every_sample_and_not_far_below(tmp_path: Path, case: int) -> None:
    drawn = Drawn(case)
    plant, problem = drawn.read(tmp_path)
    sampled = drawn.least(40)
    room, _ = checker._clearance(
        checker.Trajectory(problem, Fraction(drawn.duration)), problem.funnel
    )
    low, high = room[0] / checker.ONE, room[1] / checker.ONE
    assert low <= sampled + 1e-12, drawn.text
    assert high >= low
    assert sampled - low <= 0.02 * (1.0 + abs(sampled)), drawn.text
    searched = transition_room(plant, drawn.duration, 1e9)
    # Over [0, T_s] only, with the same meaning: the two sides agree where that is the least.
    assert searched.lower <= searched.reached + 1e-15
    assert min(searched.lower, high) <= sampled + 1e-12
    assert searched.reached >= low - 1e-12


@pytest.mark.parametrize("case", range(60 if EVERY else 6))
def test_center_performance_is_judged_as_samples_say(tmp_path: Path, case: int) -> None:
    drawn = Drawn(case)
    draw, low, high = drawn.draw, *drawn.box[0]
    rate = draw.choice([0.5, 1.0, 3.0])
    delta = draw.choice([0.0, 0.05])
    text = drawn.text.replace(
        "synthesis: {center: nominal}\n", "synthesis: {center: performance}\n"
    )
    text += f"measurement: {{noise: {delta}}}\n"
    text = text.replace(", transition:", f", rho: {{kind: exponential, rate: {rate}}}, transition:")
    drawn.text = text.replace("accuracy: 0.01", "accuracy: 0.06")
    plant, problem = drawn.read(tmp_path)
    first = float(sp.sympify(drawn.reference, locals={"t": T}).subs(T, 0))
    most = max(abs(low - first), abs(high - first)) + delta
    times = [*(k / 50 for k in range(2000)), 1e2, 1e4, 1e6]
    least = min(drawn.height(t) - most * math.exp(-rate * t) for t in times)
    center = checker.performance_center(problem)
    (claim,) = checker._funnel_claims(problem, center)
    (comparison,) = claim.comparisons
    assert comparison.lhs[0] <= int((least + 1e-12) * checker.ONE)
    assert comparison.lhs[1] >= int((least - 0.02 * (1.0 + abs(least))) * checker.ONE)
    if least < 0.06 - 1e-9:
        assert comparison.verdict() == "refuted"
        with pytest.raises(PlantFileError, match=r"performance\.funnel"):
            require_funnel(plant)
    elif comparison.verdict() == "proved":
        require_funnel(plant)
