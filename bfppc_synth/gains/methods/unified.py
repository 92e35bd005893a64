"""Theorem U: quantized, sampled, delayed tracking in one condition."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from bfppc_synth.bounds.chain import ChainInput, ChainRules
from bfppc_synth.bounds.feedback import Numbers, feedback
from bfppc_synth.gains.methods.demands import Demand
from bfppc_synth.model.certificate import Strictness

if TYPE_CHECKING:
    from bfppc_synth.model.bounds import ChainBounds

T = TypeVar("T")


class Unified:
    """(U0), (U1) and (U2) or (U2') of docs/theory.md section 3."""

    rules = ChainRules()
    strictness = Strictness.STRICT

    def alternatives(self) -> tuple[str, ...]:
        """U2 counts the hold error in the tube, U2' in the last step's load."""
        return ("U2", "U2'")

    def demands(
        self,
        alternative: str,
        start: ChainInput[T],
        bounds: ChainBounds[T],
        numbers: Numbers[T],
        inner: T | None,
    ) -> tuple[Demand[T], ...]:
        """Every inequality, in the order of the states.

        References
        ----------
        docs/theory.md section 3, Theorem U; (65) and (71) of the paper without quantization.
        """
        last = len(start.shapes) - 1
        chain: ChainBounds[Any] = bounds
        p: tuple[Any, ...] = start.half_widths
        out: list[Demand[Any]] = []
        for i in range(last + 1):
            out.append(Demand(name="U0", equation="Theorem U", step=i, lhs=p[i], rhs=chain.eta[i]))
            if i < last:
                out.append(
                    Demand(name="U1", equation="(65)", step=i, lhs=chain.A[i], rhs=chain.F_star[i])
                )
        hold: Any = start.hold
        load = chain.F_star[last] + start.actuator_error + chain.delta_v
        if alternative == "U2":
            loss = chain.zeta
            room = loss
        else:
            pushed: Any = start.actuator_error + chain.delta_v
            noise = chain.eta[last]
            drift = chain.D[last] + chain.G[last] * pushed
            loss = noise + hold * drift
            room = noise + 2 * hold * chain.V
        out.append(
            Demand(name=f"{alternative}.room", equation="(71)", step=last, lhs=p[last], rhs=room)
        )
        if inner is None:
            argument: Any = numbers.maximum(p[last] - loss, numbers.number(0.0))
        else:
            argument = inner
            out.append(
                Demand(
                    name=f"{alternative}.inner",
                    equation="(71)",
                    step=last,
                    lhs=p[last],
                    rhs=loss + argument,
                )
            )
        force = feedback(start.shapes[last], argument, numbers)
        out.append(Demand(name=alternative, equation="(71)", step=last, lhs=force, rhs=load))
        return tuple(out)
