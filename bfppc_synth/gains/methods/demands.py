"""What a method asks of a design: named inequalities lhs > rhs over any number type."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from bfppc_synth.bounds.chain import ChainInput, ChainRules
    from bfppc_synth.bounds.feedback import Numbers
    from bfppc_synth.model.bounds import ChainBounds
    from bfppc_synth.model.certificate import Strictness

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Demand(Generic[T]):
    """lhs > rhs (or >=, as ``Theorem.strictness`` says); ``step`` is the 0-based channel.

    ``name`` is the id without the state (``U1``); ``equation`` the paper's or theory's number.
    """

    name: str
    equation: str
    step: int
    lhs: T
    rhs: T


class Theorem(Protocol):
    """A method: how its chain is evaluated and what must hold of the result."""

    @property
    def rules(self) -> ChainRules:
        """How the chain is evaluated."""
        ...

    @property
    def strictness(self) -> Strictness:
        """Whether the inequalities are strict."""
        ...

    def alternatives(self) -> tuple[str, ...]:
        """Names of the alternative forms, any one of which suffices (``U2``, ``U2'``)."""
        ...

    def demands(
        self,
        alternative: str,
        start: ChainInput[T],
        bounds: ChainBounds[T],
        numbers: Numbers[T],
        inner: T | None,
    ) -> tuple[Demand[T], ...]:
        """Every inequality of one alternative.

        ``inner`` is the argument of phi_n in the last inequality: a variable of the search,
        which then also demands that it is small enough; None takes the largest one allowed.
        """
        ...
