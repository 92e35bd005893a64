"""Command synth: from a plant file to its folder."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import (
    Allow,
    Force,
    Functions,
    Json,
    Numbers,
    Out,
    Pdf,
    Plant,
    Quiet,
    Seed,
)
from bfppc_synth.model.arithmetic import Arithmetic, Mathematics, Real
from bfppc_synth.voice import Voice


def synth(
    plant: Plant,
    *,
    out: Out = None,
    allow_uncertified: Allow = False,
    force: Force = False,
    real: Numbers = Real.DOUBLE,
    math: Functions = Mathematics.LIBM,
    pdf: Pdf = False,
    as_json: Json = False,
    quiet: Quiet = False,
    seed: Seed = None,
) -> None:
    """Gains, certificate, code, simulation and report of a plant file."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        from bfppc_synth import pipeline

        doubtful, existing = pipeline.Uncertified, pipeline.Overwrite
        kinds = pipeline.Report
        with voice.progress() as progress:
            options = pipeline.Options(
                out=out,
                uncertified=doubtful.WRITE if allow_uncertified else doubtful.REFUSE,
                overwrite=existing.FORCE if force else existing.REFUSE,
                seed=seed,
                arithmetic=Arithmetic(real=real, mathematics=math),
                report=kinds.PAGE_AND_PDF if pdf else kinds.PAGE,
                progress=progress,
            )
            outcome = pipeline.run(plant, options)
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))
