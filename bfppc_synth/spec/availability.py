"""What the contract names and this version refuses: one table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class Unavailable:
    """A row of what the contract names and this version refuses.

    ``key`` is the last part of a path below ``section``; ``word`` the refused value, empty
    where the key itself is refused.
    """

    section: str
    key: str
    word: str = ""


UNAVAILABLE: Final[tuple[Unavailable, ...]] = ()
"""What later versions bring: deleting a row here makes the reader read it."""


def is_unavailable(path: str, word: str) -> bool:
    """Tell whether a key (empty word), or a word as its value, is refused for now."""
    section, _, key = path.rpartition(".")
    return any(
        row.key == key
        and row.word == word
        and (section == row.section or section.startswith(f"{row.section}."))
        for row in UNAVAILABLE
    )
