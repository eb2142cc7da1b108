"""How a program is laid out: which words make a row of their own, and how far each is indented."""

from collections.abc import Sequence

import attrs

from armwright.program.formatter.pieces import Comment, Piece
from armwright.program.syntax.lexer import TokenKind

# Blanks per level, in front of what goes on from the line above, and of the clauses of a MOVE.
LEVEL, GOES_ON, CLAUSE = 2, 4, 5
_DECLARED = 4

_ENDS = frozenset((";", "END", "UNTIL", "COEND", "RECOVER", "ELSE"))
_CLAUSES = frozenset(("DIRECTLY", "STRAIGHTLY", "VIA", "WITH", "ON"))
# What has rows of its own, and so no place within a row.
_LARGE = frozenset(("BEGIN", "IF", "WHILE", "FOR", "REPEAT", "COBEGIN", "TRY", "LOCK", "MOVE"))
_NOTHING_BEFORE = frozenset((",", ")", "]", "."))


@attrs.define(eq=False)
class Row:
    """What stands in one line, if it is not too long.

    Attributes:
        column: how far it is indented.
        goes_on: how much further, if it takes several lines, the others are.
        pieces: what it says.
        comments: what stands in front of it.
        breaks: how many lines end between those and it.
        comment_column: how far comments in front of it are indented.
        clauses: which of its pieces begin the clauses of a MOVE; none where a clause is the row.
        is_open: whether a clause of its MOVE takes rows of its own, so that each clause begins a line.
    """

    column: int
    goes_on: int
    pieces: list[Piece]
    comments: list[Comment]
    breaks: int
    comment_column: int
    clauses: list[int] = attrs.field(factory=list)
    is_open: bool = False


def rows_of(pieces: Sequence[Piece], width: int) -> list[Row]:
    """Lay a program out.

    Args:
        pieces: of a program without errors of syntax, the last being its end.
        width: how long a line may be.
    """
    return _Layout(pieces, width).run()


def length(pieces: Sequence[Piece]) -> int:
    """Return how many characters pieces take in one line."""
    return sum(len(one.text) + one.blank for one in pieces) - (bool(pieces) and pieces[0].blank)


