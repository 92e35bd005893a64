"""The output folder: staged beside its place, swapped in whole, never another plant's."""

from __future__ import annotations

import hashlib
import json
import os
import secrets
import shutil
from enum import Enum, auto
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from bfppc_synth.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

MANIFEST = "manifest.json"
_FORMAT = "bfppc-synth/manifest/1"


class Overwrite(Enum):
    """What to do about a folder that is not this plant's."""

    REFUSE = auto()
    FORCE = auto()


def may_write(folder: Path, *, name: str, overwrite: Overwrite) -> None:
    """Refuse a folder that must not be replaced, before any work is done.

    Parameters
    ----------
    folder : Path
        Where the generated folder will stand.
    name : str
        Name of the plant.
    overwrite : Overwrite
        FORCE accepts the folder of another plant and one without a manifest.

    Raises
    ------
    UsageError
        The place, or one above it, is a file; the place is a symbolic link or the current
        directory; the folder is another plant's, or holds files and no manifest.
    """
    if folder.is_symlink():
        raise UsageError(
            f"{folder.as_posix()}: is a symbolic link, which swapping the folder in would replace\n"
            "  fix: name the folder that it points to"
        )
    for place in (folder, *folder.parents):
        if place.exists():
            if not place.is_dir():
                raise UsageError(
                    f"{place.as_posix()}: is a file, so there can be no folder here\n"
                    "  fix: name another folder with --out"
                )
            break
    if Path.cwd().is_relative_to(folder.resolve()):
        raise UsageError(
            f"{folder.as_posix()}: is the current directory or one above it, and would be swapped"
            " for a new one\n  fix: name a folder below it with --out, or change directory"
        )
    if overwrite is Overwrite.FORCE or not folder.is_dir() or not any(folder.iterdir()):
        return
    owner = _owner(folder)
    if owner is None:
        raise UsageError(
            f"{folder.as_posix()}: holds files but no {MANIFEST} of this tool: they would be mixed"
            f" with those of {name}\n"
            "  fix: name an empty or new folder with --out, or add --force"
        )
    if owner != name:
        raise UsageError(
            f"{folder.as_posix()}: belongs to the plant {owner}, not to {name}\n"
            "  fix: name another folder with --out, or add --force"
        )


def write_folder(
    files: Mapping[str, bytes], out: Path, *, name: str, status: str, overwrite: Overwrite
) -> None:
    """Write all files and their manifest as one folder, or nothing.

    Files of the user that stand in the old folder are kept; those of its old manifest go.

    Parameters
    ----------
    files : Mapping[str, bytes]
        Relative POSIX path -> content, without the manifest.
    out : Path
        The folder; parents are made.
    name, status : str
        Plant and verdict, for the manifest.
    overwrite : Overwrite
        As in ``may_write``.

    Raises
    ------
    UsageError
        As ``may_write``; a path of ``files`` leads out of the folder or is the manifest's; a
        file of the user stands where a new one must be written; the system refuses to write.
    """
    may_write(out, name=name, overwrite=overwrite)
    for path in files:
        if path == MANIFEST or not _is_inside(path):
            raise UsageError(f"{path}: is not a path that a generated folder can hold")
    # A relative --out must mean the same folder until the end.
    target = Path(os.path.abspath(out))  # noqa: PTH100 -- resolve() would follow links
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        stamp = f".{target.name}.{secrets.token_hex(4)}"
        staging, retired = target.parent / f"{stamp}.new", target.parent / f"{stamp}.old"
        try:
            staging.mkdir()
            _fill(staging, files)
            _carry_over(target, staging, files, overwrite)
            _write_manifest(staging, files, name=name, status=status)
            _swap(staging, target, retired)
        finally:
            shutil.rmtree(staging, ignore_errors=True)
            if target.exists():
                shutil.rmtree(retired, ignore_errors=True)
    except OSError as error:
        raise UsageError(
            f"{out.as_posix()}: {error.strerror or error}: nothing was written\n"
            "  fix: name a folder that can be written with --out"
        ) from error


