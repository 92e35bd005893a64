"""Command simulate: run a folder's controller again."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import (
    Folder,
    Horizon,
    Json,
    Number,
    Plot,
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
    run: Number = None,
    plot: Plot = False,
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
        if run is not None and x0:
            raise UsageError("--run and --x0 exclude each other; fix: leave one out")
        from bfppc_synth.campaign import showing

        with voice.progress() as progress:
            if run is not None:
                outcome = showing.show_run(folder, run, seed=seed, horizon=horizon, plot=plot)
            else:
                start = initial_state(x0 or [])
                outcome = showing.show_nominal(
                    folder, horizon=horizon, start=start, seed=seed, plot=plot, progress=progress
                )
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))
