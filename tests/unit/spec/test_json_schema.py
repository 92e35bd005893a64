"""The JSON Schema for editors: every plant file keeps it, mistakes of structure do not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML

from bfppc_synth.errors import PlantFileError
from bfppc_synth.spec.json_schema import json_schema
from bfppc_synth.spec.load import load_text
from bfppc_synth.spec.schema import PLANT

ROOT = Path(__file__).parents[3]
PLANTS = sorted([*(ROOT / "examples").glob("*.yaml"), *(ROOT / "tests/plants").glob("*.yaml")])
SCHEMA = json_schema()
VALIDATOR = Draft202012Validator(SCHEMA)
BASE = """\
name: small
states: [y, v]
dynamics:
  y: {f: 0}
  v: {f: sin(y), g: 2}
initial: {y: 0.1, v: 0}
performance: {accuracy: 0.1}
"""


def faults(text: str) -> list[str]:
    document = YAML(typ="safe", pure=True).load(text)
    return [".".join(map(str, error.absolute_path)) for error in VALIDATOR.iter_errors(document)]


def refused(text: str) -> bool:
    try:
        load_text(text, "small.yaml")
    except PlantFileError:
        return True
    return False


def test_it_is_a_schema_and_json():
    Draft202012Validator.check_schema(SCHEMA)
    assert json.loads(json.dumps(SCHEMA)) == SCHEMA
    assert SCHEMA["$schema"] == "https://json-schema.org/draft/2020-12/schema"


@pytest.mark.parametrize("path", PLANTS, ids=lambda path: path.stem)
def test_every_plant_file_keeps_it(path):
    assert faults(path.read_text(encoding="utf-8")) == []


def test_every_key_is_in_it_and_described():
    assert set(SCHEMA["properties"]) == {field.key for field in PLANT.fields}
    loose = []

    def walk(path, schema):
        for key, below in schema.get("properties", {}).items():
            if "description" not in below and "const" not in below:
                loose.append(f"{path}.{key}")
            walk(f"{path}.{key}", below)
        for key in ("additionalProperties", "then", "else", "items"):
            if isinstance(schema.get(key), dict):
                walk(path, schema[key])

    walk("", SCHEMA)
    assert loose == []


ACCEPTED = [
    "measurement: {quantizer: [{kind: uniform, step: 0.1}, {kind: none}]}",
    "measurement: {quantizer: {y: {kind: uniform, step: 1/100}, v: {kind: none}}}",
    "measurement: {noise: [0, 1e-3]}",
    "measurement: {noise: {y: 0, v: pi/600}}",
    "reference: {bounds: [1, 2]}",
    "reference: {value: sin(t), bound: 1, rate: 1}",
    "reference: 0.5*sin(2*pi*t)",
    "reference: 1",
    "performance: {accuracy: sqrt(2), rho: [{kind: cosine, t_s: 1}, {kind: exponential, rate: 2}]}",
    "synthesis: {objective: {peak-input: 1, slope: 0.5}, gains: {v: {N: 5}}, p: {v: 2}}",
    "parameters: {a: [0.9, 1.1], b: pi/60}",
    "units: {y: m, v: m/s, u: N}",
    "title: 2024",
]
REFUSED = [
    ("acuracy: 1", ""),
    ("performance: {acuracy: 0.1}", "performance"),
    ("performance: {accuracy: -0.1}", "performance.accuracy"),
    ("performance: {accuracy: '0.1'}", "performance.accuracy"),
    ("performance: {accuracy: true}", "performance.accuracy"),
    ("performance: {accuracy: [0.1, 0.2]}", "performance.accuracy"),
    ("performance: {accuracy: 2*y}", "performance.accuracy"),
    ("performance: {accuracy: 0.1, rho: {kind: cosinus, t_s: 1}}", "performance.rho.kind"),
    ("performance: {accuracy: 0.1, rho: {kind: cosine}}", "performance.rho"),
    ("performance: {accuracy: 0.1, rho: {kind: cosine, t_s: 1, rate: 2}}", "performance.rho"),
    ("measurement: {quantizer: {kind: uniform}}", "measurement.quantizer"),
    ("measurement: {quantizer: {kind: none, step: 1}}", "measurement.quantizer"),
    ("measurement: {quantizer: {y: {kind: uniform}, v: {kind: none}}}", "measurement.quantizer.y"),
    ("sampling: {period: -1}", "sampling.period"),
    ("sampling: 0.001", "sampling"),
    ("dynamics: {y: {g: 1}, v: {f: 0}}", "dynamics.y"),
    ("dynamics: {y: {f: 0, g_min: 1}, v: {f: 0}}", "dynamics.y"),
    ("dynamics: {y: {f: 0, h: 1}, v: {f: 0}}", "dynamics.y"),
    ("dynamics: {y: {f: 'y; v'}, v: {f: 0}}", "dynamics.y.f"),
    ("reference: sin(y)", "reference"),
    ("reference: {value: sin(t), bound: 1}", "reference"),
    ("reference: {bounds: [1]}", "reference.bounds"),
    ("synthesis: {method: unifed}", "synthesis.method"),
    ("synthesis: {gains: {v: {N: 4}}}", "synthesis.gains.v.N"),
    ("synthesis: {objective: {speed: 1}}", "synthesis.objective"),
    ("simulation: {seed: 1.5}", "simulation.seed"),
    ("parameters: {a: [1, 2, 3]}", "parameters.a"),
    ("parameters: {sin: 1}", "parameters"),
    ("states: [y, y]", "states"),
    ("states: []", "states"),
    ("states: [t, v]", "states.0"),
    ("name: Small", "name"),
    ("name: double", "name"),
]


def without(line: str) -> str:
    """BASE with a section replaced or added."""
    key = line.partition(":")[0]
    document = YAML(typ="safe", pure=True).load(BASE)
    kept = {name: value for name, value in document.items() if name != key}
    return f"{json.dumps(kept)[:-1]}, {line}}}"


@pytest.mark.parametrize("line", ACCEPTED)
def test_what_the_reader_takes_the_schema_takes(line):
    text = without(line)
    assert faults(text) == []
    # The offset that a run-time reference needs is a relation of values.
    assert not refused(text) or "bounds" in line


@pytest.mark.parametrize(("line", "place"), REFUSED)
def test_a_mistake_of_structure_is_found_at_its_place(line, place):
    text = without(line)
    assert refused(text)
    assert place in faults(text)


@pytest.mark.parametrize("key", ["name", "states", "dynamics", "initial", "performance"])
def test_a_missing_section_is_found(key):
    document = YAML(typ="safe", pure=True).load(BASE)
    del document[key]
    assert faults(json.dumps(document)) == [""]


@pytest.mark.parametrize("objective", ["accuracy", "{accuracy: 1, slope: 0.1}"])
def test_only_objective_accuracy_goes_without_an_accuracy(objective):
    free = BASE.replace("performance: {accuracy: 0.1}", "performance: {}\nactuator: {limit: 5}")
    assert faults(free) == ["performance"]
    assert faults(f"{free}synthesis: {{objective: {objective}}}\n") == []
    assert faults(f"{free}synthesis: {{objective: period}}\n") == ["performance"]
