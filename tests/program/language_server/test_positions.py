"""Places in texts, as editors and as programs count them."""

import pytest
from hypothesis import given, strategies as st

from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Span
from armwright.program.language.text_edits import TextEdit, apply_edits, smallest_edit

TEXTS = st.text(st.sampled_from(["a", "b", " ", "\n", "\r", "é", "€", "🤖", "\u2028", "\f"]), max_size=30)
ENCODINGS = st.sampled_from(["utf-8", "utf-16", "utf-32"])


@given(text=TEXTS, encoding=ENCODINGS)
def test_there_and_back(text: str, encoding: str) -> None:
    """The line and column of every character lead back to it, unless it stands inside of a line end."""
    ruler = PositionCodec(text, encoding)
    for offset in range(len(text) + 1):
        line, column = ruler.line_and_column(offset)
        if text[offset - 1 : offset + 1] != "\r\n" or offset == 0:
            assert ruler.offset(line, column) == offset


@given(text=TEXTS, encoding=ENCODINGS)
def test_columns_are_what_the_encoding_takes(text: str, encoding: str) -> None:
    """A column counts the units of the encoding in front of it in the line."""
    size = {"utf-8": 1, "utf-16": 2, "utf-32": 4}[encoding]
    codec = encoding if encoding == "utf-8" else f"{encoding}-le"
    ruler = PositionCodec(text, encoding)
    for offset in range(len(text)):
        line, column = ruler.line_and_column(offset)
        assert column == len(text[ruler.line_starts[line] : offset].encode(codec)) // size


@pytest.mark.parametrize(
    ("line", "column", "offset"),
    [(0, 99, 2), (1, 0, 4), (1, 1, 4), (1, 2, 5), (1, 99, 6), (99, 0, 6)],
)
def test_places_that_are_not_there(line: int, column: int, offset: int) -> None:
    """What lies behind a line is its end, what lies behind the text its end, what lies inside a character its start."""
    assert PositionCodec("ab\r\n🤖a").offset(line, column) == offset


@given(before=TEXTS, after=TEXTS)
def test_smallest_edit(before: str, after: str) -> None:
    """The change of one stretch makes the one text out of the other, and what it replaces differs at both ends."""
    edit = smallest_edit(before, after)
    gone = before[edit.span.start : edit.span.end]

    assert apply_edits(before, (edit,)) == after
    assert not gone or not edit.text or (gone[0] != edit.text[0] and gone[-1] != edit.text[-1])


def test_edits() -> None:
    """Changes are all counted in the text as it was; of two that overlap the first is made."""
    edits = (
        TextEdit(Span(4, 5), "!"),
        TextEdit(Span(0, 1), "XY"),
        TextEdit(Span(0, 2), "no"),
        TextEdit(Span(2, 2), "-"),
    )

    assert apply_edits("abcde", edits) == "XYb-cd!"
