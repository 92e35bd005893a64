"""report.html as a reader's browser shows it: window and phone, light and dark, and on paper."""

from __future__ import annotations

import base64
import os
import re
from pathlib import Path

import pytest

from bfppc_synth.model.certificate import Verdict

ROOT = Path(__file__).parents[2]
FOLDERS = sorted(path.parent for path in (ROOT / "generated").glob("*/report.html"))
# One page, and one that is not certified; the others with BFPPC_TESTS=all.
EVERYTHING = os.environ.get("BFPPC_TESTS") == "all"
CHOSEN = [path for path in FOLDERS if path.name == "paper_example_2" or EVERYTHING]
REFUTED = ROOT / "generated" / "theorem1_example_1"
WINDOW, PHONE = 1280, 390
VIEWS = [(width, scheme) for width in (WINDOW, PHONE) for scheme in ("light", "dark")]
# A4 between margins of 15 mm, in CSS pixels.
PAPER = 680
# What reaches beyond the window, unless it stands in something that scrolls by itself.
OVERFLOW = """(() => {
  const width = document.documentElement.clientWidth;
  const scrolls = (element) => {
    for (let e = element.parentElement; e; e = e.parentElement)
      if (["auto", "scroll", "hidden"].includes(getComputedStyle(e).overflowX)) return true;
    return false;
  };
  const out = [...document.querySelectorAll("body *")].filter((e) => {
    const box = e.getBoundingClientRect();
    return box.width && box.right > width + 0.5 && !scrolls(e);
  });
  return {
    overflow: document.scrollingElement.scrollWidth - width,
    beyond: out.slice(0, 5).map((e) => e.outerHTML.slice(0, 120)),
  };
})()"""
RULES = """axe.run({exclude: [["math"]]}, {resultTypes: ["violations"]}).then((found) =>
  found.violations.map((v) => v.id + ": " + v.nodes.slice(0, 3).map((n) => n.html).join(" | ")))"""


@pytest.fixture(
    scope="module",
    params=[*((path, Verdict.CERTIFIED) for path in CHOSEN), (REFUTED, Verdict.REFUTED)],
    ids=lambda chosen: f"{chosen[0].name}-{chosen[1].value}",
)
def path(request, rendered):
    return rendered(*request.param)


@pytest.fixture(scope="module")
def page(path, browser):
    opened = browser.open(path, width=WINDOW)
    yield opened
    opened.close()


def test_a_page_asks_for_nothing_and_has_nothing_to_say(page, path):
    # Its own file, and the font that it carries.
    own, font = page.requests()
    assert own == path.resolve().as_uri()
    assert font.startswith("data:font/woff2;")
    assert page.messages() == []


def test_nothing_reaches_beyond_window_phone_and_paper(page):
    for width, media in ((WINDOW, "screen"), (PHONE, "screen"), (PAPER, "print")):
        page.show(width=width, media=media)
        assert page.run(OVERFLOW) == {"overflow": 0, "beyond": []}, (width, media)


@pytest.mark.parametrize(("width", "scheme"), VIEWS)
def test_a_picture_of_every_view_is_kept(page, path, screens, width, scheme):
    page.show(width=width, height=2000, scheme=scheme)
    # The first screens; with BFPPC_TESTS=all the page to its end.
    shot = page.ask("Page.captureScreenshot", format="png", captureBeyondViewport=EVERYTHING)
    picture = screens / f"{path.stem}-{width}-{scheme}.png"
    picture.write_bytes(base64.b64decode(shot["data"]))
    assert picture.stat().st_size > 10_000


def test_every_formula_is_laid_out_with_the_embedded_font(page):
    root = page.ask("DOM.getDocument", depth=0)["root"]["nodeId"]
    found = page.ask("DOM.querySelectorAll", nodeId=root, selector="math mi, math mn, math mo")
    nodes = found["nodeIds"]
    assert len(nodes) > 300
    fonts = {}
    for node in nodes[:: max(1, len(nodes) // 120)]:
        for font in page.ask("CSS.getPlatformFontsForNode", nodeId=node)["fonts"]:
            key = font["familyName"], font["isCustomFont"]
            fonts[key] = fonts.get(key, 0) + font["glyphCount"]
    assert set(fonts) == {("STIX Two Math", True)}


def test_a_page_in_the_dark_has_other_colours_and_keeps_its_plots_visible(page):
    page.show(width=WINDOW)

    def colours():
        return page.run(
            "[document.body, document.querySelector('.plot .tick')]"
            ".map((e) => getComputedStyle(e)).map((s) => s.backgroundColor + s.fill)"
        )

    light = colours()
    page.show(width=WINDOW, scheme="dark")
    assert all(a != b for a, b in zip(light, colours(), strict=True))


def test_a_page_prints_to_pdf_with_its_font(page, path, screens):
    # Paper is white, whatever the colours of the window were.
    page.show(width=WINDOW, scheme="dark", media="print")
    colours = page.run(
        "['body', '.verdict'].map((each) => getComputedStyle(document.querySelector(each)))"
        ".map((style) => style.backgroundColor)"
    )
    assert colours[0] == "rgb(255, 255, 255)"
    assert min(int(part) for part in re.findall(r"\d+", colours[1])) > 200
    pdf = base64.b64decode(page.ask("Page.printToPDF", printBackground=True)["data"])
    (screens / f"{path.stem}.pdf").write_bytes(pdf)
    assert pdf.startswith(b"%PDF-")
    assert re.search(rb"/FontName /[A-Z]{6}\+STIXTwoMath", pdf)
    # A page that overflowed would be shrunk to fit, or cut.
    assert len(re.findall(rb"/Type /Page\b", pdf)) > 3


def test_axe_finds_no_violation(page, path, axe):
    page.run(f"{axe}; 1")
    # One view a page, another one for each page; all views of all pages with BFPPC_TESTS=all.
    chosen = VIEWS if EVERYTHING else [VIEWS[0 if "refuted" in path.stem else 3]]
    for width, scheme in chosen:
        page.show(width=width, scheme=scheme)
        assert page.run(RULES) == [], (width, scheme)


def test_the_first_stop_of_the_keyboard_leads_past_the_list_of_sections(page):
    page.show(width=WINDOW)
    page.ask(
        "Input.dispatchKeyEvent", type="keyDown", key="Tab", code="Tab", windowsVirtualKeyCode=9
    )
    assert page.run("document.activeElement.className") == "skip"
    assert page.run("document.activeElement.getBoundingClientRect().left") == 0
