"""Command simulate: run a folder's controller again."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import (
    Folder,
    Horizon,
    Json,
    Quiet,
    Seed,
    Start,
    initial_state,
    require_folder,
)
from bfppc_synth.errors import UsageError
from bfppc_synth.voice import Voice


def simulate(
    folder: Folder,
    *,
    horizon: Horizon = None,
    x0: Start = None,
    as_json: Json = False,
    quiet: Quiet = False,
    seed: Seed = None,
) -> None:
    """Run the generated controller of a folder against its plant."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        require_folder(folder)
        if horizon is not None and not 0.0 < horizon < float("inf"):
            raise UsageError(f"--horizon {horizon}: not a positive time; fix: write --horizon 10")
        from bfppc_synth import pipeline

        start = initial_state(x0 or [])
        with voice.progress() as progress:
            outcome = pipeline.simulate(
                folder, horizon=horizon, start=start, seed=seed, progress=progress
            )
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))
