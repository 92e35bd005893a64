"""Command check: audit the gains of a plant file."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import Force, Json, Plant, Quiet, Seed, Starts, Written, initial_state
from bfppc_synth.voice import Voice


def check(
    plant: Plant,
    *,
    x0: Starts = None,
    out: Written = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
    seed: Seed = None,
) -> None:
    """Audit the gains of a plant file: both forms of every inequality, then simulations."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        starts = tuple(initial_state([words]) for words in x0 or [])
        with voice.progress() as progress:
            progress("importing")
            from bfppc_synth.pipeline import Overwrite
            from bfppc_synth.pipeline_check import CheckOptions
            from bfppc_synth.pipeline_check import check as check_plant

            existing = Overwrite.FORCE if force else Overwrite.REFUSE
            options = CheckOptions(starts=starts, out=out, overwrite=existing, progress=progress)
            outcome = check_plant(plant, options)
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))
