"""No random point exceeds a tight claim: de_i from its definition, with everything at random."""

import math
import random

import pytest

from bfppc_synth.bounds.latch import starts
from bfppc_synth.bounds.nominal.model import nominal_model
from bfppc_synth.bounds.signals import bound_signals, performance_center
from bfppc_synth.bounds.tight.bounds import tight_search
from bfppc_synth.bounds.tight.search import Effort
from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate, evaluate_float
from bfppc_synth.expressions.nominal import center_series, start_series, transition_series
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.model.shapes import Shape
from bfppc_synth.spec.load import load_spec

POINTS = 3_000
PLANTS = {
    "performance": """name: plant
states: [x1, x2]
parameters: {a: [0.4, 0.6]}
dynamics:
  x1: {f_bound: 'abs(x1)*exp(a*abs(x1))', g_min: 1, g_bound: '2 + x1**2'}
  x2: {f: 'x1*sin(x2) - a*x2*abs(x2)', g: '3 + cos(x1)', disturbance: '0.1*abs(x2)'}
reference: sin(t)
initial: {x1: [-0.5, 0.5], x2: [-0.2, 0.4]}
performance: {accuracy: 0.1, rho: {x1: {kind: cosine, t_s: 1}, x2: {kind: cosine, t_s: 0.5}}}
synthesis: {center: performance, bounds: tight}
""",
    "exponential": """name: plant
states: [x1, x2]
dynamics:
  x1: {f: 'max(x1, 0.2) - x1**3'}
  x2: {f_bound: 'x2**2 + 1', g_min: '1', g_bound: 2}
reference: 0.3*cos(2*t)
initial: {x1: 0.8, x2: [-0.5, 0.5]}
performance: {accuracy: 0.1, rho: {kind: exponential, rate: 1.5, floor: 0.1}}
synthesis: {center: performance, bounds: tight}
""",
    "nominal": """name: plant
states: [x1, x2, x3]
parameters: {a: [0.8, 1.2], b: [0.9, 1.1]}
dynamics:
  x1: {f: '-a*x1**3', g: '2 + sin(x1)*a'}
  x2: {f: 'a*x1*x2 + 0.1*abs(x2)', g: b}
  x3: {f: '-b*x2 - x3', disturbance: 0.05}
reference: 0.5*sin(t)
initial: {x1: [0.1, 0.3], x2: [-0.2, 0.1], x3: [-0.1, 0.1]}
performance: {accuracy: 0.1, transition: 1.5}
measurement: {noise: {x1: 0.001, x2: 0.002, x3: 0.002}}
synthesis: {center: nominal, bounds: tight}
""",
    "unknown": """name: plant
states: [x1, x2]
parameters: {a: [0.8, 1.2]}
dynamics:
  x1: {f: 'a*sin(x1)', g_min: '1', g_bound: '1.5 + 0.1*x1**2'}
  x2: {f_bound: 0.3, g: a}
reference: cos(t) + 0.3*sin(3*t)
initial: {x1: [1, 1.1], x2: 0}
performance: {accuracy: 0.1, transition: 1}
synthesis: {center: nominal, bounds: tight}
""",
}
SHAPES = (
    Shape(k=1.0, M=1.5, epsilon=0.3, c=0.0, N=3),
    Shape(k=0.0, M=2.0, epsilon=0.8, c=4.0, N=3),
    Shape(k=3.0, M=0.0, epsilon=1.0, c=0.0, N=3),
)
WIDTHS = (0.1, 0.4, 0.7)


def phi(shape, e):
    return shape.k * e + shape.M * math.tanh(shape.M * e / shape.epsilon) + shape.c * e**shape.N


def slope(shape, e):
    bent = math.tanh(shape.M * e / shape.epsilon)
    steep = shape.M**2 / shape.epsilon * (1.0 - bent * bent)
    return shape.k + steep + shape.c * shape.N * e ** (shape.N - 1)


def nominal_center_at(plant, model, start, t):
    """r_1..r_n, v and dr_1..dr_n of center nominal in floats."""
    order, functions = plant.order, FLOAT_FUNCTIONS
    y_d = evaluate(plant.reference, {plant.time: (t, 1.0)}, TaylorFunctions(functions, order + 2))
    b = ()
    if t < model.transition:
        short = TaylorFunctions(functions, order)
        begun = evaluate(plant.reference, {plant.time: (0.0, 1.0)}, short)
        beta = short.sub(start_series(model, functions, start), begun)
        beta = (*beta, *[0.0] * (order - len(beta)))
        s = t / model.transition
        b = transition_series(functions, beta, s, model.transition, length=order + 2)
    center, v = center_series(model, functions, y_d, b, length=order + 2)
    return [r[0] for r in center] + [v[0]], [r[1] for r in center]


