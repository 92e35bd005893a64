"""Hooks of the site: unlisted pages, and the formulas of the theory in print.

docs/theory.md writes formulas as plain text, so that an editor, a comment in the code and a diff
show them as they are. The site prints x_{i+1}, rho, <= and f* as a book would.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig

EVIDENCE = "Evidence"
TYPESET = {"theory.md"}
GREEK = {
    "alpha": "α", "gamma": "γ", "delta": "δ", "eps": "ε", "zeta": "ζ", "eta": "η", "kappa": "κ",
    "nu": "ν", "xi": "ξ", "pi": "π", "rhobar": "ρ̄", "rho": "ρ", "sigma": "σ", "tau": "τ",
    "phi": "φ", "Delta": "Δ", "Lambda": "Λ", "Psi": "Ψ", "Omega": "Ω", "th": "θ",
}  # fmt: skip
NAMES = "|".join(sorted(GREEK, key=len, reverse=True))
# In this order: a hat before its index, an index before its power.
RULES = (
    (re.compile(rf"(?<![A-Za-z-])(d?)({NAMES})(?![A-Za-z])"), lambda m: m[1] + GREEK[m[2]]),
    (re.compile(r"(?<![A-Za-z])([fgpΩ])\^(?=[_\s,.;=)])"), lambda m: m[1] + "\u0302"),
    (re.compile(r"&lt;=|≤"), lambda _: "≤"),
    (re.compile(r"&gt;=|≥"), lambda _: "≥"),
    (re.compile(r"\+-(?=\s?\d)"), lambda _: "±"),
    (re.compile(r"_\{([^{}]*)\}"), lambda m: f"<sub>{m[1]}</sub>"),
    (re.compile(r"(?<=[^\s_])_([A-Za-z0-9]{1,2})(?![A-Za-z0-9_])"), lambda m: f"<sub>{m[1]}</sub>"),
    (re.compile(r"\^(\([^()]*\)|-?\d+(?:\.\d+)?|[A-Za-z])"), lambda m: f"<sup>{m[1]}</sup>"),
    (re.compile(r"\bQED\b"), lambda _: "∎"),
)
FORMULA = re.compile(r"[=^(]|&[lg]t;|_\{")


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


def on_page_content(html: str, *, page: Any, **_: Any) -> str:
    """Print the formulas of a page."""
    return typeset(html) if page.file.src_path in TYPESET else html


def typeset(html: str) -> str:
    """Print the formulas between the tags; a key of the plant file in code stays as it is."""
    parts = re.split(r"(<[^>]+>)", html)
    depth = 0
    for index, part in enumerate(parts):
        if part.startswith("<"):
            depth += (part.startswith("<code")) - (part == "</code>")
        elif depth == 0 or FORMULA.search(part):
            for pattern, made in RULES:
                part = pattern.sub(made, part)  # noqa: PLW2901
            parts[index] = part
    return "".join(parts)
