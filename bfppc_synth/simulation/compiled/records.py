"""The records of the C loop, and what Python reads of them."""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from bfppc_synth.simulation.drawing import SEGMENTS
from bfppc_synth.simulation.drawn import steps_until
from bfppc_synth.simulation.implicit import accuracy
from bfppc_synth.simulation.scheme import Stepping

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.drawn import Draw
    from bfppc_synth.simulation.scheme import Scheme

_D, _I = ctypes.c_double, ctypes.c_int64


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """A time axis with what an implicit step needs, as numbers.

    ``enough`` and ``close`` are those of ``implicit.accuracy``, ``rate`` the first by the
    second of a step, ``peak`` the certified U.
    """

    step: float
    sample: float
    delay: float
    enough: float
    close: float
    rate: float
    peak: float
    substeps: int
    samples: int
    implicit: int

    @property
    def room(self) -> int:
        """Commands that may be under way at once: one a plant step at most."""
        return int(self.delay / self.step) + 8


def make_axis(design: Design, scheme: Scheme, horizon: float) -> Axis:
    """Lay out a time axis up to the horizon [s]."""
    implicit = scheme.stepping is Stepping.IMPLICIT
    enough, close = accuracy(design, scheme.sample)
    return Axis(
        step=scheme.step,
        sample=scheme.sample,
        delay=scheme.delay,
        enough=enough,
        close=close,
        rate=enough / scheme.sample,
        peak=design.bounds.U,
        substeps=scheme.substeps,
        samples=scheme.samples(horizon),
        implicit=int(implicit),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What one run came to.

    ``peaks`` are (stage, largest |e_i|) of every stage met, from 1; ``share`` the largest
    share of the funnel, None without one; ``rows`` how many plant steps were judged.
    """

    peaks: tuple[tuple[int, tuple[float, ...]], ...]
    peak_u: float
    share: float | None
    complete: bool
    rows: int


class Records:
    """ctypes records of one shape; equal shapes share them."""

    def __init__(self, order: int, arguments: int, stages: int) -> None:
        self.order, self.stages = order, stages
        width = arguments + order + 1

        class CDraw(ctypes.Structure):
            _fields_ = (
                ("start", _D * order),
                ("wave", _D * 3),
                ("amplitudes", _D * (order + 1)),
                ("dwell", _D),
                ("until", _D * SEGMENTS),
                ("plan", (_D * width) * SEGMENTS),
                *((name, _I) for name in ("manner", "bounded", "corners", "target")),
                *((name, _I) for name in ("late", "jitter")),
                ("seed", ctypes.c_uint64),
            )

        class CAxis(ctypes.Structure):
            _fields_ = (
                *((name, _D) for name in ("step", "sample", "delay", "enough")),
                *((name, _D) for name in ("close", "rate", "peak")),
                *((name, _I) for name in ("substeps", "samples", "implicit")),
            )

        class CResult(ctypes.Structure):
            _fields_ = (
                ("peaks", (_D * order) * stages),
                ("peak_u", _D),
                ("share", _D),
                ("met", _I * stages),
                *((name, _I) for name in ("rows", "complete", "stage")),
            )

        class CTrace(ctypes.Structure):
            _fields_ = (
                ("rows", ctypes.POINTER(_D)),
                *((name, _I) for name in ("room", "count", "stride")),
            )

        self.draw: Any = CDraw
        self.axis: Any = CAxis
        self.result: Any = CResult
        self.trace: Any = CTrace

    @property
    def sizes(self) -> tuple[int, ...]:
        """Bytes of each record, which the library must confirm."""
        kinds = (self.draw, self.axis, self.result, self.trace)
        return tuple(ctypes.sizeof(kind) for kind in kinds)

    def fill_draw(self, place: Any, draw: Draw, step: float) -> None:
        """Write a draw into its record, for plant steps of ``step`` [s]."""
        place.start[:] = draw.start
        if draw.wave is not None:
            wave = draw.wave
            place.wave[:] = (wave.amplitude, wave.frequency, wave.phase)
            powers = (wave.amplitude * wave.frequency**j for j in range(self.order + 1))
            place.amplitudes[:] = tuple(powers)
        place.dwell = draw.dwell
        for index in range(SEGMENTS):
            last = index + 1 >= len(draw.plan)
            place.until[index] = math.inf if last else steps_until(draw.plan[index].until, step)
            if index < len(draw.plan):
                segment = draw.plan[index]
                place.plan[index][:] = (*segment.arguments, *segment.noise, segment.error)
        place.manner, place.bounded = int(draw.manner), int(draw.bounded)
        place.corners, place.target = int(draw.corners), draw.target
        place.late, place.jitter, place.seed = int(draw.late), int(draw.jitter), draw.seed

    def fill_axis(self, place: Any, axis: Axis) -> None:
        """Write a time axis into its record."""
        for name in axis.__slots__:
            setattr(place, name, getattr(axis, name))

    def read(self, place: Any, *, funnel: bool) -> Run:
        """Read a result."""
        met = [stage for stage in range(self.stages) if place.met[stage]]
        return Run(
            peaks=tuple((stage + 1, tuple(place.peaks[stage])) for stage in met),
            peak_u=place.peak_u,
            share=place.share if funnel and place.rows else None,
            complete=bool(place.complete),
            rows=place.rows,
        )


@lru_cache(maxsize=16)
def records(order: int, arguments: int, stages: int) -> Records:
    """Return the records of a shape."""
    return Records(order, arguments, stages)
