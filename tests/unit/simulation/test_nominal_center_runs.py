"""Center nominal in the simulation: the followed trajectory, and runs that stay in their tube."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import sympy as sp

from bfppc_synth.bounds.nominal.model import nominal_model
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.expressions.evaluate import evaluate_float
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.model.bounds import CenterBounds, ChainBounds, Conditions, SignalBounds
from bfppc_synth.model.certificate import Certificate, Verdict
from bfppc_synth.model.design import Design
from bfppc_synth.model.shapes import Shape
from bfppc_synth.simulation.adversary import Adversary
from bfppc_synth.simulation.following import FollowingTracking, normalized
from bfppc_synth.simulation.loading import load_text
from bfppc_synth.simulation.loop import simulate_adversaries, simulate_nominal
from bfppc_synth.simulation.plant import compile_plant, modelled
from bfppc_synth.simulation.references import sine
from bfppc_synth.simulation.scheme import Coverage, choose_scheme
from bfppc_synth.simulation.tracking import Start
from bfppc_synth.spec import availability
from bfppc_synth.spec.load import load_spec

# With phi_1 = 10 e, phi_2 = 40 e, p = (0.1, 0.5), docs/theory.md section 3 by hand:
# F_1* = 0.5 < 1; W_2 = 0.1 + 1.1 0.1 + 0.05, B_1 = 10 (0.5 + 1), D_2 = 15.3;
# eta = (0.0007, 0.0077), V_2 < 36, zeta < 0.062; 40 (0.5 - 0.062) = 17.5 > 15.3 + 0.1 + delta_v,
# delta_v < 0.1. So Theorem U holds with room.
PLANT = """
name: swing
parameters: {a: [0.9, 1.1]}
states: [x1, x2]
dynamics:
  x1: {f: 0}
  x2: {f: -a*sin(x1), f_bound: 5, disturbance: 0.05}
