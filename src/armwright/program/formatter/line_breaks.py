"""From rows to lines: comments in their poses, and rows that are too long broken where it hurts least."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

from armwright.program.formatter.layout import CLAUSE, LEVEL, Row, length
from armwright.program.formatter.pieces import Comment, Piece

# In front of a comment behind a statement.
_BEFORE_COMMENT = "  "


def lines_of(rows: Iterable[Row], width: int) -> list[str]:
    """Return the lines of a program.

    Args:
        rows: in order, the last being its end.
        width: how long a line may be, if there is a pose where it can end; comments may stand out.
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
        text = "".join([f" {piece.text}" if piece.blank else piece.text for piece in pieces])
        if pieces[0].blank:
            text = text[1:]
        if not row.is_open and row.column + len(text) <= self._width and not any(piece.is_hard for piece in pieces):
            lines.append(" " * row.column + text)
        elif row.clauses:
            self._clauses(row)
        else:
            self._fill(pieces, row.column, row.column + row.goes_on)

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
        first = row.column + length(_visible(pieces[:end])) <= self._width and not any(piece.is_hard for piece in head)
        self._fill(pieces[:end] if first else head, row.column, column)
        bounds = [*starts, len(pieces)][first:]
        for start, stop in pairwise(bounds):
            self._fill(pieces[start:stop], column, column + LEVEL)

    def _fill(self, pieces: Sequence[Piece], column: int, goes_on: int) -> None:
        """Write pieces into as many lines as it takes.

        Args:
            pieces: in order.
            column: where the first line begins.
            goes_on: where the others do, outside of parentheses; inside, they begin where those do.
        """
        brackets: list[int] = []
        start, column_ = 0, column
        while start < len(pieces):
            stop = self._stop(pieces, start, column_)
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
            column_ = brackets[-1] if brackets and brackets[-1] <= self._width * 2 // 3 else goes_on

    def _stop(self, pieces: Sequence[Piece], start: int, column: int) -> int:
        """Return where the line that starts with a piece should end."""
        best, lowest = 0, 0
        for index in range(start, len(pieces)):
            piece = pieces[index]
            if index > start:
                hard = pieces[index - 1].is_hard
                fits = column <= self._width
                if hard and (fits or not best):
                    return index
                if piece.cut is not None:
                    if not fits:
                        return best or index
                    if not best or piece.cut <= lowest:
                        best, lowest = index, piece.cut
            if not piece.is_hard:
                column += len(piece.text) + (piece.blank and index > start)
        return len(pieces) if column <= self._width or not best else best


def _visible(pieces: Sequence[Piece]) -> Sequence[Piece]:
    """Return pieces without the last, if that is a comment that ends a line."""
    return pieces[:-1] if pieces[-1].is_hard else pieces
