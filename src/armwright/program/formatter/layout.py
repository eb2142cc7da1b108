"""How a program is laid out: a walk over its tree states which words begin a row, and how far each is indented."""

from collections.abc import Callable, Sequence
from typing import Any

import attrs

from armwright.program.formatter.pieces import Comment, Piece
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import TokenKind

# Blanks per level, in front of what goes on from the line above, and of the clauses of a MOVE.
LEVEL, GOES_ON, CLAUSE = 2, 4, 5
_DECLARED = 4

# What has rows of its own, and so no pose within a row.
_LARGE = (tree.Block, tree.If, tree.While, tree.For, tree.Repeat, tree.Cobegin, tree.Try, tree.Lock, tree.Move)
_NOTHING_BEFORE = frozenset((",", ")", "]", "."))


@attrs.define(eq=False)
class Row:
    """What stands in one line, if it is not too long.

    Attributes:
        column: how far it is indented.
        goes_on: how much further, if it takes several lines, the others are.
        comment_column: how far comments in front of it are indented.
        pieces: what it says.
        comments: what stands in front of it.
        breaks: how many lines end between those and it.
        clauses: which of its pieces begin the clauses of a MOVE; none where a clause is the row.
        is_open: whether a clause of its MOVE takes rows of its own, so that each clause begins a line.
    """

    column: int
    goes_on: int
    comment_column: int
    pieces: list[Piece] = attrs.field(factory=list)
    comments: list[Comment] = attrs.field(factory=list)
    breaks: int = 0
    clauses: list[int] = attrs.field(factory=list)
    is_open: bool = False

    def add(self, piece: Piece) -> None:
        """Put a piece behind the others, with the comments in front of it."""
        if not self.pieces:
            self.comments, self.breaks = piece.comments, piece.breaks
        elif piece.comments:
            for comment in piece.comments:
                blank = self.pieces[-1].word not in ("(", "[")
                self.pieces.append(Piece(comment.text, "", None, piece.start, 0, [], blank=blank, comment=comment))
            piece.blank = piece.word not in _NOTHING_BEFORE
        self.pieces.append(piece)


def rows_of(program: tree.Program, pieces: Sequence[Piece], width: int) -> list[Row]:
    """Lay a program out.

    Args:
        program: without errors of syntax.
        pieces: of the program, the last being its end.
        width: how long a line may be.
    """
    layout = _Layout(pieces, width)
    layout.program(program)
    rows: list[Row] = []
    for index, piece in enumerate(pieces):
        is_first = layout.clauses.get(piece.start)
        # A comma stands in front of each clause but the first.
        if is_first is False and rows[-1].pieces[-1].word != ",":
            rows[-1].pieces.append(Piece(",", ",", TokenKind.SYMBOL, piece.start, 0, [], blank=False))
        if (row := layout.rows.get(piece.start)) is not None:
            rows.append(row)
        if piece.word == "," and layout.clauses.get(pieces[index + 1].start):
            pieces[index + 1].comments[:0] = piece.comments
            continue
        rows[-1].add(piece)
        if is_first is not None and len(rows[-1].pieces) > 1:
            rows[-1].clauses.append(len(rows[-1].pieces) - 1)
    return rows


def length(pieces: Sequence[Piece]) -> int:
    """Return how many characters pieces take in one line."""
    return sum(len(piece.text) + piece.blank for piece in pieces) - (bool(pieces) and pieces[0].blank)


