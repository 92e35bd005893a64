"""What one step of a generated controller costs on an emulated processor, or why nobody knows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

PROCESSOR: Final = "Cortex-M4F (QEMU mps2-an386)"


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetCost:
    """Instructions and bytes of one step, over the samples of test/vectors.h that are OK.

    ``stack`` is what a step writes to, the libm's part included; ``code`` is the object of
    NAME.c without the libm; ``state`` is the struct that a caller keeps. All in bytes.
    """

    compiler: str
    emulator: str
    least: int
    average: int
    most: int
    stack: int
    code: int
    state: int


@dataclass(frozen=True, slots=True, kw_only=True)
class NotMeasured:
    """Why there are no numbers, in one phrase without paths of this machine."""

    reason: str


NOT_ASKED: Final = NotMeasured(reason="no measurement was asked for")
