"""Other methods on the plant of a folder, each tuned by the same search: ``compare DIR``."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bfppc_synth.codegen.package import Overwrite, may_write, write_folder
from bfppc_synth.compare.document import (
    head,
    measured,
    not_covered,
    operations_of,
    own_row,
    row_of,
)
from bfppc_synth.errors import UsageError
from bfppc_synth.pipeline import Outcome
from bfppc_synth.report.numbers import finite

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.baselines.cases import Cases, Clock
    from bfppc_synth.simulation.baselines.method import Law, Method
    from bfppc_synth.simulation.loading import Controller

CONTRADICTED = (
    "a run that the certificate covers left the envelope: report this plant file, or simulate with"
    " a smaller simulation.period"
)
#: What memory and patience allow; each is far beyond what changes the table.
MOST_RUNS, MOST_SETS, MOST_SAMPLES = 400, 1000, 5_000_000
#: Runs that gains are tuned on; none of them is among those that the table is made of.
_TUNING_RUNS = 6


def _silent(message: str) -> None:
    del message


@dataclass(frozen=True, slots=True, kw_only=True)
class CompareOptions:
    """How methods are compared; ``seed``, ``horizon`` None are the plant file's."""

    runs: int = 24
    budget: int = 64
    seed: int | None = None
    horizon: float | None = None
    progress: Callable[[str], None] = _silent


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The object of compare.json, and the nominal run of every method that can be used.

    ``t``, ``edge`` and each curve, y - y_d, have shape (K+1,).
    """

    document: dict[str, Any]
    t: NDArray[np.float64]
    edge: NDArray[np.float64]
    curves: tuple[tuple[str, NDArray[np.float64]], ...]


def compare(folder: Path, options: CompareOptions) -> Outcome:
    """Compare the controller of a folder with other methods, into ``folder/compare``.

    Parameters
    ----------
    folder : Path
        A generated folder.
    options : CompareOptions
        Runs, budget, seed, horizon.

    Returns
    -------
    Outcome
        Exit code 0; compare.json, compare.csv, compare.svg are written together or not at all.

    Raises
    ------
    UsageError
        If the folder is none of this tool's, or an option is out of its range.
    """
    _require(options)
    from bfppc_synth.report.comparison import comparison_csv, comparison_lines, comparison_svg
    from bfppc_synth.simulation.loading import load_controller
    from bfppc_synth.synthesis.synthesize import restore

    options.progress(f"reading {folder.as_posix()}")
    design = restore(folder)
    place = folder / "compare"
    may_write(place, name=design.spec.name, overwrite=Overwrite.REFUSE)
    controller = load_controller(folder / "controller.py")
    found = compare_design(design, controller, options)
    document = found.document
    files = {
        "compare.json": json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n",
        "compare.csv": comparison_csv(document),
        "compare.svg": comparison_svg(document, found.t, found.edge, found.curves),
    }
    write_folder(
        {path: text.encode() for path, text in files.items()},
        place,
        name=design.spec.name,
        status="evidence",
        overwrite=Overwrite.REFUSE,
    )
    notes: tuple[str, ...] = (
        () if found.document["sampling"]["covered"] else (not_covered(document),)
    )
    own = document["methods"][0]
    if own["certified"] and not design.stages and own["inside"] < own["runs"]:
        notes = (*notes, CONTRADICTED)
    lines = (*comparison_lines(document), f"  written: {place.as_posix()}")
    return Outcome(
        exit_code=0,
        folder=None,
        document={**document, "written": place.as_posix()},
        messages=notes,
        lines=lines,
    )


def compare_design(
    design: Design, controller: type[Controller], options: CompareOptions
) -> Comparison:
    """Tune every method and run all of them on the same plants.

    Parameters
    ----------
    design : Design
        Plant, envelope, sampling; its controller is not tuned.
    controller : type[Controller]
        Class of the generated controller.py.
    options : CompareOptions
        As for ``compare``.

    Returns
    -------
    Comparison
        The same for the same design, seed, runs and budget.

    References
    ----------
    docs/theory.md sections 10 and 11.
    """
    from bfppc_synth.simulation.baselines.cases import make_cases, make_clock
    from bfppc_synth.simulation.baselines.generated import GeneratedLaw
    from bfppc_synth.simulation.baselines.tuning import law_of, run_laws, tune

    spec = design.spec
    seed = spec.simulation.seed if options.seed is None else options.seed
    horizon = spec.simulation.horizon if options.horizon is None else options.horizon
    clock = make_clock(design, horizon)
    most = MOST_SAMPLES // options.runs
    if clock.count > most:
        raise UsageError(
            f"--horizon {horizon:g}: {clock.count} samples of {clock.period:g} s, above {most} for"
            f" {options.runs} runs; fix: a horizon of at most {most * clock.period:g} s, or fewer"
            " --runs"
        )
    tuning = make_cases(design, clock, seed=seed, stream=0, runs=min(options.runs, _TUNING_RUNS))
    judged = make_cases(design, clock, seed=seed, stream=1, runs=options.runs)
    document = head(design, clock, judged, options.budget, seed=seed, horizon=horizon)
    document["tuning_runs"] = tuning.runs
    y_d, edge = judged.path.y_d[:, 0], judged.path.edge[:, 0]
    every = methods(design, clock, judged)
    usable = [method for method in every if method.build is not None]
    options.progress("tuning")
    tuned = dict(zip(usable, tune(usable, tuning, seed=seed, budget=options.budget), strict=True))
    options.progress("simulating")
    laws = [law_of(method, judged, tuned[method].point) for method in usable]
    own: Law = GeneratedLaw(judged, controller)
    result = run_laws(judged, [(own, 1), *laws], kept=1 + len(usable))
    rows = [own_row(design, clock) | measured(design, clock, result.column(0))]
    for method in every:
        row = row_of(method, design.plant.order)
        if method in tuned:
            found = tuned[method]
            row |= {"gains": found.gains, "tried": found.tried}
            row |= {"tuned_share": found.share, "tuned_completed": found.completed}
            row |= {"tuned_peak_u": finite(found.peak)}
            row |= measured(design, clock, result.column(1 + usable.index(method)))
        rows.append(row)
    titles = [row["title"] for row in rows if not row["missing"]]
    curves = [(title, result.output[:, j] - y_d) for j, title in enumerate(titles)]
    document["methods"] = rows
    options.progress("counting operations")
    document["operations"] = operations_of(design)
    return Comparison(document=document, t=clock.times, edge=edge, curves=tuple(curves))


def methods(design: Design, clock: Clock, cases: Cases) -> tuple[Method, ...]:
    """Make every method of comparison for a design's plant."""
    from bfppc_synth.simulation.baselines.backstepping import backstepping
    from bfppc_synth.simulation.baselines.barrier import barrier
    from bfppc_synth.simulation.baselines.funnel import funnel, wide_funnel
    from bfppc_synth.simulation.baselines.surface import surface

    plant, accuracy, missing = design.plant, design.omega[0], cases.path.missing
    return (
        barrier(plant.order, accuracy),
        funnel(plant.order, accuracy),
        wide_funnel(plant.order, accuracy, design.conditions.delta[0]),
        surface(plant, clock.period, missing),
        backstepping(plant, missing),
    )


def _require(options: CompareOptions) -> None:
    """Refuse options out of their ranges."""
    for name, value, most in (
        ("--runs", options.runs, MOST_RUNS),
        ("--budget", options.budget, MOST_SETS),
    ):
        if not 1 <= value <= most:
            raise UsageError(f"{name} {value}: not from 1 to {most}; fix: write {name} {most}")
    if options.seed is not None and options.seed < 0:
        raise UsageError(f"--seed {options.seed}: below 0; fix: write --seed 1")
    if options.horizon is not None and not 0.0 < options.horizon < math.inf:
        raise UsageError(
            f"--horizon {options.horizon}: not a positive time; fix: write --horizon 10"
        )
