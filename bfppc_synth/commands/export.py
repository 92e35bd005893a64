"""Command export: a folder for other tools."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import Folder, Json, Quiet, To
from bfppc_synth.voice import Voice


def export(folder: Folder, *, to: To, as_json: Json = False, quiet: Quiet = False) -> None:
    """Write a certified folder for other provers or simulators into DIR/interop."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        from bfppc_synth.pipeline_export import export as export_folder

        return voice.tell(export_folder(folder, to))

    raise typer.Exit(voice.settle(work))
