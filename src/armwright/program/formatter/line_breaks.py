"""From rows to lines: comments beside or between them, and rows that are too long broken where it hurts least."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

from armwright.program.formatter.layout import CLAUSE, INDENT, Row, length
from armwright.program.formatter.pieces import Comment, Piece

# In front of a comment behind a statement.
_BEFORE_COMMENT = "  "


def lines_of(rows: Iterable[Row], width: int) -> list[str]:
    """Return the lines of a program.

    Args:
        rows: in order, the last being its end.
        width: how long a line may be, if it can be broken; comments may stand out.
    """
    page = _Page(width)
    for row in rows:
        page.add(row)
    return page.lines


class _Page:
    """The lines so far."""

    def __init__(self, width: int) -> None:
        self.lines: list[str] = []
        self._width = width

    def add(self, row: Row) -> None:
        """Put a row behind the others, with the comments in front of it."""
        lines = self.lines
        if row.comments:
            self._comments(row.comments, row.comment_column)
        if not row.pieces[0].text:
            return
        if row.breaks > 1 and lines:
            lines.append("")
        pieces = row.pieces
        text = "".join([f" {piece.text}" if piece.blank else piece.text for piece in pieces]).removeprefix(" ")
        if not row.is_open and row.column + len(text) <= self._width and not any(piece.ends_line for piece in pieces):
            lines.append(" " * row.column + text)
        elif row.clauses:
            self._clauses(row)
        else:
            self._fill(pieces, row.column, row.column + row.continuation)

    def _comments(self, comments: Sequence[Comment], column: int) -> None:
        """Put comments behind the last line, as long as they stand in it, and then below."""
        lines = self.lines
        beside = bool(lines)
        gap = _BEFORE_COMMENT
        for comment in comments:
            if beside and not comment.breaks:
                first, *more = comment.lines(len(lines[-1]) + len(gap))
                lines[-1] += gap + first
            else:
                if comment.breaks > 1 and lines:
                    lines.append("")
                first, *more = comment.lines(column)
                lines.append(" " * column + first)
            lines += more
            gap = " "
            beside = not comment.text.startswith("//")

    def _clauses(self, row: Row) -> None:
        """Write a MOVE with one clause in each line; the first stays in the line of what is moved if it can."""
        pieces, starts = row.pieces, row.clauses
        column = row.column + CLAUSE
        head, end = pieces[: starts[0]], starts[1] if len(starts) > 1 else len(pieces)
        # A comment that ends a line may stand out.
        visible = pieces[: end - pieces[end - 1].ends_line]
        first = row.column + length(visible) <= self._width and not any(piece.ends_line for piece in head)
        self._fill(pieces[:end] if first else head, row.column, column)
        for start, stop in pairwise([*starts, len(pieces)][first:]):
            self._fill(pieces[start:stop], column, column + INDENT)

    def _fill(self, pieces: Sequence[Piece], column: int, continuation: int) -> None:
        """Write pieces into as many lines as it takes.

        Args:
            pieces: in order.
            column: where the first line begins.
            continuation: where the others do, outside of parentheses; inside, they begin where those do.
        """
        brackets: list[int] = []
        start, column_ = 0, column
        while start < len(pieces):
            stop = self._line_end(pieces, start, column_)
            line = " " * column_
            more: list[str] = []
            for index in range(start, stop):
                piece = pieces[index]
                if piece.blank and index > start:
                    line += " "
                if piece.comment is not None:
                    first, *more = piece.comment.lines(len(line))
                    line += first
                    continue
                line += piece.text
                if piece.word in ("(", "["):
                    brackets.append(len(line))
                elif piece.word in (")", "]"):
                    brackets.pop()
            self.lines += [line, *more]
            start = stop
            column_ = brackets[-1] if brackets and brackets[-1] <= self._width * 2 // 3 else continuation

    def _line_end(self, pieces: Sequence[Piece], start: int, column: int) -> int:
        """Return where the line that starts with a piece should end."""
        best, lowest = 0, 0
        for index in range(start, len(pieces)):
            piece = pieces[index]
            if index > start:
                fits = column <= self._width
                if pieces[index - 1].ends_line and (fits or not best):
                    return index
                if piece.penalty is not None:
                    if not fits:
                        return best or index
                    if not best or piece.penalty <= lowest:
                        best, lowest = index, piece.penalty
            if not piece.ends_line:
                column += len(piece.text) + (piece.blank and index > start)
        return len(pieces) if column <= self._width or not best else best
