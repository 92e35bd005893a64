"""Hook of the site: a page of docs/ that the navigation does not name stands under Evidence."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig

EVIDENCE = "Evidence"


def named(entry: Any) -> set[str]:
    """Paths that a part of the navigation names."""
    if isinstance(entry, str):
        return {entry}
    parts = entry.values() if isinstance(entry, dict) else entry
    return set().union(*(named(part) for part in parts))


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Append the measurements that a script of benchmarks/ wrote and nobody listed."""
    listed = named(config.nav)
    pages = sorted(path.name for path in Path(config.docs_dir).glob("*.md"))
    for section in config.nav:
        if EVIDENCE in section:
            section[EVIDENCE].extend(page for page in pages if page not in listed)
    return config
