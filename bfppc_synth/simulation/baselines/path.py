"""The path r_1 = y_d + rho_1 a, or y_d + b, that every method is given, with its derivatives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from bfppc_synth.errors import BfppcError
from bfppc_synth.expressions.evaluate import FLOAT_FUNCTIONS, evaluate
from bfppc_synth.expressions.nominal import fading_series, start_series, transition_weights
from bfppc_synth.expressions.taylor import TaylorFunctions
from bfppc_synth.model.spec import Anchor, RhoKind
from bfppc_synth.simulation.baselines.arrays import ArrayStatements, array_function
from bfppc_synth.simulation.tracking import performance_function

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.nominal import NominalModel
    from bfppc_synth.model.spec import RhoSpec
    from bfppc_synth.simulation.baselines.arrays import Array
    from bfppc_synth.simulation.references import Sine


@dataclass(frozen=True, slots=True, kw_only=True)
class Path:
    """What is asked of the output in every run, at every sample.

    ``derivatives`` are r_1 and its derivatives, shape (count, K+1, R), count = n+1, or 1 where
    the reference lacks derivatives (``missing`` says why); ``y_d`` and ``edge``, the bound on
    abs(y - y_d), are (K+1, R); ``fade`` are rho_2..rho_n, (K+1, n-1).
    """

    derivatives: Array
    y_d: Array
    edge: Array
    fade: Array
    missing: str


def make_path(
    design: Design,
    times: Array,
    starts: Sequence[tuple[tuple[float, ...], tuple[float, ...]]],
    supplied: Sequence[Sine | None],
) -> Path:
    """Lay the path of every run.

    Parameters
    ----------
    design : Design
        Reference, performance functions or transition, accuracy.
    times : array (K+1,)
        The samples [s].
    starts : sequence of R pairs
        Measured and true x(0) of every run: the path begins where the measurement is.
    supplied : sequence of R
        The reference of a run, None where the plant file has it.

    References
    ----------
    docs/theory.md sections 2 and 4.
    """
    columns = [
        _reference(design, times) if sine is None else _sampled(sine, times) for sine in supplied
    ]
    missing = "" if columns[0].shape[0] > 1 else "the reference has no derivatives everywhere"
    reference = np.stack(columns, axis=2)
    count = reference.shape[0]
    offset, promised = np.empty_like(reference), np.empty_like(reference[0])
    exact = design.spec.synthesis.anchor is Anchor.EXACT and design.nominal is None
    faded = _performance(design.spec.performance.rho[0], times, count)
    for run, (measured, true) in enumerate(starts):
        if design.nominal is not None:
            begun = reference[:, 0, run].tolist()
            offset[:, :, run] = _transition(design.nominal, measured, begun, times)[:count]
        else:
            offset[:, :, run] = (measured[0] - reference[0, 0, run]) * faded
        promised[:, run] = offset[0, :, run]
        if exact:
            promised[:, run] = (true[0] - reference[0, 0, run]) * faded[0]
    fade = [[performance_function(rho)(t) for t in times] for rho in design.spec.performance.rho]
    return Path(
        derivatives=reference + offset,
        y_d=reference[0],
        edge=np.abs(promised) + design.omega[0],
        fade=np.array(fade[1:]).reshape(len(fade) - 1, len(times)).T,
        missing=missing,
    )


def _reference(design: Design, times: Array) -> Array:
    """y_d and its n derivatives from the plant file's expression, shape (n+1, K+1)."""
    plant, out = design.plant, ArrayStatements()
    reference = sp.S.Zero if plant.reference is None else plant.reference
    functions: TaylorFunctions[str] = TaylorFunctions(out, plant.order + 1)
    try:
        series = evaluate(reference, {plant.time: ("t", "1.0")}, functions)
    except BfppcError:
        out, series = ArrayStatements(), ()
    if not series:
        series = (evaluate(reference, {plant.time: "t"}, out),)
        count = 1
    else:
        count = plant.order + 1
    values = array_function(("t",), out, series)(times)
    rows = np.zeros((count, len(times)))
    for j, value in enumerate(values):
        rows[j] = value * math.factorial(j)
    return rows


def _sampled(sine: Sine, times: Array) -> Array:
    """y_d and its n derivatives of a reference supplied at run time, shape (n+1, K+1)."""
    return np.array([sine.derivatives(float(t)) for t in times]).T


def _performance(rho: RhoSpec, times: Array, count: int) -> Array:
    """Rho and its derivatives, shape (count, K+1); those of (52) jump where it reaches 0."""
    rows = np.zeros((count, len(times)))
    if rho.kind is RhoKind.COSINE:
        t_s = 1.0 if rho.t_s is None else rho.t_s.approximate
        alive = times < math.pi * t_s
        for j in range(count):
            wave = 0.5 * np.cos(times / t_s + 0.5 * math.pi * j) / t_s**j
            rows[j] = np.where(alive, wave + (0.5 if j == 0 else 0.0), 0.0)
        return rows
    rate = 1.0 if rho.rate is None else rho.rate.approximate
    floor = 0.0 if rho.floor is None else rho.floor.approximate
    for j in range(count):
        rows[j] = (1.0 - floor) * (-rate) ** j * np.exp(-rate * times)
    rows[0] += floor
    return rows


def _transition(
    model: NominalModel, measured: Sequence[float], reference: Sequence[float], times: Array
) -> Array:
    """B and its n derivatives from the measured start, shape (n+1, K+1)."""
    order, duration = model.order, model.transition
    course = start_series(model, FLOAT_FUNCTIONS, tuple(measured))
    begun = tuple(float(value) / math.factorial(j) for j, value in enumerate(reference[:order]))
    gap = TaylorFunctions(FLOAT_FUNCTIONS, order).sub(course, begun)
    gap = tuple(gap) + (0.0,) * (order - len(gap))
    weights = transition_weights(FLOAT_FUNCTIONS, gap, duration)
    out = ArrayStatements()
    names = tuple(f"w{j}" for j in range(order))
    series = fading_series(out, names, "s", repr(duration), length=order + 1)
    share = np.minimum(times / duration, 1.0)
    values = array_function(("s", *names), out, series)(share, *weights)
    rows = np.zeros((order + 1, len(times)))
    for j, value in enumerate(values):
        rows[j] = np.where(times < duration, value * math.factorial(j), 0.0)
    return rows
