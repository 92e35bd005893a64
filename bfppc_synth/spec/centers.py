"""Which center a plant file means that names none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from bfppc_synth.expressions.partial import operands
from bfppc_synth.model.expression import Branches, Call, Number, Operation
from bfppc_synth.model.spec import CenterKind, ReferenceKind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.model.expression import Expression, Node
    from bfppc_synth.model.spec import ChannelSpec, ReferenceSpec

_ROUGH: Final = frozenset({"abs", "sign", "min", "max"})


def default_center(channels: Sequence[ChannelSpec], reference: ReferenceSpec) -> CenterKind:
    """Return nominal where the plant and the reference's derivatives are known.

    Parameters
    ----------
    channels : Sequence[ChannelSpec]
        The dynamics, one per state.
    reference : ReferenceSpec
        Smooth expressions have all derivatives; bounds must be n + 2.

    Returns
    -------
    CenterKind
        Performance where some state has f_bound or g_bound, or a g that center nominal cannot
        differentiate.

    References
    ----------
    docs/theory.md section 4, "Regularity".
    """
    if any(channel.f_bound or channel.g_bound for channel in channels):
        return CenterKind.PERFORMANCE
    match reference.kind:
        case ReferenceKind.DECLARED:
            known = False
        case ReferenceKind.RUNTIME:
            known = len(reference.bounds) >= len(channels) + 2
        case ReferenceKind.EXPRESSION:
            known = _is_smooth(reference.expression)
    smooth = known and all(_is_smooth(channel.g) for channel in channels)
    return CenterKind.NOMINAL if smooth else CenterKind.PERFORMANCE


def _is_smooth(expression: Expression | None) -> bool:
    """Whether an expression, absent ones included, has neither kinks nor odd roots."""
    waiting: list[Node] = [] if expression is None else [expression.tree]
    while waiting:
        node = waiting.pop()
        match node:
            case Call(function=function) if function in _ROUGH:
                return False
            case Branches():
                return False
            case Operation(operator="**", operands=(_, Number(value=exponent))) if (
                exponent.denominator > 1 and exponent.denominator % 2 == 1
            ):
                return False
        waiting.extend(operands(node))
    return True
