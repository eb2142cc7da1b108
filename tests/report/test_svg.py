"""Drawings that do not depend on the machine that draws them."""

import re
import runpy
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from armwright.report.elements import Card
from armwright.report.figures import Drawing, curves
from armwright.report.static_page import static_page
from armwright.report.svg import alike, inline_svg, normalize_svg

DOCS = Path(__file__).parents[2] / "docs"
DRAWINGS = sorted([*(DOCS / "gallery").glob("*.svg"), *(DOCS / "pictures").glob("*.svg")])
X = np.linspace(0.0, 1.0, 50)


def drawn(error: float = 0.0) -> str:
    """Draw two curves with an error in their last digits."""
    lines = {"first": np.sin(7 * X) * (1 + error), "second": np.cos(5 * X) * (1 - error)}
    return curves("Two curves", X * (1 + error), lines, x_label="time, s", y_label="of the limit")


def test_last_digits_do_not_show() -> None:
    """Curves whose numbers differ in the last digits, as on another machine, are one drawing; others are another."""
    first = drawn()

    assert all(alike(drawn(error), first) for error in (1e-15, -1e-12, 1e-9))
    assert not alike(drawn(1e-2), first)
    assert "Matplotlib v" not in first
    assert not alike(first.replace("stroke-width: 1.6", "stroke-width: 1.7"), first)


@pytest.mark.parametrize("drawing", DRAWINGS, ids=lambda path: path.stem)
def test_drawings_of_the_docs(drawing: Path) -> None:
    """The drawings of the docs are of that kind, and every part that they name is there."""
    text = drawing.read_text(encoding="utf-8")

    assert normalize_svg(text) == text
    root = ET.fromstring(text)
    parts = {one.get("id") for one in root.iter() if one.get("id")}
    named = {value[1:] for one in root.iter() for key, value in one.attrib.items() if key.endswith("href")}
    clips = {one.get("clip-path")[5:-1] for one in root.iter() if one.get("clip-path")}  # type: ignore[index]
    assert named | clips <= parts


def test_the_gallery_keeps_a_picture(tmp_path: Path) -> None:
    """A picture of the gallery is written anew only where more than rounding has changed."""
    copied = runpy.run_path(str(DOCS / "make_gallery.py"))["copied"]
    new, picture = tmp_path / "new.svg", tmp_path / "picture.svg"
    new.write_text(drawn())
    kept = drawn().replace('d="M 0 302.4', 'd="M 0.01 302.4', 1)
    picture.write_text(kept)
    copied(new, picture)
    assert picture.read_text() == kept != drawn()

    new.write_text(drawn(0.01))
    copied(new, picture)
    assert picture.read_text() == drawn(0.01)


def test_drawings_of_a_page_have_its_colours() -> None:
    """Ink is the text colour, the ground that of the card, series have variables; the file itself stays as it is."""
    file = drawn()
    inline = inline_svg(file, "one")

    assert "#ffffff" in file
    assert "#1f77b4" in file
    assert set(re.findall(r"(?:fill|stroke): ([^;\"]+)", inline)) == {
        "none",
        "currentColor",
        "var(--card)",
        "var(--c0)",
        "var(--c1)",
        *(f"color-mix(in srgb, currentColor {ink}%, var(--card))" for ink in (20, 31)),
    }
    # Without a name space, a style for all of the page, and the texts of the figure.
    assert not re.search(r"xmlns|xlink|<style|<!--|<\?xml", inline)


def test_drawings_of_a_page_share_no_identifiers() -> None:
    """Every part that a drawing of a page names is its own."""
    texts = [inline_svg(drawn(), name) for name in ("one", "two")]
    own = [set(re.findall(r'id="([^"]*)"', text)) for text in texts]

    assert not own[0] & own[1]
    for text, parts in zip(texts, own, strict=True):
        named = set(re.findall(r'href="#([^"]*)"|url\(#([^)]*)\)', text))
        assert {a or b for a, b in named} == parts


def test_a_caption_is_a_text() -> None:
    element = Drawing("one", '"><script>', drawn()).element

    assert "<script>" not in element
    assert element.count("&quot;&gt;&lt;script&gt;") == 2


@pytest.mark.browser
def test_nothing_white_in_the_dark(browser) -> None:
    """On a dark page no shape of a drawing is white, and its letters are light."""
    page = browser.new_page(color_scheme="dark")
    page.set_content(
        static_page(title="A", command="a", sections=[Card("Figures", Drawing("one", "A", drawn()).element)])
    )
    fills = page.evaluate("[...document.querySelectorAll('figure svg *')].map(e => getComputedStyle(e).fill)")
    letters = page.evaluate("getComputedStyle(document.querySelector('figure svg use[href*=DejaVu]')).fill")
    page.close()

    assert "rgb(255, 255, 255)" not in fills
    assert "rgb(26, 32, 41)" in fills
    assert letters == "rgb(228, 233, 239)"