class _Layout:
    """One pass over the pieces; every method leaves the row of its last words open, so that a sign can follow."""

    def __init__(self, pieces: Sequence[Piece], width: int) -> None:
        # Behind the end there is nothing to take; a second end is there to be looked at.
        self._pieces = [*pieces, pieces[-1]]
        self._width = width
        self._at = 0
        self._now = pieces[0]
        self._word = self._now.word
        self._rows: list[Row] = []
        self._row: Row | None = None
        self._column = self._comment_column = 0
        self._goes_on = GOES_ON

    def run(self) -> list[Row]:
        while self._word != "BEGIN":
            self._start(0)
            self._header()
        self._start(0)
        self._block(0)
        self._take()
        self._start(0)
        self._take()
        return self._rows

    def _start(self, column: int, *, inner: int = 0, goes_on: int = GOES_ON) -> None:
        """Begin a row; comments in front of it are indented by ``inner`` more."""
        self._row = None
        self._column, self._comment_column, self._goes_on = column, column + inner, goes_on

    def _take(self) -> None:
        """Put the next piece into the row."""
        one = self._now
        row = self._row
        if row is None:
            row = Row(self._column, self._goes_on, [one], one.comments, one.breaks, self._comment_column)
            self._row = row
            self._rows.append(row)
        else:
            if one.comments:
                self._comments(row.pieces, one)
            row.pieces.append(one)
        self._at += 1
        self._now = self._pieces[self._at]
        self._word = self._now.word

    @staticmethod
    def _comments(pieces: list[Piece], one: Piece) -> None:
        """Put the comments in front of a piece into the row."""
        for comment in one.comments:
            blank = pieces[-1].word not in ("(", "[")
            pieces.append(Piece(comment.text, "", None, one.start, 0, [], blank=blank, comment=comment))
        one.blank = one.word not in _NOTHING_BEFORE

    def _up_to(self, word: str) -> None:
        """Take everything up to and with a word."""
        while self._word != word:
            self._take()
        self._take()

    # ---- in front of BEGIN

    def _header(self) -> None:
        word = self._word
        if word == "VAR":
            self._declarations()
        elif word == "PROCEDURE":
            self._goes_on = GOES_ON
            self._up_to(";")
            if self._word == "VAR":
                self._start(0)
                self._declarations()
            self._start(0)
            self._block(0)
            self._take()
        else:
            self._up_to(";")

    def _declarations(self) -> None:
        self._goes_on = _DECLARED + LEVEL
        self._take()
        self._up_to(";")
        while self._now.kind is TokenKind.NAME:
            self._start(_DECLARED, goes_on=LEVEL)
            self._up_to(";")

    # ---- statements

    def _statements(self, column: int) -> None:
        """Lay statements out up to the word that ends them, which begins a row."""
        while self._word not in _ENDS:
            self._start(column)
            self._statement(column)
            if self._word == ";":
                self._take()
        self._start(column - LEVEL, inner=LEVEL)

    def _statement(self, column: int) -> None:
        word = self._word
        if word == "MOVE":
            self._move(column)
        elif word == "BEGIN":
            self._block(column)
        elif word == "IF":
            self._if(column)
        elif word in ("WHILE", "FOR", "LOCK"):
            self._up_to("DO")
            self._nested(column)
        elif word == "REPEAT":
            self._take()
            self._statements(column + LEVEL)
            self._rest()
        elif word == "COBEGIN":
            self._cobegin(column)
        elif word == "TRY":
            self._take()
            self._statements(column + LEVEL)
            self._take()
            self._statements(column + LEVEL)
            self._take()
        else:
            self._rest()

    def _rest(self) -> None:
        """Take the rest of a statement that takes one row."""
        self._take()
        while self._word not in _ENDS:
            self._take()

    def _block(self, column: int) -> None:
        self._take()
        self._statements(column + LEVEL)
        self._take()

    def _nested(self, column: int) -> None:
        """Lay out the statement behind THEN, ELSE or DO."""
        inner = column if self._word == "BEGIN" else column + LEVEL
        self._start(inner)
        self._statement(inner)

    def _if(self, column: int) -> None:
        further = column + LEVEL
        while True:
            self._up_to("THEN")
            self._nested(column)
            if self._word != "ELSE":
                return
            self._start(column, inner=LEVEL)
            self._take()
            if self._word != "IF":
                break
            if any(comment.is_hard for comment in self._now.comments):
                # It cannot stand in the line of its ELSE; but a long chain does not walk off to the right.
                column = further
                self._start(column)
        self._nested(column)

    def _cobegin(self, column: int) -> None:
        self._take()
        inner = column + LEVEL
        while self._word != "COEND":
            self._start(inner)
            if self._word == "PRIORITY":
                self._up_to(":")
            self._block(inner)
            if self._word == ";":
                self._take()
        self._start(column, inner=LEVEL)
        self._take()

    # ---- motions

    def _move(self, column: int) -> None:
        """Lay a MOVE out: no comma in front of its first clause, one in front of each other."""
        self._goes_on = CLAUSE
        self._take()
        depth, first, opened = 0, True, False
        while self._word not in _ENDS:
            word = self._word
            if not depth and word == "," and self._pieces[self._at + 1].word in _CLAUSES:
                if first:
                    self._leave_out()
                else:
                    self._take()
            elif not depth and word in _CLAUSES:
                if not first:
                    self._comma()
                if opened:
                    self._start(column + CLAUSE, goes_on=LEVEL)
                opened = self._clause(column) or opened
                first = False
            else:
                depth += (word in ("(", "[")) - (word in (")", "]"))
                self._take()

    def _leave_out(self) -> None:
        """Pass over a piece; the comments in front of it go to the next."""
        comments = self._now.comments
        self._at += 1
        self._now = self._pieces[self._at]
        self._now.comments[:0] = comments
        self._word = self._now.word

    def _comma(self) -> None:
        """Put a comma in if there is none."""
        row = self._rows[-1]
        if row.pieces[-1].word != ",":
            row.pieces.append(Piece(",", ",", TokenKind.SYMBOL, self._now.start, 0, [], blank=False))

    def _clause(self, column: int) -> bool:
        """Lay out the beginning of a clause, or all of one with a block; whether it has rows of its own."""
        at = self._at
        self._take()
        row = self._rows[-1]
        if len(row.pieces) > 1:
            row.clauses.append(len(row.pieces) - 1)
        if self._pieces[at].word != "ON":
            return False
        begin = at
        while self._pieces[begin].word != "DO":
            begin += 1
        begin += 1
        if self._pieces[begin].word != "BEGIN":
            return False
        end = self._small_block(at + 1, begin)
        # Behind the block comes a comma or a semicolon.
        if end and column + CLAUSE + length(self._pieces[at : end + 1]) + LEVEL <= self._width:
            while self._at <= end:
                self._take()
            return False
        row.is_open = True
        self._up_to("DO")
        self._start(column + CLAUSE)
        self._block(column + CLAUSE)
        return True

    def _small_block(self, start: int, begin: int) -> int:
        """Return the END of a block that fits into a row, if it is short enough; 0 where it holds too much.

        Args:
            start: where no comment may stand from here on.
            begin: its BEGIN.
        """
        at = begin + 1
        while self._pieces[at].word != "END":
            if self._pieces[at].word in _LARGE:
                return 0
            at += 1
        return 0 if any(one.comments for one in self._pieces[start : at + 1]) else at
