"""What the runs of a campaign need, gathered once and sent to whoever makes them."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import TYPE_CHECKING

from bfppc_synth.errors import UsageError
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.simulation.compiled.build import NoCompilerError
from bfppc_synth.simulation.compiled.library import Axes, CompiledLoop
from bfppc_synth.simulation.compiled.python import PythonLoop
from bfppc_synth.simulation.compiled.records import make_axis
from bfppc_synth.simulation.compiled.source import Source, write_source
from bfppc_synth.simulation.drawing import Choices, choices
from bfppc_synth.simulation.plant import compile_plant, modelled
from bfppc_synth.simulation.scheme import Coverage, Scheme, Stepping, choose_scheme
from bfppc_synth.simulation.staged import stage_widths

if TYPE_CHECKING:
    from pathlib import Path

    from bfppc_synth.model.design import Design

#: How much finer the axis is on which samples come irregularly, and that of a repeated run.
FINER = 4

#: Plant steps of the longest run: an hour of a processor.
LONGEST = 1e10


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """One campaign's design, code and time axes; the same on every machine.

    ``source`` is the loop in C, ``controller`` the text of controller.py for where nothing
    compiles it; ``widths`` are the tubes of every stage, ``peak`` the certified U.
    ``controller_sha256`` is of controller.py, NAME.h and NAME.c.
    """

    design: Design
    source: Source
    controller: str
    controller_sha256: str
    choices: Choices
    scheme: Scheme
    axes: Axes
    finer: Axes
    widths: tuple[tuple[float, ...], ...]
    peak: float
    covered: bool
    version: str

    @property
    def horizon(self) -> float:
        """Simulated time of every run [s]."""
        return self.choices.horizon

    @property
    def steps(self) -> int:
        """Plant steps of a regular run."""
        return self.axes.regular.samples * self.axes.regular.substeps


def gather_material(folder: Path, *, horizon: float | None) -> Material:
    """Read a generated folder for a campaign.

    Parameters
    ----------
    folder : Path
        A generated folder; its own controller.py and c/ are what runs.
    horizon : float or None
        Simulated time [s]; None is the plant file's.

    Returns
    -------
    Material
        Everything that the runs need.

    Raises
    ------
    UsageError
        If the folder is not one that this tool wrote, or the horizon is not positive.
    """
    from bfppc_synth.synthesis.arithmetic import require_arithmetic
    from bfppc_synth.synthesis.synthesize import restore

    design = restore(folder)
    spec = design.spec
    if horizon is None:
        horizon = spec.simulation.horizon
    if not 0.0 < horizon < math.inf:
        raise UsageError(f"--horizon {horizon}: not a positive time; fix: write --horizon 10")
    if horizon / choose_scheme(design).step > LONGEST:
        raise UsageError(
            f"--horizon {horizon:g}: more than {LONGEST:g} plant steps a run; fix: a shorter one"
        )
    spec = replace(spec, simulation=replace(spec.simulation, horizon=horizon))
    require_arithmetic(spec, design.arithmetic)
    texts = [_text(folder / path) for path in code_files(spec.name)]
    controller, header, code = texts
    certified = design.certificate.verdict is Verdict.CERTIFIED
    scheme = choose_scheme(design)
    plant = design.plant if design.nominal is None else modelled(design.plant)
    return Material(
        design=design,
        source=write_source(design, header, code),
        controller=controller,
        controller_sha256=hashlib.sha256("\0".join(texts).encode()).hexdigest(),
        choices=choices(design, compile_plant(plant), scheme, horizon),
        scheme=scheme,
        axes=_axes(design, scheme, horizon),
        finer=_axes(design, scheme.finer(FINER), horizon),
        widths=stage_widths(design),
        peak=design.bounds.U,
        covered=certified and scheme.coverage is Coverage.COVERED,
        version=version("bfppc-synth"),
    )


def code_files(name: str) -> tuple[str, str, str]:
    """Name the files of a folder that a campaign runs."""
    return "controller.py", f"c/include/{name}.h", f"c/src/{name}.c"


def open_loop(material: Material) -> CompiledLoop | PythonLoop:
    """Compile the loop, or take the Python one where there is no compiler."""
    try:
        return CompiledLoop(material.source, funnel=material.design.plant.funnel is not None)
    except NoCompilerError:
        return PythonLoop(material.design, material.controller, material.scheme)


def _axes(design: Design, scheme: Scheme, horizon: float) -> Axes:
    # An implicit scheme measures all the time: there is nothing to be irregular.
    irregular = scheme.finer(FINER) if scheme.stepping is Stepping.SAMPLED else scheme
    return Axes(
        regular=make_axis(design, scheme, horizon), jittered=make_axis(design, irregular, horizon)
    )


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(
            f"{path.as_posix()}: cannot be read: {error}; fix: synthesize the folder again"
        ) from error
