import hashlib
import json
from fractions import Fraction

import pytest

from bfppc_synth.model.spec import (
    Anchor,
    Form,
    Method,
    Objective,
    Place,
    QuantizerKind,
    ReferenceKind,
    RhoKind,
)
from bfppc_synth.spec.canonical import plant_document, plant_json
from bfppc_synth.spec.load import load_spec

MINIMAL = """\
name: paper_example_1            # prefix of every generated symbol
states: [x1, x2]
dynamics:                        # dx_i = f + g * x_{i+1}
  x1: {f: x1**2 - sin(x1), f_bound: x1**2 + 1}
  x2: {f: x1*x2**2}
initial: {x1: 1, x2: 0}
performance: {accuracy: 0.15}
"""

FULL = """\
name: paper_example_2
title: Uncertain second-order plant, tracking sin t
units: {x1: rad, x2: rad/s, u: V}
parameters:
  a: 0.5
  m: [0.9, 1.1]
  w: 2*pi
states: [x1, x2]
dynamics:
  x1:
    f: x1 + x1*exp(-a*x1)
    g: 1 + sin(x1**2)
    f_bound: Abs(x1) + Abs(x1)*exp(a*Abs(x1))
    g_bound: 2
    g_min: 1
    disturbance: 0.01*w
  x2: {f: "x1*sin(x2) + Max(x1, 0)*x2**2", g: 3 + cos(x1)}
reference: sin(t)
initial: {x1: 0.5, x2: [-0.1, pi/60]}
performance:
  accuracy: 0.05
  rho: {x1: {kind: cosine, t_s: 1, rate_bound: 1}, x2: {kind: exponential, rate: 2, floor: 0.1}}
  transition: 2
measurement:
  quantizer: [{kind: uniform, step: 0.001}, {kind: none}]
  noise: {x1: 0, x2: 1e-3}
sampling: {period: 0.0001, delay: 2e-5}
actuator: {limit: 20000, error: 0.1}
synthesis:
  method: unified
  form: sound
  center: performance
  bounds: termwise
  anchor: latched
  objective: {peak-input: 1, slope: 0.5}
  gains: {x1: {N: 5, M: 0, k: 3/2}}
  p: {x2: 2}
simulation: {horizon: 10, period: 0.0001, seed: 7}
"""


@pytest.fixture
def read(tmp_path):
    def run(text):
        path = tmp_path / "plant.yaml"
        path.write_bytes(text.encode())
        return load_spec(path)

    return run


def test_a_minimal_file_gets_the_defaults_of_the_contract(read):
    spec = read(MINIMAL)
    assert (spec.name, spec.title, spec.states, spec.order) == (
        "paper_example_1",
        "paper_example_1",
        ("x1", "x2"),
        2,
    )
    assert spec.dynamics[0].f_bound.text == "x1**2 + 1"
    assert spec.dynamics[1].g is None
    assert spec.reference.kind is ReferenceKind.EXPRESSION
    assert spec.reference.expression.text == "0"
    assert [(rho.kind, rho.t_s.exact) for rho in spec.performance.rho] == [(RhoKind.COSINE, 1)] * 2
    assert [item.kind for item in spec.measurement.quantizers] == [QuantizerKind.NONE] * 2
    assert [item.exact for item in spec.measurement.noise] == [0, 0]
    assert (spec.sampling.period.exact, spec.sampling.delay.exact) == (0, 0)
    assert (spec.actuator.limit, spec.actuator.error.exact) == (None, 0)
    assert spec.synthesis.method is Method.UNIFIED
    assert spec.synthesis.form is Form.SOUND
    assert spec.synthesis.anchor is Anchor.LATCHED
    assert spec.synthesis.objective == ((Objective.BALANCED, 1.0),)
    assert [gains.N for gains in spec.synthesis.gains] == [3, 3]
    assert spec.synthesis.p == (None, None)
    assert (spec.simulation.horizon, spec.simulation.period, spec.simulation.seed) == (10, 0.002, 1)
    assert spec.notes == ()


