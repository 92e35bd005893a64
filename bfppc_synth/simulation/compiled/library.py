"""Drawn runs, many in one call of the compiled loop."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bfppc_synth.simulation.compiled.build import NoCompilerError, build
from bfppc_synth.simulation.compiled.records import Axis, Run, records
from bfppc_synth.simulation.compiled.source import MAIN, Source

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bfppc_synth.simulation.drawn import Draw


class Stop:
    """Asks every call under way to end after its current run."""

    def __init__(self) -> None:
        self.flag = ctypes.c_int64(0)

    def set(self) -> None:
        """Ask."""
        self.flag.value = 1

    @property
    def asked(self) -> bool:
        """Whether somebody did."""
        return bool(self.flag.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Axes:
    """The time axis of a regular run, and the finer one on which samples may come irregularly."""

    regular: Axis
    jittered: Axis

    def of(self, draw: Draw) -> Axis:
        """Return the axis of a run."""
        return self.jittered if draw.jitter else self.regular


class CompiledLoop:
    """The loop of one design in C; every call releases the interpreter.

    Parameters
    ----------
    source : Source
        From ``write_source``.
    funnel : bool
        Whether the design has a funnel, so that a share of it means something.

    Raises
    ------
    NoCompilerError
        If it cannot be compiled here.
    """

    compiled = True

    def __init__(self, source: Source, *, funnel: bool) -> None:
        self._source, self._funnel = source, funnel
        self._records = records(source.order, source.arguments, source.stages)
        library = build(source.files, MAIN)
        self._run = library.Sim_run
        self._run.restype = ctypes.c_int64
        measured = library.Sim_sizes
        measured.restype, measured.argtypes = ctypes.c_int64, (ctypes.c_int64,)
        found = tuple(measured(which) for which in range(4))
        if found != self._records.sizes:
            raise NoCompilerError(f"the compiler lays records out as {found} bytes")

    def run(self, draws: Sequence[Draw], axes: Axes, stop: Stop | None = None) -> list[Run]:
        """Make runs; fewer than asked for where ``stop`` was set meanwhile."""
        found, done = self._call(draws, axes, self._records.trace(), stop or Stop())
        return [self._records.read(found[index], funnel=self._funnel) for index in range(done)]

    def trace(self, draw: Draw, axes: Axes, *, stride: int) -> tuple[Run, NDArray[np.float64]]:
        """Make one run and keep every ``stride``-th row of it.

        Returns
        -------
        tuple
            The run, and rows (N, 4n + 5): t, x, measured, e, r, u, y_d, status, stage.
        """
        import numpy as np

        axis = axes.of(draw)
        room = 1 + axis.samples * axis.substeps // stride
        rows = np.zeros((room, 4 * self._source.order + 5))
        kept = self._records.trace()
        kept.rows = rows.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        kept.room, kept.stride = room, stride
        found, _ = self._call([draw], axes, kept, Stop())
        return self._records.read(found[0], funnel=self._funnel), rows[: kept.count]

    def _call(self, draws: Sequence[Draw], axes: Axes, trace: Any, stop: Stop) -> tuple[Any, int]:
        kinds, count = self._records, len(draws)
        drawn, results = (kinds.draw * count)(), (kinds.result * count)()
        both = (kinds.axis * 2)()
        for place, axis in zip(both, (axes.regular, axes.jittered), strict=True):
            kinds.fill_axis(place, axis)
        for place, draw in zip(drawn, draws, strict=True):
            kinds.fill_draw(place, draw, axes.of(draw).step)
        room = max(axes.regular.room, axes.jittered.room)
        pending = (ctypes.c_double * (2 * room))()
        done = self._run(
            drawn,
            both,
            results,
            ctypes.c_int64(count),
            pending,
            ctypes.c_int64(room),
            ctypes.byref(trace),
            ctypes.byref(stop.flag),
        )
        return results, int(done)
