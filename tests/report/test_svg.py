"""Drawings that do not depend on the machine that draws them."""

import runpy
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from armwright.report.figures import curves
from armwright.report.svg import alike, normalize_svg

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
