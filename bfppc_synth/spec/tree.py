"""The plant file as a tree of source texts: mappings, sequences, scalars, each with its place."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from bfppc_synth.model.spec import Place


class Style(StrEnum):
    """How a scalar is written; BROKEN is one whose mistake is reported already."""

    PLAIN = "plain"
    QUOTED = "quoted"
    BLOCK = "block"
    BROKEN = "broken"


@dataclass(frozen=True, slots=True, kw_only=True)
class Scalar:
    """A text; ``length`` is what a caret underlines on its first line.

    ``offset`` is how many columns behind ``place`` the text's first character stands, or
    None where columns of the text are no columns of the file (several lines, escapes).
    """

    text: str
    style: Style
    place: Place
    length: int
    offset: int | None

    @property
    def is_null(self) -> bool:
        """Whether YAML reads nothing here."""
        return self.style is Style.PLAIN and self.text in {"", "~", "null", "Null", "NULL"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A key with its value."""

    key: Scalar
    value: Tree


@dataclass(frozen=True, slots=True, kw_only=True)
class Mapping:
    """Entries in file order, keys unique."""

    entries: tuple[Entry, ...]
    place: Place
    length: int

    def get(self, key: str) -> Tree | None:
        """Value of a key, None where it is absent."""
        for entry in self.entries:
            if entry.key.text == key:
                return entry.value
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Sequence:
    """Items in file order."""

    items: tuple[Tree, ...]
    place: Place
    length: int


Tree: TypeAlias = Scalar | Mapping | Sequence
