"""Counts the operations of one control step."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from bfppc_synth.model.cost import StepCost
from bfppc_synth.model.law import Operator

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bfppc_synth.model.law import Law, Statement

_ADDITIONS = (Operator.ADD, Operator.SUB, Operator.NEG)
_CHOICES = (Operator.SELECT_LESS, Operator.SELECT_LESS_EQUAL)
#: t_0, t_last, the command.
_ALWAYS_KEPT = 3


def step_cost(law: Law) -> StepCost:
    """Count what the longest step computes, the first one left out.

    Parameters
    ----------
    law : Law
        The controller; one in stages may pass through all of them in one step.

    Returns
    -------
    StepCost
        Screening, clamp and status are not counted: they are comparisons, a few per state.
    """
    count = Counter(statement.operator for statement in _statements(law))
    simple = (*_ADDITIONS, Operator.MUL, Operator.DIV, *_CHOICES)
    anchors = 0 if law.switching is None else law.switching.anchors
    return StepCost(
        additions=sum(count[operator] for operator in _ADDITIONS),
        multiplications=count[Operator.MUL],
        divisions=count[Operator.DIV],
        choices=sum(count[operator] for operator in _CHOICES),
        functions=tuple(
            sorted(
                (operator.value, calls)
                for operator, calls in count.items()
                if operator not in simple
            )
        ),
        remembered=_ALWAYS_KEPT
        + len(law.center.latched)
        + (law.center.latch is None)
        + (2 * anchors + bool(anchors and law.center.latched)),
    )


def _statements(law: Law) -> Iterator[Statement]:
    yield from law.derived
    if law.center.latch is not None:
        yield from law.center.latch.signals
    if law.switching is None:
        yield from law.center.statements
        yield from law.feedback
        return
    # Every handover makes a new center.
    for _ in range(1 + law.switching.anchors):
        yield from law.center.statements
    for stage in law.switching.stages:
        yield from stage.feedback
