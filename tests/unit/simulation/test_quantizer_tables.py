"""The quantizers' levels, cell by cell, and their keys in the plant file."""

from __future__ import annotations

from fractions import Fraction

import pytest

from bfppc_synth.errors import ShapeError
from bfppc_synth.expressions.resolution import resolution
from bfppc_synth.model.expression import Constant, Number
from bfppc_synth.model.spec import QuantizerKind, QuantizerSpec
from bfppc_synth.simulation.quantizers import (
    DeadZoneUniform,
    HysteresisUniform,
    LogarithmicUniform,
    Uniform,
    make_quantizer,
)


def number(text):
    value = Fraction(text)
    return Constant(text=text, tree=Number(value=value), exact=value, approximate=float(value))


@pytest.mark.parametrize(
    ("x", "q"), [(0.0, 0.0), (0.24, 0.0), (0.25, 0.5), (0.74, 0.5), (-0.25, 0.0), (-0.26, -0.5)]
)
def test_the_corrected_cells_of_the_paper_leave_no_gap(x, q):
    assert Uniform(0.5)(x) == q


@pytest.mark.parametrize(
    ("x", "q"), [(0.0, 0.0), (0.99, 0.0), (1.0, 1.25), (1.49, 1.25), (1.5, 1.75), (-1.0, -1.25)]
)
def test_cells_begin_at_the_dead_zone(x, q):
    assert DeadZoneUniform(0.5, 1.0)(x) == q


def test_without_dead_zone_only_zero_is_read_as_zero():
    quantizer = DeadZoneUniform(0.5, 0.0)
    assert [quantizer(x) for x in (0.0, 1e-9, -1e-9, 0.5)] == [0.0, 0.25, -0.25, 0.75]


def test_hysteresis_moves_up_late_and_down_late():
    quantizer = HysteresisUniform(1.0, 0.25)
    up = [quantizer(x) for x in (0.0, 0.74, 0.75, 1.74, 1.75)]
    down = [quantizer(x) for x in (1.26, 1.25, 0.26, 0.25, -0.74, -0.75)]
    assert up == [0.0, 0.0, 1.0, 1.0, 2.0]
    assert down == [2.0, 1.0, 1.0, 0.0, 0.0, -1.0]


def test_hysteresis_jumps_over_any_number_of_levels_at_once():
    quantizer = HysteresisUniform(1e-6, 2.5e-7)
    assert quantizer(1e6) == pytest.approx(1e6, abs=8e-7)
    assert quantizer(-1e6) == pytest.approx(-1e6, abs=8e-7)


def test_logarithmic_cells_grow_by_their_ratio_up_to_the_threshold():
    quantizer = LogarithmicUniform(0.1, 0.5, 10.0, 2.0)
    # Cells (0.1, 0.3], (0.3, 0.9], (0.9, 2.7], .. with levels 1.5 times their lower edges.
    inputs = (0.1, 0.11, 0.29, 0.31, 0.89, 0.91, 2.6, 9.99)
    levels = [quantizer(x) for x in inputs]
    assert levels == pytest.approx([0.0, 0.15, 0.15, 0.45, 0.45, 1.35, 1.35, 12.15])
    assert [quantizer(-x) for x in inputs] == [-level for level in levels]
    assert [quantizer(x) for x in (10.0, 11.9, 12.1)] == [11.0, 11.0, 13.0]


SPECS = (
    QuantizerSpec(kind=QuantizerKind.NONE),
    QuantizerSpec(kind=QuantizerKind.UNIFORM, step=number("0.01")),
    QuantizerSpec(kind=QuantizerKind.UNIFORM, step=number("0.01"), dead_zone=number("0.02")),
    QuantizerSpec(kind=QuantizerKind.UNIFORM, step=number("0.01"), dead_zone=number("0.001")),
    QuantizerSpec(
        kind=QuantizerKind.HYSTERESIS_UNIFORM, step=number("0.01"), hysteresis=number("0.002")
    ),
    QuantizerSpec(
        kind=QuantizerKind.LOGARITHMIC_UNIFORM,
        minimum=number("0.02"),
        density=number("0.1"),
        threshold=number("0.5"),
        step=number("0.04"),
    ),
)


@pytest.mark.parametrize("spec", SPECS)
def test_the_simulated_resolution_is_the_one_of_the_certificate(spec):
    certified = float(resolution(spec, number("0")))
    assert make_quantizer(spec).resolution == pytest.approx(certified, rel=1e-15)


def test_every_quantizer_made_has_a_memory_of_its_own():
    spec = SPECS[4]
    first, second = make_quantizer(spec), make_quantizer(spec)
    first(10.0)
    assert second(0.006) == 0.0


def test_a_missing_key_is_refused():
    with pytest.raises(ShapeError, match=r"measurement\.quantizer"):
        make_quantizer(QuantizerSpec(kind=QuantizerKind.UNIFORM))
