"""report.json as nested dictionaries, and trajectory.csv."""

from __future__ import annotations

import math
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.model.spec import THEOREMS
from bfppc_synth.model.target import NOT_ASKED
from bfppc_synth.report.choices import choice_entry, optimality_entry
from bfppc_synth.report.code import code_entry
from bfppc_synth.report.evidence import failures, inequality_entry, simulation_entry
from bfppc_synth.report.nominal import feed_entry, nominal_entry
from bfppc_synth.report.numbers import constant, finite, finites
from bfppc_synth.report.requirements import (
    arithmetic_entry,
    majorant_entries,
    measurement_entry,
    performance_entry,
    plant_entry,
    reference_entry,
    sampling_entry,
)
from bfppc_synth.report.sensitivities import sensitivity_entries
from bfppc_synth.report.stages import stages_entry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bfppc_synth.model.bounds import CenterBounds
    from bfppc_synth.model.cost import StepCost
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.target import NotMeasured, TargetCost
    from bfppc_synth.model.trajectory import RunSummary, Trajectory

FORMAT = "bfppc-synth/report/1"
CSV_ROWS = 2001


def report_document(
    design: Design,
    nominal: Trajectory,
    adversaries: tuple[RunSummary, ...],
    *,
    cost: StepCost | None = None,
    target: TargetCost | NotMeasured = NOT_ASKED,
) -> dict[str, object]:
    """Lay out report.json: every number that the page and the README show.

    Parameters
    ----------
    design : Design
        Order n; gains, half-widths, bounds and certificate [units of the plant file].
    nominal : Trajectory
        The nominal run, arrays of N rows.
    adversaries : tuple[RunSummary, ...]
        The seeded adversarial runs, possibly none.
    cost : StepCost, optional
        Operations of one step of the generated code, for its section.
    target : TargetCost | NotMeasured
        What was measured of that step on a processor, or why nothing was.

    Returns
    -------
    dict[str, object]
        Keys in a fixed order; a number that is not finite is None, so that
        ``json.dumps(document, allow_nan=False)`` always succeeds.

    References
    ----------
    SPEC section 3 (docs/theory.md sections 2 and 3 define the bounds).
    """
    whole = design_document(design)
    ends = ("arithmetic", "tool")
    last: dict[str, object] = {key: whole.pop(key) for key in ends if key in whole}
    return {
        **whole,
        "simulation": simulation_entry(design, nominal, adversaries),
        **code_entry(design, cost, target),
        **last,
    }


def design_document(design: Design) -> dict[str, object]:
    """Lay out the part of report.json that a design alone gives, before it is run.

    Parameters
    ----------
    design : Design
        As for ``report_document``.

    Returns
    -------
    dict[str, object]
        All keys but ``simulation`` and ``code``.
    """
    spec, certificate = design.spec, design.certificate
    synthesis = spec.synthesis
    return {
        "format": FORMAT,
        "name": spec.name,
        "title": spec.title,
        "order": spec.order,
        "status": str(certificate.verdict),
        "method": str(synthesis.method),
        "form": str(synthesis.form),
        "center": str(synthesis.center),
        "anchor": str(synthesis.anchor),
        "notice": "" if certificate.verdict is Verdict.CERTIFIED else "NOT CERTIFIED",
        "theorem": THEOREMS[synthesis.method, synthesis.form],
        "checked": _checked(design),
        "certificate": "certificate.json" if certificate.document else None,
        "states": list(spec.states),
        "units": dict(spec.units),
        "gains": [_gain(gain) for gain in design.gains],
        "omega": {"p": list(design.omega)},
        "plant": plant_entry(spec),
        "majorants": majorant_entries(design),
        "bounds": _bounds(design),
        **_tight(design),
        **_theorem1(design),
        **nominal_entry(design),
        **stages_entry(design),
        "reference": reference_entry(design),
        "performance": performance_entry(design),
        **choice_entry(design),
        **optimality_entry(design),
        "initial": {
            state: [constant(start.lower), constant(start.upper)]
            for state, start in zip(spec.states, spec.initial, strict=True)
        },
        "measurement": measurement_entry(design),
        "sampling": sampling_entry(design),
        "actuator": {
            "limit": None if spec.actuator.limit is None else constant(spec.actuator.limit),
            "error": finite(design.conditions.actuator_error),
        },
        "inequalities": [inequality_entry(spec, entry) for entry in certificate.inequalities],
        "sensitivities": sensitivity_entries(design),
        "assumption_checks": [
            inequality_entry(spec, entry) for entry in certificate.assumption_checks
        ],
        "assumptions": list(certificate.assumptions),
        "failures": list(failures(certificate)),
        **arithmetic_entry(design),
        "tool": {"version": version("bfppc-synth"), "plant_sha256": spec.sha256},
    }


