"""Positions in a text as editors count them: lines and columns, in bytes, halves of words or characters."""

import re
from bisect import bisect_right
from functools import cached_property

import attrs

_LINE_END = re.compile(r"\r\n|\r|\n")
# What a character takes where editors count bytes or halves of words; in UTF-32 each takes one.
UTF_8, UTF_16, UTF_32 = "utf-8", "utf-16", "utf-32"


@attrs.frozen(slots=False)
class PositionCodec:
    """Converts between offsets into a text and lines and columns, both from 0.

    Attributes:
        text: the text.
        encoding: what columns count: ``utf-8``, ``utf-16`` or ``utf-32``.
    """

    text: str
    encoding: str = UTF_16

    @cached_property
    def line_starts(self) -> list[int]:
        """Where each line starts."""
        return [0, *(match.end() for match in _LINE_END.finditer(self.text))]

    @cached_property
    def _has_single_columns(self) -> bool:
        """Whether every character takes one column."""
        return self.encoding == UTF_32 or self.text.isascii()

    def line_of(self, offset: int) -> int:
        """Return the line of an offset."""
        return bisect_right(self.line_starts, offset) - 1

    def line_end(self, line: int) -> int:
        """Return the offset behind the last character of a line, in front of what ends it."""
        if line + 1 >= len(self.line_starts):
            return len(self.text)
        start, end = self.line_starts[line], self.line_starts[line + 1] - 1
        return end - 1 if end > start and self.text[end] == "\n" and self.text[end - 1] == "\r" else end

    def line_and_column(self, offset: int) -> tuple[int, int]:
        """Return line and column of an offset."""
        offset = min(max(0, offset), len(self.text))
        line = self.line_of(offset)
        return line, self.width(self.line_starts[line], offset)

    def width(self, start: int, end: int) -> int:
        """Return how many columns a stretch of one line takes."""
        if self._has_single_columns:
            return end - start
        stretch = self.text[start:end]
        return end - start if stretch.isascii() else column_count(stretch, self.encoding)

    def offset(self, line: int, column: int) -> int:
        """Return the offset of a place; what lies behind the end of a line is its end."""
        if line >= len(self.line_starts):
            return len(self.text)
        start, end = self.line_starts[max(0, line)], self.line_end(max(0, line))
        if self._has_single_columns:
            return min(start + max(0, column), end)
        at = start
        while at < end and column > 0:
            column -= column_count(self.text[at], self.encoding)
            # A place inside a character is in front of it.
            at += column >= 0
        return at


def column_count(text: str, encoding: str) -> int:
    """Return how many columns a text takes."""
    if encoding == UTF_16:
        return len(text) + sum(character > "\uffff" for character in text)
    # Half of a character that takes two places in UTF-16 is no text, but may be sent all the same.
    return len(text.encode("utf-8", "surrogatepass")) if encoding == UTF_8 else len(text)
