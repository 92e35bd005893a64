"""Which names an expression may use, and which names a plant may not give away."""

from __future__ import annotations

import keyword
import re
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


VARIADIC: Final = 0
"""Arity of a function that takes two or more arguments."""

FUNCTIONS: Final[dict[str, int]] = {
    "exp": 1,
    "sinh": 1,
    "cosh": 1,
    "tanh": 1,
    "atan": 1,
    "asinh": 1,
    "sign": 1,
    "log": 1,
    "abs": 1,
    "sin": 1,
    "cos": 1,
    "tan": 1,
    "sqrt": 1,
    "min": VARIADIC,
    "max": VARIADIC,
}
"""Canonical function name to arity: the rows of the table in docs/theory.md section 1."""

ALIASES: Final[dict[str, str]] = {"Abs": "abs", "ln": "log", "Min": "min", "Max": "max"}
"""Other spellings that users bring along, to the canonical name."""

CONSTANTS: Final = frozenset({"pi", "E"})

BRANCHES: Final = "Piecewise"

_C_KEYWORDS: Final = _words(
    # C99, C11 and C++: the generated header is read by both kinds of compiler.
    """
    alignas alignof and_eq asm auto bitand bitor bool break case catch char char8_t char16_t
    char32_t compl concept const const_cast consteval constexpr constinit continue co_await
    co_return co_yield decltype default delete do double dynamic_cast else enum explicit export
    extern false float for friend goto if inline int long mutable namespace new noexcept not_eq
    nullptr operator or_eq private protected public register reinterpret_cast requires restrict
    return short signed sizeof static static_assert static_cast struct switch template this
    thread_local throw true try typedef typeid typename typeof union unsigned using virtual void
    volatile wchar_t xor xor_eq NULL NAN INFINITY EOF errno main
    """
)

KEYWORDS: Final = frozenset(keyword.kwlist) | _C_KEYWORDS

LIBRARY_HEADERS: Final = _words(
    # include/NAME.h of such a plant would hide the compiler's own header.
    """
    assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal
    stdalign stdarg stdatomic stdbool stddef stdint stdio stdlib string tgmath threads time
    uchar unistd wchar wctype
    """
)

RESERVED: Final = (
    frozenset({"t", "u", "y_d", BRANCHES})
    | CONSTANTS
    | frozenset(FUNCTIONS)
    | frozenset(ALIASES)
    | KEYWORDS
)
"""Names that no state and no parameter may have."""

_IDENTIFIER: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,30}\Z")
_PLANT_NAME: Final = re.compile(r"[a-z][a-z0-9_]{0,23}\Z")


def is_identifier(name: str) -> bool:
    """Whether a state or parameter may be spelled so (reserved words are another matter)."""
    return _IDENTIFIER.match(name) is not None


def is_plant_name(name: str) -> bool:
    """Whether a plant may be spelled so: the prefix of every generated symbol."""
    return _PLANT_NAME.match(name) is not None


def is_library_header(name: str) -> bool:
    """Whether NAME.h is a header of the C library."""
    return name in LIBRARY_HEADERS


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return the known name that is closest to a mistyped one, or an empty string.

    Case alone never keeps two names apart here: ``Sin`` is answered with ``sin``.
    """
    from difflib import get_close_matches

    candidates = sorted(set(known))
    folded = {candidate.lower(): candidate for candidate in reversed(candidates)}
    if name.lower() in folded:
        return folded[name.lower()]
    close = get_close_matches(name.lower(), sorted(folded), n=1, cutoff=0.6)
    return folded[close[0]] if close else ""
