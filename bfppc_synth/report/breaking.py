"""Long formulas in pieces: a browser breaks lines between formulas, never inside one."""

from __future__ import annotations

import re
from xml.etree import ElementTree as ET

_MATH = re.compile(r"<math.*?</math>", re.DOTALL)
# Signs and letters that fit on a line of a phone, about.
LONGEST_LINE = 34
# Shorter pieces stay with the one before them.
SHORTEST_PIECE = 9
_BREAKS = frozenset("=+<>") | {"\N{MINUS SIGN}", "\N{LESS-THAN OR EQUAL TO}"}
_BREAKS |= {"\N{GREATER-THAN OR EQUAL TO}"}


def broken(mathml: str) -> str:
    """Cut a displayed formula before its outermost relations and signs, if it is long.

    Parameters
    ----------
    mathml : str
        One ``math`` element.

    Returns
    -------
    str
        The same, or several ``math`` elements that follow one another, in display style if
        the one was displayed.
    """
    formula = ET.fromstring(mathml)  # noqa: S314  markup made by this package
    parts = list(formula)
    while len(parts) == 1 and parts[0].tag == "mrow":
        parts = list(parts[0])
    if width(formula) <= LONGEST_LINE or len(parts) < 3:
        return mathml
    pieces = _pieces(parts)
    if len(pieces) == 1:
        return mathml
    style = {"displaystyle": "true"} if formula.get("display") == "block" else {}
    return " ".join(_formula(piece, style) for piece in pieces)


def widest(markup: str) -> float:
    """Estimate how wide the widest of some formulas is, in letters."""
    found = (ET.fromstring(each[0]) for each in _MATH.finditer(markup))  # noqa: S314  our own
    return max((width(formula) for formula in found), default=0.0)


def width(element: ET.Element) -> float:
    """Estimate how wide a formula is, in letters; a fraction is as wide as its wider half."""
    parts = [width(part) for part in element]
    if element.tag == "mfrac":
        return max(parts)
    if element.tag in {"mover", "munder", "munderover"}:
        return max(parts)
    if element.tag in {"msub", "msup"}:
        return parts[0] + 0.7 * parts[1]
    if element.tag == "msubsup":
        return parts[0] + 0.7 * max(parts[1:])
    text = (element.text or "").strip()
    # A place that a number takes later.
    if text.startswith("@"):
        return 7.0
    own = 2.0 if element.tag == "mo" and text in _BREAKS else float(len(text))
    return own + sum(parts)


def _pieces(parts: list[ET.Element]) -> list[list[ET.Element]]:
    pieces: list[list[ET.Element]] = [[]]
    depth = 0
    for part in parts:
        text = (part.text or "").strip() if part.tag == "mo" else ""
        depth += (text in {"(", "["}) - (text in {")", "]"})
        if depth == 0 and text in _BREAKS and _is_full(pieces[-1]) and not _starts(pieces[-1]):
            pieces.append([])
        pieces[-1].append(part)
    return pieces


def _is_full(piece: list[ET.Element]) -> bool:
    return sum(width(part) for part in piece) >= SHORTEST_PIECE


def _starts(piece: list[ET.Element]) -> bool:
    """Whether a sign would be its piece's second: x = -y is not cut between = and -."""
    return piece[-1].tag == "mo" and (piece[-1].text or "").strip() in _BREAKS


def _formula(piece: list[ET.Element], style: dict[str, str]) -> str:
    formula = ET.Element("math", style)
    row = ET.SubElement(formula, "mrow")
    first = piece[0]
    if first.tag == "mo" and len(piece) > 1 and (first.text or "").strip() in _BREAKS:
        first.set("form", "infix")
    row.extend(piece)
    return ET.tostring(formula, encoding="unicode")
