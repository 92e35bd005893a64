"""Simulations of a design: the nominal run and the adversarial ones (SPEC section 1).

Evidence, never proof: the certificate covers every plant within the bounds, a run is one.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.errors import UsageError
from bfppc_synth.model.trajectory import RunSummary, StagePeaks, Trajectory, within
from bfppc_synth.simulation.adversary import Adversary
from bfppc_synth.simulation.loading import load_controller
from bfppc_synth.simulation.nominal import Nominal
from bfppc_synth.simulation.plant import compile_plant, modelled
from bfppc_synth.simulation.recorder import DIVERGED
from bfppc_synth.simulation.scheme import Coverage, choose_scheme
from bfppc_synth.simulation.staged import stage_widths
from bfppc_synth.simulation.stepping import Setting, run

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.loading import Controller
    from bfppc_synth.simulation.plant import Dynamics
    from bfppc_synth.simulation.scheme import Scheme
    from bfppc_synth.simulation.stepping import Run

__all__ = ["coverage", "load_controller", "simulate_adversaries", "simulate_nominal"]

#: Rows of a nominal run that are kept; the maxima are over every step.
_ROWS = 200_000

#: By what the steps are divided before a run counts as outside.
_FINER = 4


def coverage(design: Design) -> Coverage:
    """Say whether the certificate speaks about the simulations of a design.

    Parameters
    ----------
    design : Design
        Its plant file.

    Returns
    -------
    Coverage
        Not covered: form printed; a quantizer without a sample period whose
        ``simulation.period`` exceeds the largest certified period; and steps in which the
        plant alone crosses its tube several times. Only a covered run outside its bounds
        contradicts the certificate.
    """
    return choose_scheme(design).coverage


def simulate_nominal(
    design: Design,
    controller: type[Controller],
    *,
    horizon: float | None = None,
    start: tuple[float, ...] | None = None,
) -> Trajectory:
    """Run the nominal plant under the generated controller.

    Parameters
    ----------
    design : Design
        Plant, gains, tube, bounds.
    controller : type[Controller]
        Class of the generated controller.py.
    horizon : float | None
        Simulated time [s]; None is the plant file's.
    start : tuple[float, ...] | None
        x(0) [unit of x_i]; None is the middle of the initial box.

    Returns
    -------
    Trajectory
        Rows every plant step, thinned evenly beyond 200,000; maxima over all steps.

    Raises
    ------
    UsageError
        If the horizon is not positive, or the start has not one number below 1e12 per state.

    References
    ----------
    docs/theory.md section 3; SPEC section 1, Simulation.
    """
    time = design.spec.simulation.horizon if horizon is None else horizon
    if not 0.0 < time < math.inf:
        raise UsageError(f"--horizon: {time} is no positive time [s]")
    if start is not None and len(start) != design.spec.order:
        raise UsageError(
            f"--x0: {len(start)} numbers for a plant of order {design.spec.order}\n"
            "  fix: give one number per state"
        )
    if start is not None and not all(abs(x) < DIVERGED for x in start):
        raise UsageError(f"--x0: {max(start, key=abs)} is not below {DIVERGED:g} in magnitude")
    dynamics = _dynamics(design)

    def attempt(scheme: Scheme) -> Run:
        setting = _setting(design, controller, scheme, time)
        stride = 1 + setting.samples * scheme.substeps // _ROWS
        return run(setting, Nominal(design, dynamics, start), stride=stride)

    finished = _settled(design, attempt)
    table = finished.recorder.table()
    stages = _stage_peaks(design, finished)
    return Trajectory(
        t=table.t,
        x=table.x,
        q=table.q,
        e=table.e,
        r=table.r,
        u=table.u,
        y_d=table.y_d,
        half_widths=stages[-1].half_widths if stages else design.omega,
        u_max=design.bounds.U,
        status=tuple(int(value) for value in table.status),
        peak_e=tuple(finished.recorder.peak_e),
        peak_u=finished.recorder.peak_u,
        complete=finished.complete,
        stage=table.stage if stages else None,
        stages=stages,
        funnel_share=finished.recorder.funnel_share,
    )


def simulate_adversaries(
    design: Design, controller: type[Controller], *, runs: int = 20
) -> tuple[RunSummary, ...]:
    """Run seeded adversaries within everything that the certificate assumes.

    Parameters
    ----------
    design : Design
        Plant, gains, tube, bounds; ``spec.simulation.seed`` seeds every run by its number.
    controller : type[Controller]
        Class of the generated controller.py.
    runs : int
        How many.

    Returns
    -------
    tuple[RunSummary, ...]
        Maxima of each run over the plant file's horizon; run k is the same for any ``runs``.

    References
    ----------
    docs/theory.md sections 2 and 3; SPEC section 1, Simulation.
    """
    dynamics = _dynamics(design)
    simulation = design.spec.simulation

    def summary(number: int) -> RunSummary:
        def attempt(scheme: Scheme) -> Run:
            nature = Adversary(design, dynamics, scheme, seed=simulation.seed, run=number)
            return run(_setting(design, controller, scheme, simulation.horizon), nature, stride=0)

        finished = _settled(design, attempt)
        return RunSummary(
            run=number,
            kind=finished.nature.kind,
            start=finished.nature.start,
            max_abs_e=tuple(finished.recorder.peak_e),
            max_abs_u=finished.recorder.peak_u,
            within_bounds=_inside(design, finished),
            stages=_stage_peaks(design, finished),
            funnel_share=finished.recorder.funnel_share,
        )

    return tuple(summary(number) for number in range(runs))


def _dynamics(design: Design) -> Dynamics:
    plant = design.plant
    return compile_plant(plant if design.nominal is None else modelled(plant))


def _setting(
    design: Design, controller: type[Controller], scheme: Scheme, horizon: float
) -> Setting:
    return Setting(
        design=design, controller=controller, scheme=scheme, samples=scheme.samples(horizon)
    )


def _settled(design: Design, attempt: Callable[[Scheme], Run]) -> Run:
    """Run; once more with finer steps before a covered run counts as outside.

    A step that is too coarse for the plant would otherwise be taken for a broken promise.
    """
    scheme = choose_scheme(design)
    first = attempt(scheme)
    if _inside(design, first) or scheme.coverage is Coverage.NOT_COVERED:
        return first
    second = attempt(scheme.finer(_FINER))
    return second if _inside(design, second) else first


def _inside(design: Design, finished: Run) -> bool:
    recorder = finished.recorder
    widths = stage_widths(design)
    tube = all(within(peaks, widths[stage - 1]) for stage, peaks in recorder.peaks.items())
    tube = tube and within((recorder.funnel_share or 0.0,), (1.0,))
    return finished.complete and tube and within((recorder.peak_u,), (design.bounds.U,))


def _stage_peaks(design: Design, finished: Run) -> tuple[StagePeaks, ...]:
    """Lay out the stages of a law that has any."""
    if not design.stages:
        return ()
    widths = stage_widths(design)
    return tuple(
        StagePeaks(stage=stage, max_abs_e=tuple(peaks), half_widths=widths[stage - 1])
        for stage, peaks in sorted(finished.recorder.peaks.items())
    )
