"""Pages that stand still: heading, notes, tables and figures."""

import re

import pytest

from armwright.files.result_table import ResultTable
from armwright.report.elements import table
from armwright.report.figures import Drawing
from armwright.report.static_page import static_page

NASTY = '</td><script>bite()</script>"&'
SVG = '<svg xmlns="http://www.w3.org/2000/svg"></svg>'


def page(**changes: object) -> str:
    told = {
        "title": "A page",
        "command": "armwright iso9283 <x>",
        "tables": [ResultTable(title="Errors", heads=("error", "mm"), rows=[("j1.d", "+0.12")], numbers=(1,))],
    }
    return static_page(**{**told, **changes})


def cards(text: str) -> list[str]:
    return re.findall(r'<section class="card" aria-label="([^"]*)">', text)


def test_parts_in_order() -> None:
    """The page has its tables in order, then its figures, and says what made it."""
    drawn = [Drawing("one", "A picture", SVG), Drawing("two", "Another", SVG)]
    tables = [ResultTable(title=name, heads=("x",), rows=[("1",)]) for name in ("First", "Second")]
    text = page(tables=tables, drawn=drawn)

    assert cards(text) == ["First", "Second", "Figures"]
    assert text.count("<img ") == 2
    assert "armwright iso9283 &lt;x&gt;</footer>" in text


def test_nothing_empty() -> None:
    """A table without rows is left out, and so are figures where there are none."""
    assert cards(page(tables=[ResultTable(title="Not fitted", heads=("error", "why"), rows=())])) == []


def test_asks_for_nothing() -> None:
    """A page that stands still has no script, and its policy allows none."""
    text = page()

    assert "<script" not in text
    assert "script-src" not in text
    assert "default-src 'none'" in text
    assert "http" not in text.replace("http-equiv", "")


def test_texts_stay_texts() -> None:
    """Whatever stands in a text is shown letter by letter and never obeyed."""
    text = page(
        title=NASTY,
        command=NASTY,
        notes=[NASTY],
        named=[("Arm", NASTY), (NASTY, "x")],
        verdict=(NASTY, False),
        tables=[ResultTable(title=NASTY, remark=NASTY, heads=(NASTY, "mm"), rows=[(NASTY, NASTY)])],
        drawn=[Drawing("one", NASTY, SVG)],
    )

    assert "<script" not in text
    assert NASTY not in text
    # Title twice, badge, fact and its name, note, card twice and its remark, head, two cells, caption twice, footer.
    assert text.count("&lt;/td&gt;&lt;script&gt;") == 15


def test_numbers_and_marks() -> None:
    """Numbers end at the right, heads above them too, and a row that is beyond its limit is marked."""
    rows = [("P1", "0.1"), ("P2", "0.3")]
    text = table(ResultTable(title="", heads=("pose", "AP"), rows=rows, numbers=(1,), marks=("holds", "over")))

    assert text.count('<th class="number">AP</th>') == 1
    assert text.count('<td class="number">') == 2
    assert re.findall(r"<tr([^>]*)><td>", text) == [' class="holds"', ' class="over"']


def test_rows_fit_heads() -> None:
    """A row with more texts than there are columns is a mistake of ours."""
    with pytest.raises(ValueError, match="longer"):
        table(ResultTable(title="", heads=("pose",), rows=[("P1", "0.1")]))
