"""MathML of the page as formulas of typst: what prints the page also prints the PDF."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from xml.etree import ElementTree as ET

_SIGNS = {
    "=": "=",
    "+": "+",
    "-": "minus",
    "\N{MINUS SIGN}": "minus",
    "(": "(",
    ")": ")",
    "[": "bracket.l",
    "]": "bracket.r",
    "{": "brace.l",
    "}": "brace.r",
    "|": "bar.v",
    ",": "comma",
    "/": "slash",
    "*": "ast",
    "!": "excl",
    "<": "lt",
    ">": "gt",
    "\N{LESS-THAN OR EQUAL TO}": "lt.eq",
    "\N{GREATER-THAN OR EQUAL TO}": "gt.eq",
    "\N{MIDDLE DOT}": "dot.op",
    "\N{DOT OPERATOR}": "dot.op",
    "\N{PLUS-MINUS SIGN}": "plus.minus",
    "\N{HORIZONTAL ELLIPSIS}": "dots.h",
    "\N{MIDLINE HORIZONTAL ELLIPSIS}": "dots.c",
    "\N{N-ARY SUMMATION}": "sum",
    "\N{PRIME}": "prime",
    "\N{INFINITY}": "infinity",
}
_INVISIBLE = frozenset("\N{FUNCTION APPLICATION}\N{INVISIBLE TIMES}")
_OVER = {"^": "hat", "\N{DOT ABOVE}": "dot", "\N{HORIZONTAL BAR}": "overline"}


def quoted(text: str) -> str:
    """Write a text as typst's string literal.

    Parameters
    ----------
    text : str
        Any text.

    Returns
    -------
    str
        In quotation marks; nothing in it is read as markup.
    """
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def equation(mathml: ET.Element) -> str:
    """Write a formula in typst's language for mathematics.

    Parameters
    ----------
    mathml : Element
        A ``math`` element of the page.

    Returns
    -------
    str
        What stands between two dollar signs.
    """
    return _row(mathml)


def _row(element: ET.Element) -> str:
    parts = list(element)
    bars = len(parts) > 2 and all(_sign(part) == "|" for part in (parts[0], parts[-1]))
    if bars and sum(_sign(part) == "|" for part in parts) == 2:
        inner = " ".join(_part(part) for part in parts[1:-1])
        return f"lr(bar.v {inner} bar.v)"
    return " ".join(text for text in map(_part, parts) if text)


def _sign(element: ET.Element) -> str:
    return (element.text or "").strip() if element.tag == "mo" else ""


def _part(element: ET.Element) -> str:
    tag, text = element.tag, (element.text or "").strip()
    parts = list(element)
    if tag == "mi":
        return text if len(text) == 1 else f"op({quoted(text)})"
    if tag == "mn":
        return quoted(text)
    if tag == "mtext":
        return f"upright({quoted(element.text or '')})"
    if tag == "mo":
        return _operator(text)
    if tag == "mspace":
        return "thin"
    if tag == "mfrac":
        above, below = _group(parts[0]), _group(parts[1])
        if element.get("linethickness") == "0":
            return f"vec(delim: #none, {above}, {below})"
        return f"frac({above}, {below})"
    if tag == "msqrt":
        return f"sqrt({_row(element)})"
    if tag == "mroot":
        return f"root({_group(parts[1])}, {_group(parts[0])})"
    if tag in {"msub", "msup", "msubsup"}:
        return _attached(tag, parts)
    if tag in {"mover", "munder", "munderover"}:
        return _stacked(tag, parts)
    if tag == "mtable":
        rows = ("; ".join(", ".join(_group(cell) for cell in row) for row in parts),)
        return f"mat(delim: #none, {rows[0]})"
    return _row(element)


def _operator(text: str) -> str:
    if text in _SIGNS:
        return _SIGNS[text]
    if not text or text in _INVISIBLE:
        return ""
    return f"op({quoted(text)})" if text.isalpha() and len(text) > 1 else quoted(text)


def _group(element: ET.Element) -> str:
    """Write an argument of a function: never empty."""
    return _part(element) or '""'


def _attached(tag: str, parts: list[ET.Element]) -> str:
    places = {"msub": ("b",), "msup": ("t",), "msubsup": ("b", "t")}[tag]
    around = ", ".join(
        f"{place}: {_group(part)}" for place, part in zip(places, parts[1:], strict=True)
    )
    return f"attach({_group(parts[0])}, {around})"


def _stacked(tag: str, parts: list[ET.Element]) -> str:
    base, mark = _group(parts[0]), "".join(parts[1].itertext()).strip()
    if tag == "mover" and mark in _OVER:
        return f"{_OVER[mark]}({base})"
    if tag == "munder" and _OVER.get(mark) == "overline":
        return f"underline({base})"
    places = {"mover": ("t",), "munder": ("b",), "munderover": ("b", "t")}[tag]
    around = ", ".join(
        f"{place}: {_group(part)}" for place, part in zip(places, parts[1:], strict=True)
    )
    return f"attach(limits({base}), {around})"
