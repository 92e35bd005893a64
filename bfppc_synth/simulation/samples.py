"""What the controller was given in a run, thinned to the samples that a test replays."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.model.vectors import Sample
from bfppc_synth.simulation.references import sine

if TYPE_CHECKING:
    from bfppc_synth.model.design import Design
    from bfppc_synth.model.trajectory import Trajectory

#: Rows from the beginning, where the law changes fastest, and rows from everywhere.
_FIRST, _SPREAD = 6, 40


def nominal_samples(design: Design, nominal: Trajectory) -> tuple[Sample, ...]:
    """Take samples out of the nominal run.

    Parameters
    ----------
    design : Design
        Says what the law is passed as y_d.
    nominal : Trajectory
        Arrays of N rows.

    Returns
    -------
    tuple[Sample, ...]
        At most 46 samples (t, measured x, y_d) from the first row to the last.
    """
    count = len(nominal.t)
    spread = (round(k * (count - 1) / (_SPREAD - 1)) for k in range(_SPREAD))
    rows = sorted({*range(min(_FIRST, count)), *spread})
    supplied = None
    if design.nominal is not None and design.plant.reference is None:
        supplied = sine(design.spec, float(nominal.y_d[0]), 1.0).derivatives
    samples = []
    for row in rows:
        t = float(nominal.t[row])
        y_d = (float(nominal.y_d[row]),) if supplied is None else supplied(t)
        samples.append(Sample(t=t, x=tuple(map(float, nominal.q[row])), y_d=tuple(y_d)))
    return tuple(samples)
