"""From a plant to Theorem 1's design problem, sound or printed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.bounds.performance import rho_rate
from bfppc_synth.bounds.rounding import above
from bfppc_synth.bounds.theorem1 import CONSTANT_NODES, SCHEDULE_NODES
from bfppc_synth.bounds.true_starts import (
    noise_bounds,
    printed_margins,
    printed_start_center,
    rho_slope,
    true_start_center,
)
from bfppc_synth.errors import UsageError
from bfppc_synth.gains.methods.theorem1 import Theorem1, Theorem1Printed
from bfppc_synth.gains.theorem1.problem import Theorem1Problem, given_steps, implied_c_0
from bfppc_synth.model.spec import Form
from bfppc_synth.model.theorem1 import Schedule

if TYPE_CHECKING:
    from bfppc_synth.gains.problem import Weights
    from bfppc_synth.model.bounds import CenterBounds, Majorants
    from bfppc_synth.model.plant import Plant


def theorem1_center(plant: Plant) -> CenterBounds:
    """Bound rho x_i(0): by the true starts, or as the printed form does."""
    spec = plant.spec
    if spec.synthesis.form is Form.PRINTED:
        return printed_start_center(spec, printed_margins(spec))
    return true_start_center(spec)


def theorem1_problem(
    plant: Plant, majorants: Majorants, weights: Weights, margin: float
) -> Theorem1Problem:
    """State the problem that a plant file with ``method: theorem1`` asks for.

    Parameters
    ----------
    plant : Plant
        Every g = 1, reference 0, one rho, continuous measurement: what the plant file's rules
        have made sure of.
    majorants : Majorants
        What bounds it.
    weights : Weights
        The objective.
    margin : float
        Relative room that every inequality of the rounded design keeps.

    Returns
    -------
    Theorem1Problem
        ``form: printed`` takes delta_M as one number, the largest.

    Raises
    ------
    UsageError
        If the accuracy is missing.

    References
    ----------
    docs/theory.md section 7.
    """
    spec = plant.spec
    synthesis, accuracy = spec.synthesis, spec.performance.accuracy
    if accuracy is None:
        raise UsageError("performance.accuracy is required in this version")
    printed = synthesis.form is Form.PRINTED
    noise = noise_bounds(spec)
    if printed:
        noise = (max(noise),) * spec.order
    options = synthesis.theorem1
    steps = given_steps(synthesis, accuracy.approximate)
    c_0 = None if options is None or options.c_0 is None else options.c_0.approximate
    if printed and c_0 is None:
        c_0 = implied_c_0(steps, noise)
    polynomial = any(step.H is not None and len(step.H) > 1 for step in steps)
    scheduled = polynomial or (options is not None and options.H is Schedule.SCHEDULED)
    limit = spec.actuator.limit
    return Theorem1Problem(
        plant=plant,
        majorants=majorants,
        center=theorem1_center(plant),
        noise=noise,
        rate=above(rho_slope(spec) if printed else rho_rate(spec.performance.rho[0])),
        steps=steps,
        c_0=c_0,
        nodes=SCHEDULE_NODES if scheduled else CONSTANT_NODES,
        theorem=Theorem1Printed() if printed else Theorem1(),
        weights=weights,
        limit=None if limit is None else limit.approximate,
        margin=margin,
    )
