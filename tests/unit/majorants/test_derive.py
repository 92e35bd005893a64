"""The majorants of whole plants: what bounds a channel, and how it reads."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest
import sympy as sp

from bfppc_synth.errors import EnvelopeError
from bfppc_synth.majorants.derive import derive_majorants, parameter_intervals
from bfppc_synth.majorants.envelope import envelope, magnitude
from bfppc_synth.majorants.targets import FloatArithmetic, SympyArithmetic
from bfppc_synth.model.plant import Channel, Plant

x1, x2, x3, a, m = sp.symbols("x1 x2 x3 a m", real=True)
R = sp.Rational


def channel(state, f, g=sp.S.One, *, f_bound=None, g_bound=None, g_min=None, disturbance=sp.S.Zero):
    return Channel(
        state=state,
        f=f,
        g=g,
        f_bound=f_bound,
        g_bound=g_bound,
        g_min=g_min,
        disturbance=disturbance,
    )


def plant(*channels, parameters=()):
    return Plant(
        spec=SimpleNamespace(),
        time=sp.Symbol("t", real=True),
        states=tuple(c.state for c in channels),
        parameters=tuple(symbol for symbol, _ in parameters),
        ranges=tuple(ends for _, ends in parameters),
        channels=channels,
        reference=None,
        funnel=None,
    )


EXAMPLE_2 = plant(
    channel(
        x1,
        x1 + x1 * sp.exp(-a * x1),
        1 + sp.sin(x1**2),
        f_bound=sp.Abs(x1) + sp.Abs(x1) * sp.exp(a * sp.Abs(x1)),
        g_bound=sp.Integer(2),
        g_min=sp.S.One,
    ),
    channel(x2, x1 * sp.sin(x2) + x1 * x2**2, 3 + sp.cos(x1)),
    parameters=[(a, (R(1, 2), R(1, 2)))],
)


def texts(majorants):
    return [(str(c.f_text), str(c.g_text), str(c.g_min_text)) for c in majorants.channels]


def test_example_2_reads_as_in_the_paper():
    majorants = derive_majorants(EXAMPLE_2)
    assert texts(majorants) == [("z1*exp(z1/2) + z1", "2", "1"), ("z1*z2**2 + z1", "4", "2")]
    assert [str(z) for z in majorants.magnitudes] == ["z1", "z2"]


def test_a_declared_bound_replaces_what_it_bounds():
    first, second = derive_majorants(EXAMPLE_2).channels
    declared = EXAMPLE_2.channels[0]
    assert (first.f_star, first.g_star, first.g_min) == (
        declared.f_bound,
        declared.g_bound,
        declared.g_min,
    )
    derived = EXAMPLE_2.channels[1]
    assert (second.f_star, second.g_star, second.g_min) == (derived.f, derived.g, derived.g)


def test_an_unknown_function_is_known_by_its_bounds():
    unknown = channel(x1, None, None, f_bound=x1**2 + 1, g_bound=sp.Integer(3), g_min=R(1, 2))
    majorants = derive_majorants(plant(unknown))
    assert texts(majorants) == [("z1**2 + 1", "3", "1/2")]


@pytest.mark.parametrize(("f", "g", "key"), [(None, sp.S.One, "f_bound"), (x1, None, "g_bound")])
def test_a_channel_that_nothing_bounds_is_refused(f, g, key):
    with pytest.raises(EnvelopeError, match=f"dynamics.x1 has neither . nor {key}"):
        derive_majorants(plant(channel(x1, f, g)))


def test_a_disturbance_is_passed_on():
    majorants = derive_majorants(plant(channel(x1, x1, disturbance=R(1, 10) * sp.Abs(x1))))
    assert majorants.channels[0].disturbance == sp.Abs(x1) / 10


@pytest.mark.parametrize("place", ["f", "g", "f_bound", "g_bound", "g_min", "disturbance"])
def test_what_has_no_rule_is_refused_wherever_it_stands(place):
    parts = {"f": x1, "g": sp.S.One, place: sp.gamma(x1)}
    with pytest.raises(EnvelopeError, match="gamma"):
        derive_majorants(plant(channel(x1, parts.pop("f"), parts.pop("g"), **parts)))


def test_parameter_ranges_enter_the_formulas():
    ranged = plant(channel(x1, m * x1, 2 + m), parameters=[(m, (R(9, 10), R(11, 10)))])
    assert texts(derive_majorants(ranged)) == [("11*z1/10", "31/10", "29/10")]


def test_parameter_intervals_are_the_ranges():
    ranged = plant(channel(x1, m * x1), parameters=[(m, (sp.pi / 60, sp.sqrt(2)))])
    assert parameter_intervals(ranged, FloatArithmetic()) == {
        m: (math.pi / 60, pytest.approx(math.sqrt(2.0)))
    }
    assert parameter_intervals(ranged, SympyArithmetic()) == {m: (sp.pi / 60, sp.sqrt(2))}


@pytest.mark.parametrize("f", [x1 ** R(-2, 1), sp.log(x1), sp.sqrt(x1 - 1)])
def test_a_formula_that_no_symmetric_box_allows_is_infinite(f):
    first = derive_majorants(plant(channel(x1, f, 2 + 1 / x1))).channels[0]
    assert (first.f_text, first.g_text, first.g_min_text) == (sp.oo, sp.oo, -sp.oo)
    assert first.f_star == f


CART = plant(
    channel(x1, sp.S.Zero),
    channel(
        x2,
        (R(49, 5) * sp.sin(x1) - x2**2 * sp.cos(x1) * sp.sin(x1) / 22)
        / (R(2, 3) - sp.cos(x1) ** 2 / 22),
        sp.cos(x1) / R(11, 10) / (R(2, 3) - sp.cos(x1) ** 2 / 22),
    ),
)
MOTOR_ARM = plant(
    channel(x1, sp.S.Zero),
    channel(x2, -R(22840, 642) * sp.sin(x1) - R(181, 642) * x2, R(10000, 642)),
    channel(x3, -36 * x2 - 200 * x3, sp.Integer(40)),
)
WING_ROCK = plant(
    channel(x1, sp.S.Zero),
    channel(
        x2,
        -R(1859521, 10**8) * x1
        - R(6245153, 10**8) * sp.Abs(x1) * x2
        + R(954708, 10**8) * sp.Abs(x2) * x2
        + R(2145291, 10**8) * x1**3,
    ),
    channel(x3, -15 * x3, sp.Integer(15)),
)


@pytest.mark.parametrize("example", [EXAMPLE_2, CART, MOTOR_ARM, WING_ROCK])
@pytest.mark.parametrize("z", [0.1, 0.6, 1.3])
def test_a_formula_is_never_below_the_envelope(example, z):
    majorants = derive_majorants(example)
    floats = FloatArithmetic()
    base = parameter_intervals(example, floats)
    base |= {state: (-z * (i + 1), z * (i + 1)) for i, state in enumerate(example.states)}
    values = {symbol: z * (i + 1) for i, symbol in enumerate(majorants.magnitudes)}
    for c in majorants.channels:
        for text, star in ((c.f_text, c.f_star), (c.g_text, c.g_star)):
            bound = magnitude(envelope(star, base, floats), floats)
            assert float(text.subs(values)) >= bound * (1 - 1e-12)
        lower = envelope(c.g_min, base, floats)[0]
        assert float(c.g_min_text.subs(values)) <= lower + 1e-12
