"""Objectives accuracy and resolution from the plant file to the folder, and their refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from bfppc_synth import pipeline
from bfppc_synth.errors import NoDesignError, UsageError
from bfppc_synth.model.spec import Method, Objective
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.questions import (
    largest_period,
    largest_resolution,
    smallest_accuracy,
)
from bfppc_synth.synthesis.synthesize import restore, synthesize

SMALL = (Path(__file__).parents[1] / "plants" / "small_exponential.yaml").read_text()


def asking(tmp_path: Path, objective: str, more: str) -> Path:
    path = tmp_path / "small.yaml"
    text = SMALL.replace("synthesis: {", f"synthesis: {{objective: {objective}, ")
    path.write_text(text + more)
    return path


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the folder of a file that states no accuracy, only a limit."""
    path = asking(tmp_path_factory.mktemp("plants"), "accuracy", "actuator: {limit: 20}\n")
    path.write_text(path.read_text().replace("  accuracy: 0.2\n", ""))
    folder = path.parent / "folder"
    assert pipeline.run(path, pipeline.Options(out=folder)).exit_code == 0
    return folder


def test_a_folder_is_about_the_accuracy_that_was_found(out: Path) -> None:
    report = json.loads((out / "report.json").read_text())
    found = report["chosen"]["value"]
    assert report["chosen"] == {"objective": "accuracy", "value": found}
    assert report["performance"]["accuracy"] == report["omega"]["p"][0] == found
    assert 0.0 < found < 0.2
    assert 0.97 * 20.0 < report["bounds"]["U"] <= 20.0
    assert f"p_1 = {found!r}" in (out / "controller.py").read_text()
    # plant.json stays the twin of the plant file, which states no accuracy at all.
    assert "accuracy" not in json.loads((out / "plant.json").read_text())["plant"]["performance"]
    certificate = json.loads((out / "certificate.json").read_text())
    assert certificate["design"]["chosen"] == {"objective": "accuracy", "value": found.hex()}
    assert pipeline.verify(out).exit_code == 0
    read = restore(out)
    assert read.spec.chosen is not None
    assert read.spec.chosen.value == found
    assert read.spec.chosen.objective is Objective.ACCURACY
    assert "smallest that was found" in (out / "report.html").read_text()


@pytest.mark.parametrize(
    ("objective", "more", "words"),
    [
        ("accuracy", "actuator: {limit: 0.01}\n", "no accuracy up to 0.2"),
        ("period", "actuator: {limit: 0.01}\n", "no period of at least 0.001"),
    ],
)
def test_a_limit_that_nothing_keeps_is_answered_with_one_that_suffices(
    objective: str, more: str, words: str, tmp_path: Path
) -> None:
    spec = load_spec(asking(tmp_path, objective, more))
    with pytest.raises(NoDesignError, match=words) as caught:
        synthesize(spec)
    assert "would suffice: actuator.limit" in str(caught.value)
    assert "fix: raise actuator.limit" in str(caught.value)


def test_a_question_without_its_subject_is_refused(tmp_path: Path) -> None:
    spec = load_spec(asking(tmp_path, "peak-input", ""))
    with pytest.raises(UsageError, match=r"accuracy needs actuator\.limit"):
        smallest_accuracy(spec)
    with pytest.raises(UsageError, match=r"resolution needs measurement\.quantizer"):
        largest_resolution(spec)
    continuous = replace(spec, synthesis=replace(spec.synthesis, method=Method.THEOREM2))
    with pytest.raises(UsageError, match="period needs method unified"):
        largest_period(continuous)


def test_weights_trade_what_is_sought_against_the_slope(out: Path, tmp_path: Path) -> None:
    steep = json.loads((out / "report.json").read_text())
    weights = "{accuracy: 1, slope: 0.5}"
    flat = synthesize(load_spec(asking(tmp_path, weights, "actuator: {limit: 20}\n")))
    flat.certificate.require()
    assert flat.bounds.U <= 20.0
    assert flat.bounds.slope < 0.1 * steep["bounds"]["slope"]
    assert flat.spec.chosen is not None
    assert steep["chosen"]["value"] < flat.spec.chosen.value <= 0.2
