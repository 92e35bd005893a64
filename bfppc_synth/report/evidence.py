"""The part of report.json that says why to believe it: inequalities and simulations."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from bfppc_synth.report.numbers import finite, finites, largest
from bfppc_synth.report.stages import peaks_entry

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.certificate import Certificate, Inequality
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.model.trajectory import RunSummary, Trajectory

# The entry of the plant file that an engineer would change first, most specific first.
_PLACES = {
    "U0": ("measurement.quantizer", "measurement", "performance.accuracy"),
    "U1": ("dynamics.{state}.f_bound", "dynamics.{state}.f", "dynamics.{state}"),
    "U2": ("sampling.period", "dynamics.{state}.f_bound", "dynamics.{state}.f"),
    "T2": ("dynamics.{state}.f_bound", "dynamics.{state}.f", "dynamics.{state}"),
    "T1": ("dynamics.{state}.f_bound", "dynamics.{state}.f", "dynamics.{state}"),
    "T3": ("synthesis.stages", "synthesis.p", "synthesis.method"),
    "tight": ("synthesis.bounds",),
    "f_bound": ("dynamics.{state}.f_bound", "dynamics.{state}"),
    "g_bound": ("dynamics.{state}.g_bound", "dynamics.{state}.g", "dynamics.{state}"),
    "g_min": ("dynamics.{state}.g_min", "dynamics.{state}.g", "dynamics.{state}"),
    "limit": ("actuator.limit", "actuator"),
    "funnel": ("performance.funnel", "performance"),
}


def failures(certificate: Certificate) -> tuple[str, ...]:
    """Name what fails: the certificate's own sentences, else its inequalities."""
    named = tuple(
        f"{entry.id} {entry.equation}: {entry.lhs[0]:.6g} is not above {entry.rhs[1]:.6g}"
        for entry in certificate.inequalities
        if not entry.holds
    )
    return certificate.failures or named


def inequality_entry(spec: PlantSpec, entry: Inequality) -> dict[str, object]:
    """Lay out one inequality: both enclosures, margin, what drives it, its line of the file."""
    margin, scale = entry.margin, max(abs(entry.lhs[0]), abs(entry.rhs[1]))
    relative = margin / scale if scale > 0.0 else math.inf
    path = _place(spec, entry.id)
    place = spec.place(path)
    lhs, rhs = entry.lhs, entry.rhs
    if entry.id.startswith("tight") and lhs == rhs:
        # Proved cell by cell: there are no two numbers to print.
        lhs = rhs = (math.inf, math.inf)
        margin = math.inf
    return {
        "id": entry.id,
        "equation": entry.equation,
        "lhs": finites(lhs),
        "rhs": finites(rhs),
        "margin": finite(margin),
        "relative_margin": finite(relative),
        "holds": entry.holds,
        "binding_terms": [
            {"term": term, "share": finite(share)} for term, share in entry.binding_terms
        ],
        "place": {"path": path, "line": place.line, "column": place.column},
    }


def _place(spec: PlantSpec, identifier: str) -> str:
    match = re.fullmatch(r"([A-Za-z0-9_]+)'?(?:\.\w+)?(?:\[(\w+)\])?", identifier)
    family, state = (match[1], match[2] or spec.states[0]) if match else ("", spec.states[0])
    known = {path for path, _ in spec.places}
    candidates = [path.format(state=state) for path in _PLACES.get(family, ())]
    # An obligation of a later issue still gets the nearest sensible line.
    candidates.append("performance.accuracy")
    return next((path for path in candidates if path in known), candidates[-1])


def simulation_entry(
    design: Design, nominal: Trajectory, adversaries: tuple[RunSummary, ...]
) -> dict[str, object]:
    """Lay out the nominal run and the adversarial runs beside the certified bounds."""
    reached = nominal.max_abs_e
    input_share = nominal.max_abs_u / design.bounds.U if design.bounds.U > 0.0 else math.inf
    return {
        "max_abs_e": finites(reached),
        "max_abs_u": finite(nominal.max_abs_u),
        "within_bounds": nominal.within_bounds,
        "share_of_p": _shares(reached, nominal.half_widths),
        "share_of_U": finite(input_share),
        **_funnel(nominal.funnel_share),
        "horizon": finite(float(nominal.t[-1])),
        "steps": len(nominal.t) - 1,
        "statuses": sorted(set(nominal.status)),
        **peaks_entry(nominal.stages),
        "adversaries": _adversaries(design, adversaries),
    }


def _funnel(share: float | None) -> dict[str, object]:
    """Largest share of the funnel that |y - y_d| took; nothing where the file has none."""
    return {} if share is None else {"share_of_funnel": finite(share)}


def _shares(reached: Sequence[float], half_widths: Sequence[float]) -> list[float | None]:
    return [finite(value / width) for value, width in zip(reached, half_widths, strict=True)]


def _width(design: Design, run: RunSummary, index: int) -> float:
    return (run.stages[-1].half_widths if run.stages else design.omega)[index]


def _adversaries(design: Design, runs: tuple[RunSummary, ...]) -> dict[str, object]:
    numbers = range(design.spec.order)
    reached = [largest([run.max_abs_e[i] for run in runs]) for i in numbers]
    # Runs may end in different stages: each error counts as a share of its own tube.
    shares = [largest([run.max_abs_e[i] / _width(design, run, i) for run in runs]) for i in numbers]
    funnel = design.plant.funnel is not None
    return {
        "runs": len(runs),
        "max_abs_e": finites(reached),
        "max_abs_u": finite(largest([run.max_abs_u for run in runs])),
        "share_of_p": finites(shares),
        **_funnel(largest([run.funnel_share or 0.0 for run in runs]) if funnel else None),
        "within_bounds": all(run.within_bounds for run in runs),
        "each": [
            {
                "run": run.run,
                "kind": run.kind,
                "start": finites(run.start),
                "max_abs_e": finites(run.max_abs_e),
                "max_abs_u": finite(run.max_abs_u),
                "within_bounds": run.within_bounds,
                **peaks_entry(run.stages),
            }
            for run in runs
        ],
    }
