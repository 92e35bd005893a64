"""A program in positive numbers, as another file states it to the solver."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from bfppc_synth.bounds.chain import Residual
    from bfppc_synth.bounds.feedback import Numbers
    from bfppc_synth.model.bounds import CenterBounds, Majorants
    from bfppc_synth.model.plant import Plant


class PositiveProblem(Protocol):
    """Minimize a product of powers under inequalities between positive numbers.

    The plant, its majorants, ``accuracy`` (p_1) and ``centers`` are what the solver needs to
    offer residuals of its own number type, one per center; ``margin`` is the relative room.
    """

    @property
    def plant(self) -> Plant:
        """The plant."""
        ...

    @property
    def majorants(self) -> Majorants:
        """What bounds it."""
        ...

    @property
    def centers(self) -> tuple[CenterBounds, ...]:
        """One residual is made for each."""
        ...

    @property
    def accuracy(self) -> float:
        """Half-width p_1, the least reach of x_1."""
        ...

    @property
    def margin(self) -> float:
        """Relative room of the rounded design; the search keeps several times that."""
        ...

    @property
    def count(self) -> int:
        """Number of unknowns."""
        ...

    def formulate(
        self,
        values: tuple[Any, ...],
        residuals: tuple[Residual[Any], ...],
        numbers: Numbers[Any],
    ) -> tuple[tuple[tuple[float, Any], ...], tuple[tuple[Any, Any], ...]]:
        """Return (exponent, number) factors of the cost and (lhs, rhs) pairs, lhs > rhs."""
        ...
