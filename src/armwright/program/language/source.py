"""Program texts and places in them: characters are counted in the text as it was written."""

import re
from bisect import bisect_right
from functools import cached_property
from typing import NamedTuple

import attrs

_BYTE_ORDER_MARK = "\ufeff"
_LINE_END = re.compile(r"\r\n?|\n")


# A tuple, as a long program has a hundred thousand of them: any other frozen thing costs more than twice as much.
class Span(NamedTuple):
    """A stretch of a text, in characters.

    Attributes:
        start: the first character.
        end: the one after the last; equal to ``start`` where something is missing.
    """

    start: int
    end: int

    def to(self, other: "Span") -> "Span":
        """Return the stretch from the start of this to the end of the other."""
        return Span(self.start, other.end)


@attrs.frozen(slots=False)
class Source:
    """A program text.

    Attributes:
        name: as shown in messages, such as ``weld.rlo``.
        text: the characters of the file, untouched.
    """

    name: str
    text: str

    @cached_property
    def line_starts(self) -> tuple[int, ...]:
        """Where each line starts. A line ends with a line feed, a carriage return or both; never elsewhere."""
        first = 1 if self.text.startswith(_BYTE_ORDER_MARK) else 0
        return (first, *(match.end() for match in _LINE_END.finditer(self.text)))

    def line(self, offset: int) -> int:
        """Return the number of the line, from 1, that holds a character."""
        return max(1, bisect_right(self.line_starts, offset))

    def column(self, offset: int) -> int:
        """Return the place of a character in its line, from 1."""
        return max(0, offset - self.line_starts[self.line(offset) - 1]) + 1

    def line_text(self, line: int) -> str:
        """Return a line, counted from 1, without its end."""
        start = self.line_starts[line - 1]
        end = self.line_starts[line] if line < len(self.line_starts) else len(self.text)
        return self.text[start:end].rstrip("\r\n")

    def slice(self, span: Span) -> str:
        """Return the characters of a span."""
        return self.text[span.start : span.end]