def trajectory_csv(design: Design, nominal: Trajectory) -> str:
    """Write the nominal run as text, at most 2001 evenly spaced rows.

    Parameters
    ----------
    design : Design
        Gives the order n.
    nominal : Trajectory
        Arrays of N rows.

    Returns
    -------
    str
        Header ``t,x1..xn,q1..qn,e1..en,u,y_d``, with stages also ``stage``, and shortest
        round-trip decimals; the first and the last row of the run are always there. A run
        that left the range of binary64 keeps its ``nan`` and ``inf``. Without a certificate,
        lines of ``# NOT CERTIFIED`` stand before the header.

    References
    ----------
    SPEC section 3.
    """
    numbers = range(1, design.spec.order + 1)
    header = ["t", *(f"{letter}{i}" for letter in "xqe" for i in numbers), "u", "y_d"]
    signals: list[NDArray[Any]] = [nominal.t, nominal.x, nominal.q, nominal.e, nominal.u]
    signals.append(nominal.y_d)
    if nominal.stage is not None:
        header.append("stage")
        signals.append(nominal.stage)
    count = len(nominal.t)
    stride = max(1, math.ceil((count - 1) / (CSV_ROWS - 1)))
    rows = list(range(0, count, stride))
    if rows and rows[-1] != count - 1:
        rows.append(count - 1)
    blocks = [column[rows].reshape(len(rows), -1).tolist() for column in signals]
    lines = [
        ",".join(repr(value) for part in parts for value in part)
        for parts in zip(*blocks, strict=True)
    ]
    notices = []
    if design.certificate.verdict is not Verdict.CERTIFIED:
        notices = [f"# NOT CERTIFIED: {text}" for text in failures(design.certificate) or ("",)]
    return "\n".join([*notices, ",".join(header), *lines]) + "\n"


def _gain(gain: Gain) -> dict[str, object]:
    if isinstance(gain, Theorem1Gain):
        own = {"gamma": gain.gamma, "H": list(gain.H), "H_star": gain.H_star}
        return own | {"c": gain.c, "N": gain.N, "k": gain.k}
    return {"k": gain.k, "M": gain.M, "epsilon": gain.epsilon, "c": gain.c, "N": gain.N}


def _tight(design: Design) -> dict[str, object]:
    """Lay out tight bounds, and beside them what termwise ones say."""
    tight, termwise = design.tight, design.termwise
    if tight is None or termwise is None:
        return {}
    return {
        "tight": {
            "load": finites(tight.load),
            "rate": finite(tight.rate),
            "termwise_load": finites(termwise.load),
            "termwise_rate": finite(termwise.rate),
            "termwise_U": None if termwise.U is None else finite(termwise.U),
        }
    }


def _theorem1(design: Design) -> dict[str, object]:
    """Lay out what Theorem 1 adds: an empty table for the other methods."""
    bounds = design.theorem1
    if bounds is None:
        return {}
    return {
        "theorem1": {
            "c_0": finite(bounds.c_0),
            "delta_M": finites(bounds.noise),
            "epsilon": finites(bounds.epsilon),
            "H_needed": finites(bounds.needed),
            "H": finites(bounds.height),
        }
    }


def _checked(design: Design) -> str:
    if design.certificate.document:
        return "certificate.json, re-checked by the separate program verify.py"
    return "every inequality evaluated in binary64, which is no proof"


def _bounds(design: Design) -> dict[str, object]:
    bounds = design.bounds
    return {
        "X": finites(bounds.X),
        "xi": finites(bounds.xi),
        "A": finites(bounds.A),
        "L": finites(bounds.L),
        "W": finites(bounds.W),
        "s": finites(bounds.s),
        "B": finites(bounds.B),
        "D": finites(bounds.D),
        "G": finites(bounds.G),
        "g_min": finites(bounds.g_min),
        "F_star": finites(bounds.F_star),
        "eta": finites(bounds.eta),
        "Lambda": finites(bounds.Lambda),
        "zeta": finite(bounds.zeta),
        "V": finite(bounds.V),
        **feed_entry(design),
        "delta_v": finite(bounds.delta_v),
        "U": finite(bounds.U),
        "slope": finite(bounds.slope),
        "conditioning": finite(math.prod(bounds.L)),
        "r": _suprema(design.center),
        "r_lower": finites(design.center.r_lower),
        "r_upper": finites(design.center.r_upper),
        "r_rate": finites(design.center.rate),
    }


def _suprema(center: CenterBounds) -> list[float | None]:
    ends = zip(center.r_lower, center.r_upper, strict=True)
    return finites([max(-lower, upper) for lower, upper in ends])
