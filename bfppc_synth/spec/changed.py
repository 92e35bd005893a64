"""A plant file with other numbers: its tree changed at a path, and printed as YAML again."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from bfppc_synth.model.spec import Place
from bfppc_synth.spec.kinds import (
    Either,
    Formula,
    Integer,
    ListOf,
    Number,
    Numbers,
    OneOrPerState,
    Parameters,
    PerState,
    Range,
    Section,
)
from bfppc_synth.spec.schema import PLANT
from bfppc_synth.spec.tree import Entry, Mapping, Scalar, Sequence, Style

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.spec.kinds import Kind
    from bfppc_synth.spec.tree import Tree

_NOWHERE: Final = Place(line=1, column=1)
_PLAIN_KEY: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*\Z")
_SHARED: Final[dict[str, str | tuple[tuple[str, str], ...]]] = {
    "performance.rho": (("kind", "cosine"), ("t_s", "1")),
    "measurement.quantizer": (("kind", "none"),),
    "measurement.noise": "0",
}
"""Paths where one value may stand for all states, and what stands for an absent one."""


def numeric_paths(spec: PlantSpec) -> tuple[str, ...]:
    """List every dotted path of a plant file that a number may stand at.

    Parameters
    ----------
    spec : PlantSpec
        Its states and parameters name some of them.

    Returns
    -------
    tuple[str, ...]
        Sorted; with paths that the file does not have.
    """
    found = set(_leaves("", PLANT, spec))
    return tuple(sorted(path for path in found if not path.startswith("reference.bounds.")))


def _leaves(path: str, kind: Kind, spec: PlantSpec) -> Iterator[str]:
    match kind:
        case Number() | Integer() | Range() | Formula():
            yield path
        case Section(fields=fields):
            for field in fields:
                yield from _leaves(f"{path}.{field.key}" if path else field.key, field.kind, spec)
        case PerState(item=item, besides=besides):
            for state in spec.states:
                yield from _leaves(f"{path}.{state}", item, spec)
            for field in besides:
                yield from _leaves(f"{path}.{field.key}", field.kind, spec)
        case OneOrPerState(item=item):
            yield from _leaves(path, item, spec)
            for state in spec.states:
                yield from _leaves(f"{path}.{state}", item, spec)
        case Parameters():
            yield from (f"{path}.{item.name}" for item in spec.parameters)
        case Either(scalar=scalar, sections=sections):
            for choice in (scalar, *sections):
                yield from _leaves(path, choice, spec)
        case ListOf(item=item):
            for index in range(len(spec.synthesis.stages)):
                yield from _leaves(f"{path}.{index}", item, spec)
        case Numbers():
            yield from (f"{path}.{index}" for index in range(len(spec.reference.bounds)))
        case _:
            return


def changed(root: Mapping, path: str, text: str, states: tuple[str, ...]) -> Mapping:
    """Return the tree with another value at a dotted path; what lacks on the way is added.

    Parameters
    ----------
    root : Mapping
        A plant file's tree.
    path : str
        One of ``numeric_paths``, or of a word such as ``synthesis.objective``.
    text : str
        The value as YAML has it.
    states : tuple[str, ...]
        In order: a list with one entry per state is entered by their names.
    """
    return edited(root, path, _scalar(text), states)


def edited(root: Mapping, path: str, value: Tree | None, states: tuple[str, ...]) -> Mapping:
    """Return the tree with another subtree at a dotted path; None takes what is there away.

    Raises
    ------
    LookupError
        If one entry of a list would go: the others would move to other states.
    """
    found = _changed(root, "", path.split("."), value, states)
    return found if isinstance(found, Mapping) else replace(root, entries=())


def _changed(
    tree: Tree | None, path: str, rest: list[str], value: Tree | None, states: tuple[str, ...]
) -> Tree | None:
    if not rest or (tree is None and value is None):
        return value
    key, *deeper = rest
    below = f"{path}.{key}" if path else key
    if path in _SHARED:
        tree = _default(path) if tree is None else tree
        tree = _by_state(tree, states) if key in states else tree
    if isinstance(tree, Sequence):
        index = states.index(key) if key in states else int(key)
        item = _changed(tree.items[index], below, deeper, value, states)
        if item is None:
            raise LookupError(below)
        return replace(tree, items=(*tree.items[:index], item, *tree.items[index + 1 :]))
    # A number where a section is wanted (one rho for all) gives way to the section.
    mapping = tree if isinstance(tree, Mapping) else _mapping(())
    known = mapping.get(key)
    inner = _changed(known, below, deeper, value, states)
    if inner is None:
        entries = tuple(entry for entry in mapping.entries if entry.key.text != key)
        # What was taken back may have been all that the section said.
        return replace(mapping, entries=entries) if entries else None
    if known is None:
        entries = (*mapping.entries, Entry(key=_scalar(key), value=inner))
    else:
        entries = tuple(
            replace(entry, value=inner) if entry.key.text == key else entry
            for entry in mapping.entries
        )
    return replace(mapping, entries=entries)


def _by_state(tree: Tree, states: tuple[str, ...]) -> Tree:
    """Give every state its own copy of what stands for all of them."""
    if isinstance(tree, Sequence):
        return tree
    if isinstance(tree, Mapping) and any(entry.key.text in states for entry in tree.entries):
        return tree
    return _mapping(tuple(Entry(key=_scalar(state), value=tree) for state in states))


def _default(path: str) -> Tree:
    given = _SHARED[path]
    if isinstance(given, str):
        return _scalar(given)
    return _mapping(tuple(Entry(key=_scalar(key), value=_scalar(word)) for key, word in given))


def _mapping(entries: tuple[Entry, ...]) -> Mapping:
    return Mapping(entries=entries, place=_NOWHERE, length=1)


def _scalar(text: str) -> Scalar:
    return Scalar(text=text, style=Style.PLAIN, place=_NOWHERE, length=len(text), offset=0)


def plant_text(root: Mapping) -> str:
    """Print a tree as YAML: the same plant file without its comments.

    Returns
    -------
    str
        Block style, keys in the tree's order, every scalar with its source text.
    """
    return "\n".join(_lines(root, "")) + "\n"


def _lines(tree: Mapping, indent: str) -> Iterator[str]:
    for entry in tree.entries:
        yield from _entry(f"{indent}{_key(entry.key.text)}:", entry.value, indent + "  ")


def _entry(head: str, value: Tree, indent: str) -> Iterator[str]:
    match value:
        case Scalar():
            yield from _written(head, value, indent)
        case Mapping(entries=()):
            yield f"{head} {{}}"
        case Mapping():
            yield head
            yield from _lines(value, indent)
        case Sequence(items=()):
            yield f"{head} []"
        case Sequence(items=items):
            yield head
            for item in items:
                yield from _entry(f"{indent}-", item, indent + "  ")


def _written(head: str, scalar: Scalar, indent: str) -> Iterator[str]:
    if scalar.style is Style.BLOCK:
        yield f"{head} |-"
        yield from (f"{indent}{line.strip()}" for line in scalar.text.splitlines())
    elif scalar.style is Style.QUOTED:
        yield f"{head} {json.dumps(scalar.text, ensure_ascii=False)}"
    else:
        yield f"{head} {scalar.text}".rstrip()


def _key(text: str) -> str:
    return text if _PLAIN_KEY.match(text) else json.dumps(text, ensure_ascii=False)
