"""Command export: a certified folder for other tools, claims or controller."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.errors import UsageError
from bfppc_synth.pipeline import Outcome

if TYPE_CHECKING:
    from pathlib import Path


def export(folder: Path, target: str) -> Outcome:
    """Write a certified folder for another tool: its claims, or its controller.

    Raises
    ------
    UsageError
        If the format is none of this version's, the folder cannot be read, or the format has
        no form for its law.
    NotCertifiedError
        If the folder does not verify.
    """
    from bfppc_synth.export import Target, export_claims
    from bfppc_synth.export_models import ModelTarget, export_model

    known = (*Target, *ModelTarget)
    if target not in known:
        raise UsageError(f"--to {target}: {target} is no format; fix: use {' or '.join(known)}")
    more: dict[str, object]
    if target in tuple(ModelTarget):
        model = export_model(folder, ModelTarget(target))
        name, files, left_out, notes = model.name, model.files, model.left_out, model.notes
        more = {} if model.step is None else {"largest_communication_step": model.step}
    else:
        claims = export_claims(folder, Target(target))
        name, files, left_out, notes = claims.name, claims.files, claims.left_out, ()
        more = {"claims": list(claims.claims)}
    document: dict[str, object] = {
        "format": "bfppc-synth/export/1",
        "name": name,
        "status": "exported",
        "target": target,
        "files": list(files),
        **more,
        "left_out": list(left_out),
    }
    messages = (*(f"not exported: {line}" for line in left_out), *notes)
    return Outcome(exit_code=0, folder=None, document=document, messages=messages)
