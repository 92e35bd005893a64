"""A plant file with other values at some paths: the same reading, the same rules."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from bfppc_synth.spec.changed import edited
from bfppc_synth.spec.document import Document
from bfppc_synth.spec.events import build_tree
from bfppc_synth.spec.load import spec_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.spec.tree import Mapping, Tree


@dataclass(frozen=True, slots=True, kw_only=True)
class Edit:
    """One value to write: a dotted path of the plant file, and YAML text; None removes it."""

    path: str
    text: str | None


def changed(spec: PlantSpec, edits: Iterable[Edit]) -> PlantSpec:
    """Read the plant file again with other values; nothing is written.

    Parameters
    ----------
    spec : PlantSpec
        What was read; its ``source`` is edited, and stays as it is in the result.
    edits : iterable of Edit
        Paths that the file lacks are added; of a list of one value per state the entry of the
        state that the path ends in is meant.

    Returns
    -------
    PlantSpec
        As ``load_spec`` would read the edited file.

    Raises
    ------
    PlantFileError
        If the edited file has mistakes.
    """
    root = _root(spec.path, spec.source)
    for edit in edits:
        value = None if edit.text is None else _fragment(spec.path, edit.text)
        root = edited(root, edit.path, value, spec.states)
    return spec_of(
        Document(path=spec.path, source=spec.source, sha256=spec.sha256, root=root, mistakes=())
    )


@lru_cache(maxsize=4)
def _root(path: str, source: str) -> Mapping:
    return build_tree(path, source)[0]


def _fragment(path: str, text: str) -> Tree:
    tree, _ = build_tree(path, f"value: {text}\n")
    return tree.entries[0].value
