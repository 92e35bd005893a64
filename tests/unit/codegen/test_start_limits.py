"""The first sample's limits read as a person would write them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from bfppc_synth.codegen.limits import screening_limits
from bfppc_synth.spec.load import load_spec
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from pathlib import Path

PLANT = """\
name: plant
states: [x1]
dynamics: {{x1: {{f: x1}}}}
initial: {{x1: {}}}
performance: {{accuracy: 0.1}}
"""


@pytest.mark.parametrize(
    ("initial", "lower", "upper"),
    [("0", 0.0, 0.0), ("[-0.5, 0]", -0.5, 0.0), ("[0, 0.5]", 0.0, 0.5), ("-0.5", -0.5, -0.5)],
)
def test_a_start_at_zero_has_limits_without_a_sign(
    tmp_path: Path, initial: str, lower: float, upper: float
) -> None:
    path = tmp_path / "plant.yaml"
    path.write_text(PLANT.format(initial))
    limits = {item.name: item.value for item in screening_limits(synthesize(load_spec(path)))}
    assert (limits["start_lower_1"], limits["start_upper_1"]) == (lower, upper)
    for name in ("start_lower_1", "start_upper_1"):
        assert math.copysign(1.0, limits[name]) == (-1.0 if limits[name] < 0.0 else 1.0)
