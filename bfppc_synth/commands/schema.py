"""Command schema: the JSON Schema of plant files."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import Json, Quiet
from bfppc_synth.voice import Voice


def schema(*, as_json: Json = False, quiet: Quiet = False) -> None:
    """Print the JSON Schema of plant files, for editors."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        from bfppc_synth.new_plant import schema_outcome

        return voice.tell(schema_outcome())

    raise typer.Exit(voice.settle(work))