class _Layout:
    """One walk over a tree.

    Attributes:
        rows: by the pose of the first word of each.
        clauses: by the pose of the first word of each clause of a MOVE, whether it is the first.
    """

    def __init__(self, pieces: Sequence[Piece], width: int) -> None:
        self.rows: dict[int, Row] = {}
        self.clauses: dict[int, bool] = {}
        self._pieces, self._width = pieces, width
        self._at = {piece.start: index for index, piece in enumerate(pieces)}
        self._visits: dict[type, Callable[[Any, int], None]] = {
            tree.Block: self._block,
            tree.If: self._if,
            tree.While: lambda node, column: self._nested(node.body, column),
            tree.For: lambda node, column: self._nested(node.body, column),
            tree.Lock: lambda node, column: self._nested(node.body, column),
            tree.Repeat: self._repeat,
            tree.Cobegin: self._cobegin,
            tree.Try: self._try,
            tree.Move: self._move,
        }

    def _row(self, start: int, column: int, *, inner: int = 0, goes_on: int = GOES_ON) -> Row:
        """Begin a row at a word; comments in front of it are indented by ``inner`` more."""
        row = self.rows[start] = Row(column, goes_on, column + inner)
        return row

    def _before(self, start: int) -> Piece:
        """Return the piece in front of the one at a pose."""
        return self._pieces[self._at[start] - 1]

    def program(self, node: tree.Program) -> None:
        """Lay a whole program out."""
        for header in node.headers:
            if isinstance(header, tree.Declaration):
                self._declaration(header)
                continue
            self._row(header.span.start, 0)
            if isinstance(header, tree.Procedure):
                for declaration in header.declarations:
                    self._declaration(declaration)
                self._row(header.body.span.start, 0)
                self._block(header.body, 0)
        end, _, last = self._pieces[-3:]
        self._row(self._before(node.statements[0].span.start if node.statements else end.start).start, 0)
        self._statements(node.statements, LEVEL)
        self._row(end.start, 0, inner=LEVEL)
        self._row(last.start, 0)

    def _declaration(self, node: tree.Declaration) -> None:
        start = node.span.start
        before = self._before(start) if self._at[start] else None
        if before is not None and before.word == "VAR":
            self._row(before.start, 0, goes_on=_DECLARED + LEVEL)
        else:
            self._row(start, _DECLARED, goes_on=LEVEL)

    # ---- statements

    def _statements(self, nodes: Sequence[tree.Statement], column: int) -> None:
        for node in nodes:
            self._statement(node, column)

    def _statement(self, node: tree.Statement, column: int) -> None:
        self._row(node.span.start, column, goes_on=CLAUSE if isinstance(node, tree.Move) else GOES_ON)
        if (visit := self._visits.get(type(node))) is not None:
            visit(node, column)

    def _nested(self, node: tree.Statement, column: int) -> None:
        """Lay out the statement behind THEN, ELSE or DO."""
        self._statement(node, column if isinstance(node, tree.Block) else column + LEVEL)

    def _block(self, node: tree.Block, column: int) -> None:
        self._statements(node.statements, column + LEVEL)
        self._row(node.end.start, column, inner=LEVEL)

    def _repeat(self, node: tree.Repeat, column: int) -> None:
        self._statements(node.body, column + LEVEL)
        self._row(node.tail.start, column, inner=LEVEL)

    def _try(self, node: tree.Try, column: int) -> None:
        self._statements((*node.body, *node.recovery), column + LEVEL)
        for word in (node.recover, node.end):
            self._row(word.start, column, inner=LEVEL)

    def _cobegin(self, node: tree.Cobegin, column: int) -> None:
        for branch in node.branches:
            self._row(branch.span.start, column + LEVEL)
            self._block(branch.body, column + LEVEL)
        self._row(node.end.start, column, inner=LEVEL)

    def _if(self, node: tree.If, column: int) -> None:
        links, last = node.else_if_chain
        further = column + LEVEL
        for link in links:
            if link is not node:
                self._row(self._before(link.span.start).start, column, inner=LEVEL)
                if any(comment.is_hard for comment in self._pieces[self._at[link.span.start]].comments):
                    # It cannot stand in the line of its ELSE; but a long chain does not walk off to the right.
                    column = further
                    self._row(link.span.start, column)
            self._nested(link.then, column)
        if last is not None:
            self._row(self._before(last.span.start).start, column, inner=LEVEL)
            self._nested(last, column)

    # ---- motions

    def _move(self, node: tree.Move, column: int) -> None:
        """Lay a MOVE out: a clause with large statements has rows of its own, and so has each behind it."""
        row = self.rows[node.span.start]
        column += CLAUSE
        opened = False
        for clause in node.clauses:
            start = clause.span.start
            self.clauses[start] = clause is node.clauses[0]
            if opened:
                row = self._row(start, column, goes_on=LEVEL)
            block = clause.action if isinstance(clause, tree.On) else None
            if isinstance(block, tree.Block) and not self._is_small(start, block, column):
                opened = row.is_open = True
                self._row(block.span.start, column)
                self._block(block, column)

    def _is_small(self, start: int, block: tree.Block, column: int) -> bool:
        """Whether a clause that begins at a pose and ends with a block fits into a row, and holds nothing large."""
        pieces = self._pieces[self._at[start] : self._at[block.end.start] + 1]
        if any(isinstance(statement, _LARGE) for statement in block.statements) or any(
            piece.comments for piece in pieces[1:]
        ):
            return False
        # Behind the block comes a comma or a semicolon.
        return column + length(pieces) + LEVEL <= self._width
