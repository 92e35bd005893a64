"""Command simulate: the nominal run, or one of a campaign, and a picture of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bfppc_synth.campaign.replay import replay
from bfppc_synth.campaign.result import picture
from bfppc_synth.campaign.store import write_whole
from bfppc_synth.pipeline import Outcome, simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from bfppc_synth.model.trajectory import Trajectory

#: Pictures stand in the folder itself; a new synthesis keeps them, as all that is the user's.
NOMINAL, RUN = "simulation.svg", "run_{number}.svg"


def show_nominal(
    folder: Path,
    *,
    horizon: float | None,
    start: Mapping[str, float],
    seed: int | None,
    plot: bool,
    progress: Callable[[str], None],
) -> Outcome:
    """Run the folder's controller again; with ``plot`` draw the nominal run into it."""
    seen: list[Trajectory] = []
    outcome = simulate(
        folder, horizon=horizon, start=start, seed=seed, progress=progress, show=seen.append
    )
    return _drawn(outcome, folder / NOMINAL, seen[0]) if plot else outcome


def show_run(
    folder: Path, number: int, *, seed: int | None, horizon: float | None, plot: bool
) -> Outcome:
    """Make one run of the folder's campaign again; with ``plot`` draw it into the folder."""
    outcome, trajectory = replay(folder, number, seed=seed, horizon=horizon)
    if not plot:
        return outcome
    return _drawn(outcome, folder / RUN.format(number=number), trajectory)


def _drawn(outcome: Outcome, path: Path, trajectory: Trajectory) -> Outcome:
    """Draw at most 20,000 rows: an SVG holds every point."""
    stride = 1 + len(trajectory.t) // 20_000
    rows = ("t", "x", "q", "e", "r", "u", "y_d")
    thinned = replace(trajectory, **{row: getattr(trajectory, row)[::stride] for row in rows})
    write_whole(path, picture(thinned.plot()))
    return replace(outcome, document={**outcome.document, "picture": path.as_posix()})
