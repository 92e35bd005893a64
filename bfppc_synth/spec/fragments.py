"""Expressions that a comma has cut in YAML's flow style: ``{f: Min(x1, 2)}`` is two entries.

YAML gives no error there, so what follows would be three puzzling ones. The pieces are put
together again, one mistake is reported, and the value is marked as broken.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Final

from bfppc_synth.errors import Mistake
from bfppc_synth.spec.tree import Entry, Scalar, Style

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bfppc_synth.spec.tree import Tree

# More commas than any function takes arguments; a bound, so that no file is slow to refuse.
_MOST_PIECES: Final = 100


def _depth(text: str) -> int:
    return text.count("(") - text.count(")")


def _piece(value: Tree | None) -> str | None:
    if isinstance(value, Scalar) and value.style is Style.PLAIN:
        return value.text
    return None


def _mistake(path: str, value: Scalar, pieces: list[str]) -> Mistake:
    whole = ", ".join(pieces)
    key = f"{path.rpartition('.')[2]}: " if path else ""
    return Mistake(
        path=path,
        line=value.place.line,
        column=value.place.column,
        length=value.length,
        message=f"in YAML flow style a comma ends the value, so only `{value.text}` is read here",
        fix=f'quote the expression: {key}"{whole}"',
    )


def _joined(first: str, rest: Iterable[str | None]) -> list[str]:
    """Collect the pieces from the first until the parentheses balance; empty if they never do."""
    pieces, depth = [first], _depth(first)
    for piece in rest:
        if piece is None:
            return []
        pieces.append(piece)
        depth += _depth(piece)
        if depth <= 0:
            return pieces
    return []


def join_entries(path: str, entries: list[Entry]) -> tuple[list[Entry], list[Mistake]]:
    """Find cut expressions among the entries of a flow mapping."""
    kept: list[Entry] = []
    mistakes: list[Mistake] = []
    index = 0
    while index < len(entries):
        entry = entries[index]
        text = _piece(entry.value)
        pieces: list[str] = []
        if text is not None and _depth(text) > 0:
            rest = (
                other.key.text if _piece(other.value) == "" else None
                for other in islice(entries, index + 1, index + _MOST_PIECES)
            )
            pieces = _joined(text, rest)
        if pieces and isinstance(entry.value, Scalar):
            name = f"{path}.{entry.key.text}" if path else entry.key.text
            mistakes.append(_mistake(name, entry.value, pieces))
            entry = Entry(key=entry.key, value=replace(entry.value, style=Style.BROKEN))
        kept.append(entry)
        index += max(1, len(pieces))
    return kept, mistakes


def join_items(path: str, items: list[Tree]) -> tuple[list[Tree], list[Mistake]]:
    """Find cut expressions among the items of a flow sequence."""
    kept: list[Tree] = []
    mistakes: list[Mistake] = []
    index = 0
    while index < len(items):
        item = items[index]
        text = _piece(item)
        pieces: list[str] = []
        if text is not None and _depth(text) > 0:
            rest = (_piece(other) for other in islice(items, index + 1, index + _MOST_PIECES))
            pieces = _joined(text, rest)
        if pieces and isinstance(item, Scalar):
            found = _mistake(path, item, pieces)
            mistakes.append(replace(found, fix=f'quote the expression: "{", ".join(pieces)}"'))
            item = replace(item, style=Style.BROKEN)
        kept.append(item)
        index += max(1, len(pieces))
    return kept, mistakes
