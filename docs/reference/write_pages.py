"""Write commands.md and plant-file.md from the program itself: ``make docs``.

Both are committed; tests/house/test_docs_reference.py holds them against the program, so that
neither can drift.
"""

from __future__ import annotations

import os
import sys
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

HERE = Path(__file__).resolve().parent
PAGES = ("commands.md", "plant-file.md")
HEAD = """# Commands

Written by `make docs` from `--help`. Exit codes are on a [page of their own](exit-codes.md).
`--json` prints one object on stdout; progress and notes go to stderr.
"""
KINDS = {
    "Number": "number",
    "Integer": "whole number",
    "Text": "text",
    "Formula": "expression",
    "Range": "number or [low, high]",
    "StateNames": "list of names",
    "Numbers": "list of numbers",
    "Units": "text for each name",
    "Parameters": "number or [low, high] for each name",
}


def help_text(*words: str) -> str:
    """Return what ``bfppc-synth WORDS --help`` prints, in lines of 80 columns."""
    from bfppc_synth.cli import main

    os.environ["COLUMNS"] = "80"
    with redirect_stdout(StringIO()) as printed:
        main([*words, "--help"])
    lines = (line.rstrip() for line in printed.getvalue().strip().splitlines())
    return "\n".join(lines)


def commands_page() -> str:
    """Return the page of all commands: what --help says, whole."""
    from bfppc_synth.arguments import COMMANDS

    parts = [
        HEAD,
        f"## bfppc-synth\n\n```text\n{help_text()}\n```\n",
    ]
    parts += [f"## {name}\n\n```text\n{help_text(name)}\n```\n" for name in COMMANDS]
    return "\n".join(parts)


def kind_of(kind: object) -> str:
    """One cell: what may stand there."""
    name = type(kind).__name__
    words = getattr(kind, "words", None)
    if words:
        return ", ".join(f"`{word!s}`" for word in words)
    if name == "OneOrPerState":
        return f"{kind_of(kind.item)}; or one for each state"
    if name == "PerState":
        return f"for each state: {kind_of(kind.item)}"
    if name == "ListOf":
        return f"list of: {kind_of(kind.item)}"
    if name == "Either":
        return "; or ".join([kind_of(kind.scalar), *(kind_of(part) for part in kind.sections)])
    if hasattr(kind, "fields"):
        return "section with " + ", ".join(f"`{field.key}`" for field in kind.fields)
    if name == "Number":
        rule = getattr(kind.rule, "value", "") if getattr(kind, "rule", None) else ""
        return f"number {rule}".strip()
    return KINDS.get(name, name)


def rows(kind: object, path: str) -> list[str]:
    """One row for every key below a section, depth first, each path once."""
    found: list[str] = []
    for field in (*getattr(kind, "fields", ()), *getattr(kind, "besides", ())):
        here = f"{path}.{field.key}".lstrip(".")
        default = "required" if field.required else f"`{field.default}`" if field.default else ""
        cell = kind_of(field.kind).replace("|", "\\|")
        meaning = field.description.replace("*", "\\*")
        found.append(f"| `{here}` | {cell} | {default} | {meaning} |")
        found += inner(field.kind, here)
    return found


def inner(kind: object, path: str) -> list[str]:
    """Rows of what a value may contain."""
    name = type(kind).__name__
    if name == "PerState":
        return [*rows(kind.item, f"{path}.STATE"), *rows(kind, path)]
    if name == "OneOrPerState":
        return rows(kind.item, path)
    if name == "ListOf":
        return rows(kind.item, f"{path}[]")
    if name == "Either":
        return [row for part in kind.sections for row in rows(part, path)]
    return rows(kind, path)


def plant_page() -> str:
    """Return the page of the plant file: every key of the reader's own schema."""
    from bfppc_synth.expressions.names import FUNCTIONS
    from bfppc_synth.spec.schema import MOST_STATES, PLANT

    functions = ", ".join(f"`{name}`" for name in sorted(FUNCTIONS))
    head = (HERE / "plant-file.head").read_text(encoding="utf-8")
    table = ["| key | value | default | meaning |", "|---|---|---|---|", *rows(PLANT, "")]
    filled = head.replace("@FUNCTIONS@", functions).replace("@STATES@", str(MOST_STATES))
    return filled.replace("@TABLE@", "\n".join(dict.fromkeys(table)))


def main() -> None:
    """Write both pages."""
    for name, text in zip(PAGES, (commands_page(), plant_page()), strict=True):
        (HERE / name).write_text(text, encoding="utf-8")
        sys.stderr.write(f"{name} written\n")


if __name__ == "__main__":
    main()
