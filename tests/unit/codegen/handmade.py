"""Designs made by hand: what codegen needs of a Design, without search or certificate.

Loaded by path from several test folders (the tests have no packages).
"""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

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
from bfppc_synth.model.expression import Constant, Expression, Number
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

T = sp.Symbol("t", real=True)


def constant(text: str) -> Constant:
    value = Fraction(text)
    return Constant(text=text, tree=Number(value=value), exact=value, approximate=float(value))


def irrational(value: float) -> Constant:
    return Constant(
        text=repr(value), tree=Number(value=Fraction(value)), exact=None, approximate=value
    )


def interval(lower: str, upper: str | None = None) -> Interval:
    low = constant(lower)
    return Interval(lower=low, upper=low if upper is None else constant(upper))


def cosine(t_s: str = "1") -> RhoSpec:
    return RhoSpec(kind=RhoKind.COSINE, t_s=constant(t_s), rate=None, floor=None, rate_bound=None)


def exponential(rate: str = "1", floor: str = "0") -> RhoSpec:
    return RhoSpec(
        kind=RhoKind.EXPONENTIAL,
        t_s=None,
        rate=constant(rate),
        floor=constant(floor),
        rate_bound=None,
    )


def shape(k=2.0, M=0.0, epsilon=1.0, c=0.0, N=3) -> Shape:
    return Shape(k=k, M=M, epsilon=epsilon, c=c, N=N)


def phi(gains: Shape, e: float) -> float:
    return gains.k * e + gains.M * math.tanh(gains.M * e / gains.epsilon) + gains.c * e**gains.N


GAINS = (shape(M=5.0, epsilon=0.5), shape(k=3.0, M=20.0, epsilon=2.0, c=0.25, N=5))
SINE = sp.sin(T)


def make_design(
    *,
    name="hand_made",
    title="A plant made by hand",
    gains=GAINS,
    p=(0.05, 2.0),
    initial=(("1/2", "1/2"), ("-1/10", "1/10")),
    offset=None,
    reference=SINE,
    Y_0=1.0,
    rho=None,
    X=None,
    delta=None,
    eta=None,
    period="0",
    anchor=Anchor.LATCHED,
    units=(),
    method=Method.UNIFIED,
    certificate=None,
) -> Design:
    n = len(gains)
    states = tuple(f"x{i}" for i in range(1, n + 1))
    rho = rho or (cosine(),) * n
    delta = delta or (0.0,) * n
    eta = eta or delta
    A = tuple(phi(g, half) for g, half in zip(gains, p, strict=True))
    reach = tuple(max(abs(float(Fraction(end))) for end in box) + 1.0 for box in initial)
    xi = tuple(half + a for half, a in zip(p, (0.0, *A[:-1]), strict=True))
    X = X or tuple(r + x for r, x in zip(reach, xi, strict=True))
    zeros = (0.0,) * n
    x = sp.symbols([f"x{i}" for i in range(1, n + 1)], real=True)
    spec = PlantSpec(
        path="plant.yaml",
        source="",
        sha256="0123456789abcdef" * 4,
        document=(),
        places=(),
        notes=(),
        name=name,
        title=title,
        units=units,
        parameters=(),
        states=states,
        dynamics=tuple(
            ChannelSpec(
                state=s, f=None, g=None, f_bound=None, g_bound=None, g_min=None, disturbance=None
            )
            for s in states
        ),
        reference=ReferenceSpec(
            kind=ReferenceKind.RUNTIME if reference is None else ReferenceKind.EXPRESSION,
            expression=None
            if reference is None
            else Expression(text=str(reference), tree=Number(value=Fraction(0))),
            bounds=(),
        ),
        initial=tuple(interval(*box) for box in initial),
        offset=None if offset is None else constant(offset),
        performance=PerformanceSpec(accuracy=None, rho=rho, transition=None, funnel=None),
        measurement=MeasurementSpec(
            quantizers=(QuantizerSpec(kind=QuantizerKind.NONE),) * n, noise=(constant("0"),) * n
        ),
        sampling=SamplingSpec(period=constant(period), delay=constant("0")),
        actuator=ActuatorSpec(limit=None, error=constant("0")),
        synthesis=SynthesisSpec(
            method=method,
            form=Form.SOUND,
            center=CenterKind.PERFORMANCE,
            bounds=BoundsKind.TERMWISE,
            anchor=anchor,
            objective=((Objective.BALANCED, 1.0),),
            gains=(GainSpec(),) * n,
            p=(None,) * n,
        ),
        simulation=SimulationSpec(horizon=10.0, period=1e-4, seed=1),
    )
    channels = tuple(
        Channel(
            state=s,
            f=sp.Integer(0),
            g=sp.Integer(1),
            f_bound=None,
            g_bound=None,
            g_min=None,
            disturbance=sp.Integer(0),
        )
        for s in x
    )
    one = ChannelMajorants(
        **dict.fromkeys(
            ("f_star", "g_star", "g_min", "disturbance", "f_text", "g_text", "g_min_text"),
            sp.Integer(1),
        )
    )
    return Design(
        spec=spec,
        plant=Plant(
            spec=spec,
            time=T,
            states=tuple(x),
            parameters=(),
            ranges=(),
            channels=channels,
            reference=reference,
            funnel=None,
        ),
        majorants=Majorants(channels=(one,) * n, magnitudes=tuple(x)),
        signals=SignalBounds(
            Y_0=Y_0,
            Y_1=1.0,
            a_0=1.0,
            offset_lower=-1.0,
            offset_upper=1.0,
            rho_floor=zeros,
            rho_rate=zeros,
        ),
        center=CenterBounds(
            r_lower=zeros, r_upper=zeros, rate=zeros, feed=zeros, v=0.0, v_rate=0.0, v_start=0.0
        ),
        conditions=Conditions(
            delta=delta, hold=float(Fraction(period)), delay=0.0, actuator_error=0.0
        ),
        gains=gains,
        omega=p,
        bounds=ChainBounds(
            X=X,
            xi=xi,
            A=A,
            L=zeros,
            W=zeros,
            s=zeros,
            B=zeros,
            D=zeros,
            G=zeros,
            g_min=zeros,
            F_star=zeros,
            eta=eta,
            Lambda=zeros,
            zeta=0.0,
            V=0.0,
            U=phi(gains[-1], p[-1] + eta[-1]),
            slope=1.0,
            delta_v=0.0,
        ),
        certificate=certificate
        or Certificate(verdict=Verdict.CERTIFIED, inequalities=(), assumptions=(), failures=()),
        largest_certified_period=0.0,
    )


