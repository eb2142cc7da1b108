"""Places in texts, as editors and as programs count them."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from armwright.program.language.position_codec import PositionCodec
from armwright.program.language.source import Span
from armwright.program.language.text_edits import Edit, apply_edits
from armwright.program.language_server.edit_map import NO_DRIFT, drift

TEXTS = st.text(st.sampled_from(["a", "b", " ", "\n", "\r", "é", "€", "🤖", "\u2028", "\f"]), max_size=30)
ENCODINGS = st.sampled_from(["utf-8", "utf-16", "utf-32"])


@given(text=TEXTS, encoding=ENCODINGS)
def test_there_and_back(text: str, encoding: str) -> None:
    """The line and column of every character lead back to it, unless it stands inside of a line end."""
    ruler = PositionCodec(text, encoding)
    for offset in range(len(text) + 1):
        line, column = ruler.place(offset)
        if text[offset - 1 : offset + 1] != "\r\n" or offset == 0:
            assert ruler.offset(line, column) == offset


@given(text=TEXTS, encoding=ENCODINGS)
def test_columns_are_what_the_encoding_takes(text: str, encoding: str) -> None:
    """A column counts the units of the encoding in front of it in the line."""
    size = {"utf-8": 1, "utf-16": 2, "utf-32": 4}[encoding]
    codec = encoding if encoding == "utf-8" else f"{encoding}-le"
    ruler = PositionCodec(text, encoding)
    for offset in range(len(text)):
        line, column = ruler.place(offset)
        assert column == len(text[ruler.starts[line] : offset].encode(codec)) // size


@pytest.mark.parametrize(
    ("line", "column", "offset"),
    [(0, 99, 2), (1, 0, 4), (1, 1, 4), (1, 2, 5), (1, 99, 6), (99, 0, 6)],
)
def test_places_that_are_not_there(line: int, column: int, offset: int) -> None:
    """What lies behind a line is its end, what lies behind the text its end, what lies inside a character its start."""
    assert PositionCodec("ab\r\n🤖a").offset(line, column) == offset


@given(text=TEXTS, new=TEXTS, data=st.data())
def test_ruler_of_a_changed_text(text: str, new: str, data: st.DataObject) -> None:
    """A ruler that has followed a change is the ruler of the changed text."""
    start = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(start, len(text)))
    changed = PositionCodec(text).changed(start, end, new)

    assert changed.text == text[:start] + new + text[end:]
    assert changed.starts == PositionCodec(changed.text).starts


@given(text=TEXTS, seed=st.integers(0, 1000))
def test_drift_over_several_changes(text: str, seed: int) -> None:
    """However often a text changes: what is outside of the drift is the same, and found again."""
    chance = random.Random(seed)
    now, change = text, NO_DRIFT
    for _ in range(4):
        start = chance.randint(0, len(now))
        end = chance.randint(start, len(now))
        new = "x" * chance.randint(0, 3)
        now = now[:start] + new + now[end:]
        change = change.then(start, end, len(new))

    for found in (change, drift(text, now)):
        assert text[: found.start] == now[: found.start]
        assert text[found.old_end :] == now[found.new_end :]
        assert found.start <= min(found.old_end, found.new_end)
        for offset in range(len(now) + 1):
            before = found.old(offset)
            assert before is None or found.new(before) == offset or before == found.start


def test_edits() -> None:
    """Changes are all counted in the text as it was; of two that overlap the first is made."""
    edits = (Edit(Span(4, 5), "!"), Edit(Span(0, 1), "XY"), Edit(Span(0, 2), "no"), Edit(Span(2, 2), "-"))

    assert apply_edits("abcde", edits) == "XYb-cd!"
