"""The nominal center is a trajectory of the nominal plant that starts where it is latched."""

import math

import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.expressions.nominal import (
    center_series,
    fading_series,
    start_series,
    transition_series,
    transition_weights,
)
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.model.nominal import NominalModel

X = sp.symbols("x1:11", real=True)
T = sp.Symbol("t", real=True)
DURATION = 1.5
MODELS = {
    1: ((-(X[0] ** 3),), (2 + sp.cos(X[0]),)),
    2: ((sp.sin(X[0]), X[0] * X[1]), (sp.Integer(1), 3 + sp.sin(X[0]))),
    3: (
        (sp.S.Zero, -5 * sp.sin(X[0]) - X[1] / 2, -X[1] - 4 * X[2]),
        (sp.Integer(1), sp.Rational(3, 2), 1 + sp.exp(-(X[0] ** 2))),
    ),
    4: (
        (X[0] / 2, -sp.tanh(X[0]), sp.cos(X[2]), X[0] * X[1] - X[3]),
        (sp.Integer(1), 1 + X[0] ** 2, sp.Integer(2), sp.sqrt(2 + X[1] ** 2)),
    ),
}
STARTS = {1: (0.4,), 2: (0.4, -0.3), 3: (0.2, -0.3, 0.1), 4: (0.2, 0.1, -0.4, 0.3)}


def model(order: int) -> NominalModel:
    f, g = MODELS[order]
    left_out = ((),) * order
    return NominalModel(states=X[:order], f=f, g=g, left_out=left_out, transition=DURATION)


class Exact:
    """Sympy numbers as a target."""

    number = staticmethod(lambda value: value)
    add = staticmethod(lambda a, b: a + b)
    sub = staticmethod(lambda a, b: a - b)
    mul = staticmethod(lambda a, b: a * b)
    div = staticmethod(lambda a, b: a / b)
    neg = staticmethod(lambda a: -a)
    power = staticmethod(lambda a, exponent: a**exponent)


class Counting:
    """Symbols as a target; an operation on the same operands counts once."""

    def __init__(self) -> None:
        self.known: dict[tuple[object, ...], str] = {}

    def number(self, value):
        return f"#{value}"

    def __getattr__(self, operator):
        def apply(*operands):
            if operator == "mul" and "#1" in operands:
                return operands[0] if operands[1] == "#1" else operands[1]
            return self.known.setdefault((operator, *operands), f"v{len(self.known)}")

        return apply


def departure(order: int, reference: sp.Expr) -> tuple[float, ...]:
    functions = TaylorFunctions(FLOAT_FUNCTIONS, order)
    y_d = evaluate(reference, {T: (0.0, 1.0)}, functions)
    return functions.sub(start_series(model(order), FLOAT_FUNCTIONS, STARTS[order]), y_d)


def center_at(order: int, reference: sp.Expr, t: float, length: int):
    functions = TaylorFunctions(FLOAT_FUNCTIONS, length)
    y_d = evaluate(reference, {T: (t, 1.0)}, functions)
    b = ()
    if t < DURATION:
        beta = departure(order, reference)
        b = transition_series(FLOAT_FUNCTIONS, beta, t / DURATION, DURATION, length=length)
    return center_series(model(order), FLOAT_FUNCTIONS, y_d, b, length=length)


@pytest.mark.parametrize("order", [1, 2, 3, 4, 5])
def test_the_transition_meets_its_hermite_conditions(order):
    beta, s, duration = sp.symbols(f"b0:{order}"), sp.Symbol("s"), sp.Symbol("d", positive=True)
    series = transition_series(Exact, beta, s, duration, length=order + 2)
    b = sp.expand(series[0].subs(s, T / duration))
    assert sp.degree(b, T) == 2 * order + 1
    for j in range(order + 2):
        rate = sp.diff(b, T, j)
        assert sp.expand(rate.subs(T, duration)) == 0
        assert sp.expand(rate / math.factorial(j) - series[j].subs(s, T / duration)) == 0
        if j < order:
            assert sp.expand(rate.subs(T, 0) / math.factorial(j) - beta[j]) == 0


def test_the_transition_ends_in_exact_zeros():
    weights = transition_weights(FLOAT_FUNCTIONS, (0.3, -0.7, 0.9), 0.7)
    assert fading_series(FLOAT_FUNCTIONS, weights, 1.0, 0.7, length=5) == (0.0,) * 5


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_the_center_starts_at_the_latched_state(order):
    r, _ = center_at(order, sp.sin(T) + T / 3, 0.0, order + 1)
    assert [series[0] for series in r] == pytest.approx(STARTS[order], abs=1e-12)


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_the_nominal_plant_under_v_follows_the_center(order):
    reference = sp.sin(T) + sp.exp(-T) / 2
    plant = model(order)

    def rates(t, x):
        values = dict(zip(plant.states, x, strict=True))
        _, v = center_at(order, reference, t, order + 1)
        ahead = [*x[1:], v[0]]
        return [
            evaluate(f, values, FLOAT_FUNCTIONS) + evaluate(g, values, FLOAT_FUNCTIONS) * following
            for f, g, following in zip(plant.f, plant.g, ahead, strict=True)
        ]

    end = 2.0
    run = solve_ivp(rates, (0.0, end), STARTS[order], rtol=1e-10, atol=1e-11, max_step=0.02)
    r, _ = center_at(order, reference, end, order + 1)
    assert run.y[:, -1] == pytest.approx([series[0] for series in r], abs=1e-6)


@pytest.mark.parametrize("order", [2, 3, 4])
@pytest.mark.parametrize("t", [0.4, 1.1, 1.9])
def test_rates_of_the_center_are_its_finite_differences(order, t):
    step = 1e-4
    here, v = center_at(order, sp.sin(T), t, order + 2)
    before, v_before = center_at(order, sp.sin(T), t - step, order + 2)
    after, v_after = center_at(order, sp.sin(T), t + step, order + 2)
    for now, low, high in zip((*here, v), (*before, v_before), (*after, v_after), strict=True):
        assert now[1] == pytest.approx((high[0] - low[0]) / (2 * step), rel=1e-5, abs=1e-5)


@pytest.mark.parametrize(("order", "most"), [(2, 37), (3, 110), (4, 200), (5, 335), (10, 2145)])
def test_the_operation_count_stays_below_what_was_measured(order, most):
    states = X[:order]
    trigonometric = NominalModel(
        states=states,
        f=tuple(sp.sin(x) * states[max(i - 1, 0)] for i, x in enumerate(states)),
        g=(sp.S.One,) * order,
        left_out=((),) * order,
        transition=1.0,
    )
    target = Counting()
    reference = tuple(f"y{j}" for j in range(order + 1))
    weights = tuple(f"w{j}" for j in range(order))
    fading = fading_series(target, weights, "s", "#2", length=order + 1)
    center_series(trigonometric, target, reference, fading, length=order + 1)
    assert len(target.known) <= most
