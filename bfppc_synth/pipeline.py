"""The passes in order: read this first.

text -> PlantSpec -> Plant -> Majorants -> Design (gains, omega, bounds) -> Certificate -> Law
-> files -> Trajectory.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from enum import Enum, auto
from pathlib import Path
from typing import TYPE_CHECKING

from bfppc_synth.artifacts import package, simulate_design
from bfppc_synth.codegen.package import Overwrite, may_write, write_folder
from bfppc_synth.errors import BfppcError, NotCertifiedError, UsageError
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.certificate import Verdict

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.model.trajectory import Trajectory

__all__ = [
    "Options",
    "Outcome",
    "Overwrite",
    "Report",
    "Uncertified",
    "run",
    "simulate",
    "verify",
]


NOT_COVERED = (
    "a simulated run left its bounds, but in steps of simulation.period, which are longer than"
    " the certificate covers: the law is continuous here, or quantized and meant to be sampled"
    " faster; fix: a smaller simulation.period, or set sampling.period"
)


class Uncertified(Enum):
    """What to do with a design that is not certified."""

    REFUSE = auto()
    WRITE = auto()


class Report(Enum):
    """What the report is written as."""

    PAGE = auto()
    PAGE_AND_PDF = auto()


def _silent(message: str) -> None:
    del message


def _unseen(nominal: Trajectory) -> None:
    del nominal


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How a plant file is run; ``out`` None means generated/NAME."""

    out: Path | None = None
    uncertified: Uncertified = Uncertified.REFUSE
    overwrite: Overwrite = Overwrite.REFUSE
    seed: int | None = None
    arithmetic: Arithmetic = DEFAULT
    report: Report = Report.PAGE
    progress: Callable[[str], None] = _silent


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """Exit code, the folder written, the object for --json, and sentences for stderr.

    ``lines`` are for stdout where the command lays its result out itself.
    """

    exit_code: int
    folder: Path | None
    document: Mapping[str, object]
    messages: tuple[str, ...] = field(default=())
    lines: tuple[str, ...] = field(default=())


def run(path: Path, options: Options) -> Outcome:
    """Synthesize one plant file into a folder.

    Parameters
    ----------
    path : Path
        The plant file.
    options : Options
        Output folder, what to do without a certificate, seed, progress.

    Returns
    -------
    Outcome
        Exit code 0 or 4; nothing is written with 4 unless ``Uncertified.WRITE``.

    Raises
    ------
    BfppcError
        With its own exit code: 2 for the file and the folder, 3 where there is no design.
    """
    from bfppc_synth.report.pdf import render_pdf, require_typst
    from bfppc_synth.spec.load import load_spec

    if options.report is Report.PAGE_AND_PDF:
        require_typst()
    spec = load_spec(path)
    if options.seed is not None:
        spec = replace(spec, simulation=replace(spec.simulation, seed=options.seed))
    folder = options.out or Path("generated") / spec.name
    may_write(folder, name=spec.name, overwrite=options.overwrite)
    from bfppc_synth.reasons.explain import synthesize

    design = synthesize(spec, progress=options.progress, arithmetic=options.arithmetic)
    certified = design.certificate.verdict is Verdict.CERTIFIED
    if not certified and options.uncertified is Uncertified.REFUSE:
        raise NotCertifiedError(_refusal(design))
    files, document, evidence = package(design, progress=options.progress)
    messages = list(spec.notes)
    if not certified:
        messages.append(_refusal(design))
    contradicted = not evidence.within_bounds and _covered(design)
    if contradicted:
        sentence = "a simulation that the certificate covers left its bounds"
        if options.uncertified is Uncertified.REFUSE:
            raise NotCertifiedError(f"{sentence}: nothing written")
        messages.append(sentence)
    elif certified and not evidence.within_bounds:
        messages.append(NOT_COVERED)
    if options.report is Report.PAGE_AND_PDF:
        options.progress("setting the report as PDF")
        files["report.pdf"] = render_pdf(files["report.html"].decode())
    options.progress(f"writing {folder.as_posix()}")
    write_folder(
        files,
        folder,
        name=spec.name,
        status=design.certificate.verdict.value,
        overwrite=options.overwrite,
    )
    exit_code = 0 if certified and not contradicted else NotCertifiedError.exit_code
    return Outcome(exit_code=exit_code, folder=folder, document=document, messages=tuple(messages))


