"""The tree, walked along the schema: every value typed, every mistake noted with its place."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bfppc_synth.expressions.names import did_you_mean
from bfppc_synth.expressions.resolution import lower_bound, upper_bound
from bfppc_synth.model.spec import Interval, Objective
from bfppc_synth.spec import scalars
from bfppc_synth.spec.availability import is_unavailable
from bfppc_synth.spec.kinds import (
    Choice,
    Coverage,
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
    Rule,
    Section,
    StateNames,
    Text,
    Units,
)
from bfppc_synth.spec.naming import read_parameter_names, read_states, visible_names
from bfppc_synth.spec.schema import PLANT
from bfppc_synth.spec.tree import Mapping, Scalar, Sequence, Style

if TYPE_CHECKING:
    from bfppc_synth.spec.kinds import Field, Kind
    from bfppc_synth.spec.notebook import Notebook
    from bfppc_synth.spec.tree import Entry, Tree

_LEAVE_OUT = "remove it, or choose another value"


class Reader:
    """Reads a whole plant file; states and parameters first, whatever their order."""

    def __init__(self, book: Notebook, root: Mapping) -> None:
        self._book = book
        self._root = root
        self.states: tuple[str, ...] = ()
        self.parameters: tuple[str, ...] = ()

    def read(self) -> None:
        """Walk over the file."""
        self._book.visit("", self._root)
        names = self._root.get("states")
        if names is not None:
            self.states = read_states(self._book, names)
        parameters = self._root.get("parameters")
        if parameters is not None:
            self.parameters = read_parameter_names(self._book, parameters, self.states)
        self._section("", self._root, PLANT)

    def _value(self, path: str, tree: Tree, kind: Kind) -> None:
        book = self._book
        book.visit(path, tree)
        if isinstance(tree, Scalar) and is_unavailable(path, tree.text):
            book.blame(path, tree, f"{tree.text} is not available in this version", _LEAVE_OUT)
            return
        match kind:
            case Number(rule=rule):
                book.note(path, scalars.read_constant(book, path, tree, rule))
            case Integer():
                book.note(path, scalars.read_integer(book, path, tree, kind))
            case Choice():
                book.note(path, scalars.read_choice(book, path, tree, kind))
            case Text(form=form):
                book.note(path, scalars.read_text(book, path, tree, form))
            case Formula(scope=scope):
                names, elsewhere = visible_names(path, scope, self.states, self.parameters)
                book.note(path, scalars.read_expression(book, path, tree, names, elsewhere))
            case Range():
                book.note(path, self._range(path, tree))
            case Numbers():
                self._numbers(path, tree, kind)
            case Section():
                self._section(path, tree, kind)
            case ListOf():
                self._listed(path, tree, kind)
            case PerState():
                self._per_state(path, tree, kind)
            case OneOrPerState(item=item):
                self._one_or_per_state(path, tree, item)
            case Either():
                self._either(path, tree, kind)
            case Parameters():
                self._by_name(path, tree, Range(), self.parameters)
            case Units():
                allowed = (*self.states, *self.parameters, "u")
                self._by_name(path, tree, Text(), allowed)
            case StateNames():
                pass

    def _mapping(self, path: str, tree: Tree, wanted: str) -> Mapping | None:
        if isinstance(tree, Mapping):
            return tree
        if isinstance(tree, Scalar) and tree.style is Style.BROKEN:
            return None
        if isinstance(tree, Scalar):
            found = "nothing" if tree.is_null else tree.text.partition("\n")[0]
        else:
            found = "a list"
        self._book.blame(path, tree, f"{found} where {wanted} belongs", f"write {wanted}")
        return None

    def _section(self, path: str, tree: Tree, section: Section) -> None:
        keys = ", ".join(field.key for field in section.fields)
        mapping = self._mapping(path, tree, f"a mapping with the keys {keys}")
        if mapping is None:
            return
        for entry in mapping.entries:
            field = section.field(entry.key.text)
            if field is None:
                self._unknown_key(path, entry, [item.key for item in section.fields])
            elif is_unavailable(_join(path, field.key), ""):
                if not self._method_refused():
                    message = "not available in this version"
                    self._book.blame(_join(path, field.key), entry.key, message, _LEAVE_OUT)
            else:
                self._value(_join(path, field.key), entry.value, field.kind)
        for field in section.fields:
            if field.required and mapping.get(field.key) is None:
                if field.key == Objective.ACCURACY and self._finds(Objective.ACCURACY):
                    continue
                self._missing(path, mapping, field)

    def _finds(self, word: Objective) -> bool:
        # The objective stands elsewhere in the file, and may come later.
        synthesis = self._root.get("synthesis")
        given = synthesis.get("objective") if isinstance(synthesis, Mapping) else None
        if isinstance(given, Mapping):
            return given.get(word) is not None
        return isinstance(given, Scalar) and given.text == word

    def _method_refused(self) -> bool:
        # The keys of theorem1 and theorem3 need no second complaint beside their method's.
        synthesis = self._root.get("synthesis")
        method = synthesis.get("method") if isinstance(synthesis, Mapping) else None
        return isinstance(method, Scalar) and is_unavailable("synthesis.method", method.text)

    def _missing(self, path: str, mapping: Mapping, field: Field) -> None:
        fix = f"add `{field.key}:`, {field.description}"
        # One column is underlined: what is missing has no place of its own.
        column = mapping.place.column
        self._book.blame_part(
            path, mapping, f"the key {field.key} is missing", fix, column=column, length=1
        )

    def _unknown_key(
        self, path: str, entry: Entry, known: list[str], message: str = "unknown key"
    ) -> None:
        name = entry.key.text.partition("\n")[0]
        guess = did_you_mean(name, known)
        fix = f"did you mean {guess}?" if guess else "known here: " + ", ".join(known)
        if name.isdigit():
            # In flow style `step: 0,001` ends the value at the comma.
            message, fix = "a comma ends the value before it", "write decimals with a point: 0.001"
        self._book.blame(_join(path, name), entry.key, message, fix)

    def _range(self, path: str, tree: Tree) -> Interval | None:
        if not isinstance(tree, Sequence):
            number = scalars.read_constant(self._book, path, tree, Rule.ANY)
            return None if number is None else Interval(lower=number, upper=number)
        if len(tree.items) != 2:
            count = len(tree.items)
            self._book.blame(
                path, tree, f"{count} numbers where [lower, upper] belongs", "give two ends"
            )
            return None
        ends = [scalars.read_constant(self._book, path, item, Rule.ANY) for item in tree.items]
        lower, upper = ends
        if lower is None or upper is None:
            return None
        if lower_bound(lower) > upper_bound(upper):
            message = f"the lower end {lower.text} is above the upper end {upper.text}"
            self._book.blame(path, tree, message, f"write [{upper.text}, {lower.text}]")
            return None
        return Interval(lower=lower, upper=upper)

    def _numbers(self, path: str, tree: Tree, kind: Numbers) -> None:
        wanted = f"a list of at least {kind.fewest} numbers"
        if not isinstance(tree, Sequence):
            self._book.blame(
                path, tree, f"a single value where {wanted} belongs", f"write {wanted}"
            )
            return
        if len(tree.items) < kind.fewest:
            self._book.blame(
                path, tree, f"{len(tree.items)} numbers where {wanted} belongs", f"write {wanted}"
            )
            return
        found = []
        for index, item in enumerate(tree.items):
            self._book.visit(f"{path}.{index}", item)
            found.append(scalars.read_constant(self._book, path, item, kind.rule))
        complete = tuple(number for number in found if number is not None)
        if len(complete) == len(found):
            self._book.note(path, complete)

    def _listed(self, path: str, tree: Tree, kind: ListOf) -> None:
        if not isinstance(tree, Sequence):
            self._book.blame(
                path,
                tree,
                f"a single value where a list belongs, {kind.wanted} each",
                "write a list",
            )
            return
        for index, item in enumerate(tree.items):
            self._value(f"{path}.{index}", item, kind.item)

    def _by_name(self, path: str, tree: Tree, item: Kind, known: tuple[str, ...]) -> None:
        mapping = self._mapping(path, tree, "a mapping by name")
        for entry in mapping.entries if mapping is not None else ():
            if entry.key.text in known:
                self._value(_join(path, entry.key.text), entry.value, item)
            elif self.states and not isinstance(item, Range):
                self._unknown_key(path, entry, list(known))

    def _per_state(self, path: str, tree: Tree, kind: PerState) -> None:
        mapping = self._mapping(path, tree, "a mapping by state")
        if mapping is None or not self.states:
            return
        besides = {field.key: field.kind for field in kind.besides}
        for entry in mapping.entries:
            key = entry.key.text
            if key in self.states:
                self._value(_join(path, key), entry.value, kind.item)
            elif key in besides:
                self._value(_join(path, key), entry.value, besides[key])
            else:
                self._unknown_key(path, entry, [*self.states, *besides], "no such state")
        self._require_all(path, mapping, kind)

    def _require_all(self, path: str, mapping: Mapping, kind: PerState) -> None:
        if kind.coverage is Coverage.SOME:
            return
        for state in self.states:
            if mapping.get(state) is None:
                column = mapping.place.column
                self._book.blame_part(
                    path,
                    mapping,
                    f"the state {state} is missing",
                    f"add `{state}:`",
                    column=column,
                    length=1,
                )

    def _one_or_per_state(self, path: str, tree: Tree, item: Kind) -> None:
        if not self.states:
            return
        if isinstance(tree, Sequence):
            if len(tree.items) != len(self.states):
                message = f"{len(tree.items)} entries for {len(self.states)} states"
                self._book.blame(path, tree, message, "write one for all, or one per state")
                return
            self._book.spread(path)
            for state, value in zip(self.states, tree.items, strict=True):
                self._value(_join(path, state), value, item)
        elif isinstance(tree, Mapping) and self._is_by_state(tree, item):
            self._book.spread(path)
            self._per_state(path, tree, PerState(item=item, coverage=Coverage.ALL))
        else:
            self._value(path, tree, item)

    def _is_by_state(self, mapping: Mapping, item: Kind) -> bool:
        if not isinstance(item, Section):
            return True
        # A state may be called `rate`: what stands behind the key decides then.
        return any(
            entry.key.text in self.states
            and (item.field(entry.key.text) is None or isinstance(entry.value, Mapping))
            for entry in mapping.entries
        )

    def _either(self, path: str, tree: Tree, kind: Either) -> None:
        if not isinstance(tree, Mapping):
            self._value(path, tree, kind.scalar)
            return
        keys = {entry.key.text for entry in tree.entries}
        owners = [
            section for section in kind.sections if keys & {field.key for field in section.fields}
        ]
        self._section(path, tree, owners[0] if owners else kind.sections[-1])


def _join(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key
