"""Theorem 2: exact continuous measurement, the paper's inequalities (65) and (71)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from bfppc_synth.bounds.chain import ChainInput, ChainRules, Coupling, Division
from bfppc_synth.gains.methods.demands import Demand
from bfppc_synth.model.certificate import Strictness
from bfppc_synth.model.shapes import Terms

if TYPE_CHECKING:
    from bfppc_synth.bounds.feedback import Numbers
    from bfppc_synth.model.bounds import ChainBounds

T = TypeVar("T")

# sup of |s| - s tanh(s) is 0.27846...; the paper rounds it up to 0.3.
TANH_DEFECT_UPPER = 0.2785
TANH_DEFECT_PRINTED = 0.3


class _Theorem2:
    rules: ChainRules
    strictness: Strictness
    defect: float

    def alternatives(self) -> tuple[str, ...]:
        """There is one form."""
        return ("T2",)

    def demands(
        self,
        alternative: str,
        start: ChainInput[T],
        bounds: ChainBounds[T],
        numbers: Numbers[T],
        inner: T | None,
    ) -> tuple[Demand[T], ...]:
        """K p + M + c p^N > F* + defect epsilon / p, for every step.

        References
        ----------
        The paper's (65), (71); docs/theory.md section 2.
        """
        del inner
        last = len(start.shapes) - 1
        out: list[Demand[Any]] = []
        for i, shape in enumerate(start.shapes):
            p: Any = start.half_widths[i]
            lhs: Any = numbers.number(0.0)
            rhs: Any = bounds.F_star[i]
            gains: Any = shape
            if Terms.LINEAR in shape.terms:
                lhs = lhs + gains.k * p
            if Terms.TANH in shape.terms:
                lhs = lhs + gains.M
                rhs = rhs + self.defect * gains.epsilon / p
            if Terms.POWER in shape.terms:
                lhs = lhs + gains.c * p**gains.N
            equation = "(71)" if i == last else "(65)"
            out.append(Demand(name=alternative, equation=equation, step=i, lhs=lhs, rhs=rhs))
        return tuple(out)


class Theorem2(_Theorem2):
    """The sound form: divided F_i*, one g_m a channel, 0.2785, strict."""

    rules = ChainRules()
    strictness = Strictness.STRICT
    defect = TANH_DEFECT_UPPER


class Theorem2Printed(_Theorem2):
    """The paper's text: undivided, one g_m, L_i E_i, 0.3, not strict. Never certified."""

    rules = ChainRules(coupling=Coupling.SIMPLE, division=Division.PRINTED)
    strictness = Strictness.WEAK
    defect = TANH_DEFECT_PRINTED
