"""The errors that a run is judged by, the references, and the time axis."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from bfppc_synth.errors import ShapeError
from bfppc_synth.model.expression import Constant, Number
from bfppc_synth.model.shapes import Shape, Theorem1Gain
from bfppc_synth.model.spec import (
    Anchor,
    Form,
    QuantizerKind,
    QuantizerSpec,
    RhoKind,
    RhoSpec,
)
from bfppc_synth.simulation.references import first_references, initial_box, sine
from bfppc_synth.simulation.scheme import Coverage, Stepping, choose_scheme
from bfppc_synth.simulation.tracking import Start, Tracking, feedback, performance_function


def number(value):
    exact = sp.Rational(str(value))
    return Constant(
        text=str(value), tree=Number(value=exact), exact=exact, approximate=float(value)
    )


SHAPE = Shape(k=2.0, M=3.0, epsilon=0.5, c=0.25, N=5)
START = Start(true=(1.0, -0.5), measured=(1.1, -0.4), reference=0.3)


def test_the_shape_is_the_papers():
    expected = 2.0 * 0.7 + 3.0 * math.tanh(3.0 * 0.7 / 0.5) + 0.25 * 0.7**5
    assert feedback(SHAPE, 0.7, math.tanh, SHAPE.k) == pytest.approx(expected, rel=1e-15)
    assert feedback(SHAPE, -0.7, math.tanh, SHAPE.k) == -feedback(SHAPE, 0.7, math.tanh, SHAPE.k)


@pytest.mark.parametrize(
    ("anchor", "offset", "second"), [(Anchor.LATCHED, 0.8, -0.4), (Anchor.EXACT, 0.7, -0.5)]
)
def test_the_center_starts_from_the_latched_or_from_the_true_states(
    design_of, anchor, offset, second
):
    design = design_of(anchor=anchor, gains=(SHAPE, SHAPE))
    tracking = Tracking(design, START)
    t, y_d = [0.0, 1.0, 4.0], np.array([0.3, 0.2, 0.1])
    r = tracking.center(t, y_d)
    rho = 0.5 * (1.0 + math.cos(1.0))
    assert r[:, 0] == pytest.approx([0.3 + offset, 0.2 + rho * offset, 0.1])
    assert r[:, 1] == pytest.approx([second, rho * second, 0.0])
    x = np.array([[1.0, -0.5], [0.5, 0.25], [0.0, 1.0]])
    e = tracking.errors(t, x, r)
    assert e[:, 0] == pytest.approx(x[:, 0] - r[:, 0])
    pushed = [feedback(SHAPE, value, math.tanh, SHAPE.k) for value in e[:, 0]]
    assert e[:, 1] == pytest.approx(x[:, 1] - r[:, 1] + pushed)
    for k in range(3):
        assert tracking.now(t[k], x[k], y_d[k]) == pytest.approx(list(e[k]), rel=1e-14)


def test_performance_functions_are_the_papers():
    cosine = performance_function(
        RhoSpec(kind=RhoKind.COSINE, t_s=number(2), rate=None, floor=None, rate_bound=None)
    )
    assert [cosine(s) for s in (0.0, math.pi, 2 * math.pi, 9.0)] == pytest.approx([1, 0.5, 0, 0])
    decay = performance_function(
        RhoSpec(
            kind=RhoKind.EXPONENTIAL,
            t_s=None,
            rate=number(3),
            floor=number("0.25"),
            rate_bound=None,
        )
    )
    assert decay(0.0) == 1.0
    assert decay(1.0) == pytest.approx(0.75 * math.exp(-3.0) + 0.25)


def test_a_runtime_reference_is_the_fastest_that_keeps_every_bound(design_of):
    spec = design_of(reference_bounds=(2.0, 3.0, 18.0)).spec
    y_d = sine(spec, 0.0, 1.0)
    times = np.linspace(0.0, 20.0, 200_001)
    values = np.array([y_d(s) for s in times])
    rate = np.gradient(values, times)
    bend = np.gradient(rate, times)[2:-2]
    assert max(abs(values)) == pytest.approx(2.0, rel=1e-6)
    assert max(abs(rate)) == pytest.approx(3.0, rel=1e-4)
    assert max(abs(bend)) <= 18.0
    tighter = design_of(reference_bounds=(2.0, 3.0, 2.0)).spec
    assert sine(tighter, 0.0, 1.0)(math.pi / 2.0) == pytest.approx(2.0)


@pytest.mark.parametrize(("start", "direction"), [(1.5, 1.0), (1.5, -1.0), (-2.0, 1.0)])
def test_a_runtime_reference_starts_where_it_is_told(design_of, start, direction):
    y_d = sine(design_of(reference_bounds=(2.0, 3.0)).spec, start, direction)
    assert y_d(0.0) == pytest.approx(start)
    slope = y_d(1e-6) - y_d(0.0)
    assert slope * direction > 0.0 or start == -2.0


def test_references_that_do_not_move_are_constant(design_of):
    assert sine(design_of(reference_bounds=(0, 1)).spec, 0.0, 1.0)(3.0) == 0.0
    assert sine(design_of(reference_bounds=(2, 0)).spec, 1.0, 1.0)(3.0) == pytest.approx(1.0)
    with pytest.raises(ShapeError, match="slope"):
        sine(design_of(reference_bounds=(2,)).spec, 0.0, 1.0)


def test_an_offset_keeps_start_and_reference_together(design_of):
    free = design_of(reference_bounds=(2, 3), initial=((-9, 9), (0, 0))).spec
    assert first_references(free, 9.0) == (-2.0, 2.0)
    assert initial_box(free)[0] == (-9.0, 9.0)
    bound = replace(free, offset=number("0.5"))
    assert initial_box(bound) == ((-2.5, 2.5), (0.0, 0.0))
    assert first_references(bound, 1.0) == (0.5, 1.5)
    assert first_references(bound, 2.5) == (2.0, 2.0)


UNIFORM = (QuantizerSpec(kind=QuantizerKind.UNIFORM, step=number("0.01")),) * 2
TOLERANT = {"quantizers": UNIFORM, "largest_period": 0.002}


@pytest.mark.parametrize(
    ("changed", "stepping", "sample", "substeps", "delay", "coverage"),
    [
        ({}, "IMPLICIT", 0.002, 1, 0.0, "COVERED"),
        ({"form": Form.PRINTED}, "IMPLICIT", 0.002, 1, 0.0, "NOT_COVERED"),
        ({"period": 0.001}, "SAMPLED", 0.001, 1, 0.0, "COVERED"),
        ({"period": 0.007}, "SAMPLED", 0.007, 4, 0.0, "COVERED"),
        ({"period": 0.006}, "SAMPLED", 0.006, 3, 0.0, "COVERED"),
        ({"period": 0.001, "delay": 0.5}, "SAMPLED", 0.001, 1, 0.5, "COVERED"),
        ({"delay": 0.001}, "IMPLICIT", 0.002, 1, 0.0, "COVERED"),
        ({"delay": 0.002}, "SAMPLED", 0.002, 1, 0.0, "COVERED"),
        ({"delay": 0.005}, "SAMPLED", 0.002, 1, 0.003, "COVERED"),
        ({"quantizers": UNIFORM}, "SAMPLED", 0.002, 1, 0.0, "NOT_COVERED"),
        (TOLERANT, "SAMPLED", 0.002, 1, 0.0, "COVERED"),
        (TOLERANT | {"largest_period": 0.0019}, "SAMPLED", 0.002, 1, 0.0, "NOT_COVERED"),
        ({"quantizers": UNIFORM, "period": 0.001}, "SAMPLED", 0.001, 1, 0.0, "COVERED"),
    ],
)  # fmt: skip
def test_the_time_axis_is_what_the_plant_file_asks_for(
    design_of, changed, stepping, sample, substeps, delay, coverage
):
    scheme = choose_scheme(design_of(**changed))
    assert scheme.stepping is Stepping[stepping]
    assert (scheme.sample, scheme.substeps) == (sample, substeps)
    assert scheme.delay == pytest.approx(delay, abs=1e-15)
    assert scheme.coverage is Coverage[coverage]


def test_the_horizon_is_reached_and_finer_steps_keep_the_samples(design_of):
    scheme = choose_scheme(design_of(period=0.004))
    assert (scheme.samples(1.0), scheme.samples(1.001), scheme.samples(1e-9)) == (250, 251, 1)
    finer = scheme.finer(4)
    assert (finer.sample, finer.substeps, finer.step) == (0.004, 8, 0.0005)
    implicit = choose_scheme(design_of()).finer(4)
    assert (implicit.sample, implicit.substeps) == (0.0005, 1)


def test_a_scheduled_gain_follows_rho(design_of):
    first = Theorem1Gain(gamma=2.0, H=(3.0, 1.5), H_star=3.0, c=0.5, N=3)
    tracking = Tracking(design_of(anchor=Anchor.EXACT, gains=(first, first)), START)
    t, y_d = [0.0, 1.0, 4.0], np.array([0.3, 0.2, 0.1])
    x = np.array([[1.2, -0.5], [0.5, 0.25], [0.1, 1.0]])
    e = tracking.errors(t, x, tracking.center(t, y_d))
    for k, rho in enumerate((1.0, 0.5 * (1.0 + math.cos(1.0)), 0.0)):
        slope = 2.0 * (3.0 + 1.5 * rho)
        second = tracking.center(t, y_d)[k, 1]
        pushed = slope * e[k, 0] + 0.5 * e[k, 0] ** 3
        assert e[k, 1] == pytest.approx(x[k, 1] - second + pushed)
        assert tracking.now(t[k], x[k], y_d[k]) == pytest.approx(list(e[k]), rel=1e-14)
