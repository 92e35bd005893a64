"""A certified folder's controller for other simulators: FMUs, python-control, CasADi."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from bfppc_synth.certificate import checker
from bfppc_synth.errors import NotCertifiedError, UsageError

if TYPE_CHECKING:
    from pathlib import Path

    from bfppc_synth.interop.fmu import Steps
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.law import Law, Provenance


class ModelTarget(StrEnum):
    """The formats that carry the controller."""

    FMU2 = "fmu2"
    FMU3 = "fmu3"
    CONTROL = "control"
    CASADI = "casadi"


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportedModel:
    """Files written, relative to the folder, and what could not be.

    ``step``: largest communication step of Co-Simulation that the certificate covers [s], 0 for
    none; None where the format has no such step.
    """

    name: str
    target: ModelTarget
    files: tuple[str, ...]
    left_out: tuple[str, ...]
    notes: tuple[str, ...] = ()
    step: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Certified:
    """A folder whose certificate is proved and whose code is that of its design."""

    design: Design
    law: Law
    provenance: Provenance
    code: dict[str, str]


def export_model(folder: Path, target: ModelTarget) -> ExportedModel:
    """Write the controller of a certified folder under ``folder/interop``.

    Parameters
    ----------
    folder : Path
        A generated folder.
    target : ModelTarget
        FMU2, FMU3: ``interop/fmu2/NAME.fmu``, with a binary where there is a compiler;
        CONTROL, CASADI: ``interop/NAME_control.py``, ``interop/NAME_casadi.py``.

    Returns
    -------
    ExportedModel
        Equal folders give equal files, FMUs by the same compiler.

    Raises
    ------
    UsageError
        If this is no generated folder, or the format has no form for the law.
    NotCertifiedError
        If the folder does not verify, or its code is not what this version generates.

    References
    ----------
    docs/theory.md section 3, Timing.
    """
    certified = _read(folder)
    if target in (ModelTarget.FMU2, ModelTarget.FMU3):
        return _export_fmu(folder, target, certified)
    path = f"interop/{certified.law.name}_{target}.py"
    text = _control(certified) if target is ModelTarget.CONTROL else _casadi(certified)
    _write(folder, {path: text.encode()})
    staged = target is ModelTarget.CONTROL and certified.law.switching is not None
    left_out = ("continuous: a law with stages has a memory that jumps; sampled() has it",)
    return ExportedModel(
        name=certified.law.name,
        target=target,
        files=(path,),
        left_out=left_out if staged else (),
    )


def _read(folder: Path) -> _Certified:
    """Verify the folder, make its design again, and compare the code: all three must agree."""
    from bfppc_synth.codegen.c import render_c
    from bfppc_synth.codegen.law import build_law
    from bfppc_synth.codegen.provenance import make_provenance
    from bfppc_synth.codegen.python import render_controller
    from bfppc_synth.spec.canonical import plant_json
    from bfppc_synth.spec.load import load_spec
    from bfppc_synth.synthesis.synthesize import restore

    for name in ("plant.json", "certificate.json"):
        if not (folder / name).is_file():
            raise UsageError(
                f"{folder}: no {name}: nothing proved to export; fix: name a folder that "
                "bfppc-synth wrote for a certified design"
            )
    report = checker.verify_folder(folder)
    if report.verdict == "malformed":
        raise UsageError(
            f"{folder}: {'; '.join(report.failures)}; fix: run bfppc-synth on its plant.yaml"
        )
    if report.verdict != "proved":
        raise NotCertifiedError(f"{folder}: {report.verdict}: {'; '.join(report.failures)}")
    design = restore(folder)
    law, provenance = build_law(design), make_provenance(design)
    code = {"controller.py": render_controller(law, provenance), **render_c(law, provenance)}
    texts = {**code, "plant.json": plant_json(load_spec(folder / "plant.yaml"))}
    try:
        for name, text in sorted(texts.items()):
            if (folder / name).read_bytes() != text.encode():
                raise NotCertifiedError(
                    f"{folder}: {name} is not what this version generates for this design: it was"
                    " edited, or another version made it; fix: run synth again"
                )
    except OSError as error:
        raise UsageError(f"{folder}: {error}; fix: run bfppc-synth on its plant.yaml") from error
    return _Certified(design=design, law=law, provenance=provenance, code=code)


def communication_steps(folder: Path, design: Design) -> Steps:
    """Let the checker find the largest communication steps that the certificate covers.

    Parameters
    ----------
    folder : Path
        Whose plant.json and certificate.json are proved.
    design : Design
        Its largest certified period is where the search starts, and no more than that.

    Returns
    -------
    Steps
        With one step of delay, and without (Event Mode of FMI 3.0).
    """
    from bfppc_synth.certificate.period import OtherDelay, proved_step
    from bfppc_synth.interop.fmu import Steps

    plant = checker.read_json(folder / "plant.json")
    written = checker.read_json(folder / "certificate.json")["design"]
    estimate = design.largest_certified_period
    if not 0.0 < estimate < math.inf:
        return Steps(delayed=None, event=None)
    delayed, event = (proved_step(plant, written, estimate, late=late) for late in (1, 0))
    alone = None
    if design.conditions.delay > 0.0:
        none = OtherDelay.NONE
        alone = proved_step(plant, written, estimate, late=1, other=none) or None
    return Steps(delayed=delayed or None, event=event or None, alone=alone)


def _export_fmu(folder: Path, target: ModelTarget, certified: _Certified) -> ExportedModel:
    from bfppc_synth.codegen.provenance import banner, heading
    from bfppc_synth.interop.binary import Binary, build_binary
    from bfppc_synth.interop.fmu import Package, Standard, archive, render_fmu

    standard = Standard.FMI2 if target is ModelTarget.FMU2 else Standard.FMI3
    design, law = certified.design, certified.law
    steps, name = communication_steps(folder, design), law.name
    package = Package(
        code={
            f"{name}.h": certified.code[f"c/include/{name}.h"],
            f"{name}.c": certified.code[f"c/src/{name}.c"],
        },
        banner=banner(certified.provenance),
        heading=heading(law.name, law.title),
        tool_version=certified.provenance.tool_version,
        steps=steps,
        stop=design.spec.simulation.horizon,
        period=design.spec.simulation.period,
    )
    texts = render_fmu(law, package, standard)
    files = {path: text.encode() for path, text in texts.items()}
    built = build_binary(texts, name, standard)
    left_out = []
    if isinstance(built, Binary):
        files[built.path] = built.content
    else:
        left_out.append(f"binary: {built.reason}; the sources are complete")
    path = f"interop/{target}/{name}.fmu"
    _write(folder, {path: archive(files)})
    notes = []
    if steps.delayed is None:
        notes.append(
            "Co-Simulation of this FMU is not certified: its one communication step of delay is"
            " more than the certificate covers at any step; Model Exchange has no delay"
        )
    return ExportedModel(
        name=name,
        target=target,
        files=(path,),
        left_out=tuple(left_out),
        notes=tuple(notes),
        step=steps.delayed or 0.0,
    )


def _casadi(certified: _Certified) -> str:
    from bfppc_synth.codegen.pure import render_casadi

    return render_casadi(certified.law, certified.provenance)


def _control(certified: _Certified) -> str:
    from bfppc_synth.codegen.control import PlantText, render_control
    from bfppc_synth.simulation.plant import (
        IMPORTS,
        argument_names,
        compile_plant,
        model_text,
        modelled,
    )

    plant = certified.design.plant
    if certified.design.nominal is not None:
        plant = modelled(plant)
    text = PlantText(
        imports=IMPORTS,
        functions=model_text(plant),
        arguments=tuple(argument_names(plant)),
        nominal=compile_plant(plant).nominal,
    )
    return render_control(certified.law, certified.provenance, text)


def _write(folder: Path, files: dict[str, bytes]) -> None:
    for path, content in files.items():
        place = folder / path
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            # Beside its place first: an interrupted export leaves the old file whole.
            draft = place.with_name(f".{place.name}.new")
            try:
                draft.write_bytes(content)
                draft.replace(place)
            finally:
                draft.unlink(missing_ok=True)
        except OSError as error:
            raise UsageError(f"{place}: {error.strerror}; fix: make the folder writable") from error
