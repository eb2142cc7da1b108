"""The pieces of a formatted program: its tokens, how each is spelt, and the comments between them."""

from collections import deque
from collections.abc import Iterator, Sequence
from itertools import pairwise, takewhile

import attrs

from armwright.program.language.source import Span
from armwright.program.language.words import SENSORS, statement_phrase
from armwright.program.semantics.builtins import AXES, FUNCTIONS, WITH_AXIS, WITH_KEY
from armwright.program.syntax import tree
from armwright.program.syntax.lexer import ScannedText, Token, TokenKind

_NAME, _KEYWORD, _ARM, _SYMBOL = TokenKind.NAME, TokenKind.KEYWORD, TokenKind.ARM, TokenKind.SYMBOL
# Behind these an empty statement needs no `;`.
_NEEDLESS_AFTER = frozenset((";", "BEGIN", "TRY", "RECOVER", "REPEAT"))
# What stays with the word in front of it, so that no line may end between the two.
_CLOSING = frozenset((";", ",", ")", "]", "."))
# White space within a line.
_BLANKS = " \t\f\v"


@attrs.frozen
class Comment:
    """A comment.

    Attributes:
        text: its first line.
        rest: its further lines, each with how much further right it begins than the first.
        breaks: how many lines end between the token or comment before it and itself.
    """

    text: str
    rest: tuple[tuple[int, str], ...]
    breaks: int

    @property
    def ends_line(self) -> bool:
        """Whether nothing may follow it in its last line."""
        return bool(self.rest) or self.text.startswith("//")

    def lines(self, column: int) -> list[str]:
        """Return its lines where the first stands at a column; only the further ones are indented."""
        return [self.text, *(" " * max(0, column + right) + text if text else "" for right, text in self.rest)]


# Not frozen: a long program has a hundred thousand of them, and their white space is determined after their texts.
@attrs.define(eq=False)
class Piece:
    """A token, or a comment within a statement.

    Attributes:
        text: as it shall be written.
        word: the text of a keyword or symbol; empty for names, numbers, strings and comments.
        kind: of the token; None for a comment.
        start: its offset in the text of the program.
        breaks: how many lines end between the token or comment before it and itself.
        comments: those before it.
        blank: whether a blank is written before it.
        penalty: whether a line may be broken before it: the lower the better; None where it must not.
        comment: the comment that this is.
    """

    text: str
    word: str
    kind: TokenKind | None
    start: int
    breaks: int
    comments: list[Comment]
    blank: bool = True
    penalty: int | None = None
    comment: Comment | None = None

    @property
    def ends_line(self) -> bool:
        """Whether nothing may follow it in its line."""
        return self.comment is not None and self.comment.ends_line


def pieces_of(text: str, scanned: ScannedText, program: tree.Program) -> list[Piece]:
    """Return the pieces of a program without errors of syntax; the last is empty and stands for its end.

    Args:
        text: with line feeds alone as line ends, line numbers blanked out.
        scanned: its tokens and comments.
        program: its tree, for the names that are declared.
    """
    pieces: list[Piece] = []
    # The comments before a `;` that is left out, and the line ends there.
    left: list[Comment] = []
    left_breaks = 0
    word = ";"
    tokens, gaps = scanned.tokens, _gaps(text, scanned)
    for token, spelling, (comments, line_ends) in zip(tokens, _spellings(tokens, program), gaps, strict=True):
        breaks = line_ends if comments else max(left_breaks, line_ends)
        if comments and left_breaks:
            comments[0] = attrs.evolve(comments[0], breaks=max(left_breaks, comments[0].breaks))
        comments[:0] = left
        left, left_breaks = [], 0
        if token.key == ";" and word in _NEEDLESS_AFTER:
            left, left_breaks = comments, breaks
            continue
        word = token.key if token.kind is _KEYWORD or token.kind is _SYMBOL else ""
        pieces.append(Piece(spelling, word, token.kind, token.start, breaks, comments))
    _move_comments(pieces)
    return pieces


