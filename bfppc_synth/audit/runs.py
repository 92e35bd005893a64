"""Runs of the bare law: the gains themselves, without the clamp and the screening of the code."""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from bfppc_synth.audit.records import Escape, Origin, RunReport
from bfppc_synth.codegen.law import build_law
from bfppc_synth.codegen.provenance import make_provenance
from bfppc_synth.codegen.python import render_controller
from bfppc_synth.errors import UsageError
from bfppc_synth.model.trajectory import ROUNDING, within
from bfppc_synth.simulation.loop import load_controller, simulate_nominal
from bfppc_synth.simulation.staged import stage_widths

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.audit.records import Completion
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.model.trajectory import Trajectory
    from bfppc_synth.simulation.loading import Controller

# Clamp and screening are moved out by this factor: what an audit asks is what the gains do.
_LIFT = 1e3


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What |e_i| must stay below in every stage, and |u| below; infinity asks nothing."""

    widths: tuple[tuple[float, ...], ...]
    peak: float


def limits_of(design: Design, completion: Completion) -> Limits:
    """Collect the tubes and the peak input of a design.

    Half-widths that are nobody's choice, only the closest to an answer, break no promise, and
    neither does the peak input that follows from them.
    """
    *free, last = stage_widths(design)
    if completion.origin is not Origin.CLOSEST:
        return Limits(widths=(*free, last), peak=design.bounds.U)
    names = [f"synthesis.p.{state}" for state in design.spec.states]
    kept = tuple(
        math.inf if name in completion.filled else width
        for name, width in zip(names, last, strict=True)
    )
    return Limits(widths=(*free, kept), peak=math.inf)


def bare(design: Design) -> Design:
    """Widen what clamps and screens the generated code until it never acts."""
    bounds = design.bounds
    widened = replace(bounds, U=_LIFT * bounds.U, X=tuple(_LIFT * X for X in bounds.X))
    # The certificate's own clamp would be taken otherwise.
    certificate = replace(design.certificate, document="")
    return replace(design, bounds=widened, certificate=certificate)


def run_from(
    design: Design, start: tuple[float, ...], limits: Limits
) -> tuple[RunReport, Trajectory]:
    """Run the nominal plant under the bare law, and hold the run against the form's bounds.

    Parameters
    ----------
    design : Design
        Of the file's own form.
    start : tuple[float, ...]
        x(0) [unit of x_i].
    limits : Limits
        What the run is held against.

    Returns
    -------
    tuple
        The report, and the run itself.

    References
    ----------
    docs/theory.md sections 7 and 8; SPEC section 1, Simulation.
    """
    lifted = bare(design)
    run = simulate_nominal(lifted, _controller(lifted), start=start)
    report = RunReport(
        start=start,
        declared=_is_declared(design.spec, start),
        horizon=float(run.t[-1]),
        half_widths=limits.widths[-1] if not run.stages else run.half_widths,
        max_abs_e=run.max_abs_e,
        max_abs_u=run.max_abs_u,
        peak_input=limits.peak,
        diverged=not run.complete,
        stages=run.stages,
        escape=_escape(run, limits),
    )
    return report, run


def full_start(spec: PlantSpec, given: Mapping[str, float]) -> tuple[float, ...]:
    """Fill a start up with the middles of the declared ranges.

    Raises
    ------
    UsageError
        If it names a state that the plant does not have.
    """
    unknown = sorted(set(given) - set(spec.states))
    if unknown:
        raise UsageError(
            f"--x0 {unknown[0]}: {spec.name} has no such state; fix: use {', '.join(spec.states)}"
        )
    return tuple(
        given.get(name, 0.5 * (box.lower.approximate + box.upper.approximate))
        for name, box in zip(spec.states, spec.initial, strict=True)
    )


def _is_declared(spec: PlantSpec, start: tuple[float, ...]) -> bool:
    return all(
        box.lower.approximate <= value <= box.upper.approximate
        for box, value in zip(spec.initial, start, strict=True)
    )


def _controller(design: Design) -> type[Controller]:
    text = render_controller(build_law(design), make_provenance(design))
    with tempfile.TemporaryDirectory(prefix="bfppc-synth-") as scratch:
        path = Path(scratch) / "controller.py"
        path.write_text(text, encoding="utf-8")
        return load_controller(path)


def _escape(run: Trajectory, limits: Limits) -> Escape | None:
    """Find the first row outside its tube; else what only the maxima between rows show."""
    peak = limits.peak
    stages = [1] * len(run.t) if run.stage is None else run.stage.tolist()
    for number in sorted(set(stages)):
        # Stages follow each other: the first one that is left wrongly comes first in time.
        found = _left(run, stages, number, limits.widths[number - 1])
        if found is not None:
            return found
    for number, reached in _peaks(run):
        bounds = limits.widths[0 if number is None else number - 1]
        worst = next((i for i, p in enumerate(bounds) if not within((reached[i],), (p,))), None)
        if worst is not None:
            return Escape(
                error=worst + 1,
                stage=number,
                # No row of the stage shows it: it was at the switch, or between thinned rows.
                time=None if number is None else float(run.t[stages.index(number)]),
                jump=number is not None and number > 1,
                bound=bounds[worst],
                reached=reached[worst],
            )
    if not within((run.max_abs_u,), (peak,)):
        rows = abs(run.u) > peak * (1.0 + ROUNDING)
        time = float(run.t[rows.argmax()]) if rows.any() else None
        return Escape(error=0, stage=None, time=time, jump=False, bound=peak, reached=run.max_abs_u)
    return None


def _peaks(run: Trajectory) -> list[tuple[int | None, tuple[float, ...]]]:
    """Maxima of every stage that the run was in."""
    if run.stages:
        return [(entry.stage, entry.max_abs_e) for entry in run.stages]
    return [(None, run.max_abs_e)]


def _left(
    run: Trajectory, stages: list[int], number: int, widths: tuple[float, ...]
) -> Escape | None:
    import numpy as np

    mask = np.array(stages) == number
    outside = (abs(run.e) > np.array(widths) * (1.0 + ROUNDING)) & mask[:, None]
    rows = outside.any(axis=1)
    if not rows.any():
        return None
    row = int(rows.argmax())
    error = int(outside[row].argmax())
    reached = {peaks.stage: peaks.max_abs_e for peaks in run.stages}.get(number, run.max_abs_e)
    return Escape(
        error=error + 1,
        stage=number if run.stages else None,
        time=float(run.t[row]),
        jump=False,
        bound=widths[error],
        reached=reached[error],
    )
