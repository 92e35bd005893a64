"""Refuse what binary64 does not resolve, before anything is searched."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.bounds.admission import refused
from bfppc_synth.bounds.nominal.center import LARGEST
from bfppc_synth.expressions.resolution import lower_bound, upper_bound

if TYPE_CHECKING:
    from bfppc_synth.model.plant import Plant

# One unit in the last place of a number, relative to it.
_UNIT = 2.0**-52


def require_representable(plant: Plant) -> None:
    """Refuse starts that overflow, and an accuracy that is lost in the rounding of the output.

    Parameters
    ----------
    plant : Plant
        With or without an accuracy.

    Raises
    ------
    PlantFileError
        At the start, or at the accuracy.

    References
    ----------
    docs/theory.md section 6: the controller's own rounding counts as a measurement error.
    """
    spec = plant.spec
    for state, start in zip(spec.states, spec.initial, strict=True):
        size = max(abs(float(lower_bound(start.lower))), abs(float(upper_bound(start.upper))))
        if size > LARGEST:
            raise refused(
                plant,
                f"initial.{state}",
                f"{size:.3g} is beyond {LARGEST:g}: its powers leave the range of binary64",
                "use other units",
            )
    accuracy, first = spec.performance.accuracy, spec.initial[0]
    largest = max(abs(first.lower.approximate), abs(first.upper.approximate))
    if accuracy is not None and accuracy.approximate <= _UNIT * largest:
        raise refused(
            plant,
            "performance.accuracy",
            f"{accuracy.text} is not above {_UNIT * largest:.3g}, one unit in the last place of a"
            f" {spec.states[0]} of {largest:.6g}: the controller cannot tell such errors apart",
            "choose a larger accuracy, or measure from another origin",
        )
