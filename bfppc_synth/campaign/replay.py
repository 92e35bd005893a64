"""Run k of a campaign once more, alone: the same numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.campaign.batch import make_runs
from bfppc_synth.campaign.material import gather_material, open_loop
from bfppc_synth.campaign.result import quantities
from bfppc_synth.campaign.store import Store
from bfppc_synth.errors import NotCertifiedError, UsageError
from bfppc_synth.model.certificate import Verdict
from bfppc_synth.model.trajectory import Trajectory
from bfppc_synth.pipeline import NOT_COVERED, Outcome

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from bfppc_synth.campaign.batch import Finished
    from bfppc_synth.campaign.material import Material

#: Rows of a picture.
_ROWS = 20_000


def replay(
    folder: Path, number: int, *, seed: int | None, horizon: float | None
) -> tuple[Outcome, Trajectory]:
    """Make run ``number`` of the folder's campaign again.

    Parameters
    ----------
    folder : Path
        A generated folder; where it holds a campaign, that one's seed and horizon are the
        defaults, else the plant file's.
    number : int
        Which run, from 0.
    seed : int or None
        Another campaign's.
    horizon : float or None
        Another campaign's [s].

    Returns
    -------
    tuple
        The outcome, and the run's rows.

    Raises
    ------
    UsageError
        If the folder cannot be used, or its campaign is about another controller.
    """
    if number < 0:
        raise UsageError(f"--run {number}: runs count from 0; fix: write --run 0")
    known = Store(folder).settings() if seed is None or horizon is None else None
    if known is not None and horizon is None:
        horizon = known.horizon
    material = gather_material(folder, horizon=horizon)
    if known is not None and known.controller_sha256 != material.controller_sha256:
        raise UsageError(
            f"{folder.as_posix()}/campaign: is about another controller than the folder holds now;"
            " fix: run the campaign again, or give --seed and --horizon"
        )
    spec = material.choices.spec
    if seed is None:
        seed = spec.simulation.seed if known is None else known.seed
    (finished,) = make_runs(material, seed, range(number, number + 1))
    trajectory = _trajectory(material, finished)
    document: dict[str, object] = {
        "format": "bfppc-synth/run/1",
        "name": spec.name,
        "run": number,
        "seed": seed,
        "horizon": material.horizon,
        "adversary": finished.adversary.value,
        "start": list(finished.draw.start),
        "ratios": dict(zip(quantities(material), finished.ratios, strict=True)),
        "max_abs_e": list(finished.run.peaks[-1][1]) if finished.run.peaks else [],
        "half_widths": list(material.widths[finished.run.peaks[-1][0] - 1])
        if finished.run.peaks
        else [],
        "max_abs_u": finished.run.peak_u,
        "U": material.peak,
        "within_bounds": finished.inside,
        "adversaries": 1,
    }
    contradicted = material.covered and not finished.inside
    certified = material.design.certificate.verdict is Verdict.CERTIFIED
    left = certified and not finished.inside and not contradicted
    outcome = Outcome(
        exit_code=NotCertifiedError.exit_code if contradicted else 0,
        folder=None,
        document=document,
        messages=(NOT_COVERED,) if left else (),
        lines=_lines(document, finished),
    )
    return outcome, trajectory


def _lines(document: dict[str, object], finished: Finished) -> tuple[str, ...]:
    where = "inside" if finished.inside else "OUTSIDE"
    start = ", ".join(f"{value:.6g}" for value in finished.draw.start)
    ratios = document["ratios"]
    rows = ratios.items() if isinstance(ratios, dict) else ()
    who = f"run {document['run']} of seed {document['seed']}, {document['horizon']:g} s"
    return (
        f"{document['name']}: {who}, adversary {finished.adversary.value}, from ({start}): {where}",
        *(f"  {name:<8} {100.0 * ratio:.2f} % of its bound" for name, ratio in rows),
    )


def _trajectory(material: Material, finished: Finished) -> Trajectory:
    """Keep the rows of the run, thinned to what a picture shows."""
    axis = finished.axes.of(finished.draw)
    stride = 1 + axis.samples * axis.substeps // _ROWS
    loop = open_loop(material)
    _, rows = loop.trace(finished.draw, finished.axes, stride=stride)
    n = material.choices.order

    def part(begin: int) -> NDArray[np.float64]:
        found: NDArray[np.float64] = rows[:, begin : begin + n]
        return found

    last = finished.run.peaks[-1] if finished.run.peaks else (1, (0.0,) * n)
    return Trajectory(
        t=rows[:, 0],
        x=part(1),
        q=part(1 + n),
        e=part(1 + 2 * n),
        r=part(1 + 3 * n),
        u=rows[:, 1 + 4 * n],
        y_d=rows[:, 2 + 4 * n],
        half_widths=material.widths[last[0] - 1],
        u_max=material.peak,
        status=tuple(int(value) for value in rows[:, 3 + 4 * n]),
        peak_e=last[1],
        peak_u=finished.run.peak_u,
        complete=finished.run.complete,
        funnel_share=finished.run.share,
    )
