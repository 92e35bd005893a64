"""Everything that a design becomes: files, simulations, the folder."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bfppc_synth.codegen.package import Overwrite, may_write, write_folder
from bfppc_synth.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.model.trajectory import RunSummary, Trajectory
    from bfppc_synth.simulation.loading import Controller


def _silent(message: str) -> None:
    del message


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """The simulations of one design."""

    nominal: Trajectory
    adversaries: tuple[RunSummary, ...]

    @property
    def within_bounds(self) -> bool:
        """Whether every run stayed in the tube and below the peak input."""
        return self.nominal.within_bounds and all(run.within_bounds for run in self.adversaries)


def package(
    design: Design, *, progress: Callable[[str], None] = _silent
) -> tuple[dict[str, bytes], dict[str, object], Evidence]:
    """Make every file of the generated folder but the manifest.

    Returns
    -------
    tuple
        Path under the folder -> bytes; the object of report.json; the simulations.
    """
    from importlib.resources import files as resource_files

    from bfppc_synth.codegen.cost import step_cost
    from bfppc_synth.codegen.law import build_law
    from bfppc_synth.codegen.measuring import measure_step
    from bfppc_synth.reasons.sensitivities import with_sensitivities
    from bfppc_synth.report.render import render_html, render_readme
    from bfppc_synth.report.tables import report_document, trajectory_csv
    from bfppc_synth.spec.canonical import plant_json

    progress("generating the controller")
    code = generated_code(design)
    progress("simulating")
    evidence = simulate_design(design, controller=code["controller.py"])
    code |= golden_vectors(design, code["controller.py"], evidence.nominal)
    cost = step_cost(build_law(design))
    progress("measuring the C code")
    target = measure_step(code, design.spec.name)
    progress("estimating what each requirement costs")
    design = with_sensitivities(design)
    nominal, adversaries = evidence.nominal, evidence.adversaries
    document = report_document(design, nominal, adversaries, cost=cost, target=target)
    progress("writing the report")
    texts = {
        "README.md": render_readme(document),
        "report.json": json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n",
        "report.html": render_html(document, design, evidence.nominal),
        "plant.json": plant_json(design.spec),
        "trajectory.csv": trajectory_csv(design, evidence.nominal),
        **code,
    }
    files = {name: text.encode() for name, text in texts.items()}
    files["plant.yaml"] = design.spec.source_bytes
    if design.certificate.document:
        files["certificate.json"] = design.certificate.document.encode()
        checker = resource_files("bfppc_synth.certificate") / "checker.py"
        files["verify.py"] = checker.read_bytes()
    return files, document, evidence


def generated_code(design: Design) -> dict[str, str]:
    """Print the controller: controller.py and everything under c/, path -> text."""
    from bfppc_synth.codegen.c import render_c
    from bfppc_synth.codegen.law import build_law
    from bfppc_synth.codegen.provenance import make_provenance
    from bfppc_synth.codegen.python import render_controller

    law, provenance = build_law(design), make_provenance(design)
    return {"controller.py": render_controller(law, provenance), **render_c(law, provenance)}


def golden_vectors(design: Design, controller: str, nominal: Trajectory) -> dict[str, str]:
    """Let the generated controller answer samples of its nominal run: the C tests replay them."""
    from bfppc_synth.codegen.choosing import make_samples, through_switches
    from bfppc_synth.codegen.law import build_law
    from bfppc_synth.codegen.provenance import make_provenance
    from bfppc_synth.codegen.vectors import PATH, answer, render_vectors
    from bfppc_synth.simulation.loading import load_text
    from bfppc_synth.simulation.samples import nominal_samples

    law = build_law(design)
    module = load_text(controller, name="answering_controller", origin="controller.py")
    run = nominal_samples(design, nominal)
    if law.switching is not None:
        run = through_switches(module, run)
    vectors = answer(law, module, make_samples(law, run))
    return {PATH: render_vectors(law, make_provenance(design), vectors)}


def simulate_design(
    design: Design,
    *,
    controller: str | None = None,
    horizon: float | None = None,
    start: Mapping[str, float] | None = None,
) -> Evidence:
    """Run the generated controller against its plant: the nominal run and 20 adversaries."""
    from bfppc_synth.simulation.loop import simulate_adversaries, simulate_nominal

    law = _load(design, controller)
    begin = None if start is None else _full_start(design.spec, start)
    nominal = simulate_nominal(design, law, horizon=horizon, start=begin)
    adversaries = simulate_adversaries(design, law, runs=20) if begin is None else ()
    return Evidence(nominal=nominal, adversaries=adversaries)


def _load(design: Design, controller: str | None) -> type[Controller]:
    """Import the generated controller from its text, made first where it is not given."""
    from bfppc_synth.codegen.law import build_law
    from bfppc_synth.codegen.provenance import make_provenance
    from bfppc_synth.codegen.python import render_controller
    from bfppc_synth.simulation.loading import load_controller

    text = controller or render_controller(build_law(design), make_provenance(design))
    with tempfile.TemporaryDirectory(prefix="bfppc-synth-") as scratch:
        path = Path(scratch) / "controller.py"
        path.write_text(text, encoding="utf-8")
        return load_controller(path)


def simulate_trajectory(
    design: Design,
    *,
    horizon: float | None = None,
    start: Mapping[str, float] | None = None,
) -> Trajectory:
    """Run the generated controller against the nominal plant.

    Parameters
    ----------
    design : Design
        A synthesized design.
    horizon : float, optional
        Length of the run [s]; default is the plant file's.
    start : Mapping[str, float], optional
        x(0) by state name; default is the middle of the initial box.

    Returns
    -------
    Trajectory
        Arrays t (N,), x (N, n), e (N, n), u (N,); ``plot()`` returns a matplotlib Figure.
    """
    from bfppc_synth.simulation.loop import simulate_nominal

    begin = None if start is None else _full_start(design.spec, start)
    return simulate_nominal(design, _load(design, None), horizon=horizon, start=begin)


def write(design: Design, out: Path | str, *, overwrite: Overwrite = Overwrite.REFUSE) -> Path:
    """Write the generated folder of a design.

    Parameters
    ----------
    design : Design
        Certified or not; every file says which.
    out : Path or str
        The folder itself.
    overwrite : Overwrite
        What to do with a folder of another plant.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    UsageError
        If the folder belongs to another plant and ``overwrite`` is REFUSE.
    """
    folder, name = Path(out), design.spec.name
    may_write(folder, name=name, overwrite=overwrite)
    files, _, _ = package(design)
    status = design.certificate.verdict.value
    write_folder(files, folder, name=name, status=status, overwrite=overwrite)
    return folder


def _full_start(spec: PlantSpec, start: Mapping[str, float]) -> tuple[float, ...]:
    unknown = sorted(set(start) - set(spec.states))
    if unknown:
        raise UsageError(
            f"--x0 {unknown[0]}: {spec.name} has no such state; fix: use {', '.join(spec.states)}"
        )
    return tuple(
        start.get(name, 0.5 * (box.lower.approximate + box.upper.approximate))
        for name, box in zip(spec.states, spec.initial, strict=True)
    )