def _move_comments(pieces: Sequence[Piece]) -> None:
    """Move comments that end a line behind a symbol that must not begin one."""
    for piece, following in pairwise(pieces):
        if piece.comments and piece.word in _CLOSING:
            count = len([*takewhile(lambda comment: not comment.ends_line, piece.comments)])
            following.comments[:0] = piece.comments[count:]
            del piece.comments[count:]


def _gaps(text: str, scanned: ScannedText) -> Iterator[tuple[list[Comment], int]]:
    """Give the comments between each token and the one before it, and how many lines end behind the last of them."""
    end, waiting = 0, deque(scanned.comments)
    for token in scanned.tokens:
        comments: list[Comment] = []
        while waiting and waiting[0].start < token.start:
            span = waiting.popleft()
            comments.append(_comment(text, span, text.count("\n", end, span.start)))
            end = span.end
        yield comments, text.count("\n", end, token.start)
        end = token.end


def _comment(text: str, span: Span, breaks: int) -> Comment:
    first, *rest = text[span.start : span.end].split("\n")
    column = len(text[text.rfind("\n", 0, span.start) + 1 : span.start].expandtabs())
    indents = [len(line.expandtabs()) - len(line.expandtabs().lstrip(_BLANKS)) - column for line in rest]
    stripped = [line.strip(_BLANKS) for line in rest]
    return Comment(first.rstrip(_BLANKS), tuple(zip(indents, stripped, strict=True)), breaks)


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
            is_axis = before == "(" and earlier in WITH_AXIS and key in AXES and follows == ")"
            if in_units or is_axis or statement_phrase(before, key, follows) or (before == "READ" and key in SENSORS):
                yield key
            elif (
                before in ("OPERATE", "PULSE", "TIMER")
                or (before == "WHEN" and follows in (":", "ON", "OFF"))
                or (before == "(" and earlier in WITH_KEY and follows == ")")
            ):
                yield token.text
            else:
                yield names.spelling(token, follows)
        else:
            yield key if kind is _ARM else token.text


class _Names:
    """How the names of a program are spelt where they are declared; to be asked for token after token."""

    def __init__(self, program: tree.Program) -> None:
        self._procedures: dict[str, str] = {}
        self._own: list[tuple[Span, dict[str, str]]] = []
        self._declared = {name.span.start for name in _declared_in(program.declarations)}
        self._declared |= {constant.name.span.start for constant in program.constants}
        self._globals = _as_declared(program.declarations)
        self._globals |= {constant.name.key: constant.name.text for constant in program.constants}
        for procedure in program.procedures:
            name = procedure.name
            self._procedures.setdefault(name.key, name.text)
            own = (*procedure.parameters, *procedure.declarations)
            self._declared |= {name.span.start, *(name.span.start for name in _declared_in(own))}
            self._own.append((procedure.span, _as_declared(own)))
        self._own.reverse()

    def spelling(self, token: Token, follows: str) -> str:
        """Return a name as it is declared, or as it is written where it is not."""
        start, key = token.start, token.key
        if start in self._declared:
            return token.text
        if "." in key and (owner := self._spelt(attrs.evolve(token, key=key.partition(".")[0]))) is not None:
            return f"{owner}.{token.text.partition('.')[2]}"
        if follows == "(":
            return self._procedures.get(key) or (key if key in FUNCTIONS else token.text)
        return self._spelt(token) or self._procedures.get(key) or token.text

    def _spelt(self, token: Token) -> str | None:
        """Return a variable as it is declared; None where it is not."""
        while self._own and self._own[-1][0].end <= token.start:
            self._own.pop()
        if self._own and self._own[-1][0].start <= token.start and (own := self._own[-1][1].get(token.key)):
            return own
        return self._globals.get(token.key)


def _declared_in(declarations: Sequence[tree.Declaration]) -> Iterator[tree.Name]:
    return (name for declaration in declarations for name in declaration.names)


def _as_declared(declarations: Sequence[tree.Declaration]) -> dict[str, str]:
    """Return how each name is written where it is declared first."""
    return {name.key: name.text for name in reversed([*_declared_in(declarations)])}
