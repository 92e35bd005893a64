import pytest
import sympy as sp

from bfppc_synth.errors import PlantFileError
from bfppc_synth.expressions.symbolic import TIME, build_plant
from bfppc_synth.spec.load import load_spec

TEXT = """\
name: plant
states: [x1, x2, x3]
parameters: {a: [1, 2], b: pi/2}
dynamics:
  x1: {f: a*x1**2, g: 1 + x1**2, disturbance: 0.1}
  x2: {f_bound: b*abs(x2), g_bound: 3, g_min: 1}
  x3: {f: 0}
reference: b_sin
initial: {x1: 1, x2: 0, x3: 0}
performance: {accuracy: 0.15}
"""


@pytest.fixture
def plant(tmp_path):
    def run(reference, old="", new=""):
        path = tmp_path / "plant.yaml"
        text = TEXT.replace("b_sin", reference)
        path.write_text(text.replace(old, new) if old else text, encoding="utf-8")
        return build_plant(load_spec(path))

    return run


def test_the_plant_has_real_symbols_and_the_defaults_of_the_contract(plant):
    built = plant("sin(2*t)")
    x1, x2, _ = built.states
    a, b = built.parameters
    assert built.order == 3
    assert all(symbol.is_real for symbol in (*built.states, *built.parameters, built.time))
    assert built.time == TIME == sp.Symbol("t", real=True)
    assert built.ranges == ((1, 2), (sp.pi / 2, sp.pi / 2))
    first, second, third = built.channels
    assert (first.f, first.g, first.disturbance) == (a * x1**2, 1 + x1**2, sp.Rational(1, 10))
    assert (second.f, second.f_bound, second.g) == (None, b * sp.Abs(x2), None)
    assert (second.g_bound, second.g_min, second.disturbance) == (3, 1, 0)
    assert (third.f, third.g, third.g_min) == (0, 1, None)
    assert built.reference == sp.sin(2 * TIME)


def test_a_declared_reference_keeps_its_expression_and_a_run_time_one_has_none(plant):
    assert plant("{value: cos(t), bound: 1, rate: 1}").reference == sp.cos(TIME)
    assert plant("{bounds: [1, 1]}").reference is None


def test_a_pole_that_only_algebra_finds_has_its_place(plant):
    with pytest.raises(PlantFileError) as caught:
        plant("0", "f: a*x1**2", "f: a/(x1 - x1)")
    (mistake,) = caught.value.mistakes
    assert (mistake.path, mistake.line, mistake.column) == ("dynamics.x1.f", 5, 11)
    assert "no finite real value" in mistake.message
