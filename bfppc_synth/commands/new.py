"""Command new: a plant file to start from."""

from __future__ import annotations

import typer

from bfppc_synth.arguments import Json, Named, Quiet, Replace, Template
from bfppc_synth.voice import Voice


def new(
    name: Named,
    *,
    template: Template = None,
    force: Replace = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a commented plant file NAME.yaml, and the schema that editors check it by."""
    voice = Voice(as_json=as_json, quiet=quiet)

    def work() -> int:
        from bfppc_synth.codegen.package import Overwrite
        from bfppc_synth.new_plant import NewOptions, new_plant

        overwrite = Overwrite.FORCE if force else Overwrite.REFUSE
        return voice.tell(new_plant(name, NewOptions(template=template, overwrite=overwrite)))

    raise typer.Exit(voice.settle(work))
