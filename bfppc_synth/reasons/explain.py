"""synthesize, and where that finds nothing: why, and what to change so that it does."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bfppc_synth.gains.diagnose import NoGainsError
from bfppc_synth.model.arithmetic import DEFAULT
from bfppc_synth.model.spec import CenterKind, Form, Method
from bfppc_synth.reasons.question import Patience, Question
from bfppc_synth.reasons.requirements import requirements_of
from bfppc_synth.reasons.sensitivities import INVERSE
from bfppc_synth.reasons.suggestions import (
    limit_suggestion,
    other_way,
    released_suggestion,
    suggestion,
    together,
)
from bfppc_synth.reasons.words import Answer, refusal
from bfppc_synth.spec.edits import Edit
from bfppc_synth.synthesis import synthesize as synthesis

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from bfppc_synth.errors import NoDesignError
    from bfppc_synth.model.arithmetic import Arithmetic
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.reasons.suggestions import Suggestion

# Lengths of a transition [s] that are tried where a plant file has none.
_LENGTHS = ("1", "3", "0.3")
# How long a user waits for an answer that is not a design [s]; what is left is said.
_PATIENCE = 60.0


def _silent(message: str) -> None:
    del message


def synthesize(
    spec: PlantSpec,
    *,
    progress: Callable[[str], None] = _silent,
    arithmetic: Arithmetic = DEFAULT,
    patience: float = _PATIENCE,
) -> Design:
    """Find gains, prove them, and return the design; or say what to change, certified.

    Parameters
    ----------
    spec : PlantSpec
        A checked plant file.
    progress : callable
        Receives one sentence per stage.
    arithmetic : Arithmetic
        What the generated code computes with.
    patience : float
        How long to look for what would suffice [s].

    Returns
    -------
    Design
        With its certificate, whatever it says: ``design.certificate.require()`` raises.

    Raises
    ------
    PlantFileError
        A bound breaks down on the smallest box, or the reference cannot be enclosed.
    NoDesignError
        Something is free and nothing was found, or the actuator limit is exceeded: which
        requirement binds, what drives it, and for each requirement alone a value with which a
        certified design was found.
    UsageError
        The arithmetic is not one that the plant file's method or functions allow.
    """
    try:
        return synthesis.synthesize(spec, progress=progress, arithmetic=arithmetic)
    except NoGainsError as error:
        inverse = any(word in INVERSE for word, _ in spec.synthesis.objective)
        if spec.synthesis.form is Form.PRINTED or inverse:
            raise
        question = Question(spec, error.problem, arithmetic, Patience.of(patience))
        raise explained(question, error, progress) from error


def explained(
    question: Question, error: NoGainsError, progress: Callable[[str], None]
) -> NoDesignError:
    """Look for what would suffice, one requirement after the other."""
    spec, diagnosis = question.spec, error.diagnosis
    given = question.miss(())
    # Tight bounds may miss where termwise ones do; the estimate is of the latter.
    given = given if given > 0.0 else math.inf
    found: dict[str, Suggestion] = {}
    useless: list[str] = []
    untried: list[str] = []
    if diagnosis.least_input is not None:
        progress("trying actuator.limit alone")
        raised = limit_suggestion(question, diagnosis.least_input)
        if raised is not None:
            found[raised.path] = raised
    elif spec.actuator.limit is not None:
        useless.append("actuator.limit")
    requirements = requirements_of(spec, question.start)
    for requirement in requirements:
        if requirement.path in found:
            continue
        if question.patience.is_over:
            untried.append(requirement.path)
            continue
        progress(f"trying {requirement.path} alone")
        change = suggestion(question, requirement, given)
        if change is not None:
            found[change.path] = change
        else:
            (untried if question.patience.is_over else useless).append(requirement.path)
    for path, value in fixed(spec):
        if question.patience.is_over:
            untried.append(path)
            continue
        progress(f"trying without {path}")
        change = released_suggestion(question, path, value)
        if change is not None:
            found[path] = change
        else:
            (untried if question.patience.is_over else useless).append(path)
    known, ways = other_ways(spec)
    if ways:
        progress(f"trying {ways[0][0].path} {ways[0][0].text}")
        change = other_way(question, known, ways)
        if change is not None:
            found[change.path] = change
    common = None
    if not found and not question.patience.is_over:
        common = together(question, requirements, given, progress)
    answer = Answer(
        diagnosis=diagnosis,
        suggestions=tuple(sorted(found.values(), key=lambda one: (one.cost, one.path))),
        useless=tuple(path for path in dict.fromkeys(useless) if path not in found),
        untried=tuple(dict.fromkeys(untried)),
        common=common,
    )
    return refusal(answer)


def other_ways(spec: PlantSpec) -> tuple[str, tuple[tuple[Edit, ...], ...]]:
    """Name a method or center that needs less input, and how to ask for it."""
    method, center = spec.synthesis.method, spec.synthesis.center
    if method in (Method.THEOREM1, Method.THEOREM2):
        return method.value, ((Edit(path="synthesis.method", text=Method.UNIFIED.value),),)
    if method is not Method.UNIFIED or center is not CenterKind.PERFORMANCE:
        return "", ()
    nominal = Edit(path="synthesis.center", text=CenterKind.NOMINAL.value)
    key = "performance.transition"
    lengths = (None,) if spec.gives(key) else _LENGTHS
    ways = tuple(
        (nominal,) if length is None else (nominal, Edit(path=key, text=length))
        for length in lengths
    )
    return center.value, ways


def fixed(spec: PlantSpec) -> Iterator[tuple[str, float]]:
    """Name each gain and half-width that the file fixes, and its value."""
    for state, gains, p in zip(spec.states, spec.synthesis.gains, spec.synthesis.p, strict=True):
        for key in ("k", "M", "epsilon", "c"):
            constant = getattr(gains, key)
            if constant is not None:
                yield f"synthesis.gains.{state}.{key}", constant.approximate
        if p is not None:
            yield f"synthesis.p.{state}", p.approximate
