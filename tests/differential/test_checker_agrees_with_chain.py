"""The checker's own chain against bounds/chain.py, on plants that use every part of the theory."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from bfppc_synth.bounds.chain import chain_input, evaluate_chain
from bfppc_synth.bounds.numbers import FloatNumbers
from bfppc_synth.bounds.residual import float_residual
from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import judge, produce_certificate
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.shapes import Shape
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.prepare import prepare
from bfppc_synth.synthesis.synthesize import restore

ROOT = Path(__file__).resolve().parents[2]
# The chain's suprema over time and over the tube are found to about 1e-9.
TOLERANCE = 1e-7

PLANTS = {
    "tracking": """\
name: tracking
parameters: {a: 0.5, d: [0.9, 1.1]}
states: [x1, x2]
dynamics:
  x1:
    f: x1 + x1*exp(-a*x1)
    g: 1 + sin(x1**2)
    f_bound: Abs(x1) + Abs(x1)*exp(a*Abs(x1))
    g_bound: 2
    g_min: 1
  x2: {f: d*x1*sin(x2) + x1*x2**2, g: 3 + cos(x1), disturbance: 0.1}
reference: sin(t)
initial: {x1: 0.5, x2: [-0.1, 0.1]}
performance: {accuracy: 0.05}
measurement: {quantizer: {kind: uniform, step: 0.0001}, noise: [0, 0.00001]}
sampling: {period: 0.000001, delay: 0.0000001}
actuator: {error: 0.5}
synthesis: {center: performance}
""",
    "three": """\
name: three
parameters: {b: 100/7, m: [1.5, 2]}
states: [x1, x2, x3]
dynamics:
  x1: {f: 0.1*abs(x1)*x1, g: b}
  x2: {f: "-x1 - tanh(x2)/m + Max(x1, x2)"}
  x3: {f: 10*(x2 - (2*x3**3 - x3)/7) + cosh(x1) + x2**(1/3), g: 2 + x3/1000}
reference: 0.5*sin(2*t) + 0.1*exp(-t)
initial: {x1: 0.1, x2: [0.1, 0.2], x3: 0.1}
performance:
  accuracy: 0.1
  rho:
    x1: {kind: exponential, rate: 2, floor: 0.1}
    x2: {kind: cosine, t_s: 0.5}
    x3: {kind: exponential, rate: pi/6}
measurement:
  quantizer: {kind: logarithmic-uniform, minimum: 1e-5, density: 0.1, threshold: 1e-4, step: 1e-5}
synthesis: {center: performance, anchor: exact}
""",
    "supplied": """\
name: supplied
states: [x1, x2]
dynamics:
  x1: {f_bound: 1 + x1**2, g_min: 0.5, g_bound: 2 + abs(x1)}
  x2: {f: x1*x2 + sqrt(4 + x1*x2/1000)}
reference: {bounds: [1, 2]}
initial: {x1: [-0.2, 0.2], x2: 0, offset: 0.5}
performance: {accuracy: 0.2}
measurement:
  quantizer: [{kind: hysteresis-uniform, step: 0.001, hysteresis: 0.0002}, {kind: none}]
