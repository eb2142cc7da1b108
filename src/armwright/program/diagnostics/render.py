"""Diagnostics as people read them: the lines of the program with marks under the places that matter."""

import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, TypeAlias

from armwright.program.language.diagnostic import Diagnostic, Label, Severity, sort_diagnostics, summary_line
from armwright.program.language.source import Source

if TYPE_CHECKING:
    from rich.text import Text

# A piece of a row and its style, in the words of rich; the style is empty for plain text.
Piece: TypeAlias = tuple[str, str]
Row: TypeAlias = list[Piece]

# So many are read one by one at most; the rest is counted.
MAX_SHOWN = 100
_TAB = 4
_NARROWEST_GUTTER = 2
# Longer lines are shown in part, from so many characters before the first place on.
_MAX_LINE_LENGTH, _CONTEXT_LENGTH, _ELLIPSIS = 240, 60, "..."
_SEVERITY_STYLES = {Severity.ERROR: "bold red", Severity.WARNING: "bold yellow"}
_GUTTER_STYLE = "bold blue"


def render(diagnostics: Iterable[Diagnostic], source: Source) -> str:
    """Return diagnostics as plain text, sorted by place, a hundred at most, with a count of all at the end."""
    return "".join("".join(text for text, _ in row).rstrip() + "\n" for row in _page_rows(diagnostics, source))


def render_rich(diagnostics: Iterable[Diagnostic], source: Source) -> "Text":
    """Return the same in colour."""
    from rich.text import Text  # noqa: PLC0415 - only who watches waits for it

    page = Text(no_wrap=True)
    for row in _page_rows(diagnostics, source):
        for text, style in row:
            page.append(text, style or None)
        page.append("\n")
    return page


def _page_rows(diagnostics: Iterable[Diagnostic], source: Source) -> Iterator[Row]:
    ordered = sort_diagnostics(diagnostics)
    # Of too many the errors come first: a warning is never shown in place of what keeps a program from running.
    shown = sort_diagnostics(sorted(ordered, key=lambda one: not one.is_error)[:MAX_SHOWN])
    for diagnostic in shown:
        yield from _diagnostic_rows(diagnostic, source)
        yield [("", "")]
    if len(ordered) > MAX_SHOWN:
        omitted = f"{len(ordered) - MAX_SHOWN} more are not shown; one mistake may have caused many"
        yield [("note", "bold"), (f": {omitted}. `armwright check --format json` prints all", "")]
        yield [("", "")]
    yield [(summary_line(ordered, source), "bold" if ordered else "")]


def _diagnostic_rows(diagnostic: Diagnostic, source: Source) -> Iterator[Row]:
    loud = _SEVERITY_STYLES[diagnostic.severity]
    labels = [Label(diagnostic.span, diagnostic.label), *diagnostic.secondary]
    width = max(_NARROWEST_GUTTER, *(len(str(source.line(label.span.start))) for label in labels))
    yield [(f"{diagnostic.severity.value}[{diagnostic.code}]", loud), (f": {diagnostic.message}", "bold")]
    # The file of the first place, then those of the others.
    arrow = "-->"
    for file in dict.fromkeys(source.file_number(label.span.start) for label in labels):
        here = [label for label in labels if source.file_number(label.span.start) == file]
        start = here[0].span.start
        location = f"{source.file_path(file)}:{source.line(start)}:{source.column(start)}"
        yield [(" " * width + f"{arrow} ", _GUTTER_STYLE), (location, "")]
        yield [(" " * width + " |", _GUTTER_STYLE)]
        yield from _excerpt_rows(here, source, width, labels[0], loud)
        arrow = ":::"
    for head, text in diagnostic.remarks:
        yield [(" " * width + " = ", _GUTTER_STYLE), (f"{head}: ", "bold"), (text, "")]


def _excerpt_rows(labels: Sequence[Label], source: Source, width: int, primary: Label, loud: str) -> Iterator[Row]:
    """Give the lines of one file that labels stand in, with the labels under them.

    Args:
        labels: all in one file; that of the message itself is the first where it is among them.
        source: the program.
        width: of the numbers of lines.
        primary: the label of the message itself.
        loud: its style.
    """
    numbers = sorted({source.line(label.span.start) for label in labels})
    before = numbers[0]
    for number in numbers:
        if number > before + 1:
            yield [("...", _GUTTER_STYLE)]
        before = number
        line_labels = [label for label in labels if source.line(label.span.start) == number]
        anchor = labels[0] if labels[0] in line_labels else line_labels[0]
        line = source.line_at(anchor.span.start)
        first, last = _visible_range(len(line), source.column(anchor.span.start) - 1)
        before_it, behind_it = _ELLIPSIS if first else "", _ELLIPSIS if last < len(line) else ""
        shown = before_it + "".join(_visible_cells(line[first:last])) + behind_it
        yield [(f"{number:>{width}} | ", _GUTTER_STYLE), (shown, "")]
        for label in sorted(line_labels, key=lambda one: one.span.start):
            mark, style = ("^", loud) if label is primary else ("-", _GUTTER_STYLE)
            marks = _marker_row(label, mark, style, source, (first, last))
            yield [(" " * width + " | " + " " * len(before_it), _GUTTER_STYLE), *marks]


def _visible_range(length: int, column: int) -> tuple[int, int]:
    """Return which characters of a line are shown: all, or of a very long line those around a place."""
    if length <= _MAX_LINE_LENGTH:
        return 0, length
    first = max(0, column - _CONTEXT_LENGTH)
    return first, min(length, first + _MAX_LINE_LENGTH)


def _marker_row(label: Label, mark: str, style: str, source: Source, visible: tuple[int, int]) -> Row:
    """Return the blanks, the marks and the words under one place; a place of several lines is marked in its first.

    Args:
        label: the place and its words.
        mark: what it is marked with.
        style: of marks and words.
        source: the program.
        visible: the first character of the line that is shown, and the one behind the last.
    """
    begin, end = visible
    line = source.line_at(label.span.start)
    cells = _visible_cells(line[begin:end])
    column = source.column(label.span.start) - 1
    # What lies in a part that is not shown is marked at its edge.
    first = column if end == len(line) and column >= begin else min(max(column, begin), end)
    last = min(column + label.span.end - label.span.start, len(line), end)
    # Beyond the end of the line every character that does not exist counts one.
    indent = sum(map(_column_width, cells[: first - begin])) + max(0, first - len(line))
    length = sum(map(_column_width, cells[first - begin : max(0, last - begin)]))
    return [(" " * indent, ""), (mark * max(1, length), style), (f" {label.text}" if label.text else "", style)]


# Diagnostics that follow one another are often about the same line.
@lru_cache(maxsize=4)
def _visible_cells(line: str) -> Sequence[str]:
    """Return what is shown for each character of a line: blanks up to the next stop for a tab."""
    shown: list[str] = []
    column = 0
    for character in line:
        cell = " " * (_TAB - column % _TAB) if character == "\t" else _printable(character)
        column += _column_width(cell)
        shown.append(cell)
    return tuple(shown)


def _printable(character: str) -> str:
    """Return the character, or a stand-in for one that would disturb the terminal."""
    return "\N{REPLACEMENT CHARACTER}" if unicodedata.category(character) in ("Cc", "Cf", "Cs") else character


def _column_width(cell: str) -> int:
    """Return how many columns of a terminal a shown character takes."""
    spacing = [character for character in cell if not unicodedata.combining(character)]
    return len(spacing) + sum(unicodedata.east_asian_width(character) in "WF" for character in spacing)
