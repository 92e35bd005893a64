"""The converter that every quantized state needs: range, cells, bits."""

from __future__ import annotations

import dataclasses
import math
from fractions import Fraction

import pytest

from bfppc_synth.model.expression import Constant, Number
from bfppc_synth.model.spec import QuantizerKind, QuantizerSpec
from bfppc_synth.report.render import render_html, render_readme
from bfppc_synth.report.requirements import cell_bits
from bfppc_synth.report.tables import report_document


def constant(text: str) -> Constant:
    value = Fraction(text)
    return Constant(text=text, tree=Number(value=value), exact=value, approximate=float(value))


def uniform(step: str) -> QuantizerSpec:
    return QuantizerSpec(kind=QuantizerKind.UNIFORM, step=constant(step))


@pytest.mark.parametrize("step", ["0.002", "0.1", "0.5", "3"])
@pytest.mark.parametrize("reach", [1.15, 5.735, 46.3, 1e4])
def test_the_bits_are_the_logarithm_of_the_cells(step, reach):
    bits = cell_bits(uniform(step), reach)
    assert bits == max(1, math.ceil(math.log2(2.0 * reach / float(step))))


@pytest.mark.parametrize(("reach", "bits"), [(0.9999, 3), (1.0, 3), (1.0001, 4), (0.1, 1)])
def test_a_cell_beyond_a_power_of_two_costs_a_bit(reach, bits):
    assert cell_bits(uniform("0.25"), reach) == bits


@pytest.mark.parametrize(("reach", "cells"), [(0.5, 1 + 2 * 17), (1.5, 1 + 2 * (17 + 10))])
def test_logarithmic_cells_are_counted_as_what_they_are(reach, cells):
    # From 0.02 to 0.5 by a factor 1.1 / 0.9 each: 17 cells, with neither end inside one.
    quantizer = QuantizerSpec(
        kind=QuantizerKind.LOGARITHMIC_UNIFORM,
        step=constant("0.1"),
        minimum=constant("0.02"),
        density=constant("0.1"),
        threshold=constant("0.5"),
    )
    assert math.ceil(math.log(25) / math.log(1.1 / 0.9)) == 17
    assert cell_bits(quantizer, reach) == math.ceil(math.log2(cells))


def test_the_report_gives_range_step_and_bits_of_quantized_states_only(design, run, adversaries):
    exact = QuantizerSpec(kind=QuantizerKind.NONE)
    measurement = dataclasses.replace(
        design.spec.measurement, quantizers=(design.spec.measurement.quantizers[0], exact)
    )
    half = dataclasses.replace(
        design, spec=dataclasses.replace(design.spec, measurement=measurement)
    )
    document = report_document(half, run, adversaries)
    first, second = document["measurement"]["adc"]
    assert second is None
    assert first == {"range": 1.55, "step": 0.002, "bits": math.ceil(math.log2(3.1 / 0.002))}
    page, readme = render_html(document, half, run), render_readme(document)
    assert 'data-json-path="measurement.adc[0].bits" data-value="11">11<' in page
    assert 'data-json-path="measurement.adc[0].range" data-value="1.55"' in page
    assert "measurement.adc[1]" not in page
    assert "- a converter of 11 bits for x1: cells of 0.002 over +-1.55;" in readme
    assert "for x2: cells" not in readme


def test_a_reach_that_is_not_finite_has_no_bits(design, run):
    bounds = dataclasses.replace(design.bounds, X=(math.inf, 1.0))
    document = report_document(dataclasses.replace(design, bounds=bounds), run, ())
    assert document["measurement"]["adc"][0] == {"range": None, "step": 0.002, "bits": None}
    assert document["measurement"]["adc"][1]["bits"] == 10
