"""The page's markup as a tree, for what is made from the page."""

from __future__ import annotations

from html.parser import HTMLParser
from xml.etree import ElementTree as ET

_VOID = frozenset({"meta", "br", "line", "rect", "polyline", "polygon"})


def read_page(page: str) -> ET.Element:
    """Read report.html into a tree.

    Parameters
    ----------
    page : str
        As ``render_html`` gives it: every element is closed.

    Returns
    -------
    Element
        The ``html`` element.
    """
    reader = _Reader()
    reader.feed(page)
    reader.close()
    return reader.root


def classes(element: ET.Element) -> frozenset[str]:
    """List the classes of an element."""
    return frozenset((element.get("class") or "").split())


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.root = ET.Element("html")
        self._open = [self.root]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "html":
            return
        # The parser writes every name small; SVG knows this one by its large letter.
        names = {"viewbox": "viewBox", "preserveaspectratio": "preserveAspectRatio"}
        given = {names.get(name, name): value or "" for name, value in attrs}
        child = ET.SubElement(self._open[-1], tag, given)
        if tag not in _VOID:
            self._open.append(child)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in _VOID:
            self._open.pop()

    def handle_endtag(self, tag: str) -> None:
        if tag not in _VOID and tag != "html":
            self._open.pop()

    def handle_data(self, data: str) -> None:
        parent = self._open[-1]
        if len(parent):
            parent[-1].tail = (parent[-1].tail or "") + data
        else:
            parent.text = (parent.text or "") + data