def performance_center_at(plant, start, t):
    """The same of center performance."""
    y, rate = evaluate(plant.reference, {plant.time: (t, 1.0)}, TaylorFunctions(FLOAT_FUNCTIONS, 2))
    begun = evaluate(plant.reference, {plant.time: (0.0,)}, TaylorFunctions(FLOAT_FUNCTIONS, 1))[0]
    r, dr = [], []
    for i, spec in enumerate(plant.spec.performance.rho):
        if spec.kind == "cosine":
            t_s = spec.t_s.approximate
            early = t < math.pi * t_s
            rho = 0.5 * (1.0 + math.cos(t / t_s)) if early else 0.0
            fall = -0.5 * math.sin(t / t_s) / t_s if early else 0.0
        else:
            floor, speed = spec.floor.approximate, spec.rate.approximate
            rho = floor + (1.0 - floor) * math.exp(-speed * t)
            fall = -speed * (1.0 - floor) * math.exp(-speed * t)
        own = start[i] - (begun if i == 0 else 0.0)
        r.append(rho * own + (y if i == 0 else 0.0))
        dr.append(fall * own + (rate if i == 0 else 0.0))
    return [*r, 0.0], dr


def pushed(plant, r, dr, e, parameters, index, draw):
    """R_i and g_i, i = index + 1, by the definition of de_j, with every unknown at random."""
    nominal = plant.spec.synthesis.center == "nominal"
    x, moved = {}, 0.0
    for j in range(index + 1):
        back = phi(SHAPES[j - 1], e[j - 1]) if j else 0.0
        x[plant.states[j]] = r[j] + e[j] - back
        here, channel = x | parameters, plant.channels[j]
        if nominal and channel.f is not None:
            f = evaluate_float(channel.f, here)
        else:
            bound = channel.f if channel.f_bound is None else channel.f_bound
            f = draw(-1.0, 1.0) * abs(evaluate_float(bound, here))
        f += draw(-1.0, 1.0) * evaluate_float(channel.disturbance, here)
        if channel.g_min is None or (nominal and channel.g is not None):
            g = 1.0 if channel.g is None else evaluate_float(channel.g, here)
        else:
            low, high = (evaluate_float(b, here) for b in (channel.g_min, channel.g_bound))
            g = draw(low, high)
        push = slope(SHAPES[j - 1], e[j - 1]) * moved if j else 0.0
        R = f + g * r[j + 1] - dr[j] + push
        moved = R
        if j < index:
            moved = R + g * (e[j + 1] - phi(SHAPES[j], e[j]))
    return R, g


@pytest.mark.parametrize("name", sorted(PLANTS))
def test_no_random_point_exceeds_a_claim(name, tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(PLANTS[name], encoding="utf-8")
    spec = load_spec(path)
    plant, order = build_plant(spec), spec.order
    signals, center, model = bound_signals(plant), None, None
    if spec.synthesis.center == "nominal":
        model = nominal_model(plant, spec.performance.transition.approximate)
    else:
        center = performance_center(plant, signals)
    finder = tight_search(plant, signals, center, model)
    effort = Effort(cuts=150)
    loads = [finder.load(i, SHAPES, WIDTHS[:order], effort) for i in range(order)]
    rate = finder.rate(SHAPES, WIDTHS[:order], effort)
    source = random.Random(f"tight {name}")  # noqa: S311  no secret
    ends = {symbol: tuple(map(float, pair)) for symbol, pair in _ranges(plant)}
    largest = [-math.inf] * order

    def draw(low, high):
        # Half of the time an end: that is where the worst points are.
        return source.choice((low, high)) if source.random() < 0.5 else source.uniform(low, high)

    for _ in range(POINTS):
        t = source.uniform(0.0, 4.0) if source.random() < 0.8 else source.uniform(0.0, 40.0)
        start = tuple(draw(float(s.lower), float(s.upper)) for s in starts(spec))
        if model is None:
            r, dr = performance_center_at(plant, start, t)
        else:
            r, dr = nominal_center_at(plant, model, start, t)
        parameters = {symbol: draw(*pair) for symbol, pair in ends.items()}
        e = [draw(-p, p) for p in WIDTHS[:order]]
        for i in range(order):
            side = source.choice((1.0, -1.0))
            wall = [*e[:i], side * WIDTHS[i], *e[i + 1 :]]
            R, g = pushed(plant, r, dr, wall, parameters, i, draw)
            largest[i] = max(largest[i], side * R / g)
            assert side * R / g <= loads[i].upper
        R, _ = pushed(plant, r, dr, e, parameters, order - 1, draw)
        assert abs(R) <= rate.upper
    # The claims are about something: random points come near.
    for found, reached in zip(loads, largest, strict=True):
        assert reached >= 0.5 * found.lower


def _ranges(plant):
    return zip(plant.parameters, plant.ranges, strict=True)
