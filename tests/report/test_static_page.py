"""Pages that stand still: heading, headline numbers, notes, sections of tables and figures."""

import re

import pytest

from armwright.files.result_table import ResultTable
from armwright.report.elements import Card, Tile, downloads, figures, length_text, pairs, table, table_cards
from armwright.report.figures import Drawing
from armwright.report.static_page import static_page

NASTY = '</td><script>bite()</script>"&'
SVG = '<svg xmlns="http://www.w3.org/2000/svg"></svg>'


def page(**changes: object) -> str:
    told = {
        "title": "A page",
        "command": "armwright iso9283 <x>",
        "sections": table_cards(
            [ResultTable(title="Errors", heads=("error", "mm"), rows=[("j1.d", "+0.12")], numbers=(1,))]
        ),
    }
    return static_page(**{**told, **changes})


def cards(text: str) -> list[str]:
    return re.findall(r'<section class="card" id="part-\d+" aria-label="([^"]*)">', text)


def test_parts_in_order() -> None:
    """The page has its numbers, then its sections in order with links to them, and says what made it."""
    drawn = [Drawing("one", "A picture", SVG), Drawing("two", "Another", SVG)]
    tables = table_cards([ResultTable(title=name, heads=("x",), rows=[("1",)]) for name in ("First", "Second")])
    text = page(sections=[*tables, Card("Figures", figures(drawn))], numbers=[Tile("0.05 mm", "held out", mark="warn")])

    assert cards(text) == ["First", "Second", "Figures"]
    assert re.findall(r'<a href="#(part-\d)">', text) == ["part-1", "part-2", "part-3"]
    assert text.count("<figure>") == 2
    assert '<li class="figure warn"><b>0.05 mm</b><small>held out</small></li>' in text
    assert text.index("0.05 mm") < text.index("First")
    assert "armwright iso9283 &lt;x&gt;</footer>" in text


def test_nothing_empty() -> None:
    """A table without rows is left out, a page without numbers has no headline, and one section needs no links."""
    assert table_cards([ResultTable(title="Not fitted", heads=("error", "why"), rows=())]) == []
    assert '<ul class="headline"' not in page()
    assert "<nav" not in page()


def test_warnings_and_facts() -> None:
    """What must not be overlooked is marked as a warning; a plain fact is not."""
    text = page(notes=["27 errors fitted"], warnings=["outliers: 7"])

    assert re.findall(r'<li class="warning"><b>Note</b>([^<]*)', text) == ["outliers: 7"]
    assert '<ul class="remarks"><li>27 errors fitted</li></ul>' in text


def test_lines_to_fill_in() -> None:
    assert pairs([("robot", ""), ("load", "2 kg")]) == (
        '<dl class="pairs"><dt>robot</dt><dd class="blank"></dd><dt>load</dt><dd>2 kg</dd></dl>'
    )


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
        warnings=[NASTY],
        numbers=[Tile(NASTY, NASTY)],
        named=[("Arm", NASTY), (NASTY, "x")],
        verdict=(NASTY, False),
        sections=[
            *table_cards([ResultTable(title=NASTY, remark=NASTY, heads=(NASTY, "mm"), rows=[(NASTY, NASTY)])]),
            Card("Figures", figures([Drawing("one", NASTY, SVG)])),
            Card("Files", downloads({"a.csv": NASTY}) + pairs([(NASTY, NASTY)])),
        ],
    )

    assert "<script" not in text
    assert NASTY not in text
    # Title twice, badge, fact and its name, both notes, number and its label, link, card twice and its remark, head,
    # two cells, caption twice, content of a file, a pair, footer.
    assert text.count("&lt;/td&gt;&lt;script&gt;") == 22


def test_numbers_and_marks() -> None:
    """Numbers end at the right, heads above them too, and a row that is beyond its limit is marked."""
    rows = [("P1", "0.1"), ("P2", "0.3")]
    text = table(ResultTable(title="", heads=("pose", "AP"), rows=rows, numbers=(1,), marks=("holds", "over")))

    assert text.count('<th class="number">AP</th>') == 1
    assert text.count('<td class="number">') == 2
    assert re.findall(r"<tr([^>]*)><td>", text) == [' class="holds"', ' class="over"']


def test_symbols_and_a_drawn_column() -> None:
    """What follows the underscore of a symbol is its index; a last column may hold drawings."""
    shown = ResultTable(title="", heads=("symbol", "mm"), rows=[("AP_x", "1"), ("RP", "2")], numbers=(1,))

    assert "<td>AP<sub>x</sub></td>" in table(shown, symbols=(0,))
    assert "<td>AP_x</td>" in table(shown)
    text = table(shown, last=["<i>scale</i>", "<svg>1</svg>", "<svg>2</svg>"])
    assert re.findall(r'<t[hd] class="drawn">(.*?)</t[hd]>', text) == ["<i>scale</i>", "<svg>1</svg>", "<svg>2</svg>"]


@pytest.mark.parametrize(
    ("x", "text"),
    [(0.01082, "10.82 mm"), (5.04e-5, "0.050 mm"), (9.99e-6, "9.99 µm"), (2e-9, "0.002 µm"), (0.0, "0 µm")],
)
def test_lengths(x: float, text: str) -> None:
    assert length_text(x) == text


def test_rows_fit_heads() -> None:
    """A row with more texts than there are columns is a mistake of ours."""
    with pytest.raises(ValueError, match="longer"):
        table(ResultTable(title="", heads=("pose",), rows=[("P1", "0.1")]))
