"""Other methods on the same plant: laws, loops, search, operations."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from bfppc_synth.expressions.parse import parse_constant
from bfppc_synth.model.spec import QuantizerKind, QuantizerSpec
from bfppc_synth.simulation.baselines.arrays import make_measure
from bfppc_synth.simulation.baselines.backstepping import backstepping, symbolic_law
from bfppc_synth.simulation.baselines.barrier import BarrierLaw, LinearLaw, barrier
from bfppc_synth.simulation.baselines.cases import Clock, make_cases, make_clock, open_choices
from bfppc_synth.simulation.baselines.funnel import FunnelLaw, funnel, wide_funnel
from bfppc_synth.simulation.baselines.generated import GeneratedLaw
from bfppc_synth.simulation.baselines.loop import close_loop
from bfppc_synth.simulation.baselines.operations import family, family_costs
from bfppc_synth.simulation.baselines.path import Path as Wanted
from bfppc_synth.simulation.baselines.plant import advance, compile_rates, nominal_fields
from bfppc_synth.simulation.baselines.surface import surface
from bfppc_synth.simulation.baselines.tuning import law_of, run_laws, tune
from bfppc_synth.simulation.loop import load_controller, simulate_nominal
from bfppc_synth.simulation.plant import compile_plant
from bfppc_synth.simulation.quantizers import make_quantizer
from bfppc_synth.synthesis.synthesize import restore

ROOT = Path(__file__).parents[3]


@cache
def design(name):
    return restore(ROOT / "generated" / name)


def cases_of(name, *, horizon, runs=1, stream=0, seed=1, period=None):
    found = design(name)
    clock = make_clock(found, horizon)
    if period is not None:
        clock = replace(clock, period=period, count=round(horizon / period), substeps=1)
    return make_cases(found, clock, seed=seed, stream=stream, runs=runs)


def quantizer(kind, **keys):
    constants = {key: parse_constant(repr(value)) for key, value in keys.items()}
    return QuantizerSpec(kind=kind, **constants)


@pytest.mark.parametrize(
    "spec",
    [
        QuantizerSpec(kind=QuantizerKind.NONE),
        quantizer(QuantizerKind.UNIFORM, step=0.1),
        quantizer(QuantizerKind.UNIFORM, step=0.1, dead_zone=0.07),
        quantizer(QuantizerKind.HYSTERESIS_UNIFORM, step=0.1, hysteresis=0.02),
        quantizer(
            QuantizerKind.LOGARITHMIC_UNIFORM, minimum=0.02, density=0.1, threshold=0.5, step=0.1
        ),
    ],
)
def test_array_quantizers_give_the_levels_of_the_scalar_ones(spec):
    scalar, arrays = make_quantizer(spec), make_measure(spec)
    walk = np.cumsum(np.random.default_rng(1).normal(0.0, 0.08, (400, 3)), axis=0)
    for column in range(3):
        scalar.reset()
        expected = [scalar(value) for value in walk[:, column]]
        fresh = make_measure(spec)
        found = [float(fresh(np.array([value]))[0]) for value in walk[:, column]]
        assert found == pytest.approx(expected, abs=1e-12)
    # Columns do not disturb each other.
    assert arrays(walk[0]).shape == (3,)


@pytest.mark.parametrize("name", ["paper_example_2", "motor_arm_nominal", "van_der_pol"])
@pytest.mark.parametrize("bounded", [False, True])
def test_the_array_plant_moves_as_the_simulated_one(name, bounded):
    plant = design(name).plant
    dynamics = compile_plant(plant)
    truth = dynamics.bounds if bounded and dynamics.bounds else dynamics.model
    generator = np.random.default_rng(3)
    x = [generator.uniform(-0.5, 0.5, (2, 3)) for _ in range(plant.order)]
    u, size = generator.uniform(-1.0, 1.0, (2, 3)), len(dynamics.nominal)
    arguments = [np.full((2, 1), value) for value in dynamics.nominal]
    assert len(arguments) == size
    free = np.full((2, 1), bounded)
    moved = advance(compile_rates(plant), 0.1, 0.01, x, u, arguments, free)
    for place in np.ndindex(2, 3):
        state = [float(row[place]) for row in x]
        alone = truth.advance(0.1, 0.01, *state, float(u[place]), *dynamics.nominal)
        assert [float(row[place]) for row in moved] == pytest.approx(alone, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("name", ["paper_example_2", "motor_arm_nominal"])
def test_the_derivatives_of_the_path_are_its_derivatives(name):
    cases = cases_of(name, horizon=1.0, period=0.001)
    jets = cases.path.derivatives
    assert len(jets) == design(name).plant.order + 1
    for j in range(len(jets) - 1):
        slope = (jets[j][2:] - jets[j][:-2]) / 0.002
        assert np.abs(slope - jets[j + 1][1:-1]).max() < 2e-4 * (1.0 + np.abs(jets[j + 1]).max())
    # It begins where the measurement is, and the envelope is the accuracy around it.
    measured = cases.measures()[0](cases.start[0])
    assert jets[0][0] == pytest.approx(measured[:, 0])
    gap = np.abs(jets[0] - cases.path.y_d) + design(name).omega[0]
    assert cases.path.edge == pytest.approx(gap)


def test_a_run_is_the_same_however_many_there_are():
    few = cases_of("motor_arm_nominal", horizon=0.01, runs=3)
    many = cases_of("motor_arm_nominal", horizon=0.01, runs=7)
    assert (few.arguments == many.arguments[:, :, :3]).all()
    assert (few.start == many.start[:, :3]).all()
    other = cases_of("motor_arm_nominal", horizon=0.01, runs=3, stream=1)
    assert (few.arguments != other.arguments).any()


def test_a_plant_that_leaves_nothing_open_has_one_run():
    assert not open_choices(design("compressor_surge"))
    assert cases_of("compressor_surge", horizon=0.01, runs=5).runs == 1
    assert open_choices(design("paper_example_1"))
    cases = cases_of("paper_example_1", horizon=0.01, runs=6)
    assert cases.free[:, 0].tolist() == [False, True, True, False, True, True]


def test_every_argument_stays_within_what_the_file_allows():
    cases = cases_of("motor_arm_nominal", horizon=0.01, runs=9)
    plant = design("motor_arm_nominal").plant
    for row, (low, high) in zip(cases.arguments.transpose(1, 0, 2), plant.ranges, strict=False):
        assert float(low) <= row.min() < row.max() <= float(high)
        assert row[:, 0] == pytest.approx(0.5 * float(low + high))
    # Nominal center: the formulas are the truth, so no run takes bounds for it.
    assert not cases.free.any()


@pytest.mark.parametrize("name", ["compressor_surge", "motor_arm_nominal"])
def test_the_generated_controller_behaves_as_in_its_own_simulation(name):
    found = design(name)
    horizon = 0.1
    controller = load_controller(ROOT / "generated" / name / "controller.py")
    alone = simulate_nominal(found, controller, horizon=horizon)
    cases = cases_of(name, horizon=horizon)
    result = close_loop(cases, GeneratedLaw(cases, controller), candidates=1, kept=1)
    assert result.inside[0, 0] == 1.0
    assert result.output[:, 0] == pytest.approx(alone.x[:, 0], abs=1e-9)
    assert result.peak[0, 0] == pytest.approx(alone.max_abs_u, rel=1e-6)


def flat_path(order, samples=2):
    ones = np.zeros((samples, 1))
    return Wanted(
        derivatives=np.zeros((order + 1, samples, 1)),
        y_d=ones,
        edge=ones + 1.0,
        fade=np.zeros((samples, max(1, order - 1))),
        missing="",
    )


@pytest.mark.parametrize(("error", "alive"), [(0.1499, True), (0.15, False), (0.16, False)])
def test_the_barrier_has_no_value_at_its_width_and_the_linear_law_has(error, alive):
    gains, widths = [np.full((1, 1), 2.0), np.full((1, 1), 3.0)], (0.15, 1e3)
    measured = [np.full((1, 1), error), np.zeros((1, 1))]
    with np.errstate(all="ignore"):
        u = BarrierLaw(flat_path(2), gains, widths).command(0, measured)
    assert bool(np.isfinite(u).all()) is alive
    linear = LinearLaw(flat_path(2), gains, widths).command(0, measured)
    assert linear == pytest.approx(-2.0 * 3.0 / 1e3 * (2.0 * 2.0 / 0.15 * error))


def test_barrier_and_linear_law_have_the_same_slope_at_zero():
    gains, widths = [np.full((1, 1), 2.0), np.full((1, 1), 3.0)], (0.15, 3.1)
    measured = [np.full((1, 1), 1e-7), np.zeros((1, 1))]
    pair = [
        float(law(flat_path(2), gains, widths).command(0, measured)[0, 0])
        for law in (BarrierLaw, LinearLaw)
    ]
    assert pair[0] == pytest.approx(pair[1], rel=1e-6)


def test_the_first_funnel_begins_around_the_error_and_ends_at_its_final_width():
    times = np.array([0.0, 100.0])
    law = FunnelLaw(flat_path(1), times, [np.ones((1, 1))], [0.1], np.ones((1, 1)), margin=1.0)
    u = law.command(0, [np.full((1, 1), 1.0)])
    assert u == pytest.approx(-math.log((1.0 + 1.0 / 1.1) / (1.0 - 1.0 / 1.1)))
    with np.errstate(all="ignore"):
        assert np.isfinite(law.command(1, [np.full((1, 1), 0.0999)])).all()
        assert not np.isfinite(law.command(1, [np.full((1, 1), 0.1001)])).all()


def test_a_wide_funnel_is_wider_than_the_envelope_and_the_resolution():
    assert "0.6" in wide_funnel(2, 0.15, 0.0).fixed
    assert "0.8" in wide_funnel(2, 0.15, 0.1).fixed
    assert "0.15" in funnel(2, 0.15).fixed


@pytest.mark.parametrize("order", [1, 2, 3])
def test_backstepping_makes_half_the_squares_fall_as_it_should(order):
    plant = family(design("paper_example_1").plant, order)
    fields = nominal_fields(plant)
    u, jets, gains = symbolic_law(plant, fields)
    above, rate, carried, errors = jets[0], jets[1], sp.S.Zero, []
    motion = [f + g * nxt for f, g, nxt in zip(*fields, [*plant.states[1:], u], strict=True)]
    # The errors again, from the definition of the virtual controls.
    for i in range(order):
        errors.append(plant.states[i] - above)
        above = (rate - fields[0][i] - gains[i] * errors[-1] - carried) / fields[1][i]
        carried = fields[1][i] * errors[-1]
        if i + 1 < order:
            rate = sum(sp.diff(above, x) * v for x, v in zip(plant.states, motion, strict=True))
            rate += sum(sp.diff(above, jets[j]) * jets[j + 1] for j in range(order))
    energy = sum(e**2 for e in errors) / 2
    fall = sum(sp.diff(energy, x) * v for x, v in zip(plant.states, motion, strict=True))
    fall += sum(sp.diff(energy, jets[j]) * jets[j + 1] for j in range(order))
    fall += sum(k * e**2 for k, e in zip(gains, errors, strict=True))
    assert sp.expand(fall) == 0


def test_methods_that_cancel_the_plant_need_it():
    plant = design("paper_example_1").plant
    first = replace(plant.channels[0], f=None)
    unknown = replace(plant, channels=(first, plant.channels[1]))
    for method in (surface(unknown, 1e-3), backstepping(unknown)):
        assert method.build is None
        assert "bound alone" in method.missing
    for method in (surface(plant, 1e-3), backstepping(plant)):
        assert method.build is not None
        assert method.missing == ""


def test_backstepping_refuses_what_it_cannot_differentiate():
    plant = design("paper_example_1").plant
    x = plant.states[0]
    kinked = replace(plant.channels[0], f=sp.sign(x), f_bound=None)
    method = backstepping(replace(plant, channels=(kinked, plant.channels[1])))
    assert method.build is None
    assert "no derivative" in method.missing
    assert "no derivatives" in backstepping(plant, "the reference has no derivatives").missing


@pytest.mark.parametrize("make", ["surface", "backstepping"])
def test_a_method_that_knows_the_plant_follows_the_path(make):
    found = design("paper_example_2")
    cases = cases_of("paper_example_2", horizon=1.0, period=0.001)
    method = surface(found.plant, 0.001) if make == "surface" else backstepping(found.plant)
    points = np.array([[20.0, 20.0, 0.002][: len(method.tunables)]])
    result = run_laws(cases, [law_of(method, cases, points)], kept=1)
    assert result.inside[0, 0] == 1.0
    assert np.abs(result.output[:, 0] - cases.path.derivatives[0, :, 0]).max() < 0.02


class Constant:
    """u = k + 1 at sample k."""

    def command(self, k, measured):
        return np.full(measured[0].shape, k + 1.0)


@pytest.mark.parametrize(
    ("delay", "area"),
    [(0.0, [1.0, 3.0, 6.0]), (0.5, [0.5, 2.0, 4.5]), (1.0, [0.0, 1.0, 3.0]), (1.5, [0, 0.5, 2.0])],
)
def test_a_command_acts_after_the_whole_delay_and_is_held(delay, area):
    base = cases_of("compressor_surge", horizon=3.0, period=1.0)
    clock = replace(base.clock, delay=delay)

    def rates(t, x, u, arguments, free):
        return [0.0 * x[0], u]

    moved = []

    class Watching(Constant):
        def command(self, k, measured):
            moved.append(float(measured[1][0, 0]))
            return super().command(k, measured)

    cases = replace(base, clock=clock, rates=rates, start=np.zeros((2, 1, 1)))
    close_loop(cases, Watching(), candidates=1)
    assert moved[1:] == pytest.approx(area)


@pytest.mark.parametrize(("value", "undefined", "diverged"), [(math.nan, 1, 0), (1e300, 0, 1)])
def test_a_law_without_a_value_and_a_plant_without_bounds_are_told_apart(
    value, undefined, diverged
):
    class Broken:
        def command(self, k, measured):
            return np.full(measured[0].shape, value if k == 1 else 0.0)

    result = close_loop(cases_of("compressor_surge", horizon=0.01), Broken(), candidates=1)
    assert (result.undefined[0, 0], result.diverged[0, 0]) == (undefined, diverged)
    assert result.inside[0, 0] == 0.0
    assert np.isfinite(result.worst).all()


def test_level_changes_are_counted():
    found = design("compressor_surge")
    item = quantizer(QuantizerKind.UNIFORM, step=0.1)
    measurement = replace(found.spec.measurement, quantizers=(item, item))
    found = replace(found, spec=replace(found.spec, measurement=measurement))
    clock = Clock(period=0.1, substeps=1, delay=0.0, count=10, source="", covered=False)
    cases = make_cases(found, clock, seed=1, stream=0, runs=1)
    still = replace(cases, rates=lambda t, x, u, arguments, free: [0.0 * x[0] + 1.0, 0.0 * x[1]])
    result = close_loop(still, Constant(), candidates=1)
    # One second at speed 1 over levels 0.1 apart; the second state rests.
    assert result.changes[0, 0] in (9.0, 10.0)
    assert close_loop(cases_of("compressor_surge", horizon=0.01), Constant(), candidates=1)


def test_the_search_is_repeatable_and_no_method_shifts_another():
    cases = cases_of("compressor_surge", horizon=0.2)
    order, accuracy = 2, design("compressor_surge").omega[0]
    pair = (barrier(order, accuracy), funnel(order, accuracy))
    both = tune(pair, cases, seed=4, budget=12)
    assert both == tune(pair, cases, seed=4, budget=12)
    assert both[1:] == tune(pair[1:], cases, seed=4, budget=12)
    assert both != tune(pair, cases, seed=5, budget=12)
    for method, found in zip(pair, both, strict=True):
        assert found.tried == 12
        for item in method.tunables:
            assert item.lower * 0.999999 <= found.gains[item.name] <= item.upper * 1.000001


@pytest.mark.parametrize("budget", [1, 2, 3, 8])
def test_a_larger_budget_is_never_worse_than_its_first_half(budget):
    cases = cases_of("compressor_surge", horizon=0.2)
    method = barrier(2, 0.05)
    (found,) = tune((method,), cases, seed=1, budget=budget)
    result = run_laws(cases, [law_of(method, cases, found.point)])
    assert float(result.share[0]) == found.share
    if found.share:
        assert float(result.peak.max()) == pytest.approx(found.peak)


def test_operations_grow_linearly_but_for_backstepping():
    rows = family_costs(design("compressor_surge").plant)
    assert [row.order for row in rows] == [1, 2, 3, 4, 5]
    for key in ("bfppc", "ln-barrier", "bechlioulis-rovithakis"):
        counts = [row.operations[key] for row in rows]
        assert len({b - a for a, b in pairwise(counts)}) == 1
    exact = [row.operations["backstepping"] for row in rows]
    assert all(b > 2 * a for a, b in pairwise(exact[1:]))
    assert all(row.expanded >= row.operations["backstepping"] for row in rows[1:])


def test_sets_of_gains_do_not_disturb_each_other():
    found = cases_of("paper_example_1", horizon=0.1, runs=4)
    method = barrier(2, 0.15)
    wide = np.array([[1.4, 180.0, 11.0], [0.5, 50.0, 5.0]])
    both = run_laws(found, [law_of(method, found, wide)])
    alone = [run_laws(found, [law_of(method, found, row[None, :])]) for row in wide]
    for j, single in enumerate(alone):
        assert (both.peak[:, j] == single.peak[:, 0]).all()
        assert (both.worst[:, j] == single.worst[:, 0]).all()