def simulate(
    folder: Path,
    *,
    horizon: float | None,
    start: Mapping[str, float],
    seed: int | None,
    progress: Callable[[str], None],
    show: Callable[[Trajectory], None] = _unseen,
) -> Outcome:
    """Run the controller of a folder again; ``show`` gets the nominal run.

    Raises
    ------
    UsageError
        If the folder is not one that this tool wrote.
    """
    from bfppc_synth.synthesis.arithmetic import require_arithmetic
    from bfppc_synth.synthesis.synthesize import restore

    progress(f"reading {folder.as_posix()}")
    design = restore(folder)
    spec = design.spec
    if horizon is not None:
        longer = replace(spec, simulation=replace(spec.simulation, horizon=horizon))
        require_arithmetic(longer, design.arithmetic)
    if seed is not None:
        spec = replace(spec, simulation=replace(spec.simulation, seed=seed))
        design = replace(design, spec=spec, plant=replace(design.plant, spec=spec))
    progress("simulating")
    text = (folder / "controller.py").read_text(encoding="utf-8")
    evidence = simulate_design(design, controller=text, horizon=horizon, start=start or None)
    nominal = evidence.nominal
    show(nominal)
    inside = evidence.within_bounds
    document: dict[str, object] = {
        "format": "bfppc-synth/simulation/1",
        "name": spec.name,
        "max_abs_e": list(nominal.max_abs_e),
        "half_widths": list(nominal.half_widths),
        "max_abs_u": nominal.max_abs_u,
        "U": nominal.u_max,
        "within_bounds": inside,
        "adversaries": len(evidence.adversaries),
    }
    # A start that the certificate does not cover may leave the tube; that is no contradiction.
    promised = not start or _starts_within(spec, start)
    contradicted = not inside and promised and _covered(design)
    code = NotCertifiedError.exit_code if contradicted else 0
    messages: tuple[str, ...] = ()
    if not inside and not promised:
        messages = ("the start is outside of `initial`: nothing is promised there",)
    elif not inside and not contradicted and design.certificate.verdict is Verdict.CERTIFIED:
        messages = (NOT_COVERED,)
    return Outcome(exit_code=code, folder=None, document=document, messages=messages)


def _starts_within(spec: PlantSpec, start: Mapping[str, float]) -> bool:
    ranges = dict(zip(spec.states, spec.initial, strict=True))
    return all(
        state in ranges and ranges[state].lower.approximate <= x <= ranges[state].upper.approximate
        for state, x in start.items()
    )


def verify(folder: Path) -> Outcome:
    """Check a folder with the separate checker, then what only the package can.

    That plant.json says what plant.yaml says, and that the code is what this version makes of
    the certified gains: a law that deviates where no sample looks is found by its text.
    """
    from bfppc_synth.certificate.checker import verify_folder
    from bfppc_synth.spec.canonical import plant_json
    from bfppc_synth.spec.load import load_spec

    if not any((folder / name).exists() for name in ("manifest.json", "certificate.json")):
        raise UsageError(f"{folder}: not a folder that bfppc-synth wrote")
    report = verify_folder(folder)
    document = report.document()
    code = report.exit_code
    messages: list[str] = []
    try:
        twin = plant_json(load_spec(folder / "plant.yaml"))
        if twin != (folder / "plant.json").read_text(encoding="utf-8"):
            raise UsageError("plant.json does not say what plant.yaml says: one of them was edited")
        if code == 0:
            messages.extend(_changed_code(folder))
    except (BfppcError, OSError) as error:
        messages.append(str(error))
    if messages and code == 0:
        code = NotCertifiedError.exit_code
        document = {**document, "verdict": "refuted", "failures": messages}
    return Outcome(exit_code=code, folder=None, document=document, messages=tuple(messages))


def _changed_code(folder: Path) -> list[str]:
    """Name each code file that is not what this version generates from the certified design."""
    from bfppc_synth.artifacts import generated_code
    from bfppc_synth.synthesis.synthesize import restore

    design = restore(folder)
    report = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    stated = {
        "performance.accuracy": design.omega[0],
        "sampling.period": design.spec.sampling.period.approximate,
    }
    changed = [
        f"report.json: {key} is not {value!r}: it was edited; fix: run synth again"
        for key, value in stated.items()
        # In binary32 the report has p_1 as the code has it.
        if not math.isclose(report[key.split(".")[0]][key.split(".")[1]], value, rel_tol=2**-22)
    ]
    return changed + [
        f"{name} is not what this version generates for these gains: it was edited, or another"
        " version made it; fix: run synth again"
        for name, text in sorted(generated_code(design).items())
        if (folder / name).read_bytes() != text.encode()
    ]


def _covered(design: Design) -> bool:
    """Whether the certificate speaks about the simulated runs."""
    from bfppc_synth.simulation.loop import coverage
    from bfppc_synth.simulation.scheme import Coverage

    certified = design.certificate.verdict is Verdict.CERTIFIED
    return certified and coverage(design) is Coverage.COVERED


def _refusal(design: Design) -> str:
    """Why a design is not certified, in the words of the failed inequalities."""
    spec, certificate = design.spec, design.certificate
    lines = [f"NOT CERTIFIED ({certificate.verdict.value}): {spec.path}"]
    lines += [f"  {failure}" for failure in certificate.failures]
    return "\n".join(lines)
