"""What a plant file with center nominal may say, and what is refused before any mathematics."""

from __future__ import annotations

import subprocess
import sys

import pytest

from bfppc_synth.errors import PlantFileError
from bfppc_synth.model.spec import Anchor, CenterKind
from bfppc_synth.spec.load import load_spec

GOOD = """\
name: plant
states: [x1, x2]
dynamics:
  x1: {f: x1}
  x2: {f: x1*x2}
reference: sin(t)
initial: {x1: 1, x2: 0}
performance: {accuracy: 0.15, transition: 2}
synthesis: {center: nominal}
"""
FREE = "{p: {x1: 0.05, x2: 1}, gains: {x1: {k: 1}, x2: {k: 1}}}"


@pytest.fixture
def read(tmp_path):
    def run(text):
        path = tmp_path / "plant.yaml"
        path.write_text(text, encoding="utf-8")
        return load_spec(path)

    return run


REFUSED = [
    ("center: nominal", "center: nominal, method: theorem1", "9:21:7", "theorem1 is proved for"),
    ("center: nominal", "center: nominal, method: theorem2", "9:21:7", "theorem2 is proved for"),
    (
        "center: nominal",
        "center: nominal, method: theorem2, form: printed",
        "9:21:7",
        "theorem2 is proved for",
    ),
    (
        "center: nominal",
        f"center: nominal, method: theorem3, stages: [{FREE}]",
        "9:21:7",
        "theorem3 is proved for center performance, not for nominal",
    ),
    ("center: nominal", "center: nominal, anchor: exact", "9:38:5", "from what is true"),
    (
        "reference: sin(t)",
        "reference: {value: sin(t), bound: 1, rate: 1}",
        "6:12:34",
        "first 3 derivatives, and the file declares two",
    ),
    (
        "reference: sin(t)",
        "reference: {bounds: [1, 1, 1]}",
        "6:21:9",
        "first 3 derivatives, 4 in all, and there are 3",
    ),
    ("reference: sin(t)", "reference: {bounds: [1, 1]}", "6:21:6", "there are 2"),
]


@pytest.mark.parametrize(("old", "new", "place", "message"), REFUSED)
def test_what_center_nominal_does_not_cover_is_refused_with_its_place(
    read, old, new, place, message
):
    with pytest.raises(PlantFileError) as caught:
        read(GOOD.replace(old, new))
    found = [
        each
        for each in caught.value.mistakes
        if f"{each.line}:{each.column}:{each.length}" == place and message in each.message
    ]
    assert len(found) == 1, caught.value
    assert "center: performance" in found[0].fix


@pytest.mark.parametrize("duration", ["9.9e-7", "1000000.5", "1e7", "1e-300"])
def test_a_transition_that_no_certificate_covers_is_refused(read, duration):
    with pytest.raises(PlantFileError) as caught:
        read(GOOD.replace("transition: 2", f"transition: {duration}"))
    (mistake,) = caught.value.mistakes
    assert (mistake.path, mistake.line, mistake.column) == ("performance.transition", 8, 43)
    assert f"{duration} s is outside 1e-6 to 1e6 s" in mistake.message
    assert "leave it out" in mistake.fix


@pytest.mark.parametrize("duration", ["1e-6", "1e6"])
def test_the_longest_and_the_shortest_transition_are_read(read, duration):
    transition = read(
        GOOD.replace("transition: 2", f"transition: {duration}")
    ).performance.transition
    assert transition.approximate == float(duration)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("center: nominal", "center: nominal, method: unified"),
        ("center: nominal", "center: nominal, anchor: latched"),
        ("reference: sin(t)", "reference: {bounds: [1, 1, 1, 1]}"),
        ("reference: sin(t)\n", ""),
        (", transition: 2", ""),
    ],
)
def test_what_center_nominal_covers_is_read_without_a_note(read, old, new):
    spec = read(GOOD.replace(old, new))
    assert (spec.synthesis.center, spec.synthesis.anchor) == (CenterKind.NOMINAL, Anchor.LATCHED)
    assert spec.notes == ()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("{center: nominal}", "{method: theorem2}"),
        ("{center: nominal}", "{anchor: exact}"),
        ("center: nominal", "center: performance, method: theorem2"),
    ],
)
def test_center_performance_takes_what_nominal_does_not(read, old, new):
    assert read(GOOD.replace(old, new)).synthesis.center is CenterKind.PERFORMANCE


RHO = "rho: {kind: exponential, rate: 1, rate_bound: 2}"
BOUNDS = ("reference: sin(t)", "reference: {bounds: [1, 1, 1, 1, 1]}")


@pytest.mark.parametrize(
    ("center", "old", "new", "notes"),
    [
        ("nominal", "transition: 2", RHO, ["performance.rho is not used with center nominal"]),
        (
            "nominal",
            "transition: 2",
            "rho: {x1: {kind: cosine, t_s: 1}, x2: {kind: cosine, t_s: 2}}",
            ["performance.rho is not used with center nominal"],
        ),
        (
            "performance",
            "transition: 2",
            "transition: 2",
            ["performance.transition is not used with center performance"],
        ),
        ("nominal", *BOUNDS, ["reference.bounds: center nominal uses the first 4"]),
        (
            "performance",
            *BOUNDS,
            [
                "performance.transition is not used with center performance",
                "reference.bounds: center performance uses the first two",
            ],
        ),
        ("nominal", "reference: sin(t)", "reference: {bounds: [1, 1, 1, 1]}", []),
    ],
)
def test_keys_of_the_other_center_are_noted(read, center, old, new, notes):
    assert old in GOOD
    text = GOOD.replace("center: nominal", f"center: {center}").replace(old, new)
    assert list(read(text).notes) == notes


def test_a_refusal_needs_no_mathematics(tmp_path):
    path = tmp_path / "plant.yaml"
    path.write_text(GOOD.replace("nominal}", "nominal, anchor: exact}"), encoding="utf-8")
    program = (
        "import sys\n"
        "from bfppc_synth.errors import PlantFileError\n"
        "from bfppc_synth.spec.load import load_spec\n"
        "try:\n    load_spec(sys.argv[1])\n"
        "except PlantFileError:\n    print('refused', 'sympy' in sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(path)], capture_output=True, text=True, check=True
    )
    assert done.stdout == "refused False\n"
