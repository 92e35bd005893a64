"""Which letters a formula contains: MathML in, keys of the glossary out."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

if TYPE_CHECKING:
    from collections.abc import Iterator

_MATH = re.compile(r"<math.*?</math>", re.DOTALL)
_ACCENTS = {"^": "hat", "\N{DOT ABOVE}": "dot", "\N{HORIZONTAL BAR}": "bar"}
# What stands above a letter and belongs to its name; everything else there is a power.
_MARKS = frozenset({"*", "\N{PRIME}", "(l)", "(j)", "(\N{GREEK SMALL LETTER MU})"})
_STEP = re.compile(r"\d+|[ijn](?:[\N{MINUS SIGN}+]1)?")
# Letters with an index of their own that is the number zero.
_ZEROS = frozenset("cv")


@dataclass(frozen=True, slots=True)
class Letter:
    """A letter as it stands: accent, stem, index and mark, each as text."""

    accent: str
    stem: str
    index: str
    mark: str

    @property
    def key(self) -> str:
        """The same with the number of its step as i, such as ``hat e_i`` or ``F_i*``."""
        index = self.index
        if not (index == "0" and self.stem in _ZEROS):
            index = ",".join(self._part(part) for part in index.split(",")) if index else ""
            # delta_{0,1} is the zeroth bound of step 1, H_{1,0} the zeroth coefficient of H_1.
            if self.index.startswith("0,"):
                index = "0,i"
            elif self.stem == "H" and "," in index:
                index = "i,j"
        accent = f"{self.accent} " if self.accent else ""
        return f"{accent}{self.stem}{'_' + index if index else ''}{self.mark}"

    @staticmethod
    def _part(part: str) -> str:
        return "i" if _STEP.fullmatch(part) else part


def letters(markup: str) -> tuple[Letter, ...]:
    """List the letters of every formula of a page or of a part of it, in reading order.

    Parameters
    ----------
    markup : str
        HTML; only what stands in ``math`` elements is read.

    Returns
    -------
    tuple[Letter, ...]
        Each once.
    """
    found = {letter: None for match in _MATH.finditer(markup) for letter in _of_formula(match[0])}
    return tuple(found)


@cache
def _of_formula(mathml: str) -> tuple[Letter, ...]:
    return tuple(_walk(ET.fromstring(mathml)))  # noqa: S314  markup made by this package


def _walk(element: ET.Element) -> Iterator[Letter]:
    if element.tag == "mrow" and len(element) == 1:
        yield from _walk(element[0])
        return
    single = _single(element)
    if single is not None:
        if any(sign.isalpha() for sign in single.stem):
            yield single
        if element.tag == "msubsup" and single.mark != _text(element[-1]):
            yield from _walk(element[-1])
        return
    for child in element:
        yield from _walk(child)


def _single(element: ET.Element) -> Letter | None:
    """Read an element that is one letter with all that belongs to it, else None."""
    tag, parts = element.tag, list(element)
    if tag == "mrow" and len(parts) == 1:
        return _single(parts[0])
    if tag == "mi":
        return Letter("", _text(element), "", "")
    if tag == "mtext":
        # Upright: a name or a word of the user, never a letter of the theory.
        return Letter("", f'"{_text(element)}"', "", "")
    if tag in {"mover", "munder"} and _text(parts[1]) in _ACCENTS:
        inner, accent = _single(parts[0]), _ACCENTS[_text(parts[1])]
        under = "under" if tag == "munder" else accent
        return inner and Letter(under, inner.stem, inner.index, inner.mark)
    if tag not in {"msub", "msubsup", "msup"}:
        return None
    base = _single(parts[0])
    if base is None:
        return None
    if tag == "msub":
        return Letter(base.accent, base.stem, _text(parts[1]), "")
    mark = _text(parts[-1])
    belongs = mark in _MARKS or (base.stem == "H" and mark == "0")
    if not belongs:
        # The exponent of x_1^N is walked through after its letter.
        return None if tag == "msup" else Letter(base.accent, base.stem, _text(parts[1]), "")
    index = _text(parts[1]) if tag == "msubsup" else base.index
    return Letter(base.accent, base.stem, index, mark)


def _text(element: ET.Element) -> str:
    return "".join(element.itertext()).strip()
