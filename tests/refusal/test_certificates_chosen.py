"""Certificates of inverse objectives with another value than the one that was proved."""

from __future__ import annotations

import copy
import hashlib
import json
import shutil
from pathlib import Path

import pytest

from bfppc_synth import pipeline
from bfppc_synth.certificate import checker
from bfppc_synth.spec.canonical import plant_document
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

SMALL = (Path(__file__).parents[1] / "plants" / "small_exponential.yaml").read_text()
QUANTIZED = "measurement: {quantizer: {kind: uniform, step: 0.004}}\n"


def asking(word: str) -> str:
    """Ask the small plant for one requirement, with a limit that its design at 1 ms keeps."""
    text = SMALL.replace("synthesis: {", f"synthesis: {{objective: {word}, ")
    text += f"actuator: {{limit: {4 if word == 'period' else 40}}}\n"
    return text + (QUANTIZED if word == "resolution" else "")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make the folder of objective period."""
    path = tmp_path_factory.mktemp("plants") / "small.yaml"
    path.write_text(asking("period"))
    out = path.parent / "small"
    assert pipeline.run(path, pipeline.Options(out=out)).exit_code == 0
    return out


@pytest.fixture(scope="module")
def proved(tmp_path_factory: pytest.TempPathFactory, folder: Path) -> dict[str, tuple[dict, dict]]:
    """Plant and certificate of each objective."""
    read = [json.loads((folder / f"{name}.json").read_text()) for name in ("plant", "certificate")]
    found = {"period": (read[0], read[1])}
    for word in ("accuracy", "resolution"):
        path = tmp_path_factory.mktemp("plants") / f"{word}.yaml"
        path.write_text(asking(word))
        design = synthesize(load_spec(path))
        certificate = json.loads(design.certificate.document)
        found[word] = (plant_document(design.spec), certificate)
    return found


def spoiled(pair: tuple[dict, dict], change: dict[str, str] | None) -> checker.Report:
    plant, certificate = copy.deepcopy(pair)
    if change is None:
        del certificate["design"]["chosen"]
    else:
        certificate["design"]["chosen"] |= change
    return checker.check_documents(plant, certificate)


@pytest.mark.parametrize("word", ["accuracy", "period", "resolution"])
def test_the_value_that_was_found_is_proved(
    proved: dict[str, tuple[dict, dict]], word: str
) -> None:
    assert spoiled(proved[word], {}).verdict == "proved"


@pytest.mark.parametrize(
    ("word", "factor"), [("accuracy", 0.999), ("period", 1.1), ("resolution", 1.5)]
)
def test_a_better_value_than_the_proved_one_is_refused(
    proved: dict[str, tuple[dict, dict]], word: str, factor: float
) -> None:
    value = float.fromhex(proved[word][1]["design"]["chosen"]["value"])
    report = spoiled(proved[word], {"value": (factor * value).hex()})
    assert report.verdict in ("refuted", "undecided")


@pytest.mark.parametrize("word", ["accuracy", "period", "resolution"])
def test_a_value_is_needed_where_the_objective_leaves_it_open(
    proved: dict[str, tuple[dict, dict]], word: str
) -> None:
    report = spoiled(proved[word], None)
    assert report.verdict == "malformed"
    assert "not what the objective of the file leaves open" in report.failures[0]


@pytest.mark.parametrize("word", ["accuracy", "period", "resolution"])
@pytest.mark.parametrize("other", ["accuracy", "period", "resolution", "peak-input", "delay"])
def test_a_value_of_another_requirement_is_refused(
    proved: dict[str, tuple[dict, dict]], word: str, other: str
) -> None:
    report = spoiled(proved[word], {"objective": other})
    assert report.verdict == ("proved" if other == word else "malformed")


@pytest.mark.parametrize("word", ["accuracy", "period", "resolution"])
@pytest.mark.parametrize("value", ["0x0.0p+0", "-0x1.0p-3", "nan", "inf", "0.1", "", 1])
def test_a_value_that_is_no_positive_number_is_refused(
    proved: dict[str, tuple[dict, dict]], word: str, value: object
) -> None:
    report = spoiled(proved[word], {"value": value})  # type: ignore[dict-item]
    assert report.verdict == "malformed"


@pytest.mark.parametrize(("word", "value"), [("accuracy", 0.2000001), ("period", 0.000999)])
def test_a_value_beyond_what_the_file_allows_is_refused(
    proved: dict[str, tuple[dict, dict]], word: str, value: float
) -> None:
    report = spoiled(proved[word], {"value": value.hex()})
    assert report.verdict == "malformed"
    assert "design.chosen" in report.failures[0]


def test_a_file_that_leaves_nothing_open_takes_no_value(
    proved: dict[str, tuple[dict, dict]],
) -> None:
    plant, certificate = copy.deepcopy(proved["accuracy"])
    plant["plant"]["synthesis"]["objective"] = "peak-input"
    report = checker.check_documents(plant, certificate)
    assert report.verdict == "malformed"
    assert "design.chosen" in report.failures[0]


def test_a_weight_of_zero_leaves_nothing_open(proved: dict[str, tuple[dict, dict]]) -> None:
    plant, certificate = copy.deepcopy(proved["accuracy"])
    plant["plant"]["synthesis"]["objective"] = {"accuracy": "0", "slope": "1"}
    assert checker.check_documents(plant, certificate).verdict == "malformed"
    plant["plant"]["synthesis"]["objective"] = {"accuracy": "0.5", "slope": "1"}
    assert checker.check_documents(plant, certificate).verdict == "proved"


def test_two_open_requirements_are_refused(proved: dict[str, tuple[dict, dict]]) -> None:
    plant, certificate = copy.deepcopy(proved["accuracy"])
    plant["plant"]["synthesis"]["objective"] = {"accuracy": "1", "period": "1"}
    report = checker.check_documents(plant, certificate)
    assert report.verdict == "malformed"
    assert "one requirement" in report.failures[0]


def test_a_folder_whose_report_and_proof_differ_is_refused(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "small"
    shutil.copytree(folder, out)
    assert pipeline.verify(out).exit_code == 0
    report = json.loads((out / "report.json").read_text())
    code = (out / "controller.py").read_text()
    found = report["chosen"]["value"]
    assert report["sampling"]["period"] == found > 0.001
    assert f"PERIOD: Final = {found!r}" in code or f"PERIOD = {found!r}" in code
    # A slower loop than the proved one, in the report and in the code alike.
    report["chosen"]["value"] = 2.0 * found
    texts = {
        "report.json": json.dumps(report),
        "controller.py": code.replace(repr(found), repr(2.0 * found)),
    }
    manifest = json.loads((out / "manifest.json").read_text())
    shutil.rmtree(out / "__pycache__", ignore_errors=True)
    for name, text in texts.items():
        (out / name).write_text(text)
        manifest["files"][name] = hashlib.sha256(text.encode()).hexdigest()
    (out / "manifest.json").write_text(json.dumps(manifest))
    outcome = pipeline.verify(out)
    # The controller states what is not proved: malformed, before any claim is read.
    assert outcome.exit_code == 2
    assert "PERIOD" in " ".join(outcome.document["failures"])
