"""The generated controller among the others: the very file of the folder, one copy a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bfppc_synth.simulation.baselines.arrays import Array
    from bfppc_synth.simulation.baselines.cases import Cases
    from bfppc_synth.simulation.loading import Controller


class GeneratedLaw:
    """One instance of the generated class for each run."""

    def __init__(self, cases: Cases, controller: type[Controller]) -> None:
        self._times = cases.clock.times.tolist()
        self._instances = [controller() for _ in range(cases.runs)]
        # A reference that is compiled in is not passed; center nominal asks for derivatives.
        many = cases.design.nominal is not None
        self._passed = [
            None if sine is None else sine.derivatives if many else sine
            for sine in cases.references
        ]

    def command(self, k: int, measured: Sequence[Array]) -> Array:
        """Return u at sample k, shape (R, 1)."""
        t = self._times[k]
        rows = np.column_stack([state[:, 0] for state in measured]).tolist()
        commands = [
            instance.step(t, row, None if passed is None else passed(t))
            for instance, row, passed in zip(self._instances, rows, self._passed, strict=True)
        ]
        return np.array(commands)[:, np.newaxis]
