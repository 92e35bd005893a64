"""Command compare: other control methods on the plant of a folder."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import (
    Budget,
    Compared,
    Folder,
    Horizon,
    Json,
    Quiet,
    Seed,
    require_folder,
)
from bfppc_synth.voice import Voice


def compare(
    folder: Folder,
    *,
    runs: Compared = 24,
    budget: Budget = 64,
    horizon: Horizon = None,
    as_json: Json = False,
    quiet: Quiet = False,
    seed: Seed = None,
) -> None:
    """Run other control methods, tuned, on the plant of a folder, into DIR/compare."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        require_folder(folder)
        from bfppc_synth.compare.run import CompareOptions
        from bfppc_synth.compare.run import compare as compare_folder

        with voice.progress() as progress:
            options = CompareOptions(
                runs=runs, budget=budget, seed=seed, horizon=horizon, progress=progress
            )
            outcome = compare_folder(folder, options)
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))
