"""A plant file with the requirement that an inverse objective has set."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from bfppc_synth.expressions.resolution import lower_bound, upper_bound
from bfppc_synth.model.chosen import Chosen
from bfppc_synth.model.expression import Constant, Number
from bfppc_synth.model.spec import Objective, QuantizerKind
from bfppc_synth.spec.build import simulation_times

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.model.spec import PlantSpec, QuantizerSpec, SimulationSpec

_LENGTHS = ("step", "dead_zone", "hysteresis", "minimum", "threshold")


def resolved(spec: PlantSpec, chosen: Chosen) -> PlantSpec:
    """Put the value of an inverse objective in the place of the file's.

    Parameters
    ----------
    spec : PlantSpec
        The file as read.
    chosen : Chosen
        The value: p_1, h [s], or the factor on every length of every quantizer.

    Returns
    -------
    PlantSpec
        With ``chosen``; source and document stay those of the file.
    """
    value = chosen.value
    match chosen.objective:
        case Objective.ACCURACY:
            performance = replace(spec.performance, accuracy=_constant(Fraction(value)))
            return replace(spec, performance=performance, chosen=chosen)
        case Objective.PERIOD:
            given = spec.sampling.period
            # The binary64 number nearest to the file's lower limit may be just below it.
            found = given if given.approximate == value else _constant(Fraction(value))
            sampling = replace(spec.sampling, period=found)
            simulation = _simulated(spec, found.approximate)
            return replace(spec, sampling=sampling, simulation=simulation, chosen=chosen)
        case Objective.RESOLUTION:
            quantizers = tuple(_scaled(q, value) for q in spec.measurement.quantizers)
            measurement = replace(spec.measurement, quantizers=quantizers)
            return replace(spec, measurement=measurement, chosen=chosen)
        case _:
            raise LookupError(chosen.objective)


def read_chosen(document: Mapping[str, Any]) -> Chosen | None:
    """Read what an inverse objective set from report.json.

    Raises
    ------
    KeyError, TypeError, ValueError
        If it is no such value.
    """
    if "chosen" not in document:
        return None
    value = float(document["chosen"]["value"])
    if not 0.0 < value < math.inf:
        raise ValueError(value)
    return Chosen(objective=Objective(document["chosen"]["objective"]), value=value)


def require_same(chosen: Chosen | None, certified: Mapping[str, Any] | None) -> None:
    """Compare what a report says was chosen with what its certificate is about.

    Raises
    ------
    ValueError
        If the two differ.
    """
    said = None
    if chosen is not None:
        said = {"objective": str(chosen.objective), "value": chosen.value.hex()}
    if said != certified:
        message = "report.json and certificate.json are about different values"
        raise ValueError(message)


def _constant(value: Fraction) -> Constant:
    near = float(value)
    return Constant(text=repr(near), tree=Number(value=value), exact=value, approximate=near)


def _scaled(quantizer: QuantizerSpec, factor: float) -> QuantizerSpec:
    """Scale every length: delta_0 grows by exactly the factor."""
    lengths: dict[str, Any] = {}
    for name in _LENGTHS:
        given = getattr(quantizer, name)
        if given is not None:
            # An irrational length is rounded outward: the file's is at most this.
            lengths[name] = _constant(Fraction(factor) * upper_bound(given))
    return replace(quantizer, **lengths)


def _simulated(spec: PlantSpec, sample_period: float) -> SimulationSpec:
    """Take the times of a run anew where the file leaves them to their defaults."""
    given = spec.simulation
    horizon, period = simulation_times(
        given.horizon if spec.gives("simulation.horizon") else None,
        given.period if spec.gives("simulation.period") else None,
        sample_period,
        any(q.kind is not QuantizerKind.NONE for q in spec.measurement.quantizers),
    )
    return replace(given, horizon=horizon, period=period)


def least_period(spec: PlantSpec) -> float:
    """Return the file's lower limit on the period as binary64, 0 where there is none [s]."""
    given = spec.sampling.period
    return given.approximate if lower_bound(given) > 0 else 0.0
