"""The part of report.json that says what was asked: plant, requirements, majorants."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.spec import QuantizerKind, RhoKind
from bfppc_synth.report.nominal import reference_bounds
from bfppc_synth.report.numbers import constant, finite, finites
from bfppc_synth.report.stages import reanchors

if TYPE_CHECKING:
    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.expression import Expression
    from bfppc_synth.model.spec import ChannelSpec, PlantSpec, QuantizerSpec, RhoSpec

LONGEST_RUN = 1e6
SHORT_RUN = 64.0


def _text(expression: Expression | None) -> str | None:
    return None if expression is None else expression.text


def plant_entry(spec: PlantSpec) -> dict[str, object]:
    """Lay out the dynamics as the plant file writes them, and the parameters' ranges."""

    def channel(entry: ChannelSpec) -> dict[str, object]:
        return {
            "state": entry.state,
            "f": _text(entry.f),
            "g": _text(entry.g),
            "f_bound": _text(entry.f_bound),
            "g_bound": _text(entry.g_bound),
            "g_min": _text(entry.g_min),
            "disturbance": _text(entry.disturbance),
        }

    return {
        "parameters": {
            entry.name: [constant(entry.range.lower), constant(entry.range.upper)]
            for entry in spec.parameters
        },
        "dynamics": [channel(entry) for entry in spec.dynamics],
    }


def majorant_entries(design: Design) -> list[dict[str, object]]:
    """Lay out maj f_i*, maj g_i* and g_m,i as texts in z_j = |x_j| (docs/theory.md section 1)."""
    return [
        {
            "state": state,
            "f": str(channel.f_text),
            "g": str(channel.g_text),
            "g_min": finite(g_min),
            "g_min_text": str(channel.g_min_text),
        }
        for state, channel, g_min in zip(
            design.spec.states, design.majorants.channels, design.bounds.g_min, strict=True
        )
    ]


def reference_entry(design: Design) -> dict[str, object]:
    """Lay out the reference with its bounds Y_0 on |y_d| and Y_1 on |dy_d|."""
    reference, signals = design.spec.reference, design.signals
    return {
        "Y0": finite(signals.Y_0),
        "Y1": finite(signals.Y_1),
        "kind": str(reference.kind),
        **reference_bounds(design),
        "expression": _text(reference.expression),
    }


def performance_entry(design: Design) -> dict[str, object]:
    """Lay out the accuracy p_1 and how the start fades: rho_i (52), (53), or T_s."""
    signals = design.signals
    if design.nominal is not None:
        accuracy = finite(design.omega[0])
        return {
            "accuracy": accuracy,
            # b is exactly 0 after T_s: nothing of the start remains.
            "final_error": accuracy,
            "offset": finite(signals.a_0),
            "funnel": _text(design.spec.performance.funnel),
            "transition": finite(design.nominal.transition),
            "rho": [],
        }

    def shape(rho: RhoSpec, floor: float, rate_bound: float) -> dict[str, object]:
        entry: dict[str, object] = {"kind": str(rho.kind)}
        if rho.kind is RhoKind.COSINE and rho.t_s is not None:
            entry["t_s"] = constant(rho.t_s)
            entry["ends_at"] = math.pi * constant(rho.t_s)
        elif rho.rate is not None:
            entry["rate"] = constant(rho.rate)
        return {**entry, "floor": finite(floor), "rate_bound": finite(rate_bound)}

    # A floor of rho_1 keeps its part of the start for ever (docs/theory.md section 10).
    moved = sum(stage.anchor_limit for stage in design.stages) if reanchors(design) else 0.0
    remainder = signals.rho_floor[0] * (signals.a_0 + moved)
    accuracy = design.omega[0]
    final = accuracy if remainder == 0.0 else math.nextafter(accuracy + remainder, math.inf)
    return {
        "accuracy": finite(accuracy),
        "final_error": finite(final),
        "offset": finite(signals.a_0),
        "funnel": _text(design.spec.performance.funnel),
        "rho": [
            shape(rho, floor, rate)
            for rho, floor, rate in zip(
                design.spec.performance.rho, signals.rho_floor, signals.rho_rate, strict=True
            )
        ],
    }