reference: sin(t)
initial: {x1: [0.4, 0.6], x2: [-0.2, 0.2]}
performance: {accuracy: 0.1, transition: 2}
measurement: {quantizer: {kind: uniform, step: 0.001}, noise: 0.0002}
sampling: {period: 0.001, delay: 0.0005}
actuator: {error: 0.1}
synthesis: {center: nominal, p: {x2: 0.5}, gains: {x1: {k: 10}, x2: {k: 40}}}
simulation: {horizon: 3, period: 0.001, seed: 1}
"""
SUPPLIED = (("reference: sin(t)", "reference: {bounds: [1, 1, 1, 1]}"), (
    "x2: [-0.2, 0.2]}", "x2: [-0.2, 0.2], offset: 0.5}"
))  # fmt: skip
CONTINUOUS = (
    ("measurement: {quantizer: {kind: uniform, step: 0.001}, noise: 0.0002}\n", ""),
    ("sampling: {period: 0.001, delay: 0.0005}\n", ""),
)
PEAK = 32.0


@pytest.fixture(scope="module", autouse=True)
def _center_to_come():
    """Open center nominal, which the plant file refuses until the checker proves it."""
    rows = tuple(row for row in availability.UNAVAILABLE if row.key != "center")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(availability, "UNAVAILABLE", rows)
        yield


@pytest.fixture
def made(tmp_path):
    def make(*changes):
        text = PLANT
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "swing.yaml").write_text(text, encoding="utf-8")
        return _design(load_spec(tmp_path / "swing.yaml"))

    return make


def _design(spec):
    plant = build_plant(spec)
    zeros = (0.0, 0.0)
    delta = tuple(0.0007 if spec.measurement.noise[0].approximate else 0.0 for _ in "12")
    return Design(
        spec=spec,
        plant=plant,
        majorants=None,
        signals=SignalBounds(
            Y_0=1.0, Y_1=1.0, a_0=1.6, offset_lower=-1.6, offset_upper=1.6,
            rho_floor=zeros, rho_rate=zeros,
        ),
        center=CenterBounds(
            r_lower=(-1.5, -3.0), r_upper=(1.5, 3.0), rate=(3.0, 10.0), feed=zeros,
            v=11.0, v_rate=60.0, v_start=11.0,
        ),
        conditions=Conditions(delta=delta, hold=0.0015, delay=0.0005, actuator_error=0.1),
        gains=tuple(Shape(k=k, M=0.0, epsilon=1.0, c=0.0, N=3) for k in (10.0, 40.0)),
        omega=(0.1, 0.5),
        bounds=ChainBounds(
            X=(1.6, 4.5), xi=(0.1, 1.5), A=(1.0, 20.0), L=(10.0, 40.0), W=(0.0, 0.26), s=zeros,
            B=(15.0, 0.0), D=(0.0, 15.3), G=(1.0, 1.0), g_min=(1.0, 1.0), F_star=(0.5, 15.3),
            eta=(delta[0], 11.0 * delta[0]), Lambda=zeros, zeta=0.06, V=36.0, U=PEAK, slope=40.0,
            delta_v=0.1,
        ),
        certificate=Certificate(
            verdict=Verdict.CERTIFIED, inequalities=(), assumptions=(), failures=()
        ),
        largest_certified_period=0.001,
        nominal=nominal_model(plant, 2.0),
    )  # fmt: skip


def _controller(design):
    text = render_controller(build_law(design), make_provenance(design))
    return load_text(text, name="controller", origin="<controller>").Controller


def _follow(design, start=(0.5, -0.1), derivatives=None):
    return FollowingTracking(
        design,
        design.nominal,
        Start(true=(9.0, 9.0), measured=start, reference=math.nan),
        derivatives,
    )


def test_the_center_starts_in_the_measured_state_and_becomes_the_reference(made):
    tracking = _follow(made())
    (first, middle, *last) = tracking.center([0.0, 1.0, 2.0, 7.5], np.zeros(4)).tolist()
    assert first == pytest.approx([0.5, -0.1], abs=1e-15)
    assert abs(middle[0] - math.sin(1.0)) > 1e-3
    for r, t in zip(last, (2.0, 7.5), strict=True):
        assert r == pytest.approx([math.sin(t), math.cos(t)], rel=1e-15)


def test_the_center_follows_the_nominal_plant(made):
    t = np.linspace(0.0, 2.5, 2501)
    r = _follow(made()).center(t.tolist(), np.zeros_like(t))
    assert np.allclose(np.gradient(r[:, 0], t), r[:, 1], atol=2e-3)


def test_the_simulated_center_is_the_controllers(made):
    for design, supplied in ((made(), None), (made(*SUPPLIED), (0.3, 0.9))):
        reference = supplied and sine(design.spec, supplied[0], supplied[1])
        derivatives = reference and reference.derivatives
        tracking = _follow(design, derivatives=derivatives)
        controller = _controller(design)()
        controller.step(0.0, (0.5, -0.1), derivatives and derivatives(0.0))
        for t in (0.2, 1.1, 1.9, 2.0, 3.3):
            ((r_1, r_2),) = tracking.center([t], np.zeros(1)).tolist()
            passed = derivatives and derivatives(t)
            # On the center the command is v; beside it phi_2(phi_1(e) + d) is added.
            v = controller.step(t, (r_1, r_2), passed)
            u = controller.step(t, (r_1 + 0.01, r_2 + 0.02), passed)
            assert u - v == pytest.approx(-40.0 * (0.02 + 10.0 * 0.01), rel=1e-9)
            signals = derivatives(t) if derivatives else (math.sin(t), math.cos(t), -math.sin(t))
            if t >= 2.0:
                assert v == pytest.approx(signals[2] + math.sin(signals[0]), rel=1e-12)
            assert tracking.now(t, (r_1 + 0.01, r_2 + 0.02), math.nan) == pytest.approx(
                [0.01, 0.12], rel=1e-9
            )


def test_errors_of_a_batch_are_those_of_each_moment(made):
    tracking, t = _follow(made()), [0.0, 0.7, 2.6]
    x = np.array([[0.5, -0.1], [0.7, 0.3], [0.4, -0.6]])
    e = tracking.errors(t, x, tracking.center(t, np.zeros(3)))
    for s, state, row in zip(t, x, e, strict=True):
        assert tracking.now(s, state, math.nan) == pytest.approx(row.tolist(), abs=1e-14)


@pytest.mark.parametrize("changes", [(), SUPPLIED, CONTINUOUS, (*SUPPLIED, *CONTINUOUS)])
def test_the_nominal_run_stays_near_its_center(made, changes):
    design = made(*changes)
    run = simulate_nominal(design, _controller(design))
    assert run.complete
    assert set(run.status) == {0}
    # Measurement and holding apart nothing moves it off.
    assert all(e < 0.15 * p for e, p in zip(run.max_abs_e, design.omega, strict=True))
    assert 0.5 < run.max_abs_u < PEAK
    assert run.r[0].tolist() == pytest.approx(run.q[0].tolist(), abs=1e-12)


@pytest.mark.parametrize("changes", [(), SUPPLIED, CONTINUOUS])
def test_no_adversary_leaves_a_tube_that_theorem_u_proves(made, changes):
    design = made(*changes)
    runs = simulate_adversaries(design, _controller(design), runs=5)
    assert all(run.within_bounds for run in runs), runs
    # They do push: 0.15 on the second channel, and what is measured wrong.
    assert max(run.max_abs_e[1] for run in runs) > 0.15 / 40.0
    assert all("declared bounds" not in run.kind for run in runs)


def test_an_adversary_beyond_the_range_is_noticed(made):
    """A plant ten times as uncertain as the gains were made for leaves the narrow tube."""
    weak = made(("a: [0.9, 1.1]", "a: [-90, 110]"))
    runs = simulate_adversaries(weak, _controller(made()), runs=5)
    assert not all(run.within_bounds for run in runs)


def test_implicit_steps_are_exact_on_the_center(made):
    """The nominal plant follows it however coarse the steps are: only errors are integrated."""
    for changes in (CONTINUOUS, (*SUPPLIED, *CONTINUOUS)):
        design = made(*changes, ("period: 0.001, seed", "period: 0.02, seed"))
        run = simulate_nominal(design, _controller(design))
        assert max(run.max_abs_e) < 1e-11


def test_what_a_step_misses_vanishes_with_the_step(made):
    tracking, other = _follow(made()), _follow(made())
    coarse = [tracking.defect(k, 0.01) for k in range(40)]
    fine = [other.defect(10 * k, 0.001) for k in range(40)]
    for row, finer in zip(coarse, fine, strict=True):
        assert max(map(abs, finer)) < 0.2 * max(map(abs, row)) < 0.5


def test_parameters_switch_between_the_ends_of_their_ranges(made):
    design = made()
    dynamics = compile_plant(modelled(design.plant))
    assert dynamics.bounds is None
    seen = set()
    for number in range(10):
        nature = Adversary(design, dynamics, choose_scheme(design), seed=1, run=number)
        k = 0
        while k < 3000:
            action = nature.act(k, 0.001 * k, (0.3, 0.1))
            seen.add(action.arguments[0])
            k = min(action.until, 3000)
            if number == 1 and nature.derivatives is None:
                nature.begin(_follow(design))
    assert {0.9, 1.1} <= seen
    assert all(0.9 <= a <= 1.1 for a in seen)


def test_what_the_file_has_no_formula_for_stays_open(made):
    plant = made(("f: -a*sin(x1), f_bound: 5", "f_bound: 0.2")).plant
    dynamics = compile_plant(modelled(plant))
    assert dynamics.bounds is not None
    known = compile_plant(made().plant)
    assert known.bounds is not None


def test_a_supplied_sine_has_the_derivatives_of_its_value(made):
    spec = made(*SUPPLIED, ("[1, 1, 1, 1]", "[0.5, 2, 1.5, 8]")).spec
    reference = sine(spec, 0.2, -1.0)
    assert reference(0.0) == pytest.approx(0.2)
    t = sp.Symbol("t")
    wave = reference.amplitude * sp.sin(reference.frequency * t + reference.phase)
    bounds = (0.5, 2.0, 1.5)
    for s in (0.0, 0.9, 4.4):
        expected = [evaluate_float(wave.diff(t, k), {t: s}) for k in range(3)]
        assert reference.derivatives(s) == pytest.approx(expected, abs=1e-14)
        assert reference.derivatives(s)[0] == pytest.approx(reference(s), rel=1e-15)
        assert all(abs(y) <= b for y, b in zip(reference.derivatives(s), bounds, strict=True))
    assert normalized((1.0, 2.0, 3.0, 4.0)) == (1.0, 2.0, 1.5, 4.0 / 6.0)
    still = sine(made(*SUPPLIED, ("[1, 1, 1, 1]", "[0, 1, 1, 1]")).spec, 0.0, 1.0)
    assert still.derivatives(3.0) == (0.0, 0.0, 0.0)
    values = [still(s) for s in (0.0, 1.0, 2.0)]
    assert all(a == b == 0.0 for a, b in pairwise(values))


def test_a_run_is_held_against_the_funnel(made):
    starts = ("x1: [0.4, 0.6], x2: [-0.2, 0.2]", "x1: 0.5, x2: 0")
    shares = {}
    # |x_1(0) - y_d(0)| = 0.5 at first: the whole of the second funnel, twice the third.
    for funnel in ("1.0", "0.5", "0.25"):
        given = ("transition: 2}", f"transition: 2, funnel: {funnel} + 0.2*t/(1 + t)}}")
        design = made(starts, given)
        run = simulate_nominal(design, _controller(design))
        assert run.within_bounds == (funnel != "0.25")
        (first, *_) = simulate_adversaries(design, _controller(design), runs=1)
        assert first.within_bounds == (funnel != "0.25")
        assert first.funnel_share == pytest.approx(run.funnel_share, abs=0.2)
        shares[funnel] = run.funnel_share
    assert shares["0.5"] == pytest.approx(1.0, rel=1e-12)
    assert shares["0.25"] == pytest.approx(2.0, rel=1e-12)
    assert 0.499 <= shares["1.0"] < 0.6
    design = made()
    assert simulate_nominal(design, _controller(design)).funnel_share is None


def test_steps_that_pass_over_the_transition_prove_nothing(made):
    design = made(*CONTINUOUS)
    assert choose_scheme(design).coverage is Coverage.COVERED
    # Ten steps of 1 ms for the transition, and a few less.
    for duration, coverage in ((0.0101, Coverage.COVERED), (0.0099, Coverage.NOT_COVERED)):
        short = replace(design, nominal=nominal_model(design.plant, duration))
        assert choose_scheme(short).coverage is coverage


def test_one_adversary_of_six_pushes_the_error_that_is_nearest_to_its_bound(made):
    design = made()
    dynamics = compile_plant(modelled(design.plant))
    nature = Adversary(design, dynamics, choose_scheme(design), seed=1, run=5)
    assert nature.kind.startswith("pushes the error nearest to its bound outward")
    nature.act(0, 0.0, nature.start)
    tracking = _follow(design)
    nature.begin(tracking)
    ((r_1, r_2),) = tracking.center([1.0], np.zeros(1)).tolist()
    # |e| / p: 0.2 and then, with e_2 = d + 10 e_1, the second or the first is nearer.
    for d, nearest in (((0.02, 0.1), 1.0), ((-0.02, 0.25), -1.0), ((-0.02, 0.6), 1.0)):
        e = tracking.now(1.0, (r_1 + d[0], r_2 + d[1]), math.nan)
        shares = [a / p for a, p in zip(e, design.omega, strict=True)]
        assert math.copysign(1.0, max(shares, key=abs)) == nearest
        action = nature.act(1000, 1.0, (r_1 + d[0], r_2 + d[1]))
        # The disturbance of the second channel goes the same way, the noise the other.
        assert action.arguments[2] == nearest
        assert action.noise == (-nearest * 0.0002, -nearest * 0.0002)


def test_center_performance_keeps_its_five_adversaries(design_of):
    design = design_of(({"f": sp.Integer(0)}, {"f": sp.Integer(0)}))
    dynamics = compile_plant(design.plant)
    kinds = [
        Adversary(design, dynamics, choose_scheme(design), seed=1, run=run).kind
        for run in range(10)
    ]
    assert len({kind.partition(";")[0] for kind in kinds[:5]}) == 5
    assert not any("nearest" in kind for kind in kinds)
