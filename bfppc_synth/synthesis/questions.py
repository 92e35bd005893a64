"""Questions that a plant file need not ask itself: how small, how slow, how coarse."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.errors import UsageError
from bfppc_synth.expressions.parse import parse_constant
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.spec import Form, Method, Objective, QuantizerKind
from bfppc_synth.synthesis.synthesize import synthesize

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec


def _silent(message: str) -> None:
    del message


def smallest_accuracy(
    spec: PlantSpec,
    *,
    progress: Callable[[str], None] = _silent,
    arithmetic: Arithmetic = DEFAULT,
) -> Design:
    """Find the smallest p_1 that keeps ``actuator.limit``, everything else as in the file.

    Parameters
    ----------
    spec : PlantSpec
        With an actuator limit; its own accuracy and objective are set aside.
    progress, arithmetic
        As of ``synthesize``.

    Returns
    -------
    Design
        ``design.spec.chosen.value`` is p_1 [unit of x_1]; certified, or ``certificate`` says why
        not. It is about an edited file: do not write it beside the given one.

    Raises
    ------
    NoDesignError, PlantFileError
        As ``synthesize``.
    UsageError
        The file lacks what the question is about.

    References
    ----------
    docs/theory.md section 5.
    """
    asked = replace(spec, performance=replace(spec.performance, accuracy=None))
    asked = replace(asked, document=_without(asked.document, "performance", "accuracy"))
    return _answered(asked, Objective.ACCURACY, progress, arithmetic)


def largest_period(
    spec: PlantSpec,
    *,
    progress: Callable[[str], None] = _silent,
    arithmetic: Arithmetic = DEFAULT,
) -> Design:
    """Find the largest h, everything else as in the file (see ``smallest_accuracy``).

    ``design.spec.chosen.value`` is h [s].
    """
    sampling = replace(spec.sampling, period=parse_constant("0"))
    asked = replace(spec, sampling=sampling)
    asked = replace(asked, document=_without(asked.document, "sampling", "period"))
    return _answered(asked, Objective.PERIOD, progress, arithmetic)


def largest_resolution(
    spec: PlantSpec,
    *,
    progress: Callable[[str], None] = _silent,
    arithmetic: Arithmetic = DEFAULT,
) -> Design:
    """Find the largest common factor on the quantizers (see ``smallest_accuracy``).

    ``design.spec.chosen.value`` is the factor on every length of every quantizer of the file.
    """
    return _answered(spec, Objective.RESOLUTION, progress, arithmetic)


def _answered(
    spec: PlantSpec,
    objective: Objective,
    progress: Callable[[str], None],
    arithmetic: Arithmetic,
) -> Design:
    missing = _missing(spec, objective)
    if missing:
        raise UsageError(f"{spec.path}: objective {objective} needs {missing}")
    synthesis = replace(spec.synthesis, objective=((objective, 1.0),))
    document = _with_objective(spec.document, objective)
    asked = replace(spec, synthesis=synthesis, document=document, chosen=None)
    return synthesize(asked, progress=progress, arithmetic=arithmetic)


def _missing(spec: PlantSpec, objective: Objective) -> str:
    """Name what the reader would ask for, had the file itself this objective."""
    if spec.synthesis.form is Form.PRINTED:
        return "form sound"
    if objective is Objective.ACCURACY and spec.actuator.limit is None:
        return "actuator.limit"
    if objective is Objective.PERIOD:
        continuous = spec.synthesis.method in (Method.THEOREM1, Method.THEOREM2)
        return "method unified or theorem3" if continuous else ""
    kinds = {quantizer.kind for quantizer in spec.measurement.quantizers}
    exact = objective is Objective.RESOLUTION and kinds == {QuantizerKind.NONE}
    return "measurement.quantizer" if exact else ""


def _without(document: object, section: str, key: str) -> object:
    """Leave one key of a section out of the frozen document (spec.canonical)."""
    kind, entries = _parts(document)
    changed: list[tuple[str, object]] = []
    for name, value in entries:
        if name == section:
            inner, pairs = _parts(value)
            changed.append((name, (inner, tuple(pair for pair in pairs if pair[0] != key))))
        else:
            changed.append((name, value))
    return kind, tuple(changed)


def _with_objective(document: object, objective: Objective) -> object:
    kind, entries = _parts(_without(document, "synthesis", "objective"))
    given = dict(entries)
    inner, pairs = _parts(given.get("synthesis"))
    given["synthesis"] = (inner, (*pairs, ("objective", str(objective))))
    return kind, tuple(given.items())


def _parts(frozen: object) -> tuple[str, tuple[tuple[str, object], ...]]:
    if not isinstance(frozen, tuple):
        return "mapping", ()
    kind, entries = frozen
    return kind, entries
