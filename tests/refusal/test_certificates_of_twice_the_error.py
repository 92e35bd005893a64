"""The gains of every nominal plant are refused for a model error of twice the declared range."""

from __future__ import annotations

import json
import os
from decimal import Decimal
from pathlib import Path

import pytest

from bfppc_synth.certificate import checker
from bfppc_synth.certificate.produce import produce_certificate
from bfppc_synth.spec.canonical import plant_json
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

ROOT = Path(__file__).parents[2]
PLANTS = {
    path.stem: path
    for folder in ("tests/plants", "examples")
    for path in sorted((ROOT / folder).glob("*.yaml"))
    if "nominal" in path.stem
}
# The plants whose model is known: twice no error is no error.
KNOWN = {"nominal_levitation"}
UNCERTAIN = sorted(set(PLANTS) - KNOWN)
SAMPLE = ["nominal_chain_of_four"]
EVERY = os.environ.get("BFPPC_TESTS") == "all"


def stretched(plant, factor):
    """Every range of a parameter and every disturbance, ``factor`` times as wide."""
    document = json.loads(json.dumps(plant))
    inner = document["plant"]
    for name, value in inner.get("parameters", {}).items():
        if isinstance(value, list):
            low, high = map(Decimal, value)
            middle, half = (low + high) / 2, (high - low) / 2 * factor
            inner["parameters"][name] = [str(middle - half), str(middle + half)]
    for channel in inner["dynamics"].values():
        if channel.get("disturbance", "0") != "0":
            channel["disturbance"] = f"{factor}*({channel['disturbance']})"
    return document


def answer(plant, design):
    made = produce_certificate(
        plant, design.gains, design.omega, tool="test", transition=design.nominal.transition
    )
    return checker.check_documents(plant, made)


@pytest.fixture(scope="module", params=UNCERTAIN if EVERY else SAMPLE)
def certified(request):
    design = synthesize(load_spec(PLANTS[request.param]))
    return json.loads(plant_json(design.spec)), design


def test_the_gains_are_proved_for_the_declared_error(certified):
    plant, design = certified
    assert stretched(plant, 1) != stretched(plant, 2)
    report = answer(stretched(plant, 1), design)
    assert report.verdict == "proved", report.failures


def test_twice_the_declared_error_is_refused(certified):
    plant, design = certified
    report = answer(stretched(plant, 2), design)
    assert report.verdict in ("refuted", "undecided")
    assert any(line.startswith(("U1", "U2")) for line in report.failures), report.failures


def test_the_certificate_itself_says_nothing_about_twice_the_error(certified):
    plant, design = certified
    made = json.loads(design.certificate.document)
    assert checker.check_documents(plant, made).verdict == "proved"
    assert checker.check_documents(stretched(plant, 2), made).verdict != "proved"


@pytest.mark.parametrize("name", sorted(PLANTS))
def test_a_plant_has_an_error_to_double_unless_its_model_is_known(name):
    plant = json.loads(plant_json(load_spec(PLANTS[name])))
    assert (stretched(plant, 2) == plant) is (name in KNOWN)


def test_every_nominal_plant_is_tried():
    assert len(UNCERTAIN) >= 6
    assert set(SAMPLE) < set(UNCERTAIN)
