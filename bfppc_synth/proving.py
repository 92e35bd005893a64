"""From a judged design to the checker's answer."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bfppc_synth.gains.evaluation import Evaluation
    from bfppc_synth.gains.problem import DesignProblem
    from bfppc_synth.model.certificate import Certificate


def proved(problem: DesignProblem, found: Evaluation) -> Certificate:
    """Write the certificate of a design, and ask the separate checker.

    Parameters
    ----------
    problem : DesignProblem
        Plant, stages and center.
    found : Evaluation
        Gains, half-widths, and the tight bounds that they were judged with, if any.

    Returns
    -------
    Certificate
        Whatever the checker says.
    """
    from bfppc_synth.certificate.produce import judge, produce_certificate, tool_name
    from bfppc_synth.spec.canonical import plant_json

    document = json.loads(plant_json(problem.plant.spec))
    produced = produce_certificate(
        document,
        found.shapes,
        found.half_widths,
        tool=tool_name(),
        stages=() if problem.staging is None else problem.staging.stages,
        transition=None if problem.nominal is None else problem.nominal.model.transition,
        tight=found.tight,
    )
    return judge(document, produced)
