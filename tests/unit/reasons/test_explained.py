"""What is said where no design exists."""

import math
import re

import pytest

from bfppc_synth.errors import NoDesignError
from bfppc_synth.reasons.explain import synthesize
from bfppc_synth.spec.load import load_spec

TEXT = """name: plant
states: [x1]
dynamics: {{x1: {{f: x1}}}}
initial: {{x1: 0.5}}
performance: {{accuracy: 0.1}}
{more}
"""
# A center whose transition is not searched: quick.
AROUND = "synthesis: {center: performance}"


@pytest.fixture
def refusal_of(tmp_path):
    def make(more):
        path = tmp_path / "plant.yaml"
        path.write_text(TEXT.format(more=more))
        with pytest.raises(NoDesignError) as caught:
            synthesize(load_spec(path), patience=math.inf)
        return str(caught.value)

    return make


def test_a_period_that_is_too_long_is_answered_with_one_that_is_not(refusal_of, tmp_path):
    said = refusal_of(f"sampling: {{period: 3}}\n{AROUND}")
    found = re.search(r"sampling\.period ([0-9.e-]+)", said)
    assert found, said
    path = tmp_path / "plant.yaml"
    path.write_text(TEXT.format(more=f"sampling: {{period: {found[1]}}}\n{AROUND}"))
    synthesize(load_spec(path)).certificate.require()


def test_a_limit_that_is_too_low_is_answered_with_one_that_suffices(refusal_of, tmp_path):
    said = refusal_of(f"actuator: {{limit: 0.1}}\n{AROUND}")
    found = re.search(r"fix: actuator\.limit (\S+)", said)
    assert found, said
    path = tmp_path / "plant.yaml"
    path.write_text(TEXT.format(more=f"actuator: {{limit: {found[1]}}}\n{AROUND}"))
    synthesize(load_spec(path)).certificate.require()


def test_fixed_gains_that_leave_no_design_are_named_as_the_reason(tmp_path):
    path = tmp_path / "plant.yaml"
    more = "synthesis: {center: performance, p: {x2: 1}, gains: {x1: {k: 1, M: 0, c: 0}}}"
    text = TEXT.format(more=more).replace("[x1]", "[x1, x2]").replace("x1: 0.5", "x1: 0.5, x2: 0")
    path.write_text(text.replace("{f: x1}", "{f: x1}, x2: {f: 0}"))
    with pytest.raises(NoDesignError, match="the gains or p that synthesis fixes leave none"):
        synthesize(load_spec(path))


def test_the_details_say_what_binds_what_drives_it_and_what_to_change(tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(TEXT.format(more=f"actuator: {{limit: 0.1}}\n{AROUND}"))
    with pytest.raises(NoDesignError) as caught:
        synthesize(load_spec(path), patience=math.inf)
    details = caught.value.details
    assert details["binding"]["requirement"] == "actuator.limit"
    assert details["drivers"][0]["share"] > 0.0
    raised = next(one for one in details["suggestions"] if one["path"] == "actuator.limit")
    assert raised["given"] == "0.1"
    assert raised["U"] <= float(raised["suffices"]) <= 1.03 * raised["U"]
    assert raised["edits"] == {"actuator.limit": raised["suffices"]}


def test_no_time_leaves_everything_untried_and_says_so(tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(TEXT.format(more=f"sampling: {{period: 3}}\n{AROUND}"))
    with pytest.raises(NoDesignError) as caught:
        synthesize(load_spec(path), patience=-1.0)
    assert "performance.accuracy" in caught.value.details["untried"]
    assert "not tried, for lack of time" in str(caught.value)
