"""What a file asks for, and how less of it is written back."""

import pytest

from bfppc_synth.reasons.requirements import requirements_of
from bfppc_synth.spec.edits import Edit, changed
from bfppc_synth.spec.load import load_spec

TEXT = """name: plant
states: [x1, x2]
parameters: {{m: [0.9, 1.1]}}
dynamics:
  x1: {{f: x1, disturbance: 0.1*m}}
  x2: {{f: m*x2, disturbance: 0.2}}
initial: {{x1: [-0.123, 0.4], x2: 0.5}}
performance: {{accuracy: 0.1{performance}}}
{more}
synthesis: {{{synthesis}}}
"""


@pytest.fixture
def spec_of(tmp_path):
    def make(more="", performance="", synthesis="center: performance"):
        path = tmp_path / "plant.yaml"
        text = TEXT.format(more=more, performance=performance, synthesis=synthesis)
        path.write_text(text, encoding="utf-8")
        return load_spec(path)

    return make


def edits_of(spec, path, factor):
    found = [one for one in requirements_of(spec) if one.path == path]
    assert found, [one.path for one in requirements_of(spec)]
    edits = found[0].change(factor)
    changed(spec, edits)
    return {edit.path: edit.text for edit in edits}


def test_a_larger_value_is_rounded_up_and_a_smaller_one_down(spec_of):
    spec = spec_of("sampling: {period: 0.001}")
    assert edits_of(spec, "performance.accuracy", 1.23456) == {"performance.accuracy": "0.124"}
    assert edits_of(spec, "sampling.period", 0.98765) == {"sampling.period": "0.000987"}


def test_a_box_is_narrowed_around_its_middle_and_rounded_inwards(spec_of):
    assert edits_of(spec_of(), "initial", 0.5) == {"initial.x1": "[0.00775, 0.2692]"}


def test_a_box_that_vanishes_is_its_middle(spec_of):
    assert edits_of(spec_of(), "initial", 0.0) == {"initial.x1": "0.1385"}


def test_disturbances_shrink_together_as_numbers_and_as_expressions(spec_of):
    assert edits_of(spec_of(), "dynamics.*.disturbance", 0.5) == {
        "dynamics.x1.disturbance": '"0.5*(0.1*m)"',
        "dynamics.x2.disturbance": "0.1",
    }


def test_a_range_of_a_parameter_is_narrowed_around_its_middle(spec_of):
    assert edits_of(spec_of(), "parameters.m", 0.5) == {"parameters.m": "[0.95, 1.05]"}


def test_a_default_rho_is_written_out_whole(spec_of):
    edits = edits_of(spec_of(), "performance.rho", 2.0)
    assert edits == {"performance.rho": "{kind: cosine, t_s: 2}"}


def test_an_exponential_rho_gets_a_smaller_rate(spec_of):
    spec = spec_of(performance=", rho: {kind: exponential, rate: 3}")
    assert edits_of(spec, "performance.rho.rate", 2.0) == {"performance.rho.rate": "1.5"}


def test_a_rho_per_state_is_slowed_by_one_factor(spec_of):
    rho = "{kind: cosine, t_s: 1}, {kind: exponential, rate: 3}"
    spec = spec_of(performance=f", rho: [{rho}]")
    edits = edits_of(spec, "performance.rho", 2.0)
    assert edits == {"performance.rho.x1.t_s": "2", "performance.rho.x2.rate": "1.5"}


def test_a_hysteresis_never_exceeds_half_its_rounded_step(spec_of):
    quantizer = "{kind: hysteresis-uniform, step: 0.01, hysteresis: 0.005}"
    spec = spec_of(f"measurement: {{quantizer: {quantizer}}}")
    for factor in (0.9, 0.777, 0.3333, 0.01237):
        edits = edits_of(spec, "measurement.quantizer", factor)
        half = float(edits["measurement.quantizer.step"]) / 2
        assert float(edits["measurement.quantizer.hysteresis"]) <= half


def test_quantizers_per_state_shrink_together_but_none_stays_none(spec_of):
    quantizers = "{x1: {kind: uniform, step: 0.01}, x2: {kind: none}}"
    spec = spec_of(f"measurement: {{quantizer: {quantizers}}}")
    edits = edits_of(spec, "measurement.quantizer.x1.step", 0.5)
    assert edits == {"measurement.quantizer.x1.step": "0.005"}


def test_noise_per_state_in_a_list_is_edited_by_state(spec_of):
    spec = spec_of("measurement: {noise: [0.01, 0]}")
    assert edits_of(spec, "measurement.noise.x1", 0.5) == {"measurement.noise.x1": "0.005"}
    again = changed(spec, (Edit(path="measurement.noise.x1", text="0.005"),))
    assert [noise.text for noise in again.measurement.noise] == ["0.005", "0"]


def test_what_the_file_does_not_ask_is_no_requirement(spec_of):
    paths = {one.path for one in requirements_of(spec_of())}
    absent = ("sampling.period", "sampling.delay", "measurement.noise", "performance.transition")
    assert paths.isdisjoint(absent)


def test_starts_move_to_where_the_reference_starts(spec_of):
    (towards,) = [one for one in requirements_of(spec_of(), 0.2) if one.path == "initial"][1:]
    edits = {edit.path: edit.text for edit in towards.change(0.0)}
    assert edits == {"initial.x1": "0.2", "initial.x2": "0"}
