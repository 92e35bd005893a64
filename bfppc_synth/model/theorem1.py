"""What a plant file may fix for Theorem 1 besides gains."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bfppc_synth.model.expression import Constant


class Schedule(StrEnum):
    """Whether H_i is taken at rho = 1 or follows rho(t)."""

    CONSTANT = "constant"
    SCHEDULED = "scheduled"


@dataclass(frozen=True, slots=True, kw_only=True)
class Theorem1Spec:
    """c_0, epsilon_i (None is free; that of the first state always) and the form of H."""

    c_0: Constant | None
    epsilon: tuple[Constant | None, ...]
    H: Schedule


@dataclass(frozen=True, slots=True, kw_only=True)
class Theorem1Bounds:
    """What Theorem 1 adds to a design's bounds; index i-1 belongs to step i.

    ``noise`` is delta_{M,i}, ``epsilon`` the rooms p_i - D_i, ``needed`` the bound H_i^0(1)
    that H_i(1) dominates, ``height`` H_i(1).
    """

    c_0: float
    noise: tuple[float, ...]
    epsilon: tuple[float, ...]
    needed: tuple[float, ...]
    height: tuple[float, ...]
