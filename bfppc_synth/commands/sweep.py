"""Command sweep: a certified trade-off curve."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import Cluster, Force, Json, Over, Plant, Quiet, Seed, Swept, Workers
from bfppc_synth.voice import Voice


def sweep(
    plant: Plant,
    *,
    over: Over = None,
    out: Swept = None,
    workers: Workers = None,
    cluster: Cluster = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
    seed: Seed = None,
) -> None:
    """Certify a design at every value of a number of the plant file, or of two."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        with voice.progress() as progress:
            from bfppc_synth.codegen.package import Overwrite
            from bfppc_synth.sweep.sweep import SweepOptions
            from bfppc_synth.sweep.sweep import sweep as sweep_plant

            options = SweepOptions(
                over=tuple(over or ()),
                out=out,
                workers=workers,
                cluster=cluster,
                overwrite=Overwrite.FORCE if force else Overwrite.REFUSE,
                progress=progress,
            )
            outcome = sweep_plant(plant, options)
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))
