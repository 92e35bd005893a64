"""Command campaign: many runs against many adversaries."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import (
    Cluster,
    Folder,
    Horizon,
    Json,
    Quiet,
    Resume,
    Runs,
    Seed,
    Workers,
    require_folder,
)
from bfppc_synth.voice import Voice


def campaign(
    folder: Folder,
    *,
    runs: Runs = None,
    workers: Workers = None,
    seed: Seed = None,
    resume: Resume = False,
    cluster: Cluster = None,
    horizon: Horizon = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Draw plants, starts and adversaries; run them all; write DIR/campaign."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        require_folder(folder)
        from bfppc_synth.campaign.conduct import Wishes, conduct

        wishes = Wishes(
            runs=runs,
            seed=seed,
            horizon=horizon,
            workers=workers,
            cluster=cluster,
            resume=resume,
        )
        outcome = conduct(folder, wishes, progress=voice.progress, bar=voice.bar)
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))
