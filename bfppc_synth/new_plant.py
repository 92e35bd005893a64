"""``new NAME``: a commented plant file to start from, and the schema that editors check it by."""

from __future__ import annotations

import json
import re
import secrets
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bfppc_synth.codegen.package import Overwrite
from bfppc_synth.errors import UsageError
from bfppc_synth.expressions.names import (
    KEYWORDS,
    did_you_mean,
    is_library_header,
    is_plant_name,
)
from bfppc_synth.pipeline import Outcome
from bfppc_synth.resources import example_folder, template_environment
from bfppc_synth.spec.json_schema import IDENTITY, json_schema

SCHEMA_FILE: Final = "bfppc-synth.schema.json"
_HEADER: Final = f"# yaml-language-server: $schema={SCHEMA_FILE}"
_NAME_LINE: Final = re.compile(r"^name:[ ]*[a-z][a-z0-9_]*", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class NewOptions:
    """``template`` is the stem of an example, None for a plant file that explains itself."""

    template: str | None = None
    overwrite: Overwrite = Overwrite.REFUSE


def schema_text() -> str:
    """Return the text of the JSON Schema, the same bytes every time."""
    return json.dumps(json_schema(), indent=1, ensure_ascii=True) + "\n"


def templates() -> tuple[str, ...]:
    """Name the examples that a new plant file may begin as."""
    return tuple(sorted(path.stem for path in example_folder().glob("*.yaml")))


def new_plant(name: str, options: NewOptions) -> Outcome:
    """Write NAME.yaml, and the schema beside it.

    Parameters
    ----------
    name : str
        The plant's name, with a folder before it where it shall not be the current one.
    options : NewOptions
        What it begins as, and what to do with a file that is there.

    Returns
    -------
    Outcome
        Exit code 0; the files written. Either both stand there, whole, or the old ones do.

    Raises
    ------
    UsageError
        No plant name, no such example, a file that would be replaced, or no right to write.
    """
    place = Path(name)
    folder, stem = place.parent, place.name.removesuffix(".yaml")
    _require_name(stem)
    plant, schema = folder / f"{stem}.yaml", folder / SCHEMA_FILE
    text = _text(stem, options.template)
    if options.overwrite is Overwrite.REFUSE:
        if plant.exists() or plant.is_symlink():
            raise UsageError(
                f"{plant.as_posix()}: is there already\n  fix: choose another name, or add --force"
            )
        if schema.exists() and not _is_ours(schema):
            raise UsageError(
                f"{schema.as_posix()}: is not the schema of a plant file\n"
                "  fix: name another folder, or add --force"
            )
    try:
        if not folder.is_dir():
            folder.mkdir(parents=True)
        _write(schema, schema_text())
        _write(plant, text)
    except OSError as error:
        raise UsageError(
            f"{plant.as_posix()}: {error.strerror or error}: no plant file was written\n"
            "  fix: name a folder that can be written, as in new plants/arm"
        ) from error
    document: dict[str, object] = {
        "format": "bfppc-synth/new/1",
        "name": stem,
        "template": options.template,
        "files": [plant.as_posix(), schema.as_posix()],
    }
    lines = [f"written: {plant.as_posix()}, {schema.as_posix()}"]
    printed = (options.template or "").endswith("_printed")
    follow = f"check {plant.as_posix()}" if printed else plant.as_posix()
    lines.append(f"next: bfppc-synth {follow}")
    return Outcome(exit_code=0, folder=None, document=document, lines=tuple(lines))


def schema_outcome() -> Outcome:
    """Return the JSON Schema for stdout; with --json it stands under the key ``schema``."""
    document: dict[str, object] = {"format": "bfppc-synth/schema/1", "schema": json_schema()}
    lines = (schema_text().rstrip("\n"),)
    return Outcome(exit_code=0, folder=None, document=document, lines=lines)


def _require_name(stem: str) -> None:
    if is_plant_name(stem) and stem not in KEYWORDS and not is_library_header(stem):
        return
    why = "a word that C, Python or a C header has already"
    if not is_plant_name(stem):
        why = "no name of 1 to 24 small letters, digits and _, a letter first"
    raise UsageError(f"new {stem}: {why}; fix: bfppc-synth new my_plant")


def _text(name: str, template: str | None) -> str:
    if template is None:
        made = template_environment().get_template("plant/new.yaml.jinja")
        return made.render(name=name, schema=SCHEMA_FILE)
    known = templates()
    if template not in known:
        near = did_you_mean(template, known)
        fix = f"did you mean {near}?" if near else f"use one of {', '.join(known)}"
        raise UsageError(f"--template {template}: no such example; fix: {fix}")
    source = (example_folder() / f"{template}.yaml").read_text(encoding="utf-8")
    return f"{_HEADER}\n#\n" + _NAME_LINE.sub(f"name: {name}", source, count=1)


def _is_ours(schema: Path) -> bool:
    try:
        document = json.loads(schema.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(document, dict) and document.get("$id") == IDENTITY


def _write(path: Path, text: str) -> None:
    """Write a file whole or not at all."""
    staging = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        staging.write_text(text, encoding="utf-8", newline="\n")
        staging.replace(path)
    finally:
        with suppress(OSError):
            staging.unlink(missing_ok=True)
