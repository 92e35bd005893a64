"""What no design could mend is refused where the file says it."""

import pytest

from bfppc_synth.bounds.admission import misplaced_term
from bfppc_synth.errors import EnvelopeError, PlantFileError
from bfppc_synth.expressions.symbolic import build_plant
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.prepare import prepare
from bfppc_synth.synthesis.synthesize import synthesize

TEXT = """name: plant
states: [x1]
dynamics: {{x1: {{f: {f}}}}}
reference: {reference}
initial: {{x1: 0}}
performance: {{accuracy: 0.1}}
"""


@pytest.fixture
def spec_of(tmp_path):
    def make(reference="0", f="x1"):
        path = tmp_path / "plant.yaml"
        path.write_text(TEXT.format(reference=reference, f=f))
        return load_spec(path)

    return make


@pytest.mark.parametrize(
    ("bound", "rate", "refused"),
    [
        ("1", "2", []),
        ("0.99", "2", ["reference.bound"]),
        ("1", "1.99", ["reference.rate"]),
        ("0.5", "0.1", ["reference.bound", "reference.rate"]),
    ],
)
def test_a_declared_bound_that_its_value_exceeds_is_refused(spec_of, bound, rate, refused):
    spec = spec_of(f"{{value: sin(2*t), bound: {bound}, rate: {rate}}}")
    if not refused:
        prepare(spec)
        return
    with pytest.raises(PlantFileError, match="at t = ") as caught:
        prepare(spec)
    assert [mistake.path for mistake in caught.value.mistakes] == refused


def test_a_declared_bound_of_a_kink_is_held_against_both_sides(spec_of):
    prepare(spec_of('{value: "Min(t, 1)", bound: 1, rate: 1}'))
    with pytest.raises(PlantFileError, match=r"0\.9 is below \|dy_d/dt\| = 1 "):
        prepare(spec_of('{value: "Min(t, 1)", bound: 1, rate: 0.9}'))


@pytest.mark.parametrize("reference", ['"Min(t, 1)"', "t**2"])
def test_a_reference_that_is_not_enclosed_is_refused_at_its_place(spec_of, reference):
    with pytest.raises(PlantFileError, match="cannot be enclosed") as caught:
        synthesize(spec_of(reference))
    (mistake,) = caught.value.mistakes
    assert (mistake.path, mistake.line, mistake.column) == ("reference", 4, 12)
    assert mistake.fix == "give {value, bound, rate}"


def test_a_saturating_reference_is_still_certified(spec_of):
    synthesize(spec_of("t/(1 + t)")).certificate.require()


def test_a_term_without_an_envelope_is_placed_by_the_term_itself(spec_of):
    plant = build_plant(spec_of(f="x1 + sin(x1)"))
    nowhere = EnvelopeError("no such term", subexpression="erf(x1)")
    assert misplaced_term(plant, nowhere).mistakes[0].path == "dynamics"
    unbounded = EnvelopeError("dynamics.x1 has neither", subexpression="x1")
    assert misplaced_term(plant, unbounded).mistakes[0].path == "dynamics.x1"
