"""What a formatted program is made of: its words and signs, how each is spelt, and the comments between them."""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise

import attrs

from armwright.program.language.source import Span
from armwright.program.language.words import SENSORS
from armwright.program.semantics.builtins import AXES, FUNCTIONS
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import ScannedText, Token, TokenKind

_NAME, _KEYWORD, _ARM, _SYMBOL = TokenKind.NAME, TokenKind.KEYWORD, TokenKind.ARM, TokenKind.SYMBOL
# Behind these an empty statement needs no `;`.
_NEEDLESS_BEHIND = frozenset((";", "BEGIN", "TRY", "RECOVER", "REPEAT"))
# What stays with the word in front of it, so that no line may end between the two.
_CLOSING = frozenset((";", ",", ")", "]", "."))
_LINE_END = re.compile(r"\n")
_TAB = 8


@attrs.frozen
class Comment:
    """A comment.

    Attributes:
        text: its first line.
        more: its further lines, each with how much further right it begins than the first.
        breaks: how many lines end between what is in front of it and itself.
    """

    text: str
    more: tuple[tuple[int, str], ...]
    breaks: int

    @property
    def is_hard(self) -> bool:
        """Whether nothing may follow it in its last line."""
        return bool(self.more) or self.text.startswith("//")

    def lines(self, column: int) -> list[str]:
        """Return its lines where the first stands at a column; only the further ones are indented."""
        return [self.text, *(" " * max(0, column + right) + text if text else "" for right, text in self.more)]


# Not frozen: a long program has a hundred thousand of them, and blanks are found out after the words.
@attrs.define(eq=False)
class Piece:
    """A word or sign, or a comment within a statement.

    Attributes:
        text: as it shall be written.
        word: the text of a keyword or sign; empty for names, numbers, texts and comments.
        kind: of the token; None for a comment.
        start: its pose in the text as it was.
        breaks: how many lines end between what is in front of it and itself.
        comments: what stands in front of it.
        blank: whether a blank comes in front of it.
        cut: whether a line may end in front of it: the lower the better; None where it must not.
        comment: the comment that this is.
    """

    text: str
    word: str
    kind: TokenKind | None
    start: int
    breaks: int
    comments: list[Comment]
    blank: bool = True
    cut: int | None = None
    comment: Comment | None = None

    @property
    def is_hard(self) -> bool:
        """Whether nothing may follow it in its line."""
        return self.comment is not None and self.comment.is_hard


def pieces_of(text: str, scanned: ScannedText, program: tree.Program) -> list[Piece]:
    """Return the pieces of a program without errors of syntax; the last is empty and stands for its end.

    Args:
        text: with line feeds alone as line ends, line numbers blanked out.
        scanned: its tokens and comments.
        program: its tree, for the names that are declared.
    """
    pieces_: list[Piece] = []
    gaps = _Gaps(text, scanned.comments)
    dropped: list[Comment] = []
    most = 0
    word = ";"
    for token, spelt in zip(scanned.tokens, _spellings(scanned.tokens, program), strict=True):
        start = token.start
        if gaps.is_plain(start):
            comments: list[Comment] = []
            breaks = text.count("\n", gaps.at, start)
        else:
            comments, breaks = gaps.read(start)
        gaps.at = token.end
        kind = token.kind
        if dropped or most:
            comments, breaks = _joined(dropped, most, comments, breaks)
            dropped, most = [], 0
        if token.key == ";" and word in _NEEDLESS_BEHIND:
            dropped, most = comments, breaks
            continue
        word = token.key if kind is _KEYWORD or kind is _SYMBOL else ""
        pieces_.append(Piece(spelt, word, kind, start, breaks, comments))
    _behind_signs(pieces_)
    return pieces_


def _joined(first: list[Comment], breaks: int, second: list[Comment], later: int) -> tuple[list[Comment], int]:
    """Join two gaps between pieces, the piece between them being left out."""
    if not second:
        return first, max(breaks, later)
    piece = attrs.evolve(second[0], breaks=max(breaks, second[0].breaks))
    return [*first, piece, *second[1:]], later


def _behind_signs(pieces: Sequence[Piece]) -> None:
    """Put comments that end a line behind a sign that must not begin one."""
    for piece, following in pairwise(pieces):
        if piece.comments and piece.word in _CLOSING:
            first = next(
                (index for index, comment in enumerate(piece.comments) if comment.is_hard), len(piece.comments)
            )
            following.comments[:0] = piece.comments[first:]
            del piece.comments[first:]


