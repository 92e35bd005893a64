"""YAML 1.2 events -> a tree of source texts with their places; nothing is interpreted.

Built from ruamel's events and not from its values: a number keeps its digits, a duplicate
key is seen, and no tag, alias or merge key ever does anything.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

from bfppc_synth.errors import Mistake, PlantFileError
from bfppc_synth.model.spec import Place
from bfppc_synth.spec.fragments import join_entries, join_items
from bfppc_synth.spec.tree import Entry, Mapping, Scalar, Sequence, Style

if TYPE_CHECKING:
    from bfppc_synth.spec.tree import Tree

_DEEPEST: Final = 12
_MOST_EVENTS: Final = 5000
_ANY_HINT: Final = "check the colons, commas, brackets and indentation around this place"
_HINTS: Final = (
    ("mapping values are not allowed", "quote the value if it contains a colon"),
    ("but got '<stream end>'", "close the bracket, brace or quotation mark"),
    ("found unexpected end of stream", "close the quotation mark"),
    ("could not find expected ':'", "write `key: value`, with a space after the colon"),
    ("but found", "check the indentation and the brackets before this place"),
    ("did not find expected", "check the indentation and the brackets before this place"),
    ("cannot start any token", "quote the text"),
)


def build_tree(path: str, source: str) -> tuple[Mapping, tuple[Mistake, ...]]:
    """Read YAML into a tree.

    Returns
    -------
    Mapping, tuple of Mistake
        The root, and the mistakes that leave the rest readable (duplicate keys, commas).

    Raises
    ------
    PlantFileError
        If the text is no YAML 1.2, uses anchors, aliases, tags or directives, or holds no
        mapping.
    """
    builder = _Builder(path, source)
    return builder.build(), tuple(builder.mistakes)


@dataclass(slots=True, kw_only=True)
class _Open:
    """A mapping or sequence whose end has not come yet."""

    path: str
    event: Any
    entries: list[Entry] = field(default_factory=list)
    items: list[Tree] = field(default_factory=list)
    key: Scalar | None = None

    @property
    def is_mapping(self) -> bool:
        return type(self.event).__name__ == "MappingStartEvent"


class _Builder:
    """Turns ruamel's events into the tree, in a loop: depth is ours to bound."""

    def __init__(self, path: str, source: str) -> None:
        self._path = path
        self._source = source
        self.mistakes: list[Mistake] = []
        self._stack: list[_Open] = []
        self._root: Tree | None = None
        self._documents = 0

    def build(self) -> Mapping:
        """Run over all events."""
        from ruamel.yaml import YAML
        from ruamel.yaml.error import MarkedYAMLError, YAMLError

        try:
            for count, event in enumerate(YAML(typ="safe", pure=True).parse(self._source)):
                if count > _MOST_EVENTS:
                    raise self._stop(
                        "too many values for a plant file", "write fewer", event.start_mark
                    )
                self._event(event)
        except MarkedYAMLError as error:
            raise self._syntax(error) from None
        except YAMLError as error:
            line = str(error).partition("\n")[0]
            raise self._stop(f"not YAML: {line}", _ANY_HINT) from None
        if isinstance(self._root, Mapping) and self._root.entries:
            return self._root
        if self._root is None or (isinstance(self._root, Scalar) and self._root.is_null):
            raise self._stop(
                "an empty file",
                "`bfppc-synth` needs at least name, states, dynamics, initial and performance",
            )
        raise self._stop("no mapping of keys to values", "begin with `name: my_plant`")

    def _stop(self, message: str, fix: str, mark: Any = None) -> PlantFileError:
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        lines = self._source.splitlines()
        if line > len(lines) > 0:
            # Behind the last line there is nothing that a caret could stand under.
            line, column = len(lines), len(lines[-1]) + 1
        mistake = Mistake(path="", line=line, column=column, length=1, message=message, fix=fix)
        return PlantFileError(self._path, self._source, (*self.mistakes, mistake))

    def _syntax(self, error: Any) -> PlantFileError:
        mark = error.problem_mark or error.context_mark
        problem = (error.problem or "not YAML").strip()
        index = mark.index if mark is not None else 0
        if error.context_mark is not None and not self._source[index:].strip():
            # What is missing at the end of the file was opened at another place.
            mark = error.context_mark
        if self._source[index : index + 1] == "\t" or "\\t" in problem:
            return self._stop("a tab where YAML wants spaces", "indent with spaces", mark)
        fix = next((hint for words, hint in _HINTS if words in problem), _ANY_HINT)
        return self._stop(f"not YAML: {problem}", fix, mark)

    def _event(self, event: Any) -> None:
        kind = type(event).__name__
        if kind == "DocumentStartEvent":
            self._documents += 1
            if self._documents > 1:
                raise self._stop("a second document", "one plant per file", event.start_mark)
            if event.version not in {None, (1, 2)} or event.tags:
                raise self._stop(
                    "a directive", "remove it: plant files are YAML 1.2", event.start_mark
                )
        elif kind == "AliasEvent":
            raise self._stop(
                f"the alias *{event.anchor}: anchors and aliases are not read",
                "write the value out; quote it if the star means a product",
                event.start_mark,
            )
        elif kind == "ScalarEvent":
            self._refuse_marks(event)
            self._add(self._scalar(event))
        elif kind in {"MappingStartEvent", "SequenceStartEvent"}:
            self._refuse_marks(event)
            self._open(event)
        elif kind in {"MappingEndEvent", "SequenceEndEvent"}:
            self._close(event)

    def _refuse_marks(self, event: Any) -> None:
        if event.anchor is not None:
            raise self._stop(
                f"the anchor &{event.anchor}: anchors and aliases are not read",
                "write the value out",
                event.start_mark,
            )
        tag = getattr(event, "tag", None)
        if tag:
            raise self._stop(f"the tag {tag}: tags are not read", "remove it", event.start_mark)

    def _scalar(self, event: Any) -> Scalar:
        start, end, style = event.start_mark, event.end_mark, event.style
        one_line = start.line == end.line
        written = self._source[start.index : end.index]
        if style in {"'", '"'}:
            kind, offset = Style.QUOTED, 1 if written[1:-1] == event.value else None
        elif style in {"|", ">"}:
            kind, offset = Style.BLOCK, None
        else:
            kind, offset = Style.PLAIN, 0 if written == event.value else None
        length = end.column - start.column if one_line else len(written.splitlines()[0])
        return Scalar(
            text=event.value if kind is not Style.BLOCK else event.value.strip(),
            style=kind,
            place=Place(line=start.line + 1, column=start.column + 1),
            length=max(1, length),
            offset=offset,
        )

    def _child_path(self) -> str:
        if not self._stack:
            return ""
        top = self._stack[-1]
        name = top.key.text if top.key is not None else str(len(top.items))
        return f"{top.path}.{name}" if top.path else name

    def _open(self, event: Any) -> None:
        top = self._stack[-1] if self._stack else None
        if top is not None and top.is_mapping and top.key is None:
            raise self._stop("a key that is no plain word", "write `key: value`", event.start_mark)
        if len(self._stack) >= _DEEPEST:
            raise self._stop(
                f"nested deeper than {_DEEPEST} levels", "write it flatter", event.start_mark
            )
        self._stack.append(_Open(path=self._child_path(), event=event))

    def _close(self, event: Any) -> None:
        closed = self._stack.pop()
        start, end = closed.event.start_mark, event.end_mark
        place = Place(line=start.line + 1, column=start.column + 1)
        length = max(1, end.column - start.column) if start.line == end.line else 1
        if closed.is_mapping:
            entries = closed.entries
            if closed.event.flow_style:
                entries, found = join_entries(closed.path, entries)
                self.mistakes += found
            entries = self._unique(closed.path, entries)
            self._add(Mapping(entries=tuple(entries), place=place, length=length))
            return
        items = closed.items
        if closed.event.flow_style:
            items, found = join_items(closed.path, items)
            self.mistakes += found
        self._add(Sequence(items=tuple(items), place=place, length=length))

    def _add(self, tree: Tree) -> None:
        if not self._stack:
            self._root = tree
            return
        top = self._stack[-1]
        if not top.is_mapping:
            top.items.append(tree)
        elif top.key is None:
            if isinstance(tree, Scalar):
                top.key = tree
        else:
            if isinstance(tree, Scalar) and tree.is_null and not tree.text:
                # Where nothing is written the parser points at what comes next.
                tree = replace(tree, place=top.key.place, length=top.key.length)
            top.entries.append(Entry(key=top.key, value=tree))
            top.key = None

    def _unique(self, path: str, entries: list[Entry]) -> list[Entry]:
        first: dict[str, Entry] = {}
        for entry in entries:
            key = entry.key
            if key.text in first:
                line = first[key.text].key.place.line
                self.mistakes.append(
                    Mistake(
                        path=f"{path}.{key.text}" if path else key.text,
                        line=key.place.line,
                        column=key.place.column,
                        length=key.length,
                        message=f"the key is given twice, first in line {line}",
                        fix="keep one of the two",
                    )
                )
            else:
                first[key.text] = entry
        return list(first.values())
