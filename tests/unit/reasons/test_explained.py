"""What is said where no design exists."""

import re

import pytest

from bfppc_synth.errors import NoDesignError
from bfppc_synth.spec.load import load_spec
from bfppc_synth.reasons.explain import synthesize

TEXT = """name: plant
states: [x1]
dynamics: {{x1: {{f: x1}}}}
initial: {{x1: 0.5}}
performance: {{accuracy: 0.1}}
{more}
"""


@pytest.fixture
def refusal_of(tmp_path):
    def make(more):
        path = tmp_path / "plant.yaml"
        path.write_text(TEXT.format(more=more))
        with pytest.raises(NoDesignError) as caught:
            synthesize(load_spec(path))
        return str(caught.value)

    return make


def test_a_period_that_is_too_long_is_answered_with_one_that_is_not(refusal_of, tmp_path):
    said = refusal_of("sampling: {period: 3}")
    found = re.search(r"sampling\.period ([0-9.e-]+)", said)
    assert found, said
    path = tmp_path / "plant.yaml"
    path.write_text(TEXT.format(more=f"sampling: {{period: {found[1]}}}"))
    synthesize(load_spec(path)).certificate.require()


def test_a_limit_that_is_too_low_is_answered_with_one_that_suffices(refusal_of, tmp_path):
    said = refusal_of("actuator: {limit: 0.1}")
    found = re.search(r"fix: actuator\.limit (\S+)", said)
    assert found, said
    path = tmp_path / "plant.yaml"
    path.write_text(TEXT.format(more=f"actuator: {{limit: {found[1]}}}"))
    synthesize(load_spec(path)).certificate.require()


def test_fixed_gains_that_leave_no_design_are_named_as_the_reason(tmp_path):
    path = tmp_path / "plant.yaml"
    more = "synthesis: {p: {x2: 1}, gains: {x1: {k: 1, M: 0, c: 0}}}"
    text = TEXT.format(more=more).replace("[x1]", "[x1, x2]").replace("x1: 0.5", "x1: 0.5, x2: 0")
    path.write_text(text.replace("{f: x1}", "{f: x1}, x2: {f: 0}"))
    with pytest.raises(NoDesignError, match="the gains or p that synthesis fixes leave none"):
        synthesize(load_spec(path))
