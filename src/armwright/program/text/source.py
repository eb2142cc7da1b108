"""Program texts and places in them: characters are counted in the text as it was written."""

from bisect import bisect_right
from functools import cached_property
from typing import NamedTuple

import attrs

_BYTE_ORDER_MARK = "\ufeff"


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
        text = self.text
        starts = [1 if text.startswith(_BYTE_ORDER_MARK) else 0]
        lone_returns = "\r" in text
        at = _next_break(text, 0, lone_returns=lone_returns)
        while at >= 0:
            at += 2 if text.startswith("\r\n", at) else 1
            starts.append(at)
            at = _next_break(text, at, lone_returns=lone_returns)
        return tuple(starts)

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


def _next_break(text: str, start: int, *, lone_returns: bool) -> int:
    """Return where the next line end begins, -1 after the last."""
    feed = text.find("\n", start)
    if not lone_returns:
        return feed
    back = text.find("\r", start, feed if feed >= 0 else len(text))
    return feed if back < 0 else back
