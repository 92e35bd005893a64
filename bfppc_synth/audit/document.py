"""An audit as the one object that ``check --json`` prints."""

from __future__ import annotations

import math
from importlib.metadata import version
from typing import TYPE_CHECKING

from bfppc_synth.audit.records import Answer
from bfppc_synth.model.shapes import Theorem1Gain

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bfppc_synth.audit.records import (
        Assumption,
        Audit,
        Escape,
        FormReport,
        Remedy,
        Row,
        RunReport,
        Side,
    )
    from bfppc_synth.model.expression import Constant
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.spec import GainSpec, PlantSpec

FORMAT = "bfppc-synth/check/1"
_SHAPE = ("k", "M", "epsilon", "c", "N")
_HEIGHT = ("gamma", "H", "H_star", "c", "N")


def audit_document(audit: Audit) -> dict[str, object]:
    """Lay out an audit; a number that is not finite is None.

    Parameters
    ----------
    audit : Audit
        From ``audit_plant``.

    Returns
    -------
    dict[str, object]
        Keys in a fixed order; places are those of the plant file as it was read.

    References
    ----------
    SPEC section 2, ``check``.
    """
    spec, completion = audit.spec, audit.completion
    candidate = completion.candidate
    held = bool(audit.runs) and all(run.held for run in audit.runs)
    return {
        "format": FORMAT,
        "name": spec.name,
        "order": spec.order,
        "method": str(spec.synthesis.method),
        "form": str(spec.synthesis.form),
        "status": str(audit.answer),
        "proved": audit.proved,
        "held_in_simulation": held,
        "broken": audit.answer is Answer.BROKEN,
        "states": list(spec.states),
        "gains": [audit_gain(gain) for gain in candidate.gains],
        "omega": {"p": _numbers(candidate.half_widths)},
        "c_0": candidate.c_0,
        "origin": str(completion.origin),
        "solved_for": list(completion.filled),
        "taken_as_0": list(completion.zeroed),
        "stages": [
            {
                "gains": [_given(gain) for gain in stage.gains],
                "omega": {"p": [_value(p) for p in stage.p]},
            }
            for stage in spec.synthesis.stages
        ],
        "forms": {
            "printed": None if audit.printed is None else _form(audit.printed),
            "sound": _form(audit.sound),
        },
        "inequalities": [_row(spec, row) for row in audit.rows],
        "assumptions": [_assumption(spec, entry) for entry in audit.assumptions],
        "runs": [_run(spec, run, audit.sound) for run in audit.runs],
        "notes": list(audit.notes),
        "tool": {"version": version("bfppc-synth"), "plant_sha256": spec.sha256},
    }


def audit_gain(gain: Gain) -> dict[str, object]:
    """Lay out one step as the numbers of its formula."""
    names = _HEIGHT if isinstance(gain, Theorem1Gain) else _SHAPE
    values = {name: getattr(gain, name) for name in names}
    return {name: list(v) if isinstance(v, tuple) else v for name, v in values.items()}


def _given(gain: GainSpec) -> dict[str, object]:
    values: dict[str, object] = {name: _value(getattr(gain, name)) for name in _SHAPE[:-1]}
    return {**values, "N": gain.N}


def _value(given: Constant | None) -> float | None:
    return None if given is None else given.approximate


def _form(report: FormReport) -> dict[str, object]:
    """Verdict and constants of one form; ``certificate`` is the separate checker's answer."""
    out: dict[str, object] = {"holds": report.holds, "certificate": None}
    certificate = report.certificate
    if certificate is not None:
        out["certificate"] = str(certificate.verdict)
        out["assumed"] = list(certificate.assumptions)
    out["failures"] = list(report.failures)
    bounds = report.bounds
    if bounds is not None:
        columns = ("X", "A", "L", "W", "B", "D", "F_star", "eta")
        out["bounds"] = {
            **{name: _numbers(getattr(bounds, name)) for name in columns},
            "U": _number(bounds.U),
            "slope": _number(bounds.slope),
        }
    return out


def _row(spec: PlantSpec, row: Row) -> dict[str, object]:
    sides = {"printed": row.printed, "sound": row.sound}
    return {
        "id": row.id,
        "equation": row.equation,
        "state": row.state,
        **{name: None if side is None else _side(spec, side) for name, side in sides.items()},
        "place": _place(spec, row.path),
        "notes": list(row.notes),
    }


def _side(spec: PlantSpec, side: Side) -> dict[str, object]:
    return {
        "id": side.id,
        "lhs": _number(side.lhs),
        "relation": side.relation,
        "rhs": _number(side.rhs),
        "margin": _number(side.margin),
        "holds": side.holds,
        "would_satisfy": [_remedy(spec, remedy) for remedy in side.remedies],
    }


def _remedy(spec: PlantSpec, remedy: Remedy) -> dict[str, object]:
    return {
        "symbol": remedy.symbol,
        "place": _place(spec, remedy.path),
        "have": _number(remedy.have),
        "need": None if remedy.need is None else _number(remedy.need),
    }


def _assumption(spec: PlantSpec, entry: Assumption) -> dict[str, object]:
    return {
        "id": entry.id,
        "statement": entry.statement,
        "standing": str(entry.standing),
        "local": entry.local,
        "detail": entry.detail,
        "place": _place(spec, entry.path),
    }


def _run(spec: PlantSpec, run: RunReport, sound: FormReport) -> dict[str, object]:
    return {
        "status": str(run.answer(sound.certificate)),
        "start": dict(zip(spec.states, run.start, strict=True)),
        "declared_start": run.declared,
        "held": run.held,
        "horizon": _number(run.horizon),
        "diverged": run.diverged,
        "max_abs_e": _numbers(run.max_abs_e),
        "half_widths": _numbers(run.half_widths),
        "max_abs_u": _number(run.max_abs_u),
        "U": _number(run.peak_input),
        "stages": [
            {
                "stage": peaks.stage,
                "max_abs_e": _numbers(peaks.max_abs_e),
                "half_widths": _numbers(peaks.half_widths),
                "within_bounds": peaks.within_bounds,
            }
            for peaks in run.stages
        ],
        "escape": None if run.escape is None else _escape(run.escape),
    }


def _escape(escape: Escape) -> dict[str, object]:
    return {
        "what": f"e_{escape.error}" if escape.error else "u",
        "stage": escape.stage,
        "time": escape.time,
        "at_switch": escape.jump,
        "bound": _number(escape.bound),
        "reached": _number(escape.reached),
        "times_the_bound": _number(escape.reached / escape.bound),
    }


def _place(spec: PlantSpec, path: str) -> dict[str, object]:
    place = spec.place(path)
    return {"path": path, "line": place.line, "column": place.column}


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _numbers(values: Iterable[float]) -> list[float | None]:
    return [_number(value) for value in values]
