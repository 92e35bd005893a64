from fractions import Fraction

import pytest

from bfppc_synth.expressions.parse import parse_constant
from bfppc_synth.expressions.resolution import lower_bound, quantization, resolution, upper_bound
from bfppc_synth.model.spec import QuantizerKind, QuantizerSpec


def quantizer(kind, **numbers):
    texts = {key: parse_constant(text) for key, text in numbers.items()}
    return QuantizerSpec(kind=kind, **texts)


@pytest.mark.parametrize(
    ("item", "delta"),
    [
        (quantizer(QuantizerKind.NONE), 0),
        (quantizer(QuantizerKind.UNIFORM, step="0.1"), "0.05"),
        (quantizer(QuantizerKind.UNIFORM, step="0.1", dead_zone="0.02"), "0.05"),
        (quantizer(QuantizerKind.UNIFORM, step="0.1", dead_zone="0.2"), "0.2"),
        (quantizer(QuantizerKind.HYSTERESIS_UNIFORM, step="0.1", hysteresis="0.01"), "0.06"),
        (quantizer(QuantizerKind.HYSTERESIS_UNIFORM, step="0.1", hysteresis="0.05"), "0.1"),
        (
            quantizer(
                QuantizerKind.LOGARITHMIC_UNIFORM,
                minimum="0.02",
                density="0.1",
                threshold="0.5",
                step="0.1",
            ),
            "0.05",
        ),
        (
            quantizer(
                QuantizerKind.LOGARITHMIC_UNIFORM,
                minimum="0.02",
                density="0.3",
                threshold="0.5",
                step="0.1",
            ),
            "0.15",
        ),
        (
            quantizer(
                QuantizerKind.LOGARITHMIC_UNIFORM,
                minimum="0.2",
                density="0.1",
                threshold="0.5",
                step="0.1",
            ),
            "0.2",
        ),
    ],
)
def test_the_bound_of_each_quantizer_is_exact(item, delta):
    assert quantization(item) == Fraction(delta)


def test_noise_adds_to_the_quantization_bound():
    item = quantizer(QuantizerKind.UNIFORM, step="0.1")
    assert resolution(item, parse_constant("1e-3")) == Fraction(51, 1000)


def test_an_irrational_number_is_enclosed_and_a_rational_one_is_itself():
    pi = Fraction("3.14159265358979323846264338327950288")
    constant = parse_constant("pi")
    assert lower_bound(constant) < pi < upper_bound(constant)
    assert upper_bound(constant) - lower_bound(constant) < Fraction(1, 10**14)
    third = parse_constant("1/3")
    assert lower_bound(third) == upper_bound(third) == Fraction(1, 3)
    assert upper_bound(None) == 0
