"""The passes of ``check`` in order: text -> PlantSpec -> both forms -> proof -> runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bfppc_synth.codegen.package import Overwrite, write_folder
from bfppc_synth.errors import NotCertifiedError
from bfppc_synth.pipeline import Outcome
from bfppc_synth.spec.load import load_spec

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path


def _silent(message: str) -> None:
    del message


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckOptions:
    """How a plant file is audited: further starts, and a folder if anything shall be written."""

    starts: tuple[Mapping[str, float], ...] = ()
    out: Path | None = None
    overwrite: Overwrite = Overwrite.REFUSE
    progress: Callable[[str], None] = _silent


def check(path: Path, options: CheckOptions) -> Outcome:
    """Audit the gains that a plant file fixes, then simulate them.

    Parameters
    ----------
    path : Path
        The plant file.
    options : CheckOptions
        Starts, output folder, progress.

    Returns
    -------
    Outcome
        Exit code 0 only if the sound form is proved and no run left its bounds, else 4; the
        folder is None, and nothing is written, unless ``options.out`` is given.

    Raises
    ------
    BfppcError
        With its own exit code: 2 for the file and the folder, 3 where gains are open and none
        were found.

    References
    ----------
    SPEC section 2, ``check``.
    """
    spec = load_spec(path)
    # What follows imports sympy: mistakes of the file are answered before.
    from bfppc_synth.audit.audit import audit_plant
    from bfppc_synth.audit.document import audit_document
    from bfppc_synth.audit.files import audit_files, may_write_audit
    from bfppc_synth.audit.records import Answer
    from bfppc_synth.audit.table import audit_lines

    if options.out is not None:
        may_write_audit(options.out, name=spec.name, overwrite=options.overwrite)
    audit, runs = audit_plant(spec, options.starts, options.progress)
    document, lines = audit_document(audit), audit_lines(audit)
    shown = lines
    if options.out is not None:
        shown = (*lines, f"written: {options.out.as_posix()}/check.txt")
        write_folder(
            audit_files(document, lines, spec, runs),
            options.out,
            name=spec.name,
            status=audit.answer.value,
            overwrite=options.overwrite,
        )
    return Outcome(
        exit_code=0 if audit.answer is Answer.PROVED else NotCertifiedError.exit_code,
        folder=options.out,
        document=document,
        messages=spec.notes,
        lines=shown,
    )
