"""The object of compare.json: what was asked, and one row a method."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from bfppc_synth.report.numbers import finite

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.baselines.cases import Cases, Clock
    from bfppc_synth.simulation.baselines.loop import Result
    from bfppc_synth.simulation.baselines.method import Method

FORMAT = "bfppc-synth/compare/1"
OBJECTIVE = (
    "most runs inside the envelope, then most that reach the horizon, then the least peak |u|;"
    " half of the budget is drawn anywhere in the ranges, uniformly in the logarithms, half within"
    " a factor of 2 of the best of the first half"
)
ENVELOPE = (
    "|y - y_d| at every sample at most the accuracy plus the distance of the declared path from y_d"
)
#: Columns of a row that runs fill; a method that cannot be used leaves them empty.
_MEASURED = (
    "runs",
    "inside",
    "share_inside",
    "nominal_inside",
    "nan",
    "diverged",
    "worst_share_of_envelope",
    "peak_u",
    "rms_u",
    "level_changes_per_second",
)


def head(
    design: Design,
    clock: Clock,
    cases: Cases,
    budget: int,
    *,
    seed: int,
    horizon: float,
) -> dict[str, Any]:
    """Say what was asked of every method."""
    spec = design.spec
    return {
        "format": FORMAT,
        "name": spec.name,
        "plant_sha256": spec.sha256,
        "order": spec.order,
        "seed": seed,
        "runs": cases.runs,
        "budget": budget,
        "objective": OBJECTIVE,
        "horizon": horizon,
        "accuracy": design.omega[0],
        "envelope": ENVELOPE,
        "sampling": {
            "period": clock.period,
            "source": clock.source,
            "delay": clock.delay,
            "covered": clock.covered,
        },
        "plants": (
            "run 0 is the nominal plant; the others draw what the file leaves open, two of three"
            " anything within its declared bounds"
        ),
    }


def own_row(design: Design, clock: Clock) -> dict[str, Any]:
    """Describe the controller of the folder."""
    from bfppc_synth.codegen.cost import step_cost
    from bfppc_synth.codegen.law import build_law
    from bfppc_synth.model.certificate import Verdict

    cost = step_cost(build_law(design))
    count = cost.additions + cost.multiplications + cost.divisions + cost.choices
    verdict = design.certificate.verdict
    certified = verdict is Verdict.CERTIFIED and clock.covered
    status = (
        verdict.value
        if certified or verdict is not Verdict.CERTIFIED
        else ("certified, but not at this sampling")
    )
    return {
        "method": "bfppc-synth",
        "title": f"this design ({status})",
        "source": "controller.py of the folder; its operations include its path",
        "fixed": "everything: it is not tuned",
        "certified": certified,
        "missing": "",
        "ranges": {},
        "gains": {},
        "operations": count + sum(calls for _, calls in cost.functions),
    }


def row_of(method: Method, order: int) -> dict[str, Any]:
    """Describe a method of comparison, its cells empty."""
    from bfppc_synth.simulation.baselines.method import count_operations

    return {
        "method": method.key,
        "title": method.title,
        "source": method.source,
        "fixed": method.fixed,
        "certified": False,
        "missing": method.missing,
        "ranges": {item.name: [item.lower, item.upper] for item in method.tunables},
        "gains": {},
        "operations": count_operations(method, order),
        **dict.fromkeys(_MEASURED),
    }


def measured(design: Design, clock: Clock, result: Result) -> dict[str, Any]:
    """Fill the cells of a row."""
    from bfppc_synth.model.spec import QuantizerKind

    samples = float(result.samples.sum())
    levels = [item.kind for item in design.spec.measurement.quantizers]
    quantized = any(kind is not QuantizerKind.NONE for kind in levels)
    changes = float(result.changes.sum()) / (samples * clock.period) if samples else 0.0
    return {
        "runs": len(result.inside),
        "inside": int(result.inside.sum()),
        "share_inside": float(result.inside.mean()),
        "nominal_inside": bool(result.inside[0, 0]),
        "nan": int(result.undefined.sum()),
        "diverged": int(result.diverged.sum()),
        "worst_share_of_envelope": finite(float(result.worst.max())),
        "peak_u": finite(float(result.peak.max())),
        "rms_u": finite(math.sqrt(float(result.energy.sum()) / max(samples, 1.0))),
        "level_changes_per_second": changes if quantized else None,
    }


def operations_of(design: Design) -> dict[str, Any]:
    """Tabulate operations against n, for the plant itself and for one of every order."""
    from bfppc_synth.simulation.baselines.operations import costs, family_costs

    tables = {"this_plant": costs(design.plant), "family": family_costs(design.plant)}
    return {
        "counted": (
            "sums, products, quotients and function calls of one step after the first, the path"
            " and its derivatives given; equal subexpressions once, but in `expanded`"
        ),
        "family_plant": "dx_i = x_1*x_i**2 + x_{i+1}, u for x_{n+1}",
        **{
            name: [
                {"n": row.order, **row.operations, "backstepping expanded": row.expanded}
                for row in table
            ]
            for name, table in tables.items()
        },
    }


def not_covered(document: dict[str, Any]) -> str:
    """Say that the sampling of the comparison is not the certified one."""
    period = document["sampling"]["period"]
    return (
        f"every method is sampled every {period:g} s, which this design's certificate does not"
        " cover: all rows are simulations, none is proved; fix: set sampling.period in the plant"
        " file and synthesize again"
    )