class _Gaps:
    """Reads what stands between tokens."""

    def __init__(self, text: str, comments: Sequence[Span]) -> None:
        self.at = 0
        self._text = text
        self._comments = comments
        self._next = 0
        self._far = len(text) + 1

    def is_plain(self, stop: int) -> bool:
        """Whether no comment stands between here and a pose."""
        return self._next >= len(self._comments) or self._comments[self._next].start >= stop

    def read(self, stop: int) -> tuple[list[Comment], int]:
        """Return the comments up to a pose, and how many lines end behind the last."""
        pieces_ = []
        while not self.is_plain(stop):
            span = self._comments[self._next]
            pieces_.append(self._comment(span))
            self._next += 1
            self.at = span.end
        return pieces_, self._text.count("\n", self.at, stop)

    def _comment(self, span: Span) -> Comment:
        text = self._text
        breaks = text.count("\n", self.at, span.start)
        first, *more = _LINE_END.split(text[span.start : span.end])
        if not more:
            return Comment(first.rstrip(" \t\f\v"), (), breaks)
        front = text[text.rfind("\n", 0, span.start) + 1 : span.start]
        column = len(front.expandtabs(_TAB))
        return Comment(first.rstrip(" \t\f\v"), tuple(_placed(line, column) for line in more), breaks)


def _placed(line: str, column: int) -> tuple[int, str]:
    """Return how far right of a column a line begins, and what it says."""
    text = line.strip(" \t\f\v")
    lead = line[: len(line) - len(line.lstrip(" \t\f\v"))]
    return len(lead.expandtabs(_TAB)) - column, text


def _spellings(tokens: Sequence[Token], program: tree.Program) -> Iterator[str]:
    """Give each token as it shall be written: words of the language in upper case, names as they are declared."""
    names = _Names(program)
    key = before = ""
    in_units = False
    last = len(tokens) - 1
    for index, token in enumerate(tokens):
        kind = token.kind
        earlier, before, key = before, key, token.key
        if kind is _KEYWORD:
            in_units = key == "UNITS"
            yield key
        elif kind is _NAME:
            follows = tokens[index + 1].key if index < last else ""
            is_axis = before == "(" and earlier == "FORCE" and key in AXES and follows == ")"
            if in_units or is_axis or (before == "READ" and key in SENSORS):
                yield key
            elif before == "OPERATE":
                yield token.text
            else:
                yield names.spelling(token, follows)
        else:
            yield key if kind is _ARM else token.text


class _Names:
    """How the names of a program are declared; asked for token after token."""

    def __init__(self, program: tree.Program) -> None:
        self._procedures: dict[str, str] = {}
        self._own: list[tuple[Span, dict[str, str]]] = []
        self._declared = {name.span.start for name in _declared_in(program.declarations)}
        self._globals = _as_declared(program.declarations)
        for procedure in program.procedures:
            name = procedure.name
            self._procedures.setdefault(name.key, name.text)
            own = (*procedure.parameters, *procedure.declarations)
            self._declared |= {name.span.start, *(piece.span.start for piece in _declared_in(own))}
            self._own.append((procedure.span, _as_declared(own)))
        self._own.sort(key=lambda piece: piece[0].start, reverse=True)

    def spelling(self, token: Token, follows: str) -> str:
        """Return a name as it is declared, or as it is written where it is not."""
        start, key = token.start, token.key
        if start in self._declared:
            return token.text
        if follows == "(":
            return self._procedures.get(key) or (key if key in FUNCTIONS else token.text)
        while self._own and self._own[-1][0].end <= start:
            self._own.pop()
        if self._own and self._own[-1][0].start <= start and (own := self._own[-1][1].get(key)):
            return own
        return self._globals.get(key) or self._procedures.get(key) or token.text


def _declared_in(declarations: Sequence[tree.Declaration]) -> Iterator[tree.Name]:
    return (name for declaration in declarations for name in declaration.names)


def _as_declared(declarations: Sequence[tree.Declaration]) -> dict[str, str]:
    """Return how each name is written where it is declared first."""
    return {name.key: name.text for name in reversed([*_declared_in(declarations)])}
