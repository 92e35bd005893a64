"""One exception tree; every error knows the exit code it ends in (SPEC section 2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


class BfppcError(Exception):
    """Base of everything that this package raises on purpose."""

    exit_code = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Mistake:
    """One mistake in a plant file.

    ``path`` is dotted (``performance.accuracy``); line and column count from 1; ``length``
    is how many columns the caret underlines; ``fix`` may be empty.
    """

    path: str
    line: int
    column: int
    length: int
    message: str
    fix: str


class PlantFileError(BfppcError):
    """The plant file has mistakes: all of them, in file order."""

    exit_code = 2

    def __init__(self, file: str, source: str, mistakes: tuple[Mistake, ...]) -> None:
        self.file = file
        self.source = source
        self.mistakes = mistakes
        super().__init__(self.render())

    def render(self) -> str:
        """``FILE:LINE:COLUMN: error: PATH: what``, the source line, a caret, a fix."""
        lines = self.source.splitlines()
        blocks = []
        for mistake in self.mistakes:
            what = f"{mistake.path}: {mistake.message}" if mistake.path else mistake.message
            block = [f"{self.file}:{mistake.line}:{mistake.column}: error: {what}"]
            if 1 <= mistake.line <= len(lines):
                text = lines[mistake.line - 1]
                pad = "".join("\t" if c == "\t" else " " for c in text[: mistake.column - 1])
                block.append(f"{mistake.line:>5} | {text}")
                block.append(f"      | {pad}{'^' * max(1, mistake.length)}")
            if mistake.fix:
                block.append(f"  fix: {mistake.fix}")
            blocks.append("\n".join(block))
        return "\n".join(blocks)


class UsageError(BfppcError):
    """The command line, or the folder it names, cannot be used."""

    exit_code = 2


class ShapeError(BfppcError):
    """Tuples of unequal length, or a half-width that is not positive."""

    exit_code = 2


class EnvelopeError(BfppcError):
    """No rule, or a point outside a function's domain; the pipeline gives it a place.

    ``subexpression`` is the text of the part that has no envelope.
    """

    exit_code = 2

    def __init__(self, message: str, *, subexpression: str, fix: str = "") -> None:
        self.subexpression = subexpression
        self.fix = fix
        super().__init__(message)


class NoDesignError(BfppcError):
    """Something is free and nothing certified was found, or the limit is exceeded.

    ``details`` are what ``--json`` adds: ``binding``, ``drivers``, ``suggestions`` and
    ``no_help``; empty where the sentence says it all.
    """

    exit_code = 3

    def __init__(self, message: str, *, details: Mapping[str, object] | None = None) -> None:
        self.details: Mapping[str, object] = details or {}
        super().__init__(message)


class NotCertifiedError(BfppcError):
    """An inequality or an assumption does not hold, or could not be decided."""

    exit_code = 4
