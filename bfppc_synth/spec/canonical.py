"""plant.json: the plant file's canonical twin, every scalar as its source text."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Final

from bfppc_synth.spec.tree import Mapping, Scalar, Sequence

if TYPE_CHECKING:
    from bfppc_synth.model.spec import PlantSpec
    from bfppc_synth.spec.tree import Tree

FORMAT: Final = "bfppc-synth/plant/1"

_BY_STATE: Final = frozenset({"performance.rho", "measurement.quantizer", "measurement.noise"})
"""Paths where a list, one entry per state, is written as a mapping by state."""

_KEYS: Final = "mapping"
_ITEMS: Final = "list"


def freeze_document(root: Mapping, states: tuple[str, ...]) -> object:
    """Turn the tree into nested tuples.

    Returns
    -------
    object
        ("mapping", ((key, value), ...)), ("list", (value, ...)) or a source text.
    """
    return _freeze("", root, states)


def _freeze(path: str, tree: Tree, states: tuple[str, ...]) -> object:
    match tree:
        case Scalar(text=text):
            return text
        case Sequence(items=items) if path in _BY_STATE:
            values = (_freeze("", item, states) for item in items)
            return (_KEYS, tuple(zip(states, values, strict=True)))
        case Sequence(items=items):
            return (_ITEMS, tuple(_freeze("", item, states) for item in items))
        case Mapping(entries=entries):
            pairs = []
            for entry in entries:
                key = entry.key.text
                below = f"{path}.{key}" if path else key
                pairs.append((key, _freeze(below, entry.value, states)))
            return (_KEYS, tuple(pairs))


def plant_document(spec: PlantSpec) -> dict[str, object]:
    """Return the content of plant.json as dictionaries, lists and texts."""
    return {
        "format": FORMAT,
        "plant_sha256": spec.sha256,
        "plant": _thaw(spec.document),
    }


def _thaw(frozen: object) -> object:
    if not isinstance(frozen, tuple):
        return frozen
    kind, parts = frozen
    if kind == _KEYS:
        return {key: _thaw(value) for key, value in parts}
    return [_thaw(item) for item in parts]


def plant_json(spec: PlantSpec) -> str:
    """Return the text of plant.json: sorted keys, ASCII, a newline at the end."""
    return json.dumps(plant_document(spec), sort_keys=True, indent=2, ensure_ascii=True) + "\n"
