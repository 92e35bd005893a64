"""The same plant file in its other form, or with every number that it leaves open filled in."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from bfppc_synth.model.expression import Constant, Number
from bfppc_synth.model.shapes import Theorem1Gain
from bfppc_synth.model.spec import Form, GainSpec, Method
from bfppc_synth.model.stages import Handover
from bfppc_synth.model.theorem1 import Schedule, Theorem1Spec

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bfppc_synth.audit.records import Candidate
    from bfppc_synth.model.shapes import Gain
    from bfppc_synth.model.spec import PlantSpec, SynthesisSpec

C_0 = "synthesis.theorem1.c_0"
_TERMS = ("k", "M", "c")


def variant(spec: PlantSpec, form: Form) -> PlantSpec:
    """Read a plant file as if it had the other form.

    The sound form of a printed file is about the law that the file describes: Theorem 3 as
    printed keeps its center at a switch, so only ``containment`` is the same law.

    Parameters
    ----------
    spec : PlantSpec
        The file as read.
    form : Form
        The form wanted.

    Returns
    -------
    PlantSpec
        Its document has the form too, so that the separate checker reads the same.
    """
    if spec.synthesis.form is form:
        return spec
    if form is Form.SOUND and spec.synthesis.method is Method.THEOREM3:
        return with_handover(spec, Handover.CONTAINMENT)
    synthesis = replace(spec.synthesis, form=form)
    return replace(spec, synthesis=synthesis, document=_edited(spec.document, {"form": form}))


def with_handover(spec: PlantSpec, handover: Handover) -> PlantSpec:
    """Read a file of Theorem 3 in the sound form with another handover."""
    synthesis = replace(spec.synthesis, form=Form.SOUND, handover=handover)
    edits = {"form": Form.SOUND, "handover": handover}
    return replace(spec, synthesis=synthesis, document=_edited(spec.document, edits))


def _edited(document: object, edits: Mapping[str, str]) -> object:
    """Set keys of ``synthesis`` in the frozen document (spec.canonical)."""
    kind, entries = _parts(document)
    changed: list[tuple[str, object]] = []
    for key, value in entries:
        if key == "synthesis":
            inner, pairs = _parts(value)
            kept = tuple(pair for pair in pairs if pair[0] not in edits)
            added = tuple((name, str(text)) for name, text in edits.items())
            changed.append((key, (inner, (*kept, *added))))
        else:
            changed.append((key, value))
    return kind, tuple(changed)


def _parts(frozen: object) -> tuple[str, tuple[tuple[str, object], ...]]:
    if not isinstance(frozen, tuple):
        return "mapping", ()
    kind, entries = frozen
    return kind, entries


def open_keys(spec: PlantSpec) -> tuple[str, ...]:
    """List the paths of the numbers that the file leaves open, in its order of states."""
    synthesis, out = spec.synthesis, []
    theorem1 = synthesis.method is Method.THEOREM1
    for i, (state, gain) in enumerate(zip(spec.states, synthesis.gains, strict=True)):
        names = ["gamma", "H", "c"] if theorem1 else [*_TERMS]
        if not theorem1 and not _is_zero(gain.M):
            names.append("epsilon")
        out += [f"synthesis.gains.{state}.{n}" for n in names if getattr(gain, n) is None]
        rooms = () if synthesis.theorem1 is None else synthesis.theorem1.epsilon
        implied = theorem1 and i < len(rooms) and rooms[i] is not None
        if i > 0 and synthesis.p[i] is None and not implied:
            out.append(f"synthesis.p.{state}")
    options = synthesis.theorem1
    if theorem1 and (options is None or options.c_0 is None):
        out.append(C_0)
    return tuple(out)


def without_absent_terms(spec: PlantSpec) -> tuple[PlantSpec, tuple[str, ...]]:
    """Take a term that a step does not name as 0 where the step names another.

    A tanh whose epsilon is given is named, though its M may be open.

    Returns
    -------
    tuple
        The file with these zeros, and their paths.
    """
    theorem1 = spec.synthesis.method is Method.THEOREM1
    leading, optional = (("gamma", "H"), ("c",)) if theorem1 else (_TERMS, _TERMS)
    gains, paths = [], []
    for state, gain in zip(spec.states, spec.synthesis.gains, strict=True):
        given = [getattr(gain, name) for name in leading]
        named = any(value is not None and not _is_zero(value) for value in given)
        absent = [name for name in optional if named and getattr(gain, name) is None]
        if not theorem1 and gain.epsilon is not None and "M" in absent:
            absent.remove("M")
        zeros: dict[str, Any] = dict.fromkeys(absent, constant(0.0))
        gains.append(replace(gain, **zeros))
        paths += [f"synthesis.gains.{state}.{name}" for name in absent]
    synthesis = replace(spec.synthesis, gains=tuple(gains))
    return replace(spec, synthesis=synthesis), tuple(paths)


def pinned(spec: PlantSpec, candidate: Candidate) -> PlantSpec:
    """Fix every number that the file leaves open at the candidate's."""
    synthesis = spec.synthesis
    gains = tuple(
        _pinned_gain(given, gain)
        for given, gain in zip(synthesis.gains, candidate.gains, strict=True)
    )
    widths = (
        synthesis.p[0],
        *(
            constant(width) if given is None else given
            for given, width in zip(synthesis.p[1:], candidate.half_widths[1:], strict=True)
        ),
    )
    changed = replace(synthesis, gains=gains, p=widths)
    if candidate.c_0 is not None:
        changed = replace(changed, theorem1=_pinned_options(synthesis, candidate.c_0))
    return replace(spec, synthesis=changed)


def _pinned_options(synthesis: SynthesisSpec, c_0: float) -> Theorem1Spec:
    given = synthesis.theorem1
    if given is None:
        nothing = (None,) * len(synthesis.p)
        return Theorem1Spec(c_0=constant(c_0), epsilon=nothing, H=Schedule.CONSTANT)
    return replace(given, c_0=constant(c_0) if given.c_0 is None else given.c_0)


def _pinned_gain(given: GainSpec, gain: Gain) -> GainSpec:
    names = ("gamma", "c") if isinstance(gain, Theorem1Gain) else (*_TERMS, "epsilon")
    filled: dict[str, Any] = {
        name: constant(getattr(gain, name)) for name in names if getattr(given, name) is None
    }
    if isinstance(gain, Theorem1Gain):
        H = given.H or tuple(constant(coefficient) for coefficient in gain.H)
        return replace(given, H=H, **filled)
    return replace(given, **filled)


def constant(value: float) -> Constant:
    """Write a binary64 number as a constant of the file."""
    exact = Fraction(value)
    return Constant(text=repr(value), tree=Number(value=exact), exact=exact, approximate=value)


def _is_zero(given: object) -> bool:
    return isinstance(given, Constant) and given.approximate == 0.0
