"""Everything that a plant file asks for and that could be asked for less."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.model.spec import CenterKind, Method
from bfppc_synth.reasons.facts import disturbances, offset, parameters, starts
from bfppc_synth.reasons.sensors import noise, quantizers
from bfppc_synth.reasons.wishes import funnel, plain, quicker_transition, rho, transition

if TYPE_CHECKING:
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.reasons.requirement import Requirement

_TIMES = ("sampling.period", "sampling.delay")


def requirements_of(spec: PlantSpec, start: float = 0.0) -> tuple[Requirement, ...]:
    """List everything that this file asks for and that could be asked for less.

    Parameters
    ----------
    spec : PlantSpec
        A plant file without a design.
    start : float
        y_d(0): where the first state starts without an error [unit of y].

    Returns
    -------
    tuple[Requirement, ...]
        In the order of the file; what the chosen method and center do not read is left out.
    """
    nominal = spec.synthesis.center is CenterKind.NOMINAL
    found: list[Requirement | None] = [plain(spec, "performance.accuracy", "larger")]
    found += [transition(spec), quicker_transition(spec)] if nominal else [rho(spec)]
    found += [
        funnel(spec),
        *starts(spec, start),
        offset(spec),
        disturbances(spec),
        parameters(spec),
    ]
    if spec.synthesis.method is not Method.THEOREM2:
        found += [quantizers(spec), noise(spec)]
    found += [plain(spec, path, "smaller") for path in _TIMES]
    found.append(plain(spec, "actuator.error", "smaller"))
    return tuple(requirement for requirement in found if requirement is not None)
