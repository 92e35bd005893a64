"""A hand-made design of the paper's first plant, and a controller as SPEC section 3 has it."""

from __future__ import annotations

import math
from enum import IntEnum
from fractions import Fraction

import pytest
import sympy as sp

from bfppc_synth.model.bounds import CenterBounds, ChainBounds, Conditions, SignalBounds
from bfppc_synth.model.certificate import Certificate, Verdict
from bfppc_synth.model.design import Design
from bfppc_synth.model.expression import Constant, Number
from bfppc_synth.model.plant import Channel, Plant
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.spec import (
    ActuatorSpec,
    Anchor,
    BoundsKind,
    CenterKind,
    Form,
    Interval,
    MeasurementSpec,
    Method,
    Objective,
    PerformanceSpec,
    PlantSpec,
    QuantizerKind,
    QuantizerSpec,
    ReferenceKind,
    ReferenceSpec,
    RhoKind,
    RhoSpec,
    SamplingSpec,
    SimulationSpec,
    SynthesisSpec,
)

X1, X2, T = sp.symbols("x1 x2 t", real=True)
EXAMPLE_1 = (
    {"f": X1**2 - sp.sin(X1), "f_bound": X1**2 + 1},
    {"f": X1 * X2**2},
)
GAINS = (
    Shape(k=30.0, M=0.0, epsilon=1.0, c=0.0, N=3),
    Shape(k=320.0, M=0.0, epsilon=1.0, c=0.0, N=3),
)


def number(value):
    exact = Fraction(value).limit_denominator(10**12)
    return Constant(
        text=str(value), tree=Number(value=exact), exact=exact, approximate=float(value)
    )


def interval(lower, upper):
    return Interval(lower=number(lower), upper=number(upper))


def make_channel(state, entries):
    unknown = "g" not in entries and ("g_bound" in entries or "g_min" in entries)
    return Channel(
        state=state,
        f=entries.get("f"),
        g=None if unknown else sp.sympify(entries.get("g", 1)),
        f_bound=entries.get("f_bound"),
        g_bound=entries.get("g_bound"),
        g_min=entries.get("g_min"),
        disturbance=sp.sympify(entries.get("disturbance", 0)),
    )


def make_spec(order, **changed):
    quantizers = changed.get("quantizers", (QuantizerSpec(kind=QuantizerKind.NONE),) * order)
    rho = changed.get("rho", RhoSpec(
        kind=RhoKind.COSINE, t_s=number(1), rate=None, floor=None, rate_bound=None
    ))  # fmt: skip
    bounds = changed.get("reference_bounds", ())
    return PlantSpec(
        path="p.yaml", source="", sha256="", document=(), places=(), notes=(), name="plant",
        title="", units=(), parameters=(), states=("x1", "x2", "x3")[:order], dynamics=(),
        reference=ReferenceSpec(
            kind=ReferenceKind.RUNTIME if bounds else ReferenceKind.EXPRESSION,
            expression=None,
            bounds=tuple(number(b) for b in bounds),
        ),
        initial=tuple(interval(*pair) for pair in changed.get("initial", ((1, 1), (0, 0), (0, 0))))[
            :order
        ],
        offset=changed.get("offset"),
        performance=PerformanceSpec(
            accuracy=number(0.15), rho=(rho,) * order, transition=None, funnel=None
        ),
        measurement=MeasurementSpec(
            quantizers=quantizers, noise=(number(changed.get("noise", 0)),) * order
        ),
        sampling=SamplingSpec(
            period=number(changed.get("period", 0)), delay=number(changed.get("delay", 0))
        ),
        actuator=ActuatorSpec(limit=None, error=number(changed.get("error", 0))),
        synthesis=SynthesisSpec(
            method=Method.UNIFIED, form=changed.get("form", Form.SOUND),
            center=CenterKind.PERFORMANCE, bounds=BoundsKind.TERMWISE,
            anchor=changed.get("anchor", Anchor.LATCHED), objective=((Objective.BALANCED, 1.0),),
            gains=(), p=(),
        ),
        simulation=SimulationSpec(
            horizon=changed.get("horizon", 2.0), period=changed.get("step", 0.002), seed=1
        ),
    )  # fmt: skip


