"""What a design owes to the numbers that its code computes with.

In binary64 rounding is far below every margin, and the checker alone counts it. In binary32 it is
not: gains are rounded first, the checker bounds what the law loses, and the search is asked again
for a design that has that much room.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.errors import NoDesignError
from bfppc_synth.gains.diagnose import no_design
from bfppc_synth.gains.evaluation import Evaluation, Judge
from bfppc_synth.gains.problem import DesignProblem, is_free
from bfppc_synth.gains.search import search
from bfppc_synth.model.certificate import Certificate, Verdict
from bfppc_synth.synthesis.arithmetic import refusal, rounded_shape, with_rounding
from bfppc_synth.synthesis.proof import errors_of, proved

if TYPE_CHECKING:
    from bfppc_synth.model.shapes import Shape

#: Room beyond the rounding of the last design, as the next one rounds a little differently.
_ROOM = 1.25
#: Designs that are tried before binary32 is refused.
_TRIES = 4

Find = Callable[[DesignProblem], tuple[Evaluation | None, Certificate | None]]


def found_with_room(base: DesignProblem, find: Find) -> tuple[Evaluation, Certificate]:
    """Search a design that has room for the rounding of binary32.

    Parameters
    ----------
    base : DesignProblem
        Under the conditions of the plant file.
    find : Find
        Searches, rounds to the numbers of the code and proves.

    Returns
    -------
    tuple[Evaluation, Certificate]
        The first design that is proved, or whose plant file is refuted; where nothing is free
        that one, proved or not.

    Raises
    ------
    NoDesignError
        If there is a design for binary64 and none that binary32 keeps.
    """
    first = search(base, _silent)
    if first is None:
        raise no_design(base, free=is_free(base))
    last = rounded_evaluation(base, first)
    for _ in range(_TRIES):
        errors = errors_of(base, last.shapes, last.half_widths)
        if not is_free(base):
            certificate = proved(base, last)
            if certificate.verdict is not Verdict.CERTIFIED:
                reasons = (refused_single(base, last, errors), *certificate.failures)
                certificate = replace(certificate, failures=reasons)
            return last, certificate
        if not errors:
            break
        found, certificate_or_none = find(with_rounding(base, allowance(errors)))
        if found is None or certificate_or_none is None:
            break
        refuted = any(not entry.holds for entry in certificate_or_none.assumption_checks)
        if refuted or certificate_or_none.verdict is Verdict.CERTIFIED:
            return found, certificate_or_none
        last = found
    raise NoDesignError(refused_single(base, last, errors))


def with_own_rounding(
    base: DesignProblem, shapes: tuple[Shape, ...], half_widths: tuple[float, ...]
) -> DesignProblem:
    """Count in a design's own bounds what its law loses in binary32; in binary64 nothing."""
    if not base.arithmetic.single:
        return base
    return with_rounding(base, errors_of(base, shapes, half_widths))


def allowance(errors: tuple[float, ...]) -> tuple[float, ...]:
    """Take more than the rounding of one design as what the next one is searched for."""
    return tuple(_ROOM * error for error in errors)


def rounded_evaluation(problem: DesignProblem, found: Evaluation) -> Evaluation:
    """Round the gains and half-widths of a candidate to the numbers of the code."""
    arithmetic = problem.arithmetic
    if not arithmetic.single:
        return found
    shapes = tuple(rounded_shape(shape, arithmetic) for shape in found.shapes)
    widths = tuple(map(arithmetic.nearest, found.half_widths))
    judged = Judge(problem).evaluate(shapes, widths, found.alternative)
    return replace(found, shapes=shapes, half_widths=widths) if judged is None else judged


def refused_single(
    problem: DesignProblem, found: Evaluation | None, errors: tuple[float, ...]
) -> str:
    """Say which inequality of a design binary32 breaks, and by how much.

    Parameters
    ----------
    problem : DesignProblem
        Under the conditions of the plant file, without rounding.
    found : Evaluation or None
        A design that has no room for the rounding.
    errors : tuple[float, ...]
        What its law loses; empty where that is not bounded.
    """
    if found is None or not errors:
        return refusal(problem, errors, "the rounding is not bounded at all")
    try:
        worse = with_rounding(problem, errors)
    except NoDesignError as error:
        return str(error)
    judged = Judge(worse).evaluate(found.shapes, found.half_widths, found.alternative)
    if judged is None:
        return refusal(problem, errors, "a bound breaks down")
    before = {(d.name, d.step): d for d in found.demands}
    lost = max(
        judged.demands,
        key=lambda d: (d.rhs - d.lhs) / max(abs(d.rhs), abs(d.lhs), 1e-300),
    )
    name = f"{lost.name}[{problem.plant.spec.states[lost.step]}]"
    own = before.get((lost.name, lost.step), lost)
    return refusal(
        problem,
        errors,
        f"{name} needs {lost.lhs:.6g} > {lost.rhs:.6g}, {own.lhs:.6g} > {own.rhs:.6g} without"
        " rounding",
    )


def _silent(message: str) -> None:
    del message