def test_every_key_of_the_contract_is_read(read):
    spec = read(FULL)
    assert spec.title == "Uncertain second-order plant, tracking sin t"
    assert spec.units == (("x1", "rad"), ("x2", "rad/s"), ("u", "V"))
    assert [item.name for item in spec.parameters] == ["a", "m", "w"]
    a, m, w = (item.range for item in spec.parameters)
    assert a.lower is a.upper
    assert (m.lower.exact, m.upper.exact) == (Fraction(9, 10), Fraction(11, 10))
    assert w.lower.exact is None
    assert w.lower.approximate == pytest.approx(6.283185307179586, abs=0)
    assert spec.dynamics[1].f.text == "x1*sin(x2) + Max(x1, 0)*x2**2"
    assert spec.initial[1].upper.text == "pi/60"
    first, second = spec.performance.rho
    assert (first.kind, first.rate_bound.exact) == (RhoKind.COSINE, 1)
    assert (second.kind, second.rate.exact, second.floor.exact) == (
        RhoKind.EXPONENTIAL,
        2,
        Fraction(1, 10),
    )
    assert [item.kind for item in spec.measurement.quantizers] == [
        QuantizerKind.UNIFORM,
        QuantizerKind.NONE,
    ]
    assert [item.exact for item in spec.measurement.noise] == [0, Fraction(1, 1000)]
    assert spec.sampling.delay.exact == Fraction(2, 100000)
    assert spec.actuator.limit.exact == 20000
    assert spec.synthesis.objective == ((Objective.PEAK_INPUT, 1.0), (Objective.SLOPE, 0.5))
    fixed = spec.synthesis.gains[0]
    assert (fixed.N, fixed.M.exact, fixed.k.exact, fixed.c) == (5, 0, Fraction(3, 2), None)
    assert spec.synthesis.p[1].exact == 2
    assert spec.simulation.seed == 7


def test_keys_that_are_read_but_not_used_are_noted(read):
    assert read(FULL).notes == (
        "performance.transition is not used with center performance",
        "performance.rho.x1.rate_bound is not used with form sound: the true bound is",
    )


def test_a_path_has_the_place_of_its_value_or_of_its_nearest_ancestor(read):
    spec = read(FULL)
    assert spec.place("dynamics.x1.g") == Place(line=12, column=8)
    assert spec.place("dynamics.x2.g_min") == spec.place("dynamics.x2")
    assert spec.place("performance.accuracy") == Place(line=21, column=13)
    assert spec.place("measurement.quantizer.x2") == Place(line=25, column=45)
    assert spec.place("nowhere") == Place(line=1, column=1)


@pytest.mark.parametrize(
    ("line", "kind", "bounds"),
    [
        ("reference: sin(t)", ReferenceKind.EXPRESSION, []),
        ("reference: {value: sin(t), bound: 1, rate: 1.5}", ReferenceKind.DECLARED, [1, 1.5]),
        ("reference: {bounds: [1, 2]}", ReferenceKind.RUNTIME, [1, 2]),
        ("reference: {bounds: [1, 2, 3, 4]}", ReferenceKind.RUNTIME, [1, 2, 3, 4]),
    ],
)
def test_a_reference_has_three_forms(read, line, kind, bounds):
    reference = read(MINIMAL + line + "\n").reference
    assert reference.kind is kind
    assert [float(item.exact) for item in reference.bounds] == bounds
    assert (reference.expression is None) is (kind is ReferenceKind.RUNTIME)


def test_a_run_time_reference_may_bound_its_offset(read):
    text = MINIMAL.replace("{x1: 1, ", "{offset: 0.5, x1: 1, ") + "reference: {bounds: [1, 2]}\n"
    assert read(text).offset.exact == Fraction(1, 2)


