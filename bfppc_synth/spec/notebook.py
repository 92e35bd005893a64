"""What the reader has found: values and mistakes by dotted path."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from bfppc_synth.errors import Mistake
from bfppc_synth.model.expression import Constant, Expression
from bfppc_synth.model.spec import Interval, Place
from bfppc_synth.spec.tree import Mapping

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bfppc_synth.spec.tree import Tree

Leaf: TypeAlias = Constant | Expression | Interval | str | int | tuple[Constant, ...]


class Notebook:
    """Values of a plant file by path, the places they stand in, and all mistakes so far."""

    def __init__(self, mistakes: Iterable[Mistake]) -> None:
        self._mistakes = list(mistakes)
        self._values: dict[str, Leaf] = {}
        self._trees: dict[str, Tree] = {}
        self._spread: set[str] = set()

    def note(self, path: str, value: Leaf | None) -> None:
        """Keep a value that was read; None is one whose mistake is noted already."""
        if value is not None:
            self._values[path] = value

    def visit(self, path: str, tree: Tree) -> None:
        """Remember where the value of a path stands."""
        self._trees[path] = tree

    def spread(self, path: str) -> None:
        """Remember that a path holds one value per state."""
        self._spread.add(path)

    def of_state(self, path: str, state: str) -> str:
        """Return the path that holds a state's own value, or the one for all states."""
        return f"{path}.{state}" if path in self._spread else path

    def blame(self, path: str, tree: Tree, message: str, fix: str) -> None:
        """Add a mistake that underlines a value or a key."""
        self.blame_part(path, tree, message, fix, column=tree.place.column, length=tree.length)

    def blame_part(
        self, path: str, tree: Tree, message: str, fix: str, *, column: int, length: int
    ) -> None:
        """Add a mistake that underlines some columns of a value's first line."""
        self._mistakes.append(
            Mistake(
                path=path,
                line=tree.place.line,
                column=column,
                length=length,
                message=message,
                fix=fix,
            )
        )

    def blame_path(self, path: str, message: str, fix: str) -> None:
        """Add a mistake at the value of a path, or at the nearest section the file has."""
        known = path
        while known not in self._trees and known:
            known = known.rpartition(".")[0]
        self.blame(path, self._trees[known], message, fix)

    def has(self, path: str) -> bool:
        """Tell whether the file has this path, readable or not."""
        return path in self._trees

    def constant(self, path: str) -> Constant | None:
        """Return a number, None where it is absent or unreadable."""
        value = self._values.get(path)
        return value if isinstance(value, Constant) else None

    def expression(self, path: str) -> Expression | None:
        """Return an expression, None where it is absent or unreadable."""
        value = self._values.get(path)
        return value if isinstance(value, Expression) else None

    def interval(self, path: str) -> Interval | None:
        """Return a range, None where it is absent or unreadable."""
        value = self._values.get(path)
        return value if isinstance(value, Interval) else None

    def text(self, path: str, default: str) -> str:
        """Return a word or text, the default where it is absent or unreadable."""
        value = self._values.get(path)
        return value if isinstance(value, str) else default

    def integer(self, path: str, default: int) -> int:
        """Return a whole number, the default where it is absent or unreadable."""
        value = self._values.get(path)
        return value if isinstance(value, int) else default

    def numbers(self, path: str) -> tuple[Constant, ...]:
        """Return a list of numbers, empty where it is absent or unreadable."""
        value = self._values.get(path)
        return value if isinstance(value, tuple) else ()

    def mistakes(self) -> tuple[Mistake, ...]:
        """Return all mistakes in file order."""
        ordered = sorted(self._mistakes, key=lambda item: (item.line, item.column))
        return tuple(dict.fromkeys(ordered))

    def places(self) -> tuple[tuple[str, Place], ...]:
        """Return the place of every path that was visited, sorted by path."""
        return tuple(sorted((path, tree.place) for path, tree in self._trees.items() if path))

    def paths(self) -> tuple[str, ...]:
        """Return every path that was visited, in file order."""
        return tuple(self._trees)

    def is_mapping(self, path: str) -> bool:
        """Tell whether a path holds a mapping."""
        return isinstance(self._trees.get(path), Mapping)
