"""The nominal run: nothing that the plant file leaves open is used against the controller."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.simulation.references import first_references, initial_box, sine
from bfppc_synth.simulation.stepping import Action

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.plant import Dynamics
    from bfppc_synth.simulation.references import Derivatives, Reference
    from bfppc_synth.simulation.tracking import Tracking


class Nominal:
    """Nominal parameters, no disturbance, noise or delay (SPEC section 1, Simulation).

    Parameters
    ----------
    design : Design
        Its plant file.
    dynamics : Dynamics
        The plant as functions.
    start : tuple[float, ...] | None
        x(0) [unit of x_i]; None is the middle of the initial box.
    """

    kind = "nominal"

    def __init__(self, design: Design, dynamics: Dynamics, start: tuple[float, ...] | None) -> None:
        middle = tuple(0.5 * (lower + upper) for lower, upper in initial_box(design.spec))
        self.start = middle if start is None else start
        self.truth = dynamics.model
        self.y_d: Reference
        self.derivatives: Derivatives | None = None
        if dynamics.reference is not None:
            self.y_d = dynamics.reference
        else:
            # From 0 where the offset allows it, else from the value nearest to 0.
            lower, upper = first_references(design.spec, self.start[0])
            supplied = sine(design.spec, min(max(0.0, lower), upper), 1.0)
            self.y_d, self.derivatives = supplied, supplied.derivatives
        quiet = (0.0,) * dynamics.order
        self._action = Action(arguments=dynamics.nominal, noise=quiet, error=0.0, until=math.inf)

    def begin(self, tracking: Tracking) -> None:
        """Do nothing: the nominal plant does not react."""

    def act(self, k: int, t: float, x: Sequence[float]) -> Action:
        """Do the same for ever."""
        del k, t, x
        return self._action

    def lag(self) -> float:
        """Let every command act at once."""
        return 0.0