def _fill(staging: Path, files: Mapping[str, bytes]) -> None:
    for path in sorted(files):
        place = staging / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(files[path])


def _write_manifest(staging: Path, files: Mapping[str, bytes], *, name: str, status: str) -> None:
    """Write the manifest, last of all: a folder without one is not finished."""
    document = {
        "format": _FORMAT,
        "name": name,
        "status": status,
        "files": {path: hashlib.sha256(files[path]).hexdigest() for path in sorted(files)},
    }
    text = json.dumps(document, indent=2, ensure_ascii=False) + "\n"
    (staging / MANIFEST).write_text(text, encoding="utf-8")


def _swap(staging: Path, target: Path, retired: Path) -> None:
    """Put the new folder in the place of the old one, which comes back if that fails."""
    if not target.exists():
        staging.rename(target)
        return
    try:
        target.rename(retired)
        staging.rename(target)
    finally:
        # Also after Ctrl-C between the two renames.
        if retired.exists() and not target.exists():
            retired.rename(target)


def _carry_over(old: Path, staging: Path, files: Mapping[str, bytes], overwrite: Overwrite) -> None:
    """Link or copy what the user keeps in the old folder into the new one."""
    made = _made(old)
    for path in _contents(old):
        if path in made:
            continue
        source, place = old / path, staging / path
        clash = next((p for p in (path, *map(str, PurePosixPath(path).parents)) if p in files), "")
        if clash or place.exists():
            if overwrite is Overwrite.FORCE:
                continue
            raise UsageError(
                f"{source.as_posix()}: is not in the old {MANIFEST}, yet a generated file must "
                "stand there\n  fix: move it away, or add --force"
            )
        place.parent.mkdir(parents=True, exist_ok=True)
        if source.is_symlink():
            place.symlink_to(source.readlink())
        elif source.is_dir():
            place.mkdir(exist_ok=True)
        else:
            _link_or_copy(source, place)


def _link_or_copy(source: Path, place: Path) -> None:
    """Give a file a second name; the first one goes with the old folder."""
    try:
        place.hardlink_to(source)
    except OSError:
        shutil.copy2(source, place)


def _contents(folder: Path) -> Iterator[str]:
    """Files, links and empty folders under a folder; Python's caches of old code are left out."""
    if not folder.is_dir():
        return
    for place in sorted(folder.iterdir()):
        if place.is_dir() and not place.is_symlink():
            # A stale __pycache__ may answer for a new controller.py written in the same second.
            if place.name == "__pycache__":
                continue
            inner = [f"{place.name}/{path}" for path in _contents(place)]
            yield from inner or ([place.name] if not any(place.iterdir()) else [])
        else:
            yield place.name


def _made(folder: Path) -> frozenset[str]:
    """Paths that an earlier run wrote, by the manifest; a forged path cannot lead outside."""
    document = _manifest(folder)
    listed = document.get("files")
    paths = listed if isinstance(listed, dict) else {}
    return frozenset({MANIFEST, *(path for path in paths if _is_inside(path))})


def _owner(folder: Path) -> str | None:
    """Name of the plant whose folder it is; None without a manifest of this tool."""
    name = _manifest(folder).get("name")
    return name if isinstance(name, str) else None


def _manifest(folder: Path) -> Mapping[str, object]:
    try:
        document = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    ours = isinstance(document, dict) and str(document.get("format", "")).startswith(
        "bfppc-synth/manifest/"
    )
    return document if ours else {}


def _is_inside(path: str) -> bool:
    """Whether a manifest path is relative, normal and below the folder."""
    parts = PurePosixPath(path)
    return (
        bool(path)
        and not parts.is_absolute()
        and ".." not in parts.parts
        and parts.as_posix() == path
        and "\\" not in path
        and "\0" not in path
    )
