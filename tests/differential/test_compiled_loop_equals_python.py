"""The loop in C makes the same runs as the loop in Python: every number, every bit."""

from __future__ import annotations

import os
import struct
from collections import Counter
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest
import sympy as sp

from bfppc_synth.artifacts import generated_code
from bfppc_synth.model.arithmetic import Arithmetic, Mathematics, Real
from bfppc_synth.model.expression import Constant, Number
from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.model.spec import Anchor, QuantizerKind, QuantizerSpec, ReferenceKind
from bfppc_synth.simulation.compiled.library import Axes, CompiledLoop
from bfppc_synth.simulation.compiled.python import PythonLoop
from bfppc_synth.simulation.compiled.records import make_axis
from bfppc_synth.simulation.compiled.source import write_source
from bfppc_synth.simulation.drawing import SEGMENTS, choices, draw_run, length, plan_at
from bfppc_synth.simulation.drawn import Manner
from bfppc_synth.simulation.loop import simulate_nominal
from bfppc_synth.simulation.plant import compile_plant, modelled
from bfppc_synth.simulation.scheme import Stepping, choose_scheme
from bfppc_synth.synthesis.synthesize import restore

ROOT = Path(__file__).parents[2]
EVERY = os.environ.get("BFPPC_TESTS") == "all"


def number(value):
    exact = Fraction(str(value))
    tree = Number(value=exact)
    return Constant(text=str(value), tree=tree, exact=exact, approximate=float(value))


def altered(design, **sections):
    spec = replace(
        design.spec,
        **{
            name: replace(getattr(design.spec, name), **fields) for name, fields in sections.items()
        },
    )
    return replace(design, spec=spec, plant=replace(design.plant, spec=spec))


def uniform(step, **more):
    return QuantizerSpec(kind=QuantizerKind.UNIFORM, step=number(step), **more)


def hysteresis(step):
    kind = QuantizerKind.HYSTERESIS_UNIFORM
    return QuantizerSpec(kind=kind, step=number(step), hysteresis=number(step / 8))


def logarithmic(step):
    return QuantizerSpec(
        kind=QuantizerKind.LOGARITHMIC_UNIFORM,
        minimum=number(0.001),
        density=number(0.01),
        threshold=number(0.1),
        step=number(step),
    )


def rough(design, *, period, delay, quantizers, noise=1e-4):
    """Everything at once that a measured, sampled, late loop can have."""
    noises = (number(noise),) * design.spec.order
    changed = altered(
        design,
        measurement={"quantizers": quantizers, "noise": noises},
        sampling={"period": number(period), "delay": number(delay)},
        actuator={"error": number(0.01)},
        simulation={"period": period / 2},
    )
    return replace(changed, largest_certified_period=1.0)


def supplied(design):
    """The same law with a reference that is supplied at run time."""
    values = (number(0.5), number(0.5), number(0.5), number(0.5), number(0.5))
    count = design.spec.order + 2 if design.nominal is not None else 2
    changed = altered(
        design,
        reference={
            "kind": ReferenceKind.RUNTIME,
            "expression": None,
            "bounds": values[:count],
        },
    )
    return replace(changed, plant=replace(changed.plant, reference=None))


def folder(name):
    return restore(ROOT / "generated" / name)


def with_funnel(design):
    t = design.plant.time
    edge = sp.Rational(1, 5) + sp.Rational(9, 10) * sp.exp(-t / 2)
    return replace(design, plant=replace(design.plant, funnel=edge))


def scheduled(design):
    """H(rho) instead of a constant."""
    gains = tuple(
        replace(gain, H=(*gain.H, 0.25, 0.125)) if isinstance(gain, Theorem1Gain) else gain
        for gain in design.gains
    )
    assert gains != design.gains
    return replace(design, gains=gains)


CASES = {
    "implicit, stages": lambda: folder("switching_example_2"),
    "nominal, late, quantized": lambda: rough(
        folder("motor_arm_nominal"),
        period=1e-4,
        delay=2.5e-4,
        quantizers=(uniform(1e-4), hysteresis(1e-3), logarithmic(1e-3)),
    ),
    "nominal, implicit, reference at run time": lambda: supplied(
        altered(
            folder("motor_arm_nominal"),
            measurement={"quantizers": (QuantizerSpec(kind=QuantizerKind.NONE),) * 3},
            sampling={"period": number(0)},
        )
    ),
    "late, quantized, uncertain gain": lambda: rough(
        folder("van_der_pol"),
        period=5e-4,
        delay=7e-4,
        quantizers=(uniform(1e-3, dead_zone=number(2e-3)), hysteresis(1e-3)),
    ),
    "funnel": lambda: with_funnel(folder("paper_example_2")),
}
MORE = {
    "theorem1": lambda: folder("theorem1_example_1"),
    "implicit": lambda: folder("paper_example_1"),
    "stages, sampled": lambda: rough(
        folder("switching_example_2"), period=2e-5, delay=0, quantizers=(logarithmic(1e-4),) * 2
    ),
    "reference at run time": lambda: supplied(folder("paper_example_2")),
    "nominal, sampled": lambda: folder("motor_arm_nominal"),
    "cart": lambda: folder("cart_pendulum"),
    "compressor": lambda: folder("compressor_surge"),
    "motor arm": lambda: folder("motor_arm"),
    "van der Pol": lambda: folder("van_der_pol"),
    "scheduled": lambda: scheduled(folder("theorem1_example_1")),
    "exact anchor": lambda: altered(
        rough(folder("paper_example_2"), period=1e-4, delay=0, quantizers=(uniform(1e-3),) * 2),
        synthesis={"anchor": Anchor.EXACT},
    ),
    # With the platform's tanhf a controller.py of binary32 differs from its C in last digits.
    "binary32, portable": lambda: replace(
        folder("compressor_surge"),
        arithmetic=Arithmetic(real=Real.FLOAT, mathematics=Mathematics.PORTABLE),
    ),
    "nominal, implicit": lambda: altered(
        folder("motor_arm_nominal"),
        measurement={"quantizers": (QuantizerSpec(kind=QuantizerKind.NONE),) * 3},
        sampling={"period": number(0)},
    ),
}
ALL = CASES | (MORE if EVERY else {})