def make_design(
    channels=EXAMPLE_1,
    *,
    states=(X1, X2),
    gains=GAINS,
    omega=(0.15, 1.0),
    peak=330.0,
    reference=0,
    parameters=(),
    largest_period=0.0,
    **changed,
):
    spec = make_spec(len(channels), **changed)
    plant = Plant(
        spec=spec,
        time=T,
        states=states,
        parameters=tuple(symbol for symbol, _, _ in parameters),
        ranges=tuple((sp.sympify(a), sp.sympify(b)) for _, a, b in parameters),
        channels=tuple(make_channel(s, e) for s, e in zip(states, channels, strict=True)),
        reference=None if "reference_bounds" in changed else sp.sympify(reference),
        funnel=None,
    )
    order = len(channels)
    many = (1.0,) * order
    return Design(
        spec=spec,
        plant=plant,
        majorants=None,
        signals=SignalBounds(
            Y_0=0.0, Y_1=0.0, a_0=1.0, offset_lower=1.0, offset_upper=1.0,
            rho_floor=(0.0,) * order, rho_rate=(0.5,) * order,
        ),
        center=CenterBounds(
            r_lower=(0.0,) * order, r_upper=many, rate=many, feed=many,
            v=0.0, v_rate=0.0, v_start=0.0,
        ),
        conditions=Conditions(delta=(0.0,) * order, hold=0.0, delay=0.0, actuator_error=0.0),
        gains=gains,
        omega=omega,
        bounds=ChainBounds(
            X=many, xi=many, A=many, L=many, W=many, s=many, B=many, D=(2.8, 285.0, 285.0)[:order],
            G=many, g_min=many, F_star=many, eta=many, Lambda=many, zeta=0.0, V=1.0, U=peak,
            slope=1.0, delta_v=0.0,
        ),
        certificate=Certificate(
            verdict=Verdict.CERTIFIED, inequalities=(), assumptions=(), failures=()
        ),
        largest_certified_period=largest_period,
    )  # fmt: skip


class Status(IntEnum):
    OK = 0
    OUTSIDE = 1
    BAD_INPUT = 2
    BAD_TIME = 3


def make_controller(design):
    """Write center performance with cosine rho, t_s = 1, as a class."""
    expression = design.plant.reference
    reference = sp.lambdify(T, expression, "math") if expression is not None else None
    gains, peak = design.gains, design.bounds.U

    def phi(shape, e):
        return shape.k * e + shape.M * math.tanh(shape.M * e / shape.epsilon) + shape.c * e**shape.N

    class Controller:
        calls = 0

        def __init__(self):
            self.reset()

        def reset(self):
            self.status = Status.OK
            self.start = None
            self.last_t = -math.inf
            self.u = 0.0

        def step(self, t, x, y_d=None):
            Controller.calls += 1
            if not all(math.isfinite(v) for v in x):
                self.status = Status.BAD_INPUT
                return self.u
            if t < self.last_t:
                self.status = Status.BAD_TIME
                return self.u
            self.status = Status.OK
            if y_d is None:
                y_d = reference(t)
            if self.start is None:
                self.start = (x[0] - y_d, *x[1:])
            self.last_t = t
            rho = 0.5 * (1.0 + math.cos(t)) if t < math.pi else 0.0
            carried = -y_d
            for state, first, shape in zip(x, self.start, gains, strict=True):
                carried = phi(shape, state - rho * first + carried)
            self.u = min(max(-carried, -peak), peak)
            return self.u

    return Controller


@pytest.fixture
def design_of():
    """Factory of designs; Example 1 with linear gains that Theorem U certifies."""
    return make_design


@pytest.fixture
def controller_of():
    """Factory of controller classes."""
    return make_controller
