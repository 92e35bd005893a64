"""What asking less of each requirement would buy, as report.json has it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.report.numbers import finite

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design


def sensitivity_entries(design: Design) -> list[dict[str, object]]:
    """Lay out the estimates, in percent; an empty list where there are none.

    ``U_percent`` and ``slope_percent`` are the changes of the peak input and of the slope of
    phi_n when 10 % less is asked (``eased`` instead of ``given``) and the gains are chosen anew.
    """
    return [
        {
            "path": one.path,
            "given": one.given,
            "eased": one.eased,
            "U_percent": finite(round(100.0 * one.peak_input, 2)),
            "slope_percent": finite(round(100.0 * one.slope, 2)),
            "kind": "estimate",
        }
        for one in design.sensitivities
    ]
