"""Plant files without a design: the answer names the requirement, and what it suggests works."""

import json
import math
import os
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from bfppc_synth.errors import NoDesignError
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.reasons.explain import synthesize
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize as synthesize_only
from bfppc_synth.voice import Voice

ROOT = Path(__file__).parents[2]
EVERY = os.environ.get("BFPPC_TESTS") == "all"
# What was spoiled in each file, and whether a run without BFPPC_TESTS=all looks at it.
SPOILED = {
    "delay": ("sampling.delay", True),
    "limit": ("actuator.limit", True),
    "transition": ("performance.transition", False),
    "disturbance": ("dynamics.x2.disturbance", False),
    "gain": ("synthesis.gains.x1.k", False),
    "initial": ("initial", False),
    "noise": ("measurement.noise", False),
    "period": ("sampling.period", False),
    "resolution": ("measurement.quantizer.step", False),
    "rho": ("performance.rho.t_s", False),
}
CASES = [name for name, (_, sampled) in SPOILED.items() if EVERY or sampled]


def written(tree, path, text):
    """Write a value where the path says, as a user would."""
    *sections, key = path.split(".")
    for section in sections:
        tree = tree.setdefault(section, {})
    if text is None:
        del tree[key]
    else:
        tree[key] = YAML(typ="safe").load(text)


def edited(source, edits, target):
    yaml = YAML()
    tree = yaml.load(source.read_text(encoding="utf-8"))
    for path, text in edits.items():
        written(tree, path, text)
    yaml.dump(tree, target)
    return load_spec(target)


@pytest.fixture(scope="module", params=CASES)
def answered(request):
    path = ROOT / "tests" / "plants" / f"infeasible_{request.param}.yaml"
    with pytest.raises(NoDesignError) as caught:
        synthesize(load_spec(path), patience=math.inf)
    return request.param, path, caught.value


def test_the_requirement_that_was_spoiled_is_named_with_a_value_that_suffices(answered):
    name, _, error = answered
    paths = [one["path"] for one in error.details["suggestions"]]
    assert SPOILED[name][0] in paths, str(error)
    assert "what binds: " in str(error)
    assert "  fix: " in str(error)


def test_every_suggestion_applied_as_printed_gives_a_certified_design(answered, tmp_path):
    _, path, error = answered
    for one in error.details["suggestions"]:
        assert all(text is None or text in str(error) for text in one["edits"].values())
        design = synthesize_only(edited(path, one["edits"], tmp_path / "applied.yaml"))
        assert design.certificate.verdict is Verdict.CERTIFIED, one
        assert pytest.approx(one["U"], rel=1e-9) == design.bounds.U


def test_a_value_a_little_nearer_to_the_given_one_is_not_enough(answered, tmp_path):
    name, path, error = answered
    one = next(one for one in error.details["suggestions"] if one["path"] == SPOILED[name][0])
    given, found = (one["given"], one["suffices"])
    if len(one["edits"]) != 1 or name == "gain":
        assert name in ("noise", "initial", "gain")
        return
    nearer = float(found) * (float(given) / float(found)) ** min(
        1.0, 0.05 / abs(math.log(float(given) / float(found)))
    )
    spec = edited(path, {one["path"]: f"{nearer:.12g}"}, tmp_path / "nearer.yaml")
    with pytest.raises(NoDesignError):
        synthesize_only(spec)


def test_the_json_object_of_a_refusal_has_the_answer(capsys):
    details = {"binding": {"requirement": "sampling.period"}, "drivers": [], "suggestions": []}
    error = NoDesignError("no certified design", details=details)

    def fail():
        raise error

    assert Voice(as_json=True, quiet=False).settle(fail) == 3
    said = json.loads(capsys.readouterr().out)
    assert said["exit_code"] == 3
    assert {key: said[key] for key in details} == details
