"""For each requirement alone the value that would suffice, and the design that proves it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.reasons.boundary import least_relaxation
from bfppc_synth.reasons.requirement import Requirement, number, relative_change
from bfppc_synth.spec.edits import Edit

if TYPE_CHECKING:
    from collections.abc import Callable

    from bfppc_synth.reasons.question import Question

# Where the checker or the rounding wants more than the search, so much further, in turn.
_FURTHER = (1.0, 1.01, 1.03, 1.08, 1.2)
# The limit is above the least peak input found by this much, then by more.
_ABOVE = (1.004, 1.02, 1.08)


@dataclass(frozen=True, slots=True, kw_only=True)
class Suggestion:
    """Edits that give a certified design of peak input ``U`` [unit of u].

    ``factor`` is on what the file gives (1 where it is no factor): how little was changed.
    """

    path: str
    given: str
    edits: tuple[Edit, ...]
    factor: float
    U: float
    weight: float = 1.0

    @property
    def cost(self) -> float:
        """How much is changed: the log of the factor times what such a change is worth."""
        return relative_change(self.factor) * self.weight

    @property
    def written(self) -> str:
        """The edits in words."""
        return ", ".join(
            f"without {edit.path}" if edit.text is None else f"{edit.path} {edit.text}"
            for edit in self.edits
        )

    @property
    def suffices(self) -> str:
        """What the file should say: the value alone where it is one."""
        if len(self.edits) == 1 and self.edits[0].path == self.path:
            return self.edits[0].text or "absent"
        return self.written

    def document(self) -> dict[str, object]:
        """Return the object of ``--json``; ``edits`` are literal."""
        return {
            "path": self.path,
            "given": self.given,
            "suffices": self.suffices,
            "edits": {edit.path: edit.text for edit in self.edits},
            "factor": self.factor if self.factor < math.inf else None,
            "U": self.U,
        }


def suggestion(question: Question, requirement: Requirement, given: float) -> Suggestion | None:
    """Relax one requirement as little as a certified design allows.

    Parameters
    ----------
    question : Question
        The plant file.
    requirement : Requirement
        What is relaxed; everything else stays.
    given : float
        By which factor (its log) the file itself misses.

    Returns
    -------
    Suggestion or None
        None where this requirement alone does not help, or not within what was tried.
    """

    def miss(factor: float) -> float:
        try:
            edits = requirement.change(factor)
        except ArithmeticError:
            # No number of a plant file is that large.
            return math.inf
        return question.miss(edits)

    factor = least_relaxation(requirement, miss, given)
    found = None if factor is None else settled(question, requirement, factor)
    if question.is_tight:
        return _tightened(question, requirement, found)
    return found


def _tightened(
    question: Question, requirement: Requirement, found: Suggestion | None
) -> Suggestion | None:
    """Ask for less than termwise bounds need, as a whole synthesis tells; each takes seconds."""
    factors: tuple[float, ...] = requirement.factors[:2]
    if found is not None:
        if not 0.0 < found.factor < math.inf:
            return found
        factors = tuple(found.factor**power for power in (0.25, 0.5, 0.75))
    for factor in factors:
        if question.patience.is_over:
            break
        nearer = _certified_at(question, requirement, factor)
        if nearer is not None:
            return nearer
    return found


def settled(question: Question, requirement: Requirement, factor: float) -> Suggestion | None:
    """Certify a relaxation, or one a little further."""
    tried: set[tuple[Edit, ...]] = set()
    for further in _FURTHER:
        at = factor * further if factor > 1.0 else factor / further
        edits = requirement.change(at)
        if edits in tried:
            continue
        tried.add(edits)
        found = _certified_at(question, requirement, at)
        if found is not None:
            return found
        if question.patience.is_over:
            break
    return None


def _certified_at(question: Question, requirement: Requirement, factor: float) -> Suggestion | None:
    edits = requirement.change(factor)
    design = question.certified(edits)
    if design is None:
        return None
    return Suggestion(
        path=requirement.path,
        given=requirement.given,
        edits=edits,
        factor=factor,
        U=design.bounds.U,
        weight=requirement.weight,
    )


def other_way(
    question: Question, given: str, ways: tuple[tuple[Edit, ...], ...]
) -> Suggestion | None:
    """Take another method or center: the first of these ways that has a design.

    Each way is complete, its transition included, as the search of a free one takes long where
    there is none.
    """
    for edits in ways:
        if question.patience.is_over or question.miss(edits) > 0.0:
            continue
        design = question.certified(edits)
        if design is not None:
            path = edits[0].path
            return Suggestion(
                path=path, given=given, edits=edits, factor=math.inf, U=design.bounds.U
            )
    return None


def limit_suggestion(question: Question, least: float) -> Suggestion | None:
    """Raise actuator.limit to the least peak input, and to what can be certified near it."""
    limit = question.spec.actuator.limit
    if limit is None:
        return None
    for above in _ABOVE:
        edits = (Edit(path="actuator.limit", text=number(least * above, 1)),)
        design = question.certified(edits)
        if design is not None:
            return Suggestion(
                path="actuator.limit",
                given=limit.text,
                edits=edits,
                factor=least * above / limit.approximate,
                U=design.bounds.U,
            )
    return None


def released_suggestion(question: Question, path: str, given: float) -> Suggestion | None:
    """Take back one fixed gain or half-width: a value nearest to the given one, else none."""
    freed = (Edit(path=path, text=None),)
    if question.miss(freed) > 0.0:
        return None
    design = question.certified(freed)
    if design is None:
        return None
    value = value_at(question, design.gains, design.omega, path)
    if given > 0.0 and value is not None and value > 0.0:
        near = _nearest_value(question, path, given, value)
        if near is not None:
            return near
    return Suggestion(
        path=path, given=f"{given:g}", edits=freed, factor=math.inf, U=design.bounds.U
    )


def _nearest_value(question: Question, path: str, given: float, value: float) -> Suggestion | None:
    ratio = value / given
    side = 1 if ratio > 1.0 else -1

    def change(factor: float) -> tuple[Edit, ...]:
        return (Edit(path=path, text=number(given * factor, side)),)

    towards = Requirement(
        path=path,
        given=f"{given:g}",
        change=change,
        factors=tuple(ratio**power for power in (0.25, 0.5, 0.75, 1.0)),
    )
    return suggestion(question, towards, math.inf)


def value_at(
    question: Question, gains: tuple[object, ...], widths: tuple[float, ...], path: str
) -> float | None:
    """Read what a design has where the file fixes ``synthesis.gains.STATE.KEY`` or ``.p.STATE``."""
    *_, kind, state, key = ("", *path.split("."))
    if kind == "gains":
        found = getattr(gains[question.spec.states.index(state)], key)
        return float(found)
    return widths[question.spec.states.index(key)]


def together(
    question: Question,
    requirements: tuple[Requirement, ...],
    given: float,
    progress: Callable[[str], None],
) -> Suggestion | None:
    """Relax everything by one common factor, where nothing alone helps."""
    distinct = {requirement.path: requirement for requirement in reversed(requirements)}
    parts = tuple(reversed(distinct.values()))
    if len(parts) < 2:
        return None
    progress("no requirement alone helps: relaxing all of them together")

    def change(factor: float) -> tuple[Edit, ...]:
        edits: dict[str, Edit] = {}
        for part in parts:
            own = factor if part.factors[0] > 1.0 else 1.0 / factor
            edits |= {edit.path: edit for edit in part.change(own)}
        return tuple(edits.values())

    whole = Requirement(
        path="together",
        given=", ".join(part.given for part in parts),
        change=change,
        factors=(1.2, 2.0, 6.0, 30.0),
    )
    return suggestion(question, whole, given)
