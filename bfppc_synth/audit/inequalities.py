"""The inequalities of both forms side by side."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING

from bfppc_synth.audit.judging import HeightForm, holds
from bfppc_synth.audit.records import Row, Side
from bfppc_synth.audit.remedies import remedies
from bfppc_synth.bounds.true_starts import printed_start_center

if TYPE_CHECKING:
    from bfppc_synth.audit.judging import FormJudge, Judged
    from bfppc_synth.audit.records import Candidate
    from bfppc_synth.gains.methods.demands import Demand
    from bfppc_synth.model.spec import PlantSpec

# Both forms ask phi_i(p_i) to exceed the load, under names and equations of their own.
_SAME = {"T2": "gain", "U1": "gain", "U2": "gain", "U2'": "gain"}
_ROUGHLY = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluated:
    """A candidate judged in one form."""

    judge: FormJudge
    judged: Judged


def side_by_side(
    spec: PlantSpec, candidate: Candidate, printed: Evaluated | None, sound: Evaluated | None
) -> tuple[Row, ...]:
    """Pair the demands of the two forms.

    Parameters
    ----------
    spec : PlantSpec
        The audited file.
    candidate : Candidate
        Its numbers.
    printed, sound : Evaluated or None
        The forms; None where the method has none, or a bound breaks down in it.

    Returns
    -------
    tuple[Row, ...]
        In the order of the states; within one state as the forms list them.
    """
    columns = [{} if form is None else _sides(spec, candidate, form) for form in (printed, sound)]
    notes = _margins_of_the_text(spec, candidate, printed)
    keys = sorted(dict.fromkeys([*columns[0], *columns[1]]), key=lambda key: key[0])
    rows = []
    for key in keys:
        (first, equation), (second, other) = (column.get(key, (None, "")) for column in columns)
        rows.append(
            Row(
                equation=equation or other,
                path=_path(spec, key, (first, second)),
                step=key[0],
                state=spec.states[key[0]],
                printed=first,
                sound=second,
                notes=notes.get(key, ()),
            )
        )
    return tuple(rows)


def _sides(
    spec: PlantSpec, candidate: Candidate, form: Evaluated
) -> dict[tuple[int, str], tuple[Side, str]]:
    out = {}
    for demand in form.judged.demands:
        relation = form.judge.relation(demand)
        side = Side(
            id=f"{demand.name}[{spec.states[demand.step]}]",
            relation=relation,
            lhs=demand.lhs,
            rhs=demand.rhs,
            holds=holds(demand, relation),
            remedies=remedies(form.judge, candidate, form.judged, demand, spec),
        )
        out[_key(demand)] = (side, demand.equation)
    return out


def _path(spec: PlantSpec, key: tuple[int, str], sides: tuple[Side | None, ...]) -> str:
    """Name the key that decides a row: where no number alone does, the one that it is about."""
    found = (remedy.path for side in sides if side is not None for remedy in side.remedies)
    step, name = key
    if name == "limit":
        return next(found, "actuator.limit")
    if name.startswith("T3.stage"):
        number = int(name.removeprefix("T3.stage")) - 1
        return next(found, f"synthesis.stages.{number}.p.{spec.states[step]}")
    return next(found, "synthesis")


def _key(demand: Demand[float]) -> tuple[int, str]:
    return demand.step, _SAME.get(demand.name, demand.name)


def _margins_of_the_text(
    spec: PlantSpec, candidate: Candidate, printed: Evaluated | None
) -> dict[tuple[int, str], tuple[str, ...]]:
    """Say what H_i must dominate by the text's |q(x(0))| + delta_0, beside Example 1's margins.

    References
    ----------
    The paper's (21)-(25) against (85)-(86); docs/theory.md section 7.
    """
    if printed is None or not isinstance(printed.judge, HeightForm):
        return {}
    problem = printed.judge.problem
    margins = tuple(Fraction(noise) / 2 for noise in problem.noise)
    center = printed_start_center(spec, margins)
    judged = HeightForm(replace(problem, center=center)).judge(candidate)
    if judged is None:
        return {}
    found: dict[tuple[int, str], list[str]] = defaultdict(list)
    before = {_key(demand): demand for demand in printed.judged.demands}
    for demand in judged.demands:
        key = _key(demand)
        if demand.name == "T1.H" and demand.rhs < before[key].rhs * (1.0 - _ROUGHLY):
            found[key].append(
                f"printed with the text's margin delta_0 instead of (85)-(86)'s delta_M: "
                f"{demand.rhs:.4g}"
            )
    return {key: tuple(sentences) for key, sentences in found.items()}
