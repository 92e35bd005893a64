"""One scalar of the plant file -> a number, an expression, a word; or one clear mistake."""

from __future__ import annotations

import re
import unicodedata
from typing import TYPE_CHECKING, Final

from bfppc_synth.expressions.names import (
    KEYWORDS,
    RESERVED,
    did_you_mean,
    is_identifier,
    is_library_header,
    is_plant_name,
)
from bfppc_synth.expressions.parse import ExpressionError, parse_constant, parse_expression
from bfppc_synth.spec.kinds import Parity, TextForm
from bfppc_synth.spec.tree import Mapping, Scalar, Style

if TYPE_CHECKING:
    from collections.abc import Collection
    from collections.abc import Mapping as Dictionary

    from bfppc_synth.model.expression import Constant, Expression
    from bfppc_synth.spec.kinds import Choice, Integer, Rule
    from bfppc_synth.spec.notebook import Notebook
    from bfppc_synth.spec.tree import Tree

_TRUTH: Final = frozenset({"true", "false", "yes", "no", "on", "off"})
_ENDLESS: Final = re.compile(r"[-+]?\.?(nan|inf|infinity)\Z", re.IGNORECASE)
_WHOLE: Final = re.compile(r"[-+]?[0-9]{1,20}\Z")
_LONGEST_LINE: Final = 200
_NOT_IN_COMMENTS: Final = ("*/", "/*", '"""', "\\", "??/")


def _readable(book: Notebook, path: str, tree: Tree, wanted: str) -> Scalar | None:
    """Return the scalar if there is one whose text may be looked at."""
    if not isinstance(tree, Scalar):
        kind = "a mapping" if isinstance(tree, Mapping) else "a list"
        book.blame(path, tree, f"{kind} where {wanted} belongs", f"write {wanted}")
        return None
    if tree.style is Style.BROKEN:
        return None
    if tree.is_null:
        book.blame(path, tree, f"no value where {wanted} belongs", "give one, or remove the key")
        return None
    return tree


def _blame_expression(book: Notebook, path: str, scalar: Scalar, error: ExpressionError) -> None:
    if scalar.offset is None:
        book.blame(path, scalar, error.message, error.fix)
        return
    column = scalar.place.column + scalar.offset + error.column - 1
    book.blame_part(path, scalar, error.message, error.fix, column=column, length=error.length)


def read_constant(book: Notebook, path: str, tree: Tree, rule: Rule) -> Constant | None:
    """Read a number or constant expression in range."""
    scalar = _readable(book, path, tree, "a number")
    if scalar is None or _is_foreign_value(book, path, scalar, "a number"):
        return None
    if scalar.style is not Style.PLAIN:
        book.blame(path, scalar, "a quoted text where a number belongs", "remove the quotes")
        return None
    try:
        constant = parse_constant(scalar.text)
    except ExpressionError as error:
        _blame_expression(book, path, scalar, error)
        return None
    value = constant.approximate if constant.exact is None else constant.exact
    if not rule.allows(value):
        book.blame(
            path, scalar, f"{scalar.text} where a number {rule} belongs", f"choose a number {rule}"
        )
        return None
    return constant


def read_expression(
    book: Notebook,
    path: str,
    tree: Tree,
    names: Collection[str],
    elsewhere: Dictionary[str, tuple[str, str]],
) -> Expression | None:
    """Read an expression in the given names."""
    scalar = _readable(book, path, tree, "an expression")
    if scalar is None or _is_foreign_value(book, path, scalar, "an expression"):
        return None
    try:
        return parse_expression(scalar.text, names=names, elsewhere=elsewhere)
    except ExpressionError as error:
        _blame_expression(book, path, scalar, error)
        return None


def _is_foreign_value(book: Notebook, path: str, scalar: Scalar, wanted: str) -> bool:
    if scalar.style is not Style.PLAIN:
        return False
    if scalar.text.lower() in _TRUTH:
        book.blame(
            path, scalar, f"the truth value {scalar.text} where {wanted} belongs", f"write {wanted}"
        )
        return True
    if _ENDLESS.match(scalar.text):
        book.blame(
            path, scalar, f"{scalar.text} is not finite where {wanted} belongs", f"write {wanted}"
        )
        return True
    return False