class Pair:
    """One design's two loops, its axes and the draws that both play."""

    def __init__(self, design, *, steps=160, count=10):
        self.design = design
        name, code = design.spec.name, generated_code(design)
        source = write_source(design, code[f"c/include/{name}.h"], code[f"c/src/{name}.c"])
        self.compiled = CompiledLoop(source, funnel=design.plant.funnel is not None)
        scheme = choose_scheme(design)
        self.python = PythonLoop(design, code["controller.py"], scheme)
        self.scheme = scheme
        horizon = steps * scheme.step
        sampled = scheme.stepping is Stepping.SAMPLED
        finer = scheme.finer(3) if sampled else scheme
        self.axes = Axes(
            regular=make_axis(design, scheme, horizon),
            jittered=make_axis(design, finer, horizon),
        )
        plant = design.plant if design.nominal is None else modelled(design.plant)
        self.choices = choices(design, compile_plant(plant), scheme, horizon)
        self.draws = [draw_run(self.choices, 7, k)[1] for k in range(count)]
        # A plan with switches, as searches use it, and one run of each kind that is irregular.
        place = [(-1.0) ** i * i / 100.0 for i in range(length(self.choices, SEGMENTS))]
        plan = plan_at(self.choices, place, SEGMENTS)
        self.draws.append(replace(self.draws[0], manner=Manner.PLAN, plan=plan))
        if sampled:
            kinds = {draw.manner: draw for draw in self.draws}
            self.draws += [replace(draw, jitter=True, late=False) for draw in kinds.values()]


@pytest.fixture(scope="module", params=[*ALL])
def pair(request):
    return Pair(ALL[request.param]())


def bits(values):
    return [struct.pack("<d", value) for value in values]


def test_every_run_is_the_same_run(pair):
    one, other = pair.compiled.run(pair.draws, pair.axes), pair.python.run(pair.draws, pair.axes)
    assert one == other
    for a, b in zip(one, other, strict=True):
        assert bits([a.peak_u, *(e for _, row in a.peaks for e in row)]) == bits(
            [b.peak_u, *(e for _, row in b.peaks for e in row)]
        )
    assert all(run.rows > 1 for run in one)
    manners = Counter(draw.manner for draw in pair.draws)
    assert set(manners) == set(Manner)


def test_every_row_is_the_same_row(pair):
    for draw in (pair.draws[0], pair.draws[-1]):
        one, rows = pair.compiled.trace(draw, pair.axes, stride=1)
        other, expected = pair.python.trace(draw, pair.axes, stride=1)
        assert one == other
        assert rows.shape == expected.shape
        assert (rows == expected).all()


def test_the_nominal_run_has_the_states_of_the_arrays(pair):
    design, n = pair.design, pair.design.spec.order
    draw = nominal_draw(pair)
    if pair.scheme.stepping is Stepping.IMPLICIT and design.nominal is not None:
        # There the center's own motion enters the step, and arrays round it their own way.
        tolerance = 1e-9
    else:
        tolerance = 0.0
    # Nothing is late in a nominal run.
    punctual = replace(pair.axes, regular=replace(pair.axes.regular, delay=0.0))
    _, rows = pair.compiled.trace(draw, punctual, stride=1)
    horizon = pair.choices.horizon
    found = simulate_nominal(design, pair.python._controller, horizon=horizon, start=draw.start)
    assert len(found.t) == len(rows)
    assert abs(rows[:, 1 : 1 + n] - found.x).max() <= tolerance
    assert abs(rows[:, 1 + n : 1 + 2 * n] - found.q).max() <= tolerance
    scale = max(1.0, abs(found.u).max())
    assert abs(rows[:, 1 + 4 * n] - found.u).max() <= 1e4 * tolerance * scale
    assert tuple(rows[:, 3 + 4 * n].astype(int)) == found.status
    # tanh is the only function that arrays round otherwise.
    assert abs(rows[:, 1 + 2 * n : 1 + 3 * n] - found.e).max() <= 1e-9


def nominal_draw(pair):
    """The nominal run as a plan: midpoints, nothing else."""
    from bfppc_synth.simulation.drawn import Segment
    from bfppc_synth.simulation.nominal import Nominal

    plant = pair.design.plant if pair.design.nominal is None else modelled(pair.design.plant)
    dynamics = compile_plant(plant)
    nature = Nominal(pair.design, dynamics, None)
    quiet = (0.0,) * pair.design.spec.order
    segment = Segment(until=1e9, arguments=dynamics.nominal, noise=quiet, error=0.0)
    wave = None if dynamics.reference is not None else nature.y_d
    return replace(
        pair.draws[0],
        manner=Manner.PLAN,
        start=nature.start,
        wave=wave,
        bounded=False,
        late=True,
        jitter=False,
        plan=(segment,),
    )
