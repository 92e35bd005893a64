"""Command verify: check a folder again."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import Folder, Json, Quiet, Seed, require_folder
from bfppc_synth.voice import Voice


def verify(
    folder: Folder, *, as_json: Json = False, quiet: Quiet = False, seed: Seed = None
) -> None:
    """Check a generated folder again with the separate checker."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        require_folder(folder)
        from bfppc_synth import pipeline

        with voice.progress() as progress:
            progress("checking the certificate")
            outcome = pipeline.verify(folder)
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))
