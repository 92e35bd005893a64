"""What a plant file with method theorem1 may say, and what is refused with a place."""

from __future__ import annotations

import pytest

from bfppc_synth.errors import PlantFileError
from bfppc_synth.model.spec import Anchor
from bfppc_synth.model.theorem1 import Schedule
from bfppc_synth.spec.load import load_spec

GOOD = """\
name: plant
states: [x1, x2]
dynamics:
  x1: {f: x1, g: 1}
  x2: {f: x1*x2}
reference: 0
initial: {x1: 1, x2: 0}
performance: {accuracy: 0.15}
measurement: {quantizer: {kind: uniform, step: 0.1}}
synthesis: {method: theorem1}
"""
FULL = GOOD.replace(
    "{method: theorem1}",
    "{method: theorem1, theorem1: {c_0: 0.1, epsilon: {x2: 1}, H: scheduled},"
    " gains: {x1: {gamma: 4, H: [5, 1], H_star: 5, c: 0.1}}}",
)


@pytest.fixture
def read(tmp_path):
    def run(text):
        path = tmp_path / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        return load_spec(path)

    return run


def test_everything_that_theorem_1_may_fix_is_read(read):
    spec = read(FULL)
    options, gain = spec.synthesis.theorem1, spec.synthesis.gains[0]
    assert options.c_0.approximate == 0.1
    assert options.epsilon[0] is None
    assert options.epsilon[1].approximate == 1.0
    assert options.H is Schedule.SCHEDULED
    assert [h.approximate for h in gain.H] == [5.0, 1.0]
    assert (gain.gamma.approximate, gain.H_star.approximate) == (4.0, 5.0)


def test_h_is_constant_by_default_and_the_errors_are_of_the_true_starts(read):
    spec = read(GOOD)
    assert spec.synthesis.theorem1 is None
    assert spec.synthesis.anchor is Anchor.EXACT
    other = read(GOOD.replace("{method: theorem1}", "{method: unified}"))
    assert other.synthesis.anchor is Anchor.LATCHED
    assert read(
        GOOD.replace("theorem1}", "theorem1, theorem1: {c_0: 1}}")
    ).synthesis.theorem1.H is (Schedule.CONSTANT)


REFUSED = [
    ("g: 1", "g: 2", "dynamics.x1.g", "g = 1, not for 2"),
    ("g: 1", "g_min: 1, g_bound: 2", "dynamics.x1.g_bound", "g = 1, not for 2"),
    ("reference: 0", "reference: sin(t)", "reference", "not for sin(t)"),
    ("reference: 0", "reference: {bounds: [1, 1]}", "reference", "given at run time"),
    (
        "accuracy: 0.15",
        "accuracy: 0.15, rho: [{kind: cosine, t_s: 1}, {kind: cosine, t_s: 2}]",
        "performance.rho",
        "one rho for all states, here are 2",
    ),
    ("synthesis:", "sampling: {period: 0.01}\nsynthesis:", "sampling.period", "not for 0.01"),
    ("synthesis:", "sampling: {delay: 0.01}\nsynthesis:", "sampling.delay", "not for 0.01"),
    ("synthesis:", "actuator: {error: 0.5}\nsynthesis:", "actuator.error", "not for 0.5"),
    (
        "method: theorem1",
        "method: theorem1, theorem1: {epsilon: {x1: 1}}",
        "synthesis.theorem1.epsilon.x1",
        "twice the resolution",
    ),
    ("accuracy: 0.15", "accuracy: 0.1", "performance.accuracy", "twice the resolution"),
    (
        "method: theorem1",
        "method: theorem1, theorem1: {H: linear}",
        "synthesis.theorem1.H",
        "one of constant",
    ),
    (
        "method: theorem1",
        "method: theorem1, gains: {x1: {H: [5, -1]}}",
        "synthesis.gains.x1.H",
        "0 or above",
    ),
]


@pytest.mark.parametrize(("old", "new", "path", "message"), REFUSED)
def test_what_theorem_1_does_not_cover_is_refused_with_its_place(read, old, new, path, message):
    with pytest.raises(PlantFileError) as caught:
        read(GOOD.replace(old, new))
    assert [mistake.path for mistake in caught.value.mistakes] == [path]
    assert message in caught.value.mistakes[0].message


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("g: 1", "g: 1.0"),
        ("reference: 0\n", ""),
        ("accuracy: 0.15", "accuracy: 0.15, rho: {kind: exponential, rate: 1}"),
        ("accuracy: 0.15", "accuracy: 0.101"),
        ("synthesis:", "sampling: {period: 0, delay: 0}\nsynthesis:"),
    ],
)
def test_what_theorem_1_covers_is_read(read, old, new):
    assert read(GOOD.replace(old, new)).order == 2


def test_keys_of_the_other_methods_are_noted(read):
    spec = read(GOOD.replace("theorem1}", "theorem1, gains: {x1: {k: 1}}, anchor: latched}"))
    assert spec.notes == (
        "synthesis.gains.x1.k is not used with method theorem1",
        "synthesis.anchor is not used with method theorem1",
    )
    spec = read(FULL.replace("method: theorem1", "method: unified"))
    assert [note.split()[0] for note in spec.notes] == [
        "synthesis.gains.x1.gamma",
        "synthesis.gains.x1.H",
        "synthesis.gains.x1.H_star",
        "synthesis.theorem1",
    ]
