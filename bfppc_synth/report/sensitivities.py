"""What each requirement costs: the table of report.json's ``sensitivities``, estimates all."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

_HEADS = {
    "given": "given",
    "unit": "unit",
    "effect": "change of $U$ for ten percent",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SensitivityRow:
    """A requirement of the plant file, and where its numbers stand in report.json."""

    path: str
    cells: tuple[tuple[str | int, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class SensitivityTable:
    """The section; ``text``, ``caption`` and ``heads`` are sentences for ``prose``."""

    text: str
    caption: str
    heads: tuple[str, ...]
    rows: tuple[SensitivityRow, ...]


def sensitivity_tables(document: Mapping[str, Any]) -> tuple[SensitivityTable, ...]:
    """Lay out ``sensitivities`` of report.json: a table, or none where there are none.

    Parameters
    ----------
    document : Mapping[str, Any]
        report.json; each entry of ``sensitivities`` has ``path`` and numbers under other keys.

    Returns
    -------
    tuple[SensitivityTable, ...]
        At most one; a column for every key that all entries have.
    """
    entries = document.get("sensitivities") or []
    if not entries:
        return ()
    keys = [key for key in entries[0] if key != "path" and all(key in each for each in entries)]
    return (
        SensitivityTable(
            text="Estimates, no proofs: how far the certified peak input $U$ would move if one "
            "requirement of the plant file were relaxed and the gains were searched again.",
            caption="Requirements of the plant file and what they cost.",
            heads=("plant.yaml", *(_HEADS.get(key, key.replace("_", " ")) for key in keys)),
            rows=tuple(
                SensitivityRow(
                    path=str(entry["path"]),
                    cells=tuple(("sensitivities", index, key) for key in keys),
                )
                for index, entry in enumerate(entries)
            ),
        ),
    )
