"""The parser's finger on the tokens: looking, taking, and saying what is missing."""

from collections.abc import Sequence
from typing import NoReturn

from armwright.program.diagnostics import Findings, Fix
from armwright.program.source import Source, Span
from armwright.program.tokens import Token, TokenKind
from armwright.program.words import STATEMENTS


class LostError(Exception):
    """The parser has said what is wrong and cannot go on here; it looks for the next statement."""


class Tokens:
    """The tokens of a program, the place the parser has come to, and what it has found."""

    def __init__(self, source: Source, tokens: Sequence[Token]) -> None:
        """Start at the first token; the last must be the end of the text."""
        self.source = source
        self.found = Findings()
        self._tokens = tokens
        self._last = len(tokens) - 1
        self.at = 0

    @property
    def now(self) -> Token:
        """The token to be read next."""
        return self._tokens[self.at]

    @property
    def before(self) -> Token:
        """The token read last; the first one where none has been read."""
        return self._tokens[max(0, self.at - 1)]

    def ahead(self, steps: int = 1) -> Token:
        """Return a token further on; behind the end it is always the end."""
        return self._tokens[min(self._last, self.at + steps)]

    def find(self, keyword: str) -> int:
        """Return where a keyword stands first; -1 if nowhere."""
        places = (at for at, one in enumerate(self._tokens) if one.key == keyword and one.kind is TokenKind.KEYWORD)
        return next(places, -1)

    @property
    def done(self) -> bool:
        """Whether everything has been read."""
        return self.now.kind is TokenKind.END

    def take(self) -> Token:
        """Read one token; the end stays."""
        token = self.now
        self.at = min(self._last, self.at + 1)
        return token

    def sees(self, *keys: str) -> bool:
        """Whether the next token is one of these keywords or symbols."""
        token = self.now
        return token.key in keys and token.kind in (TokenKind.KEYWORD, TokenKind.SYMBOL)

    def sees_word(self, *keys: str) -> bool:
        """Whether the next token is a name that reads so: a word with a meaning in this place only."""
        return self.now.kind is TokenKind.NAME and self.now.key in keys

    def accept(self, *keys: str) -> Token | None:
        """Read the next token if it is one of these keywords or symbols."""
        return self.take() if self.sees(*keys) else None

    def accept_word(self, *keys: str) -> Token | None:
        """Read the next token if it is a name that reads so."""
        return self.take() if self.sees_word(*keys) else None

    def gap(self) -> Span:
        """Return the place right behind the token read last, where a missing thing belongs."""
        end = self.before.end if self.at else self.now.start
        return Span(end, end)

    def since(self, start: Token | Span) -> Span:
        """Return the stretch from ``start`` to the token read last."""
        first = start.start
        return Span(first, max(first, self.before.end))

    def same_line(self) -> bool:
        """Whether the next token stands in the line of the one read last."""
        return self.source.line(self.before.start) == self.source.line(self.now.start)

    def lost(self, message: str, label: str, *, code: str = "E111", helps: tuple[str, ...] = ()) -> NoReturn:
        """Say what is missing at the next token, unless that was reported before, and give up the statement.

        Raises:
            LostError: always.
        """
        if not self.now.damaged:
            # At the end of the text there is nothing to mark; the gap before it is the place.
            span = self.gap() if self.done else self.now.span
            self.found.say(code, message, span, label, helps=helps)
        raise LostError

    def expect(self, key: str, where: str) -> None:
        """Read ``key``; or say that it is missing, and go on as if it had been there.

        Args:
            key: a keyword or symbol.
            where: the place in words, such as ``after the name``.

        Raises:
            LostError: nothing that could stand behind ``key`` follows either.
        """
        if self.accept(key):
            return
        if self._misspelt(key):
            self.found.say(
                "E112", f"expected `{key}` {where}", self.now.span, f"expected `{key}`", helps=(f"write `{key}`",)
            )
            self.take()
            return
        gap = self.gap()
        if not self.now.damaged:
            # A word needs blanks around it; a sign goes where it is missing.
            self.found.say(
                "E112",
                f"missing `{key}` {where}",
                gap,
                f"expected `{key}` here",
                helps=(f"insert `{key}` after `{self.before.text}`",),
                fixes=(Fix(gap, f" {key}" if key[0].isalpha() else key),),
            )
        if key != ")" and (self.done or self.sees(";", "END", *STATEMENTS)):
            raise LostError

    def _misspelt(self, key: str) -> bool:
        """Whether a name stands where a keyword should, with another name or arm behind it."""
        kinds = (TokenKind.NAME, TokenKind.ARM)
        return key[0].isalpha() and self.now.kind is TokenKind.NAME and self.ahead().kind in kinds and self.same_line()


def shown(token: Token) -> str:
    """Return how a token is called in a message."""
    return "the end of the text" if token.kind is TokenKind.END else f"`{token.text}`"
