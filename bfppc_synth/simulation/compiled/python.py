"""The same drawn runs in plain Python, where there is no compiler; the same bits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.simulation.compiled.records import Axis, Run
from bfppc_synth.simulation.drawn import Drawn
from bfppc_synth.simulation.exact import Exact, ExactRecorder
from bfppc_synth.simulation.loading import load_text
from bfppc_synth.simulation.plant import compile_plant, modelled
from bfppc_synth.simulation.scheme import Scheme, Stepping
from bfppc_synth.simulation.stepping import Setting, run

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bfppc_synth.model.design import Design
    from bfppc_synth.simulation.compiled.library import Axes, Stop
    from bfppc_synth.simulation.drawn import Draw
    from bfppc_synth.simulation.exact import Sight


class PythonLoop:
    """The loop of one design in Python.

    Parameters
    ----------
    design : Design
        Plant, gains, bounds.
    controller : str
        Text of the generated controller.py.
    scheme : Scheme
        From ``choose_scheme``.
    """

    compiled = False

    def __init__(self, design: Design, controller: str, scheme: Scheme) -> None:
        self._design, self._scheme = design, scheme
        module = load_text(controller, name="generated_controller", origin="controller.py")
        self._controller = module.Controller
        plant = design.plant
        self._dynamics = compile_plant(plant if design.nominal is None else modelled(plant))

    def run(self, draws: Sequence[Draw], axes: Axes, stop: Stop | None = None) -> list[Run]:
        """Make runs; fewer than asked for where ``stop`` was set meanwhile."""
        found: list[Run] = []
        for draw in draws:
            if stop is not None and stop.asked:
                break
            found.append(self._one(draw, axes.of(draw), None))
        return found

    def trace(self, draw: Draw, axes: Axes, *, stride: int) -> tuple[Run, NDArray[np.float64]]:
        """Make one run and keep every ``stride``-th row, as ``CompiledLoop.trace`` does."""
        import numpy as np

        rows: list[list[float]] = []
        count = 0

        def see(row: list[float]) -> None:
            nonlocal count
            if count % stride == 0:
                rows.append(row)
            count += 1

        found = self._one(draw, axes.of(draw), see)
        width = 4 * self._design.plant.order + 5
        return found, np.array(rows).reshape(len(rows), width)

    def _one(self, draw: Draw, axis: Axis, sight: Sight | None) -> Run:
        scheme = Scheme(
            stepping=Stepping.IMPLICIT if axis.implicit else Stepping.SAMPLED,
            sample=axis.sample,
            substeps=axis.substeps,
            delay=axis.delay,
            coverage=self._scheme.coverage,
        )
        setting = Setting(
            design=self._design,
            controller=self._controller,
            scheme=scheme,
            samples=axis.samples,
            judging=Exact(self._design, sight),
        )
        finished = run(setting, Drawn(self._design, self._dynamics, scheme, draw), stride=0)
        recorder = finished.recorder
        rows = recorder.count if isinstance(recorder, ExactRecorder) else 0
        return Run(
            peaks=tuple((stage, tuple(peaks)) for stage, peaks in sorted(recorder.peaks.items())),
            peak_u=recorder.peak_u,
            share=recorder.funnel_share,
            complete=finished.complete,
            rows=rows,
        )
