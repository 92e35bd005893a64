"""Text of an expression -> tokens with their columns, and the limits on numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from typing import Final

from bfppc_synth.errors import BfppcError

LONGEST_TEXT: Final = 4000
_LONGEST_NUMBER: Final = 320
_LARGEST_DECADE: Final = 300


class ExpressionError(BfppcError):
    """An expression that the grammar refuses.

    ``column`` counts from 1 in the expression's own text; ``length`` is how many characters
    are at fault.
    """

    exit_code = 2

    def __init__(self, message: str, *, column: int, fix: str, length: int = 1) -> None:
        self.message = message
        self.column = column
        self.length = max(1, length)
        self.fix = fix
        super().__init__(f"column {column}: {message} (fix: {fix})")


class TokenKind(StrEnum):
    """What a token is; END stands behind the last character."""

    NUMBER = "number"
    NAME = "name"
    SIGN = "sign"
    END = "end"


@dataclass(frozen=True, slots=True, kw_only=True)
class Token:
    """A token; ``start`` and ``end`` count characters from 0."""

    kind: TokenKind
    text: str
    start: int
    end: int


_TOKEN: Final = re.compile(
    r"(?P<number>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r"|(?P<sign>\*\*|<=|>=|==|!=|//|[-+*/^(),<>])"
)
_SPACE: Final = re.compile(r"[ \t\r\n]*")
_LOOKALIKES: Final = {
    "\u2212": "-",
    "\u2013": "-",
    "\u00b7": "*",
    "\u00d7": "*",
    "\u22c5": "*",
    "\u00f7": "/",
    "\u03c0": "pi",
    "\u00b2": "**2",
    "\u00b3": "**3",
    "\u221a": "sqrt(...)",
    "\u2264": "<=",
    "\u2265": ">=",
}
_REFUSED: Final = {
    "==": ("an equation has no place in an expression", "use <= or >= inside Piecewise"),
    "!=": ("an equation has no place in an expression", "use < or > inside Piecewise"),
    "=": ("an equation or a named argument has no place in an expression", "leave the name out"),
    "//": ("there is no rounding division", "write / for the quotient"),
    "%": ("there is no remainder", "write a smooth function, or Piecewise"),
    "[": ("brackets do not group here", "write parentheses"),
    "]": ("brackets do not group here", "write parentheses"),
    "{": ("braces do not group here", "write parentheses"),
    "}": ("braces do not group here", "write parentheses"),
    "&": ("conditions are single comparisons", "nest one Piecewise in another"),
    "|": ("conditions are single comparisons, and no size is written so", "write abs(...)"),
    ".": ("a dot belongs into a number", "write 0.5 or 5.0; nothing here has attributes"),
    "'": ("a quotation mark or a derivative mark has no place in an expression", "remove it"),
    '"': ("a quotation mark has no place in an expression", "remove it"),
    "!": ("there is no factorial", "write the product, or the number itself"),
}


def tokenize(text: str) -> tuple[Token, ...]:
    """Split an expression into tokens, the last one END.

    Raises
    ------
    ExpressionError
        If the text is too long or contains what no token begins with.
    """
    if len(text) > LONGEST_TEXT:
        raise ExpressionError(
            f"{len(text)} characters, more than the {LONGEST_TEXT} that are read",
            column=LONGEST_TEXT,
            fix="shorten it by naming parts of it as parameters",
        )
    tokens: list[Token] = []
    position = _skip(text, 0)
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None or match.group() in _REFUSED:
            raise _foreign(position, match.group() if match else text[position])
        kind = TokenKind(match.lastgroup or "sign")
        tokens.append(Token(kind=kind, text=match.group(), start=position, end=match.end()))
        position = _skip(text, match.end())
    tokens.append(Token(kind=TokenKind.END, text="", start=len(text), end=len(text)))
    return tuple(tokens)


def _skip(text: str, position: int) -> int:
    match = _SPACE.match(text, position)
    return match.end() if match else position


def _foreign(position: int, sign: str) -> ExpressionError:
    column = position + 1
    if sign in _REFUSED:
        message, fix = _REFUSED[sign]
        return ExpressionError(f"`{sign}`: {message}", column=column, length=len(sign), fix=fix)
    if not sign.isascii():
        # Python would fold a full-width letter into a plain one: two names for one state.
        ascii_sign = _LOOKALIKES.get(sign)
        fix = f"write {ascii_sign}" if ascii_sign else "use plain ASCII letters and signs"
        shown = sign if sign.isprintable() else f"U+{ord(sign):04X}"
        return ExpressionError(f"`{shown}` is no ASCII character", column=column, fix=fix)
    shown = sign if sign.isprintable() else f"U+{ord(sign):04X}"
    return ExpressionError(
        f"`{shown}` has no place in an expression", column=column, fix="remove it"
    )


def read_number(token: Token) -> Fraction:
    """Exact value of a NUMBER token, its size judged on the text alone.

    Raises
    ------
    ExpressionError
        If it has too many digits, lies outside 1e-300 to 1e300 or looks like an octal.
    """
    text, column, length = token.text, token.start + 1, token.end - token.start
    mantissa, _, exponent = text.lower().partition("e")
    if length > _LONGEST_NUMBER:
        raise ExpressionError(
            f"a number of {length} characters, more than {_LONGEST_NUMBER}",
            column=column,
            length=length,
            fix="round it: binary64 keeps 17 digits",
        )
    if text.isdigit() and len(text) > 1 and text[0] == "0":
        raise ExpressionError(
            f"{text} begins with 0, which is octal in some languages and decimal in others",
            column=column,
            length=length,
            fix=f"write {text.lstrip('0') or '0'}",
        )
    whole, _, fraction = mantissa.partition(".")
    digits = (whole + fraction).strip("0")
    if not digits:
        return Fraction(0)
    # 1e-9999999 is tiny in the file and endless as a fraction: the text is judged first.
    leading = len((whole + fraction).lstrip("0")) - len(fraction)
    decade = int(exponent or "0") + leading
    if not -_LARGEST_DECADE < decade <= _LARGEST_DECADE + 1:
        raise ExpressionError(
            f"{text if length < 30 else text[:30] + '...'} lies outside 1e-300 to 1e300",
            column=column,
            length=length,
            fix="choose other units",
        )
    scale = int(exponent or "0") - len(fraction)
    return Fraction(int(whole + fraction)) * Fraction(10) ** scale
