"""A hand-made design (Example 1 of the paper, numbers rounded) for the tests of the report."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import sympy as sp

from bfppc_synth.model.bounds import (
    CenterBounds,
    ChainBounds,
    ChannelMajorants,
    Conditions,
    Majorants,
    SignalBounds,
)
from bfppc_synth.model.certificate import Certificate, Inequality, Verdict
from bfppc_synth.model.design import Design
from bfppc_synth.model.expression import Constant, Expression, Name, Number
from bfppc_synth.model.plant import Channel, Plant
from bfppc_synth.model.shapes import Shape
from bfppc_synth.model.spec import (
    ActuatorSpec,
    Anchor,
    BoundsKind,
    CenterKind,
    ChannelSpec,
    Form,
    GainSpec,
    Interval,
    MeasurementSpec,
    Method,
    Objective,
    ParameterSpec,
    PerformanceSpec,
    Place,
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
from bfppc_synth.model.trajectory import RunSummary, Trajectory

if TYPE_CHECKING:
    from collections.abc import Callable


def constant(text: str) -> Constant:
    value = Fraction(text)
    return Constant(text=text, tree=Number(value=value), exact=value, approximate=float(value))


def expression(text: str) -> Expression:
    return Expression(text=text, tree=Name(name="x1"))


def make_spec(order: int) -> PlantSpec:
    zero, one = constant("0"), constant("1")
    states = tuple(f"x{i + 1}" for i in range(order))
    channels = tuple(
        ChannelSpec(
            state=state,
            f=expression(f"{state}**2 - sin({state})"),
            g=None,
            f_bound=expression("x1**2 + 1") if state == "x1" else None,
            g_bound=None,
            g_min=None,
            disturbance=None,
        )
        for state in states
    )
    rho = RhoSpec(kind=RhoKind.COSINE, t_s=one, rate=None, floor=None, rate_bound=None)
    return PlantSpec(
        path="/somewhere/else/plant.yaml",
        source="name: hand_made\n",
        sha256="ab" * 32,
        document=(),
        places=(
            ("dynamics.x1.f_bound", Place(line=5, column=22)),
            ("dynamics.x2.f", Place(line=6, column=11)),
            ("performance.accuracy", Place(line=9, column=25)),
        ),
        notes=(),
        name="hand_made",
        title="Hand-made plant <for tests> & more",
        units=(("x1", "rad"), ("x2", "rad/s"), ("u", "V")),
        parameters=(
            ParameterSpec(
                name="mass", range=Interval(lower=constant("0.9"), upper=constant("1.1"))
            ),
        ),
        states=states,
        dynamics=channels,
        reference=ReferenceSpec(
            kind=ReferenceKind.EXPRESSION, expression=expression("sin(t)"), bounds=()
        ),
        initial=tuple(Interval(lower=zero, upper=one) for _ in states),
        offset=None,
        performance=PerformanceSpec(
            accuracy=constant("0.15"), rho=(rho,) * order, transition=None, funnel=None
        ),
        measurement=MeasurementSpec(
            quantizers=tuple(
                QuantizerSpec(kind=QuantizerKind.UNIFORM, step=constant("0.002")) for _ in states
            ),
            noise=(zero,) * order,
        ),
        sampling=SamplingSpec(period=constant("0.0001"), delay=zero),
        actuator=ActuatorSpec(limit=constant("500"), error=zero),
        synthesis=SynthesisSpec(
            method=Method.UNIFIED,
            form=Form.SOUND,
            center=CenterKind.PERFORMANCE,
            bounds=BoundsKind.TERMWISE,
            anchor=Anchor.LATCHED,
            objective=((Objective.BALANCED, 1.0),),
            gains=(GainSpec(),) * order,
            p=(None,) * order,
        ),
        simulation=SimulationSpec(horizon=2.0, period=0.0001, seed=1),
    )


def make_plant(spec: PlantSpec) -> tuple[Plant, Majorants]:
    states = sp.symbols([f"x{i + 1}" for i in range(spec.order)], real=True)
    mass, time = sp.Symbol("mass", real=True), sp.Symbol("t", real=True)
    z = sp.symbols([f"z{i + 1}" for i in range(spec.order)], nonnegative=True)
    channels, majorants = [], []
    for i, x in enumerate(states):
        f = mass * x**2 - sp.sin(x) * sp.Rational(321, 5000)
        channels.append(
            Channel(
                state=x,
                f=f,
                g=sp.Integer(1) if i else 2 + sp.sin(x),
                f_bound=x**2 + 1 if i == 0 else None,
                g_bound=None,
                g_min=None,
                disturbance=sp.Integer(0) if i else sp.Rational(1, 10),
            )
        )
        majorants.append(
            ChannelMajorants(
                f_star=f,
                g_star=sp.Integer(2),
                g_min=sp.Integer(1),
                disturbance=sp.Integer(0),
                f_text=z[i] ** 2 * sp.exp(z[i] / 2) + 1,
                g_text=sp.Max(2, z[i]) ** sp.Rational(1, 3),
                g_min_text=sp.Piecewise((1, z[i] < 1), (sp.Rational(1, 2), True)),
            )
        )
    plant = Plant(
        spec=spec,
        time=time,
        states=tuple(states),
        parameters=(mass,),
        ranges=((sp.Rational(9, 10), sp.Rational(11, 10)),),
        channels=tuple(channels),
        reference=sp.sin(time),
        funnel=None,
    )
    return plant, Majorants(channels=tuple(majorants), magnitudes=tuple(z))


def make_design(order: int = 2) -> Design:
    spec = make_spec(order)
    plant, majorants = make_plant(spec)
    steps = range(order)

    def per_step(first: float) -> tuple[float, ...]:
        return tuple(first * 3.7**i for i in steps)

    bounds = ChainBounds(
        X=per_step(1.55),
        xi=per_step(0.15),
        A=per_step(5.123456789012345),
        L=per_step(40.25),
        W=per_step(4.91442),
        s=(*per_step(0.2)[:-1], 0.0),
        B=(*per_step(31.0)[:-1], 0.0),
        D=per_step(5.5),
        G=per_step(2.0),
        g_min=(1.0,) * order,
        F_star=per_step(5.0),
        eta=per_step(0.001),
        Lambda=per_step(0.0123),
        zeta=0.0456,
        V=3.21e4,
        U=95.43210987654321,
        slope=1234.5678901,
        delta_v=0.0,
    )
    inequalities = [
        Inequality(
            id=f"U1[x{i + 1}]",
            equation="(65)",
            lhs=(5.2, 5.25),
            rhs=(5.0, 5.1),
            holds=True,
            binding_terms=(("B_0 / g_min", 0.72), ("p_2", 0.28)),
        )
        for i in range(order - 1)
    ]
    inequalities.append(
        Inequality(id=f"U2[x{order}]", equation="(U2)", lhs=(9.0, 9.0), rhs=(8.5, 8.5), holds=True)
    )
    return Design(
        spec=spec,
        plant=plant,
        majorants=majorants,
        signals=SignalBounds(
            Y_0=1.0,
            Y_1=1.0,
            a_0=1.001,
            offset_lower=0.0,
            offset_upper=1.001,
            rho_floor=(0.0,) * order,
            rho_rate=(0.5,) * order,
        ),
        center=CenterBounds(
            r_lower=(-1.0,) * order,
            r_upper=(1.28,) * order,
            rate=(1.03,) * order,
            feed=(0.2,) * order,
            v=0.0,
            v_rate=0.0,
            v_start=0.0,
        ),
        conditions=Conditions(delta=(0.001,) * order, hold=0.0001, delay=0.0, actuator_error=0.0),
        gains=tuple(
            Shape(k=2.0 + i, M=13.31441, epsilon=0.5, c=0.1 if i == 0 else 0.0, N=3) for i in steps
        ),
        omega=per_step(0.15),
        bounds=bounds,
        certificate=Certificate(
            verdict=Verdict.CERTIFIED,
            inequalities=tuple(inequalities),
            assumptions=("the plant obeys the bounds of the plant file",),
            failures=(),
        ),
        largest_certified_period=0.00012345678901234,
    )


def make_run(design: Design, rows: int = 5001) -> Trajectory:
    order = design.spec.order
    t = np.linspace(0.0, 2.0, rows)
    y_d = np.sin(t)
    r = np.stack([y_d + 0.5 * (1.0 + np.cos(t))] * order, axis=1)
    e = np.stack([width * 0.3 * np.cos(7.0 * t) for width in design.omega], axis=1)
    return Trajectory(
        t=t,
        x=r + e,
        q=r + e,
        e=e,
        r=r,
        u=3.0 * np.cos(t),
        y_d=y_d,
        half_widths=design.omega,
        u_max=design.bounds.U,
        status=(0,) * rows,
    )


@pytest.fixture(scope="session")
def design() -> Design:
    return make_design()


@pytest.fixture(scope="session")
def design_of() -> Callable[[int], Design]:
    return make_design


@pytest.fixture(scope="session")
def run_of() -> Callable[..., Trajectory]:
    return make_run


@pytest.fixture(scope="session")
def run(design: Design) -> Trajectory:
    return make_run(design)


@pytest.fixture(scope="session")
def adversaries(design: Design) -> tuple[RunSummary, ...]:
    return tuple(
        RunSummary(
            run=number,
            kind="corner, switching f",
            start=(0.0,) * design.spec.order,
            max_abs_e=tuple(width * 0.5 for width in design.omega),
            max_abs_u=7.0 + number,
            within_bounds=True,
        )
        for number in range(3)
    )


@pytest.fixture(scope="session")
def refuted(design: Design) -> Design:
    """The same design with an inequality that fails and a bound that is not finite."""
    broken: dict[str, Any] = {"U": float("inf"), "V": float("nan")}
    failing = dataclasses.replace(
        design.certificate.inequalities[0], lhs=(4.0, 4.1), rhs=(5.0, 5.1), holds=False
    )
    return dataclasses.replace(
        design,
        bounds=dataclasses.replace(design.bounds, **broken),
        certificate=dataclasses.replace(
            design.certificate,
            verdict=Verdict.REFUTED,
            inequalities=(failing, *design.certificate.inequalities[1:]),
        ),
    )