def measurement_entry(design: Design) -> dict[str, object]:
    """Lay out quantizer, noise, delta_0 and the converter of every state [unit of x_i]."""
    measurement = design.spec.measurement
    keys = ("step", "dead_zone", "hysteresis", "minimum", "density", "threshold")
    quantizers = []
    for quantizer in measurement.quantizers:
        given = {key: getattr(quantizer, key) for key in keys}
        numbers = {key: constant(value) for key, value in given.items() if value is not None}
        quantizers.append({"kind": str(quantizer.kind), **numbers})
    return {
        "delta": finites(design.conditions.delta),
        "quantizer": quantizers,
        "noise": [constant(value) for value in measurement.noise],
        "adc": [
            _converter(quantizer, max(ranges))
            for quantizer, ranges in zip(measurement.quantizers, _ranges(design), strict=True)
        ],
    }


def _ranges(design: Design) -> tuple[tuple[float, ...], ...]:
    """X_i of every stage, state by state: the converter is the same in all of them."""
    chains = (*(stage.bounds for stage in design.stages), design.bounds)
    return tuple(zip(*(bounds.X for bounds in chains), strict=True))


def _converter(quantizer: QuantizerSpec, reach: float) -> dict[str, object] | None:
    """Lay out the range +-X_i and the bits that a converter needs; None for exact measurement."""
    if quantizer.kind is QuantizerKind.NONE or quantizer.step is None:
        return None
    step = constant(quantizer.step)
    bits = cell_bits(quantizer, reach) if math.isfinite(reach) else None
    return {"range": finite(reach), "step": step, "bits": bits}


def cell_bits(quantizer: QuantizerSpec, reach: float) -> int:
    """Give the bits that tell the cells of a quantizer on [-X, X] apart.

    Parameters
    ----------
    quantizer : QuantizerSpec
        Of a kind that has a step.
    reach : float
        X, finite [unit of the state].

    Returns
    -------
    int
        ceil(log2(2 X / step)), at least 1; for a logarithmic-uniform quantizer its cells below
        the threshold are counted as what they are.

    References
    ----------
    docs/theory.md sections 2 (X_i) and 3.
    """
    step = Fraction(1 if quantizer.step is None else constant(quantizer.step))
    cells = math.ceil(2 * Fraction(reach) / step)
    if quantizer.minimum and quantizer.density and quantizer.threshold:
        least, threshold = constant(quantizer.minimum), constant(quantizer.threshold)
        ratio = (1.0 + constant(quantizer.density)) / (1.0 - constant(quantizer.density))
        inner = math.ceil(math.log(max(min(reach, threshold) / least, 1.0)) / math.log(ratio))
        outer = math.ceil(max(Fraction(reach) - Fraction(threshold), Fraction(0)) / step)
        cells = 1 + 2 * (inner + outer)
    # The smallest b with 2^b >= cells, in integers: a logarithm may land on the wrong side.
    return max(1, (cells - 1).bit_length())


def sampling_entry(design: Design) -> dict[str, object]:
    """Lay out sample period, delay and the times that the code tolerates [s]."""
    period = constant(design.spec.sampling.period)
    return {
        "period": period,
        "delay": constant(design.spec.sampling.delay),
        "hold": finite(design.conditions.hold),
        "largest_certified_period": finite(design.largest_certified_period),
        "longest_run": longest_run(period, design.arithmetic),
    }


def arithmetic_entry(design: Design) -> dict[str, object]:
    """Lay out what the code computes with: an empty table for binary64 and the libm."""
    arithmetic = design.arithmetic
    if arithmetic == DEFAULT:
        return {}
    return {
        "arithmetic": {"real": str(arithmetic.real), "math": str(arithmetic.mathematics)},
    }


def longest_run(period: float, arithmetic: Arithmetic = DEFAULT) -> float:
    """Give the time since the first sample after which the controller holds its command [s].

    Parameters
    ----------
    period : float
        Sample period [s], 0 for a continuous design.
    arithmetic : Arithmetic
        Of the clock.

    Returns
    -------
    float
        1e6 s, or the first time at which one unit in the last place of t is more than a
        sixteenth of the period; in binary32 64 s where there is no period.

    References
    ----------
    SPEC section 3, status BAD_TIME.
    """
    if period <= 0.0:
        return SHORT_RUN if arithmetic.single else LONGEST_RUN
    exponent = math.frexp(period / 16.0)[1]
    return min(LONGEST_RUN, math.ldexp(1.0, exponent + arithmetic.bits - 1))