synthesis: {center: performance}
""",
}
SHAPES = {
    "tracking": ((2.0, 13.4, 0.5, 0.1, 3), (8000.0, 0.0, 1.0, 0.0, 3)),
    "three": ((3.0, 1.0, 0.3, 0.5, 3), (200.0, 0.0, 1.0, 0.2, 5), (9000.0, 10.0, 2.0, 0.0, 3)),
    "supplied": ((0.0, 12.0, 2.0, 0.0, 3), (500.0, 0.0, 1.0, 0.0, 3)),
}
HALF_WIDTHS = {"tracking": (0.05, 2.0), "three": (0.1, 2.0, 50.0), "supplied": (0.2, 3.0)}


def compare(path: Path, shapes: tuple[Shape, ...], half_widths: tuple[float, ...]) -> int:
    spec = load_spec(path)
    problem, _ = prepare(spec)
    numbers = FloatNumbers()
    generic = tuple(shape.generic for shape in shapes)
    start = chain_input(generic, half_widths, problem.center, problem.conditions, numbers)
    residual = float_residual(problem.plant, problem.majorants, problem.center)
    bounds = evaluate_chain(start, residual, numbers, problem.theorem.rules)
    gains = [(s.k, s.M, s.epsilon, s.c, s.N) for s in shapes]
    found = checker.derive(json.loads(plant_json(spec)), gains, half_widths).enclosures
    compared, steepest = 0, math.prod(max(1.0, slope) for slope in bounds.L)
    names = ("X", "xi", "A", "L", "W", "D", "G", "g_min", "F_star", "eta", "Lambda")
    for name in names:
        for state, value in zip(spec.states, getattr(bounds, name), strict=True):
            inside(value, found[f"{name}[{state}]"], f"{name}[{state}]", steepest)
            compared += 1
    for name in ("B", "s"):
        for state, value in zip(spec.states[:-1], getattr(bounds, name)[:-1], strict=True):
            inside(value, found[f"{name}[{state}]"], f"{name}[{state}]", steepest)
            compared += 1
    for name in ("U", "V", "zeta"):
        inside(getattr(bounds, name), found[name], name, steepest)
        compared += 1
    return compared


def inside(value: float, enclosure: checker.Interval, name: str, steepest: float) -> None:
    lower, upper = checker.to_doubles(enclosure)
    room = TOLERANCE * abs(value) + 1e-12
    assert lower - room <= value <= upper + room, (name, value, lower, upper)
    # The upper ends of what follows from eta contain the rounding of the controller as well,
    # 1e-10 in the first error and as much more as the slopes of phi magnify it.
    rounded = name[:2] in ("et", "La", "U", "V", "ze")
    share, least = (1e-3, 1e-9 * steepest) if rounded else (10 * TOLERANCE, 1e-9)
    assert upper - lower <= share * abs(value) + least, (name, value, lower, upper)


@pytest.mark.parametrize("name", sorted(PLANTS))
def test_the_two_chains_agree_within_the_enclosures(name: str, tmp_path: Path) -> None:
    path = tmp_path / f"{name}.yaml"
    path.write_text(PLANTS[name])
    shapes = tuple(Shape(k=k, M=M, epsilon=e, c=c, N=N) for k, M, e, c, N in SHAPES[name])
    assert compare(path, shapes, HALF_WIDTHS[name]) > 20


FOLDERS = sorted(path.parent for path in (ROOT / "generated").glob("*/certificate.json"))
# The other methods and centers have chains of their own, and files of their own beside this one.
PLAIN = [
    folder
    for folder in FOLDERS
    if json.loads((folder / "certificate.json").read_text())["design"].keys()
    == {"p", "gains", "U_MAX"}
]


def test_every_generated_folder_is_proved_and_its_two_chains_agree() -> None:
    for folder in FOLDERS:
        assert checker.verify_folder(folder).verdict == "proved", folder.name
    for folder in PLAIN:
        design = restore(folder)
        assert compare(folder / "plant.yaml", design.gains, design.omega) > 10


def test_every_generated_design_with_half_its_gains_is_refused() -> None:
    assert len(PLAIN) > 5
    for folder in PLAIN:
        design = restore(folder)
        weak = tuple(
            Shape(k=s.k / 2, M=s.M / 2, epsilon=s.epsilon, c=s.c / 2, N=s.N) for s in design.gains
        )
        plant = json.loads((folder / "plant.json").read_text())
        plant["plant"].get("synthesis", {}).pop("gains", None)
        answer = judge(plant, produce_certificate(plant, weak, design.omega, tool="test"))
        assert answer.verdict is not Verdict.CERTIFIED, folder.name
