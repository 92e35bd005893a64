"""The page as a document of typst: the same sections, tables, formulas and plots."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from bfppc_synth.report.markup import classes, read_page
from bfppc_synth.report.typst_math import equation, quoted

if TYPE_CHECKING:
    from collections.abc import Callable

# Colours of the plots: those of the page in the light.
_COLOURS = {
    "curve-1": "#0072b2",
    "curve-2": "#b34700",
    "curve-3": "#00805c",
    "curve-4": "#a8527f",
    "curve-5": "#6b5b00",
    "curve-6": "#4b4b9b",
    "rule": "#a61b1b",
    "start": "#00805c",
    "band": "#cce3f0",
}
_PLOT_STYLE = (
    "text{font-family:'Libertinus Serif'}.tick{font-size:12px;fill:#59616b}"
    ".axis{font-size:12.5px;fill:#1a1d21}.grid{stroke:#d5dae0;stroke-width:.75}"
    ".rule{stroke-width:1.5;fill:none;stroke-dasharray:7 4}polyline{fill:none;stroke-width:1.6}"
    ".start{stroke-width:6}.dashed{stroke-dasharray:5 3}"
) + "".join(
    f".{kind}{{{'fill' if kind == 'band' else 'stroke'}:{colour}}}"
    for kind, colour in _COLOURS.items()
)
_PREAMBLE = """\
#set document(title: {title}, date: none)
#set page(paper: "a4", margin: 18mm, numbering: "1 / 1")
#set text(size: 9.5pt, lang: "en")
#set par(spacing: 0.8em)
#set table(stroke: (x, y) => (bottom: 0.4pt + luma(190)), inset: (x: 3pt, y: 3pt))
#set math.equation(numbering: none)
#show math.equation.where(block: true): set align(left)
#show heading: set block(above: 1.3em, below: 0.7em, sticky: true)
#show table: set text(size: 8pt)
"""
_LEFT_OUT = frozenset({"nav", "head", "style", "title", "desc"})
_BARE = frozenset({"section", "main", "header", "footer", "body", "html", "span", "tbody", "a"})


def typst_source(page: str) -> str:
    """Write the page in the language of typst.

    Parameters
    ----------
    page : str
        report.html as ``render_html`` gives it.

    Returns
    -------
    str
        Source of one document, the same text for the same page; no text of the page is read
        as markup.
    """
    root = read_page(page)
    title = root.find("head/title")
    head = _PREAMBLE.format(title=quoted(_text(title) if title is not None else ""))
    body = root.find("body")
    return head + ("" if body is None else _children(body)) + "\n"


def _text(element: ET.Element) -> str:
    return "".join(element.itertext())


def _plain(text: str | None) -> str:
    """Write running text: white space as the browser would show it."""
    if not text:
        return ""
    words = " ".join(text.split())
    left = " " if text[0].isspace() else ""
    right = " " if words and text[-1].isspace() else ""
    return f"#{quoted(left + words + right)};" if words else (" " if left else "")


def _children(element: ET.Element) -> str:
    parts = [_plain(element.text)]
    for child in element:
        parts += [_element(child), _plain(child.tail)]
    return "".join(parts)


def _element(element: ET.Element) -> str:
    tag, kinds = element.tag, classes(element)
    if tag in _LEFT_OUT or "skip" in kinds:
        return ""
    if tag in _WRITERS:
        return _WRITERS[tag](element)
    if tag == "div":
        for kind, write in _BOXES.items():
            if kind in kinds:
                return write(element)
    inner = _children(element)
    if tag == "span" and "small" in kinds:
        return f"#text(size: 8.5pt, fill: luma(80))[{inner}]"
    if tag in _BARE or tag == "div":
        return inner
    return f"#block[{inner}]\n"


def _heading(element: ET.Element) -> str:
    level = int(element.tag[1])
    return f"#heading(level: {level})[{_children(element)}]\n"


def _paragraph(element: ET.Element) -> str:
    inner = _children(element)
    if "verdict" in classes(element):
        inner = f"#strong[{inner}]"
    if "soft" in classes(element):
        inner = f"#text(fill: luma(80))[{inner}]"
    return f"#block[{inner}]\n"


def _list(element: ET.Element) -> str:
    items = ", ".join(f"[{_children(item)}]" for item in element)
    mark = "marker: none, " if "legend" in classes(element) else ""
    return f"#list({mark}{items})\n"


def _letters(element: ET.Element) -> str:
    cells = []
    for row in element:
        cells += [f"[{_children(part)}]" for part in row]
    return (
        "#block(text(size: 8.5pt, grid(columns: (auto, 1fr, auto, 1fr), gutter: 5pt,"
        f" {', '.join(cells)})))\n"
    )


def _table(element: ET.Element) -> str:
    caption = element.find("caption")
    head = [cell for row in element.findall("thead/tr") for cell in row]
    rows = [list(row) for row in element.findall("tbody/tr")]
    count = max([len(head), *(len(row) for row in rows)], default=1)
    cells = [f"[{_children(cell)}]" for row in rows for cell in _filled(row, count)]
    top = ", ".join(f"[#strong[{_children(cell)}]]" for cell in head)
    title = _children(caption) if caption is not None else ""
    return (
        f"#block(sticky: true, text(fill: luma(80))[{title}])\n"
        f"#table(columns: {count}, table.header({top}), {', '.join(cells)})\n"
    )


def _filled(row: list[ET.Element], count: int) -> list[ET.Element]:
    return [*row, *(ET.Element("td") for _ in range(count - len(row)))]


def _formula(element: ET.Element) -> str:
    """Write a displayed formula; its pieces stay in one line and break where they must."""
    soft = "soft" in classes(element)
    inner = " ".join(f"$display({equation(part)})$" for part in element.iter("math"))
    # A line is as tall as its fractions.
    edges = 'top-edge: "bounds", bottom-edge: "bounds"'
    return f"#block[#text({edges}, fill: luma({80 if soft else 0}))[{inner}]]\n"


def _constant(element: ET.Element) -> str:
    left, right = list(element)
    cells = f"[{_children(left)}], [{_children(right)}]"
    return f"#block(grid(columns: (32%, 1fr), gutter: 8pt, {cells}))\n"


def _claim(element: ET.Element) -> str:
    box = "stroke: 0.4pt + luma(190), inset: 6pt, radius: 2pt, width: 100%, breakable: false"
    return f"#block({box})[{_children(element)}]\n"


def _figure(element: ET.Element) -> str:
    return f"#block(breakable: false)[{_children(element)}]\n"


def _banner(element: ET.Element) -> str:
    return f"#block(stroke: 1pt + red, inset: 6pt, width: 100%)[{_children(element)}]\n"


def _shares(element: ET.Element) -> str:
    cells = []
    for part in element:
        if part.tag == "svg":
            bar = part.find("rect")
            share = float(bar.get("width", "0")) if bar is not None else 0.0
            cells.append(f'[#rect(width: {100 * share:.2f}%, height: 6pt, fill: rgb("5b93c5"))]')
        else:
            cells.append(f"[{_children(part)}]")
    return f"#block(grid(columns: (auto, 5em, 1fr), gutter: 6pt, {', '.join(cells)}))\n"


def _drawing(element: ET.Element) -> str:
    if "plot" not in classes(element):
        return _swatch(element)
    copy = ET.fromstring(ET.tostring(element))  # noqa: S314  markup of this package
    copy.set("xmlns", "http://www.w3.org/2000/svg")
    style = ET.Element("style")
    style.text = _PLOT_STYLE
    copy.insert(0, style)
    alternative = element.find("desc")
    text = _text(alternative) if alternative is not None else ""
    source = quoted(ET.tostring(copy, encoding="unicode"))
    return f'#image(bytes({source}), format: "svg", width: 12cm, alt: {quoted(text)})\n'


def _swatch(element: ET.Element) -> str:
    """Draw the sample of a curve in the legend."""
    kinds = classes(element[0])
    colour = next((_COLOURS[kind] for kind in sorted(kinds) if kind in _COLOURS), "#000000")
    paint = f'rgb("{colour}")'
    if element[0].tag == "rect":
        return f"#box(rect(width: 1.8em, height: 0.6em, fill: {paint}));#h(0.4em)"
    dash = "dashed" if kinds & {"dashed", "rule"} else "solid"
    stroke = f'(paint: {paint}, thickness: 1.2pt, dash: "{dash}")'
    return f"#box(baseline: -0.25em, line(length: 1.8em, stroke: {stroke}));#h(0.4em)"


def _code(element: ET.Element) -> str:
    return f"#raw({quoted(_text(element))})"


def _listing(element: ET.Element) -> str:
    return f"#block(fill: luma(245), inset: 6pt, width: 100%, raw({quoted(_text(element))}))\n"


_WRITERS: dict[str, Callable[[ET.Element], str]] = {
    "h1": _heading,
    "h2": _heading,
    "h3": _heading,
    "p": _paragraph,
    "ul": _list,
    "dl": _letters,
    "table": _table,
    "svg": _drawing,
    "code": _code,
    "pre": _listing,
    "article": _claim,
    "figure": _figure,
    "math": lambda element: f"${equation(element)}$",
    "strong": lambda element: f"#strong[{_children(element)}]",
    "br": lambda _: "#linebreak()",
}
_BOXES: dict[str, Callable[[ET.Element], str]] = {
    "formula": _formula,
    "constant": _constant,
    "banner": _banner,
    "shares": _shares,
}
