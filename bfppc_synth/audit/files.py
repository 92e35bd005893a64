"""What ``check --out`` writes: the audit as JSON and as text, and its runs."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from bfppc_synth.codegen.package import Overwrite, may_write
from bfppc_synth.errors import UsageError
from bfppc_synth.report.tables import trajectory_csv

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from bfppc_synth.model.design import Design
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.model.trajectory import Trajectory


def may_write_audit(folder: Path, *, name: str, overwrite: Overwrite) -> None:
    """Refuse a folder that must not be replaced, also the plant's own generated one.

    Raises
    ------
    UsageError
        As ``may_write``; or a controller stands there, which writing would remove.
    """
    may_write(folder, name=name, overwrite=overwrite)
    if (folder / "controller.py").exists():
        raise UsageError(
            f"{folder.as_posix()}: holds a generated controller, which an audit would replace\n"
            "  fix: name another folder with --out"
        )


def audit_files(
    document: Mapping[str, object],
    lines: Sequence[str],
    spec: PlantSpec,
    runs: Sequence[tuple[Design, Trajectory]],
) -> dict[str, bytes]:
    """Lay out the files of an audit: path -> bytes.

    Returns
    -------
    dict[str, bytes]
        check.json, check.txt, plant.yaml and one run_K.csv per start, the file's own first.
    """
    texts = {
        "check.json": json.dumps(document, indent=2, allow_nan=False) + "\n",
        "check.txt": "\n".join(lines) + "\n",
    }
    for number, (design, run) in enumerate(runs, start=1):
        texts[f"run_{number}.csv"] = trajectory_csv(design, run)
    files = {path: text.encode() for path, text in texts.items()}
    return {**files, "plant.yaml": spec.source_bytes}
