"""Command doctor: versions, compilers and optional tools."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import Json, Quiet
from bfppc_synth.voice import Voice


def doctor(*, as_json: Json = False, quiet: Quiet = False) -> None:
    """Say what is installed, what it is for, and how to get what is missing."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        from bfppc_synth.doctor import doctor as look

        with voice.progress() as progress:
            progress("asking every tool for its version")
            outcome = look()
        return voice.tell(outcome)

    raise typer.Exit(voice.settle(work))
