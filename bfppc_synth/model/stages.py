"""The stages of method theorem3: what the file says of them and what follows from it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bfppc_synth.model.bounds import CenterBounds, ChainBounds
    from bfppc_synth.model.expression import Constant
    from bfppc_synth.model.shapes import Shape
    from bfppc_synth.model.spec import GainSpec


class Handover(StrEnum):
    """What happens at a switch: a new center, or a tube that contains every jump."""

    REANCHOR = "reanchor"
    CONTAINMENT = "containment"


@dataclass(frozen=True, slots=True, kw_only=True)
class StageSpec:
    """One free stage of the plant file: half-widths p_{1,m}..p_{n,m} and gains, all fixed."""

    p: tuple[Constant | None, ...]
    gains: tuple[GainSpec, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """One free stage m < K of docs/theory.md section 8.

    ``gains`` phi_{1,m}..phi_{n,m}; ``omega`` p_{i,m}, what the monitor keeps |ê_{i,m}| below
    at the samples; ``widened`` p^_{i,m}, what |e_{i,m}| stays below up to and at the switch;
    ``bounds`` is the chain at p^_m around ``center``; ``speed`` bounds |de_{i,m}| [unit of
    x_i per s]; ``peak`` is U_m = phi_{n,m}(p_{n,m}), the largest command of this stage.
    """

    gains: tuple[Shape, ...]
    omega: tuple[float, ...]
    widened: tuple[float, ...]
    bounds: ChainBounds[float]
    center: CenterBounds
    speed: tuple[float, ...]
    peak: float

    @property
    def anchor_limit(self) -> float:
        """|r_1^(m)| <= p^_{1,m} + eta_{1,m}: it is a measured error."""
        return self.widened[0] + self.bounds.eta[0]

    @property
    def measured_limits(self) -> tuple[float, ...]:
        """|ê_{i,m}| at the switch is at most p^_{i,m} + eta_{i,m}."""
        return tuple(p + eta for p, eta in zip(self.widened, self.bounds.eta, strict=True))
