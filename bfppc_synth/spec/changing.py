"""A plant file with other values at some paths: the same reading, the same rules."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

from bfppc_synth.spec.document import Document
from bfppc_synth.spec.events import build_tree
from bfppc_synth.spec.load import spec_of
from bfppc_synth.spec.tree import Entry, Mapping, Scalar, Sequence, Style

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.spec.tree import Tree


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
        whole = _with(root, tuple(edit.path.split(".")), value, spec.states)
        root = whole if isinstance(whole, Mapping) else replace(root, entries=())
    return spec_of(
        Document(path=spec.path, source=spec.source, sha256=spec.sha256, root=root, mistakes=())
    )


@lru_cache(maxsize=4)
def _root(path: str, source: str) -> Mapping:
    return build_tree(path, source)[0]


def _fragment(path: str, text: str) -> Tree:
    tree, _ = build_tree(path, f"value: {text}\n")
    return tree.entries[0].value


def _with(
    tree: Tree | None, keys: tuple[str, ...], value: Tree | None, states: tuple[str, ...]
) -> Tree | None:
    """Return the tree with the value at these keys."""
    if not keys:
        return value
    key, rest = keys[0], keys[1:]
    if isinstance(tree, Sequence):
        place = states.index(key) if key in states else int(key)
        items = list(tree.items)
        inner = _with(items[place], rest, value, states)
        if inner is None:
            raise LookupError(key)
        items[place] = inner
        return replace(tree, items=tuple(items))
    # A number where a section is wanted (one rho for all) gives way to the section.
    entries = list(tree.entries) if isinstance(tree, Mapping) else []
    known = next((i for i, entry in enumerate(entries) if entry.key.text == key), None)
    inner = _with(None if known is None else entries[known].value, rest, value, states)
    if known is not None:
        entries[known : known + 1] = [] if inner is None else [replace(entries[known], value=inner)]
        if not entries:
            # What was taken back was all that the section said.
            return None
    elif inner is not None:
        entries.append(Entry(key=_key(key, inner), value=inner))
    if isinstance(tree, Mapping):
        return replace(tree, entries=tuple(entries))
    place_of = (inner or _fragment("", "0")).place
    return Mapping(entries=tuple(entries), place=place_of, length=1)


def _key(text: str, near: Tree) -> Scalar:
    return Scalar(text=text, style=Style.PLAIN, place=near.place, length=len(text), offset=0)
