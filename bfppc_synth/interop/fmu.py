"""A controller as an FMU: variables, XML, sources, and the archive."""

from __future__ import annotations

import hashlib
import io
import uuid
import zipfile
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from bfppc_synth.resources import template_environment

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.model.law import Law


class Standard(StrEnum):
    """Versions of the Functional Mock-up Interface."""

    FMI2 = "2.0"
    FMI3 = "3.0"

    @property
    def major(self) -> str:
        """2 or 3."""
        return self.value[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Steps:
    """Largest communication steps [s] that the certificate covers, None where it covers none.

    ``delayed``: commands act one communication step late, and the declared delay later still.
    ``event``: FMI 3.0 with Event Mode, where the declared delay is all. ``alone``: one step late
    and no more, where the plant file declares a delay.
    """

    delayed: float | None
    event: float | None
    alone: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Package:
    """What an FMU is made of besides the law.

    ``code`` holds NAME.h and NAME.c by file name; ``banner`` and ``heading`` stand in every
    file; ``stop`` is the horizon of the default experiment [s].
    """

    code: Mapping[str, str]
    banner: tuple[str, ...]
    heading: str
    tool_version: str
    steps: Steps
    stop: float
    period: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuVariable:
    """A row of modelDescription.xml; texts without a meaning are empty."""

    name: str
    reference: int
    kind: str
    causality: str
    variability: str
    description: str
    initial: str = ""
    start: str = ""
    unit: str = ""


_STATUS = (
    "0 OK: the certificate speaks about the sample; 1 OUTSIDE: an error left its tube or the"
    " start its set; 2 BAD_INPUT, 3 BAD_TIME: the last command is held"
)


def variables_of(law: Law, steps: Steps, standard: Standard) -> tuple[FmuVariable, ...]:
    """List the variables, inputs first, by value reference from 1.

    Parameters
    ----------
    law : Law
        States, units, reference.
    steps : Steps
        They stand there as constants; 0 where the certificate covers no step.
    standard : Standard
        FMI 3.0 has one constant more.

    Returns
    -------
    tuple[FmuVariable, ...]
        Measured states by their names, y_d and its derivatives where they are passed at run
        time, u, status, constants, and the stage of a law that has any.
    """
    taken = {"u", "status", "stage", "time", "largest_communication_step"}
    units, real = dict(law.units), "Real" if standard is Standard.FMI2 else "Float64"
    whole = "Integer" if standard is Standard.FMI2 else "Int32"
    limits = {constant.name: float(constant.value) for constant in law.limits}
    rows: list[dict[str, str]] = []
    for i, state in enumerate(law.states, start=1):
        name = state
        while name in taken:
            name = f"state_{name}"
        taken.add(name)
        middle = 0.5 * (limits[f"start_lower_{i}"] + limits[f"start_upper_{i}"])
        about = f"measured state {i}, quantized as the certificate assumes"
        rows.append(_row(name, real, "input", about, start=repr(middle), unit=units.get(state, "")))
    if law.reference is None:
        names = law.derivatives or ("y_d",)
        for k, name in enumerate(names):
            about = "the reference" if k == 0 else f"derivative {k} of the reference, exact"
            unit = units.get(law.states[0], "") if k == 0 else ""
            rows.append(_row(name, real, "input", about, start="0.0", unit=unit))
    about = f"the command, within {law.u_max!r} of 0"
    rows.append(_row("u", real, "output", about, initial="calculated", unit=units.get("u", "")))
    rows.append(_row("status", whole, "output", _STATUS, initial="calculated"))
    about = "largest communication step of Co-Simulation that the certificate covers [s]; 0: none"
    rows.append(_constant("largest_communication_step", real, about, steps.delayed))
    if standard is Standard.FMI3:
        name = "largest_communication_step_event_mode"
        rows.append(_constant(name, real, f"{about}, with Event Mode", steps.event))
    if law.switching is not None:
        about = f"the stage in force, 1 to {len(law.switching.stages)}"
        rows.append(_row("stage", whole, "output", about, initial="calculated"))
    return tuple(FmuVariable(**row, reference=place) for place, row in enumerate(rows, start=1))


def _row(name: str, kind: str, causality: str, description: str, **more: str) -> dict[str, str]:
    variability = "continuous" if kind in ("Real", "Float64") else "discrete"
    return {
        "name": name,
        "kind": kind,
        "causality": causality,
        "variability": variability,
        "description": description,
        **more,
    }


def _constant(name: str, kind: str, description: str, value: float | None) -> dict[str, str]:
    row = _row(name, kind, "local", description, initial="exact", start=repr(value or 0.0))
    return {**row, "variability": "constant"}


def sentences(law: Law, steps: Steps, standard: Standard) -> tuple[str, ...]:
    """Say what an importing tool has to know of the certificate."""
    reach = (
        f"The certificate counts this delay: it holds for communication steps of at most"
        f" {steps.delayed!r} s, the plant's own delay being the declared one besides."
        if steps.delayed
        else "With this delay the certificate holds for no communication step: Co-Simulation of"
        " this controller is not certified."
    )
    if steps.alone:
        reach += (
            " Where the declared delay stands for this one and the plant has none of its own, it"
            f" holds for communication steps of at most {steps.alone!r} s."
        )
    told = [
        (
            "Model Exchange has no delay: u follows the inputs. The start is latched when"
            " Continuous-Time Mode is first entered; from then on the samples that count are"
            " those of completed integrator steps and events."
        ),
        (
            "Co-Simulation adds one communication step of delay: u after a step is the command"
            f" for the inputs at its beginning. {reach}"
        ),
        (
            "Inputs are what the controller measures: the states after quantizer and noise,"
            " within the resolution of the plant file. The importing tool has to quantize."
        ),
    ]
    if standard is Standard.FMI3:
        told.insert(
            2,
            "With Event Mode each communication point is an event, and u there is the command"
            " for the inputs at this very point, without delay. "
            + (
                f"The certificate then holds for communication steps of at most {steps.event!r} s."
                if steps.event
                else "The certificate then holds for no communication step either."
            ),
        )
    if law.switching is not None:
        told.append(
            "The law has stages. In Model Exchange a stage is left at the first completed step"
            " whose errors are outside its half-widths, which is an event."
        )
    return tuple(told)


def render_fmu(law: Law, package: Package, standard: Standard) -> dict[str, str]:
    """Write every text of an FMU.

    Parameters
    ----------
    law : Law
        The controller.
    package : Package
        Its C code, and what the certificate says of communication steps.
    standard : Standard
        Which of the two.

    Returns
    -------
    dict[str, str]
        Path in the archive -> text; equal arguments give equal bytes, and the GUID
        (instantiation token) is a hash of all of them.

    Raises
    ------
    ResourceError
        If the installation has no templates.
    """
    draft = _texts(law, package, standard, guid="")
    digest = hashlib.sha256()
    for path, text in sorted(draft.items()):
        digest.update(f"{path}\0{text}\0".encode())
    guid = f"{{{uuid.UUID(bytes=digest.digest()[:16], version=5)}}}"
    return _texts(law, package, standard, guid=guid)


def _texts(law: Law, package: Package, standard: Standard, *, guid: str) -> dict[str, str]:
    variables = variables_of(law, package.steps, standard)
    inputs = [item for item in variables if item.causality == "input"]
    told = sentences(law, package.steps, standard)
    context = {
        "name": law.name,
        "guid": guid,
        "banner": package.banner,
        "heading": package.heading,
        "sentences": told,
        "description": f"Controller {package.heading}. {' '.join(told)}",
        "tool_version": package.tool_version,
        "version": standard.value,
        "variables": variables,
        "units": sorted({item.unit for item in variables if item.unit}),
        "inputs": inputs,
        "known": [item.reference for item in inputs],
        "outputs": [item.reference for item in variables if item.causality == "output"],
        "first_output": len(inputs) + 1,
        "order": law.order,
        "derivatives": law.derivatives,
        "reference": law.reference is not None,
        "switching": law.switching is not None,
        "step": repr(package.steps.delayed or 0.0),
        "event_step": repr(package.steps.event or 0.0),
        "stop": repr(package.stop),
    }
    experiment = package.steps.delayed or package.period
    major = standard.major
    templates = {
        "modelDescription.xml": f"modelDescription{major}.xml.jinja",
        "documentation/index.html": "index.html.jinja",
    }
    # No plant's name has a dash: NAME.c and NAME.h stand beside these.
    for file in (source_of(standard), f"fmi{major}-types.h", "fmu-memory.h"):
        templates[f"sources/{file}"] = f"{file}.jinja"
    if standard is Standard.FMI3:
        templates["sources/buildDescription.xml"] = "buildDescription.xml.jinja"
    environment = template_environment()
    texts = {}
    for path, template in templates.items():
        # The step of the C code is the certified one, that of the XML a suggestion.
        own = {"step": repr(experiment)} if path.startswith("model") else {}
        texts[path] = environment.get_template(f"fmu/{template}").render({**context, **own})
    return texts | {f"sources/{name}": text for name, text in package.code.items()}


def source_of(standard: Standard) -> str:
    """Name the one file under sources/ that is compiled; it includes the others."""
    return f"fmi{standard.major}-interface.c"


def archive(files: Mapping[str, bytes]) -> bytes:
    """Zip files, sorted and without the time of day: equal files give equal bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as target:
        for path in sorted(files):
            entry = zipfile.ZipInfo(path, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = (0o755 if path.endswith(".so") else 0o644) << 16
            target.writestr(entry, files[path])
    return buffer.getvalue()
