"""A path -> text that YAML may read -> the tree of spec.events, or one clear refusal."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from bfppc_synth.errors import Mistake, PlantFileError
from bfppc_synth.spec.events import build_tree

if TYPE_CHECKING:
    from pathlib import Path

    from bfppc_synth.spec.tree import Mapping

_LARGEST_FILE: Final = 100_000
_LONGEST_LINE: Final = 5000
# Line breaks of other standards would make our line numbers differ from an editor's.
_UNPRINTABLE: Final = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ufeff\ud800-\udfff]"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """A file that is YAML; ``mistakes`` are those that leave the rest readable."""

    path: str
    source: str
    sha256: str
    root: Mapping
    mistakes: tuple[Mistake, ...]


def read_document(path: Path) -> Document:
    """Read a plant file as YAML.

    Raises
    ------
    PlantFileError
        If it cannot be read, is no YAML 1.2, or no mapping.
    """
    return _document(str(path), _read_bytes(path))


def document_of(path: str, source: str) -> Document:
    """Read a text as if it stood in a file called ``path``.

    Raises
    ------
    PlantFileError
        As ``read_document``.
    """
    return _document(path, source.encode())


def _document(path: str, data: bytes) -> Document:
    source = _decode(path, data)
    root, mistakes = build_tree(path, source)
    return Document(
        path=path,
        source=source,
        sha256=hashlib.sha256(data).hexdigest(),
        root=root,
        mistakes=mistakes,
    )


def _fatal(path: str, source: str, message: str, fix: str, **at: int) -> PlantFileError:
    mistake = Mistake(
        path="",
        line=at.get("line", 1),
        column=at.get("column", 1),
        length=at.get("length", 1),
        message=message,
        fix=fix,
    )
    return PlantFileError(path, source, (mistake,))


def _read_bytes(path: Path) -> bytes:
    try:
        if path.is_dir():
            raise _fatal(str(path), "", "a folder, not a plant file", "name the .yaml file in it")
        with path.open("rb") as file:
            data = file.read(_LARGEST_FILE + 1)
    except FileNotFoundError:
        raise _fatal(str(path), "", "no such file", "check the path") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _fatal(str(path), "", f"cannot be read: {reason}", "check its permissions") from None
    if len(data) > _LARGEST_FILE:
        raise _fatal(
            str(path),
            "",
            f"more than {_LARGEST_FILE} bytes: no plant file is that long",
            "shorten it",
        )
    return data


def _decode(path: str, data: bytes) -> str:
    try:
        source = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start].decode("utf-8-sig", errors="replace")
        line, column = _position(before, len(before))
        raise _fatal(
            path,
            "",
            f"byte 0x{data[error.start]:02x} is no UTF-8 text",
            "save the file as UTF-8 text",
            line=line,
            column=column,
        ) from None
    found = _UNPRINTABLE.search(source)
    if found:
        line, column = _position(source, found.start())
        raise _fatal(
            path,
            "",
            f"the control character U+{ord(found.group()):04X} is no text",
            "remove it",
            line=line,
            column=column,
        )
    for number, text in enumerate(source.splitlines(), start=1):
        if len(text) > _LONGEST_LINE:
            message = f"a line of {len(text)} characters, more than {_LONGEST_LINE}"
            raise _fatal(path, "", message, "break it", line=number, column=_LONGEST_LINE)
    return source


def _position(source: str, index: int) -> tuple[int, int]:
    before = source[:index].replace("\r\n", "\n").replace("\r", "\n")
    return before.count("\n") + 1, len(before) - (before.rfind("\n") + 1) + 1
