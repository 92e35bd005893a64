"""Theorem 1: quantized states, g = 1, no reference; the sound form and the printed (39)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from bfppc_synth.bounds.theorem1 import Facet
from bfppc_synth.gains.methods.demands import Demand
from bfppc_synth.model.certificate import Strictness

if TYPE_CHECKING:
    from bfppc_synth.bounds.theorem1 import Chain1, Chain1Input

T = TypeVar("T")


class Theorem1Form(Protocol):
    """A form of Theorem 1: what its chain counts and what must hold of the result."""

    @property
    def facet(self) -> Facet:
        """Whether the chain counts the motion of p_i(rho)."""
        ...

    @property
    def strictness(self) -> Strictness:
        """Whether the inequalities are strict."""
        ...

    def demands(self, start: Chain1Input[T], chain: Chain1[T], order: int) -> tuple[Demand[T], ...]:
        """Every inequality of the steps that the chain has; ``order`` is n."""
        ...


class Theorem1:
    """The sound form of docs/theory.md section 7, H constant or scheduled."""

    facet = Facet.MOVING
    strictness = Strictness.STRICT

    def demands(self, start: Chain1Input[T], chain: Chain1[T], order: int) -> tuple[Demand[T], ...]:
        """T1.p, T1.H, T1.c and T1.gamma of every step.

        The gamma inequality is affine in H and its power credit grows with rho, so rho = 0
        and H(1) with p_i(0) in the credit imply it for every rho in [0, 1].

        References
        ----------
        docs/theory.md section 7, ``form: sound``.
        """
        out: list[Demand[Any]] = []
        for i, step in enumerate(start.steps):
            table: tuple[Any, ...] = chain.tables[i]
            first, last, room = table[0], table[-1], chain.epsilon[i]
            # A fixed p is what counts here: eps_i is what it leaves, and must be positive.
            out.append(Demand(name="T1.p", equation="(14)", step=i, lhs=last.p, rhs=last.D))
            out.extend(_domination(i, step, table))
            swing = step.c * power_growth(last.p, last.D, step.N)
            out.append(Demand(name="T1.c", equation="(39)", step=i, lhs=start.c_0, rhs=swing))
            ahead = _ahead(start, chain, i, order)
            if ahead is None:
                continue
            credit: Any = step.c * first.p**step.N
            ends = (first,) if len(table) == 1 else (first, last)
            for name, node in zip(("T1.gamma", "T1'.gamma"), ends, strict=False):
                out.append(
                    Demand(
                        name=name,
                        equation="(39)",
                        step=i,
                        lhs=step.gamma * node.H * room + credit,
                        rhs=node.H + ahead,
                    )
                )
        return tuple(out)


class Theorem1Printed:
    """The paper's text: (39) at the least H_i, the lemma's factor N, fixed facets.

    p_i and delta_i are taken at rho = 1. Never certified: (39) does not imply (45).
    """

    facet = Facet.IGNORED
    strictness = Strictness.WEAK

    def demands(self, start: Chain1Input[T], chain: Chain1[T], order: int) -> tuple[Demand[T], ...]:
        """T1.p, T1.H (25), (31), (37) and the three lines of (39).

        References
        ----------
        The paper's (39); docs/theory.md section 7, ``form: printed``.
        """
        out: list[Demand[Any]] = []
        for i, step in enumerate(start.steps):
            table: tuple[Any, ...] = chain.tables[i]
            node = table[-1]
            room: Any = chain.epsilon[i] if step.epsilon is None else step.epsilon
            # A file may fix both p_i and eps_i, as Example 1 does: p_i then differs from (14).
            both = step.p is not None and step.epsilon is not None
            least_p: Any = node.D + step.epsilon if both else node.D
            out.append(Demand(name="T1.p", equation="(14)", step=i, lhs=node.p, rhs=least_p))
            out.extend(_domination(i, step, table))
            swing = step.c * lemma_growth(node.p, node.D, step.N)
            out.append(Demand(name="T1.c", equation="(39)", step=i, lhs=start.c_0, rhs=swing))
            ahead = _ahead(start, chain, i, order)
            if ahead is None:
                continue
            least: Any = chain.H[i][0] if step.H_star is None else step.H_star
            asked = (least + ahead - step.c * node.p**step.N) / (room * least)
            out.append(Demand(name="T1.gamma", equation="(39)", step=i, lhs=step.gamma, rhs=asked))
        return tuple(out)


def power_growth(p: Any, D: Any, N: int) -> Any:
    """(p + D)^N - p^N by the binomial formula: nothing cancels.

    References
    ----------
    docs/theory.md section 7, item 5: the exact supremum over |e| <= p, |d| <= D.
    """
    total: Any = 0
    binomial = 1
    for power in range(1, N + 1):
        binomial = binomial * (N - power + 1) // power
        total = total + binomial * p ** (N - power) * D**power
    return total


def lemma_growth(p: Any, D: Any, N: int) -> Any:
    """N D (p^(N-1) + (p + D)^(N-1)), Lemma 3 of [29] as (39)-(40) use it: twice too large."""
    return N * D * (p ** (N - 1) + (p + D) ** (N - 1))


def _domination(i: int, step: Any, table: tuple[Any, ...]) -> list[Demand[Any]]:
    if step.H is None:
        return []
    return [
        Demand(name="T1.H", equation="(31)", step=i, lhs=node.H, rhs=node.needed) for node in table
    ]


def _ahead(start: Chain1Input[Any], chain: Chain1[Any], i: int, order: int) -> Any:
    """c_0 + delta_M + eps_{i+1} (c_0 alone for the last step); None where step i+1 is cut off."""
    if i == order - 1:
        return start.c_0
    if i + 1 >= len(start.steps):
        return None
    room = chain.epsilon[i + 1]
    after = start.steps[i + 1]
    if start.facet is Facet.IGNORED and after.epsilon is not None:
        room = after.epsilon
    return start.c_0 + start.noise[i + 1] + room
