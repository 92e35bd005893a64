"""``--over PATH=a:b:n``: which values it means, and what it refuses."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from bfppc_synth.errors import UsageError
from bfppc_synth.spec.load import load_spec
from bfppc_synth.sweep.axes import Spacing, grid, read_axes

SPEC = load_spec(Path(__file__).parents[3] / "examples" / "van_der_pol.yaml")


def axis(word):
    return read_axes([word], SPEC)[0]


def test_more_than_a_decade_is_spaced_by_ratios_and_less_by_differences():
    wide, narrow = axis("performance.accuracy=0.01:0.2:3"), axis("performance.accuracy=0.1:1:3")
    assert (wide.spacing, wide.texts) == (Spacing.GEOMETRIC, ("0.01", "0.0447214", "0.2"))
    assert (narrow.spacing, narrow.texts) == (Spacing.LINEAR, ("0.1", "0.55", "1"))


def test_the_spacing_can_be_asked_for():
    assert axis("performance.accuracy=0.1:0.4:3:log").texts == ("0.1", "0.2", "0.4")
    assert axis("performance.accuracy=0.01:1.01:3:lin").texts == ("0.01", "0.51", "1.01")


def test_ends_are_taken_as_they_are_written_and_may_fall():
    falling = axis("initial.x1=pi/6:-1/3:3")
    assert falling.texts[0] == "pi/6"
    assert falling.texts[-1] == "-1/3"
    assert falling.values == pytest.approx((math.pi / 6, (math.pi / 6 - 1 / 3) / 2, -1 / 3))


def test_values_close_together_stay_different():
    values = axis("performance.accuracy=0.1:0.1000001:5").values
    assert len(set(values)) == 5
    assert values == tuple(sorted(values))


def test_the_last_axis_runs_fastest():
    axes = read_axes(["sampling.period=1:2:2", "performance.accuracy=3:4:2"], SPEC)
    assert grid(axes) == (("1", "3"), ("1", "4"), ("2", "3"), ("2", "4"))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "over what"),
        (["performance.accuracy"], "not PATH=from:to:count"),
        (["performance.accuracy=1:2"], "not PATH=from:to:count"),
        (["performance.acuracy=1:2:3"], "did you mean performance.accuracy?"),
        (["name=1:2:3"], "no such path"),
        (["performance.accuracy=1:1:3"], "the same"),
        (["performance.accuracy=1:2:1"], "from 2 on"),
        (["performance.accuracy=1:2:2.5"], "from 2 on"),
        (["performance.accuracy=1:2:99999"], "more than 10000"),
        (["performance.accuracy=1:2:9999999999999"], "from 2 on"),
        (["performance.accuracy=nan:2:3"], "nan"),
        (["performance.accuracy=1:inf:3"], "inf"),
        (["performance.accuracy=x1:2:3"], "x1"),
        (["performance.accuracy=:2:3"], "nothing"),
        (["initial.x1=-1:2:3:log"], "not both above 0"),
        (["performance.accuracy=1:2:3:cubic"], "no spacing"),
        (["performance.accuracy=1:2:3"] * 2, "the same number"),
        (["measurement.noise=1:2:3", "measurement.noise.x1=1:2:3"], "the same number"),
        (["performance.rho.t_s=1:2:3", "performance.rho.x2.t_s=1:2:3"], "the same number"),
        (["performance.accuracy=1:2:200", "sampling.period=1:2:200"], "40000 points"),
        (["performance.accuracy=1:2:3"] * 3, "3 times"),
        (["performance.accuracy=1:1.0000000000000002:9"], "do not fit"),
    ],
)
def test_what_cannot_be_swept_is_refused_with_a_cure(words, said):
    with pytest.raises(UsageError) as caught:
        read_axes(words, SPEC)
    assert said in str(caught.value)
    assert "fix:" in str(caught.value)
    assert caught.value.exit_code == 2
