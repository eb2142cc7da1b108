"""Layout of a program: a walk over its tree determines which words begin a row, and how far each is indented."""

from collections.abc import Sequence

import attrs

from armwright.program.formatter.pieces import Comment, Piece
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import TokenKind

# Blanks per level, in front of what goes on from the line above, and of the clauses of a MOVE.
INDENT, CONTINUATION, CLAUSE = 2, 4, 5
_DECLARATION = 4

# Statements that take rows of their own, and so cannot stand within a row.
_LARGE = (
    tree.Block,
    tree.If,
    tree.While,
    tree.For,
    tree.Repeat,
    tree.Cobegin,
    tree.Try,
    tree.Lock,
    tree.Move,
    tree.Queue,
    tree.WaitUntil,
)
_NOTHING_BEFORE = frozenset((",", ")", "]", "."))


@attrs.define(eq=False)
class Row:
    """Pieces that stand in one line, if it is not too long.

    Attributes:
        column: how far it is indented.
        continuation: how much further, if it takes several lines, the others are.
        comment_column: how far comments in front of it are indented.
        pieces: in order.
        comments: those in front of it.
        breaks: how many lines end between those and it.
        clauses: which of its pieces begin the clauses of a MOVE; none where a clause is the row.
        is_open: whether a clause of its MOVE takes rows of its own, so that each clause begins a line.
    """

    column: int
    continuation: int
    comment_column: int
    pieces: list[Piece] = attrs.field(factory=list)
    comments: list[Comment] = attrs.field(factory=list)
    breaks: int = 0
    clauses: list[int] = attrs.field(factory=list)
    is_open: bool = False

    def add(self, piece: Piece) -> None:
        """Append a piece with the comments in front of it."""
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
        rows: by the offset of the first word of each.
        clauses: by the offset of the first word of each clause of a MOVE, whether it is the first.
    """

    def __init__(self, pieces: Sequence[Piece], width: int) -> None:
        self.rows: dict[int, Row] = {}
        self.clauses: dict[int, bool] = {}
        self._pieces, self._width = pieces, width
        self._index = {piece.start: index for index, piece in enumerate(pieces)}

    def _row(self, start: int, column: int, *, comment_indent: int = 0, continuation: int = CONTINUATION) -> Row:
        """Begin a row at a word; comments in front of it are indented by ``comment_indent`` more."""
        row = self.rows[start] = Row(column, continuation, column + comment_indent)
        return row

    def _end_index(self, node: tree.Record) -> int:
        """Return the piece that is the END of a record."""
        index = self._index[node.fields[-1].span.start] if node.fields else self._index[node.span.start]
        return next(at for at in range(index, len(self._pieces)) if self._pieces[at].word == "END")

    def _before(self, start: int) -> Piece:
        """Return the piece in front of the one that starts at an offset."""
        return self._pieces[self._index[start] - 1]

    def program(self, node: tree.Program) -> None:
        """Lay a whole program out."""
        for header in node.headers:
            if isinstance(header, tree.Declaration | tree.Constant):
                self._declaration(header)
                continue
            self._row(header.span.start, 0)
            if isinstance(header, tree.Record):
                for field in header.fields:
                    self._row(field.span.start, INDENT)
                self._row(self._pieces[self._end_index(header)].start, 0)
            if isinstance(header, tree.Procedure):
                for declaration in header.declarations:
                    self._declaration(declaration)
                self._row(header.body.span.start, 0)
                self._block(header.body, 0)
        end, _, last = self._pieces[-3:]
        begin = self._before(node.statements[0].span.start if node.statements else end.start)
        if begin.word == "BEGIN":
            self._row(begin.start, 0)
        self._statements(node.statements, INDENT)
        self._row(end.start, 0, comment_indent=INDENT)
        self._row(last.start, 0)

    def _declaration(self, node: tree.Declaration | tree.Constant) -> None:
        start = node.span.start
        before = self._before(start)
        if before.word in ("VAR", "CONST"):
            self._row(before.start, 0, continuation=_DECLARATION + INDENT)
        else:
            self._row(start, _DECLARATION, continuation=INDENT)

    # ---- statements

    def _statements(self, nodes: Sequence[tree.Statement], column: int) -> None:
        for node in nodes:
            self._statement(node, column)

    def _statement(self, node: tree.Statement, column: int) -> None:
        self._row(node.span.start, column, continuation=CLAUSE if isinstance(node, tree.Move) else CONTINUATION)
        match node:
            case tree.Move():
                self._move(node, column)
            case tree.Wait() | tree.WaitUntil() | tree.Put():
                self._wait(node, column)
            case tree.If():
                self._if(node, column)
            case tree.While(body=body) | tree.For(body=body) | tree.Lock(body=body) | tree.Queue(body=body):
                self._nested(body, column)
            case tree.When(action=body):
                self._nested(body, column)
            case tree.Block():
                self._block(node, column)
            case _:
                self._parts(node, column)

    def _parts(self, node: tree.Statement, column: int) -> None:
        """Lay out a statement that has several stretches of statements."""
        match node:
            case tree.Repeat():
                self._statements(node.body, column + INDENT)
                self._row(node.tail.start, column, comment_indent=INDENT)
            case tree.Cobegin():
                for branch in node.branches:
                    self._row(branch.span.start, column + INDENT)
                    self._block(branch.body, column + INDENT)
                self._row(node.end.start, column, comment_indent=INDENT)
            case tree.Try():
                self._statements((*node.body, *node.recovery), column + INDENT)
                for word in (node.recover, node.end):
                    self._row(word.start, column, comment_indent=INDENT)

    def _nested(self, node: tree.Statement, column: int) -> None:
        """Lay out the statement behind THEN, ELSE or DO."""
        self._statement(node, column if isinstance(node, tree.Block) else column + INDENT)

    def _wait(self, node: tree.Wait | tree.WaitUntil | tree.Put, column: int) -> None:
        if node.otherwise is not None:
            self._row(self._before(node.otherwise.span.start).start, column, comment_indent=INDENT)
            self._nested(node.otherwise, column)

    def _block(self, node: tree.Block, column: int) -> None:
        self._statements(node.statements, column + INDENT)
        self._row(node.end.start, column, comment_indent=INDENT)

    def _if(self, node: tree.If, column: int) -> None:
        links, last = node.else_if_chain
        further = column + INDENT
        for link in links:
            if link is not node:
                self._row(self._before(link.span.start).start, column, comment_indent=INDENT)
                if any(comment.ends_line for comment in self._pieces[self._index[link.span.start]].comments):
                    # It cannot stand in the line of its ELSE; but a long chain does not walk off to the right.
                    column = further
                    self._row(link.span.start, column)
            self._nested(link.then, column)
        if last is not None:
            self._row(self._before(last.span.start).start, column, comment_indent=INDENT)
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
                row = self._row(start, column, continuation=INDENT)
            block = clause.action if isinstance(clause, tree.On) else None
            if isinstance(block, tree.Block) and not self._is_small(start, block, column):
                opened = row.is_open = True
                self._row(block.span.start, column)
                self._block(block, column)

    def _is_small(self, start: int, block: tree.Block, column: int) -> bool:
        """Whether a clause that begins at an offset and ends with a block fits into a row, and holds nothing large."""
        pieces = self._pieces[self._index[start] : self._index[block.end.start] + 1]
        is_large = any(isinstance(statement, _LARGE) for statement in block.statements)
        has_comments = any(piece.comments for piece in pieces[1:])
        # Behind the block comes a comma or a semicolon.
        return not is_large and not has_comments and column + length(pieces) + INDENT <= self._width