def read_integer(book: Notebook, path: str, tree: Tree, kind: Integer) -> int | None:
    """Read a whole number in range, odd where that is asked."""
    wanted = f"a whole number from {kind.lowest} to {kind.highest}"
    if kind.parity is Parity.ODD:
        wanted = f"an odd number from {kind.lowest} to {kind.highest}"
    scalar = _readable(book, path, tree, wanted)
    if scalar is None or _is_foreign_value(book, path, scalar, wanted):
        return None
    if scalar.style is not Style.PLAIN:
        book.blame(path, scalar, f"a quoted text where {wanted} belongs", "remove the quotes")
        return None
    number = int(scalar.text) if _WHOLE.match(scalar.text) else None
    if number is None or not kind.lowest <= number <= kind.highest:
        book.blame(path, scalar, f"{_short(scalar.text)} where {wanted} belongs", f"write {wanted}")
        return None
    if kind.parity is Parity.ODD and number % 2 == 0:
        near = number - 1 if number > kind.lowest else kind.lowest
        book.blame(
            path,
            scalar,
            f"{number} is even: e**{number} pushes the same way on both sides",
            f"choose an odd number such as {near} or {number + 1}",
        )
        return None
    return number


def read_choice(book: Notebook, path: str, tree: Tree, kind: Choice) -> str | None:
    """Read one of a few words."""
    wanted = "one of " + ", ".join(kind.words)
    scalar = _readable(book, path, tree, wanted)
    if scalar is None:
        return None
    if scalar.text in kind.words:
        return scalar.text
    guess = did_you_mean(scalar.text, kind.words)
    fix = f"did you mean {guess}?" if guess else f"write {wanted}"
    book.blame(path, scalar, f"{_short(scalar.text)} where {wanted} belongs", fix)
    return None


def read_text(book: Notebook, path: str, tree: Tree, form: TextForm) -> str | None:
    """Read the plant's name, or a line of text for people."""
    wanted = "a name" if form is TextForm.PLANT_NAME else "a text"
    scalar = _readable(book, path, tree, wanted)
    if scalar is None:
        return None
    if form is TextForm.PLANT_NAME:
        return _plant_name(book, path, scalar)
    text = scalar.text
    odd = [sign for sign in _NOT_IN_COMMENTS if sign in text]
    odd += [f"U+{ord(sign):04X}" for sign in text if unicodedata.category(sign)[0] == "C"]
    if odd:
        book.blame(
            path,
            scalar,
            f"{odd[0]} cannot stand in the comments of generated code",
            "write plain text on one line",
        )
        return None
    if len(text) > _LONGEST_LINE:
        book.blame(path, scalar, f"{len(text)} characters, more than {_LONGEST_LINE}", "shorten it")
        return None
    return text


def _plant_name(book: Notebook, path: str, scalar: Scalar) -> str | None:
    text = scalar.text
    if not is_plant_name(text):
        book.blame(
            path,
            scalar,
            f"{_short(text)} is no name of 1 to 24 small letters, digits and _, a letter first",
            "it becomes the prefix of every generated symbol: write my_plant",
        )
    elif text in KEYWORDS:
        book.blame(path, scalar, f"{text} is a word of C or Python", f"write {text}_plant")
    elif is_library_header(text):
        book.blame(path, scalar, f"{text}.h is a header of the C library", f"write {text}_plant")
    else:
        return text
    return None


def read_new_name(book: Notebook, path: str, tree: Tree, role: str) -> str | None:
    """Read the name of a state or parameter."""
    scalar = _readable(book, path, tree, f"the name of a {role}")
    if scalar is None:
        return None
    text = scalar.text
    if text in RESERVED:
        book.blame(path, scalar, f"{text} is reserved", f"rename the {role}, to {text}_1 say")
    elif not is_identifier(text):
        book.blame(
            path,
            scalar,
            f"{_short(text)} is no name: up to 31 letters, digits and _, a letter first",
            f"rename the {role}",
        )
    else:
        return text
    return None


def _short(text: str) -> str:
    line = text.partition("\n")[0]
    return line if len(line) <= 40 else line[:37] + "..."