def refuted(design: Design) -> Design:
    """Return the same design with a failed inequality."""
    failed = Inequality(id="U1[x1]", equation="(65)", lhs=(1.0, 1.0), rhs=(2.0, 2.0), holds=False)
    certificate = Certificate(
        verdict=Verdict.REFUTED, inequalities=(failed,), assumptions=(), failures=()
    )
    return replace(design, certificate=certificate)


def everyday() -> Design:
    """Two states, quantized and sampled, tubes wide enough for random samples to be inside."""
    return make_design(
        gains=(
            shape(k=1.5, M=0.8, epsilon=0.5),
            shape(k=3.0, M=20.0, epsilon=2.0, c=0.0625, N=5),
        ),
        p=(1.0, 4.0),
        initial=(("-3/2", "3/2"), ("-1", "1")),
        X=(1.5, 3.0),
        delta=(0.001, 0.01),
        eta=(0.001, 0.02),
        period="1/10000",
    )


def kinked() -> Design:
    """One state, a reference made of every operation that has branches, exponential rho."""
    wave = sp.sin(3 * T)
    kinks = (
        sp.Abs(wave) / 4
        + sp.Min(sp.cos(T), sp.Rational(1, 3)) / 4
        + sp.Piecewise((sp.tanh(T) / 8, T < 2), (sp.exp(-T) / 8, True))
        + sp.Pow(wave, sp.Rational(1, 3)) / 16
        + sp.sign(sp.cos(5 * T)) / 32
        + sp.sqrt(1 + T) / (32 * (1 + T**3))
    )
    return make_design(
        name="kinked",
        gains=(shape(k=2.5),),
        p=(1.0,),
        initial=(("-1", "1"),),
        reference=kinks,
        rho=(exponential("3/2", "1/10"),),
        X=(1.0,),
    )


def run_time() -> Design:
    """Three states, a reference supplied at run time, a different rho for each state."""
    return make_design(
        name="run_time",
        gains=(shape(k=1.0, c=0.5), shape(k=0.5, M=1.0, epsilon=2.0), shape(k=2.0, c=0.1, N=7)),
        p=(1.0, 3.0, 3.0),
        initial=(("-1", "1"), ("-1", "1"), ("-1", "1")),
        offset="1/2",
        reference=None,
        rho=(cosine("7/10"), exponential("2"), cosine("7/10")),
        X=(1.0, 1.5, 1.5),
        delta=(0.02, 0.02, 0.02),
        anchor=Anchor.EXACT,
        period="1/1000",
    )


def overflowing() -> Design:
    """A saturating reference whose parts overflow after 709 s: C and Python must agree on that."""
    grown = sp.exp(T)
    return make_design(
        name="overflowing",
        gains=(shape(k=1.0), shape(k=1.0), shape(k=1.0), shape(k=1.0)),
        p=(1.0, 2.0, 2.0, 2.0),
        initial=(("0", "1"),) * 4,
        reference=sp.Mul(grown, 1 / (1 + grown), evaluate=False) / 2 + sp.sinh(T) / sp.cosh(2 * T),
        rho=(cosine("3"),) * 4,
        X=(1.0, 1.0, 1.0, 1.0),
    )


DESIGNS = {
    "everyday": everyday,
    "kinked": kinked,
    "run_time": run_time,
    "overflowing": overflowing,
}