def test_a_state_may_be_called_like_a_key(read):
    text = MINIMAL.replace("x1", "rate").replace("x2", "offset") + "measurement: {noise: 0.01}\n"
    one = read(text + "synthesis: {p: {offset: 1}}\n")
    assert one.offset is None
    assert one.synthesis.p[1].exact == 1
    single = text.replace("0.15}", "0.15, rho: {kind: exponential, rate: 3}}")
    assert [rho.rate.exact for rho in read(single).performance.rho] == [3, 3]
    each = text.replace(
        "0.15}",
        "0.15, rho: {rate: {kind: exponential, rate: 3}, offset: {kind: cosine, t_s: 2}}}",
    )
    assert [rho.kind for rho in read(each).performance.rho] == [RhoKind.EXPONENTIAL, RhoKind.COSINE]


def test_yaml_1_2_reads_words_as_words_and_numbers_by_their_digits(read):
    spec = read(MINIMAL.replace("[x1, x2]", "[on, y]").replace("x1", "on").replace("x2", "y"))
    assert spec.states == ("on", "y")
    assert read(MINIMAL.replace("0.15", "1e-3")).performance.accuracy.exact == Fraction(1, 1000)


def test_block_scalars_quotes_and_windows_line_ends_are_read_alike(read):
    plain = read(MINIMAL)
    quoted = read(MINIMAL.replace("x1*x2**2", '"x1*x2**2"'))
    block = read(MINIMAL.replace("  x2: {f: x1*x2**2}\n", "  x2:\n    f: |\n      x1*x2**2\n"))
    windows = read(MINIMAL.replace("\n", "\r\n"))
    marked = read("\ufeff" + MINIMAL)
    for spec in (quoted, block, windows, marked):
        assert spec.dynamics == plain.dynamics
    assert windows.place("performance.accuracy") == plain.place("performance.accuracy")


def test_the_json_twin_has_sorted_keys_and_every_scalar_as_its_text(read):
    spec = read(FULL)
    text = plant_json(spec)
    twin = json.loads(text)
    assert text.endswith("}\n")
    assert text.isascii()
    assert text == json.dumps(twin, sort_keys=True, indent=2) + "\n"
    assert twin == plant_document(spec)
    assert twin["format"] == "bfppc-synth/plant/1"
    assert twin["plant_sha256"] == hashlib.sha256(FULL.encode()).hexdigest()
    plant = twin["plant"]
    assert plant["parameters"] == {"a": "0.5", "m": ["0.9", "1.1"], "w": "2*pi"}
    assert plant["initial"]["x2"] == ["-0.1", "pi/60"]
    assert plant["measurement"]["noise"]["x2"] == "1e-3"


def test_a_list_per_state_becomes_a_mapping_by_state_in_the_twin(read):
    quantizer = plant_document(read(FULL))["plant"]["measurement"]["quantizer"]
    assert quantizer == {"x1": {"kind": "uniform", "step": "0.001"}, "x2": {"kind": "none"}}


def test_only_what_the_user_wrote_stands_in_the_twin(read):
    plant = plant_document(read(MINIMAL))["plant"]
    assert sorted(plant) == ["dynamics", "initial", "name", "performance", "states"]
    assert plant["performance"] == {"accuracy": "0.15"}


@pytest.mark.parametrize(
    ("lines", "horizon", "period"),
    [
        ("", 10.0, 0.002),
        ("simulation: {horizon: 5}", 5.0, 0.001),
        ("sampling: {period: 0.001}", 10.0, 0.001),
        ("sampling: {period: 1e-4}", 4.0, 1e-4),
        ("sampling: {period: 5e-5}", 40_000 * 5e-5, 5e-5),
        ("sampling: {period: 1e-6}", 40_000 * 1e-6, 1e-6),
        ("sampling: {period: 1e-4}\nsimulation: {horizon: 8}", 8.0, 1e-4),
        ("measurement: {quantizer: {kind: uniform, step: 0.01}}", 10.0, 0.0005),
        ("simulation: {horizon: 3, period: 0.01}", 3.0, 0.01),
    ],
)
def test_a_simulation_without_numbers_takes_some_ten_thousand_steps(read, lines, horizon, period):
    simulation = read(MINIMAL + lines + "\n").simulation
    assert (simulation.horizon, simulation.period) == (horizon, period)
