"""From characters to tokens. Spans count characters of the text as written; comments and blanks leave no token."""

import enum
import math
import re
from collections.abc import Iterator

import attrs

from armwright.cell.names import arm_name
from armwright.program.diagnostics import Diagnostic, Fix
from armwright.program.source import Source, Span
from armwright.program.words import RESERVED


class TokenKind(enum.Enum):
    """What a token is."""

    NAME = "name"
    KEYWORD = "keyword"
    ARM = "arm"
    NUMBER = "number"
    STRING = "string"
    SYMBOL = "symbol"
    END = "end of text"


@attrs.frozen
class Token:
    """One token.

    Attributes:
        kind: what it is.
        text: as written.
        key: as compared: upper case, ``ARM_1`` for ``arm-01``, the digits alone of a number with a unit.
        start: its first character.
        end: the one after its last.
        damaged: whether something has been said about it already.
    """

    kind: TokenKind
    text: str
    key: str
    start: int
    end: int
    damaged: bool = False

    @property
    def span(self) -> Span:
        """Where it stands."""
        return Span(self.start, self.end)


UNITS = ("MM", "CM", "M", "IN", "DEG", "RAD", "S", "MS", "N")

_TOKEN = re.compile(
    r"""
      (?P<blank>   [ \t\r\n\f\v]+ )
    | (?P<comment> \{ [^}]* \} | //[^\r\n]* )
    | (?P<open>    \{ | \(\* | /\* )
    | (?P<arm>     ARM [-_] [0-9]+ (?![\w]) )
    | (?P<noarm>   ARM (?: [ \t]* [-_] [ \t]* | [ \t]+ ) [0-9]+ (?![\w]) | ARM (?![\w]) )
    | (?P<word>    [^\W\d_] \w* )
    | (?P<number>  [0-9]+ (?:\.[0-9]+)? (?:E[+-]?[0-9]+)? (?![\w.]) )
    | (?P<odd>     \.?[0-9] (?: [\w.] | (?<=E)[+-](?=[0-9]) )* )
    | (?P<string>  " [^"\r\n]* "? )
    | (?P<symbol>  := | <= | >= | <> | [;,()=:.\[\]+*/<>-] )
    | (?P<stray>   . )
    """,
    re.VERBOSE | re.IGNORECASE | re.DOTALL,
)
_PLAIN = {"symbol": TokenKind.SYMBOL, "string": TokenKind.STRING}
_WITH_UNIT = re.compile(rf"([0-9]+(?:\.[0-9]+)?(?:E[+-]?[0-9]+)?)({'|'.join(UNITS)})", re.IGNORECASE)

# Characters of other keyboards that stand for one of the language; each takes one place, like the one it stands for.
LOOK_ALIKES = {0xFF01 + i: chr(0x21 + i) for i in range(94)} | {
    ord(other): meant
    for meant, others in {
        " ": "\u00a0\u3000\u2002\u2003\u2009\u202f",
        "-": "\u2010\u2011\u2012\u2013\u2014\u2212",
        "_": "\u203f",
        ".": "\u3002\uff61",
        ",": "\u3001\uff64\u060c\u201a",
        ";": "\u061b\u037e",
        ":": "\u2236",
        "*": "\u00d7\u2217",
    }.items()
    for other in others
}
_HINTS = {
    "'": "RLO has no quotation marks",
    "!": "a comment is written { ... } or // ...",
    "#": "a comment is written { ... } or // ...",
    "}": "no comment is open here",
    "\u201c": "RLO has no quotation marks",
    "\u201d": "RLO has no quotation marks",
}


def scan(source: Source, text: str) -> tuple[list[Token], list[Diagnostic]]:
    """Cut a text into tokens, the last being the end of the text.

    Args:
        source: the program as written.
        text: the same, as long, with line numbers blanked out.

    Returns:
        The tokens and what is wrong with them; whatever can be guessed is a token all the same.
    """
    return _Scanner(source, text).run()


class _Scanner:
    """One pass over a text."""

    def __init__(self, source: Source, text: str) -> None:
        self._written = source.text
        self._text = text if text.isascii() else text.translate(LOOK_ALIKES)
        # A look-alike inside a comment is nobody's business, so they are looked for token by token.
        self._foreign = not text.isascii()
        self._unclosed = False
        self._found: list[Diagnostic] = []
        self._strays: dict[str, list[Span]] = {}
        self._refused: set[str] = set()

    def run(self) -> tuple[list[Token], list[Diagnostic]]:
        tokens = list(self._tokens())
        end = len(self._text)
        tokens.append(Token(TokenKind.END, "", "", end, end, damaged=self._unclosed))
        self._found += [_stray(character, spans) for character, spans in self._strays.items()]
        return tokens, self._found

    def _tokens(self) -> Iterator[Token]:
        position, text = 0, self._text
        makers = {
            "word": self._word,
            "odd": self._odd_number,
            "noarm": self._no_arm,
            "arm": _arm,
            "number": self._number,
        }
        while match := _TOKEN.match(text, position):
            what, word, start = match.lastgroup or "", match[0], position
            position = match.end()
            if self._foreign and what != "comment":
                self._look_alikes(start, position)
            if what in _PLAIN:
                yield Token(_PLAIN[what], word, word, start, position)
            elif what in makers:
                yield makers[what](word, start, position)
            elif what == "open":
                position = self._comment(word, start)
            elif what == "stray":
                self._strays.setdefault(self._written[start], []).append(Span(start, position))

    def _word(self, word: str, start: int, end: int) -> Token:
        key = word.upper()
        if word.isascii():
            return Token(TokenKind.KEYWORD if key in RESERVED else TokenKind.NAME, word, key, start, end)
        if key not in self._refused:
            self._refused.add(key)
            odd = next(character for character in word if not character.isascii())
            self._say(
                "E101",
                f"a name cannot contain `{odd}`",
                Span(start, end),
                "names are made of the letters A to Z, digits and `_`",
            )
        return Token(TokenKind.NAME, word, key, start, end, damaged=True)

    def _number(self, word: str, start: int, end: int) -> Token:
        if not math.isfinite(float(word)):
            return self._odd_number(word, start, end)
        return Token(TokenKind.NUMBER, word, word, start, end)

    def _odd_number(self, word: str, start: int, end: int) -> Token:
        if match := _WITH_UNIT.fullmatch(word):
            return Token(TokenKind.NUMBER, word, match[1], start, end)
        why = "too large" if _is_number(word) else "not a number"
        helps: tuple[str, ...] = ()
        fixes: tuple[Fix, ...] = ()
        if _is_number(word) and "." in (word[0], word[-1]):
            cured = f"0{word}" if word[0] == "." else f"{word}0"
            why, helps, fixes = (
                "a digit is missing beside the point",
                (f"write `{cured}`",),
                (Fix(Span(start, end), cured),),
            )
        self._say("E113", f"`{word}` is not a number of RLO", Span(start, end), why, helps=helps, fixes=fixes)
        return Token(TokenKind.NUMBER, word, "0", start, end, damaged=True)

    def _no_arm(self, word: str, start: int, end: int) -> Token:
        digits = word[3:].strip(" \t-_")
        key = arm_name(digits or "1")
        message, label = (
            (f"`{word}` is not the name of an arm", "no blanks in the name of an arm")
            if digits
            else ("`ARM` alone is not a name", "which arm?")
        )
        fixes = (Fix(Span(start, end), key),) if digits else ()
        self._say("E106", message, Span(start, end), label, helps=(f"write `{key}`",), fixes=fixes)
        return Token(TokenKind.ARM, word, key, start, end, damaged=True)

    def _comment(self, opening: str, start: int) -> int:
        """Say what is wrong with a comment; return where the text goes on."""
        closing = "}" if opening == "{" else opening[::-1].replace("(", ")")
        end = self._text.find(closing, start + len(opening))
        here = Span(start, start + len(opening))
        if end < 0:
            self._unclosed = True
            self._say("E102", "this comment is not closed", here, "opened here", helps=(f"close it with `{closing}`",))
            return len(self._text)
        inside = self._text[start + 2 : end]
        fixes = () if "}" in inside else (Fix(here, "{"), Fix(Span(end, end + 2), "}"))
        self._say("E101", f"`{opening}` does not open a comment in RLO", here, "write `{ ... }`", fixes=fixes)
        return end + 2

    def _look_alikes(self, start: int, end: int) -> None:
        if self._written[start:end] == self._text[start:end]:
            return
        for at in range(start, end):
            # Line numbers have been blanked out and are no look-alikes.
            if ord(self._written[at]) in LOOK_ALIKES:
                self._strays.setdefault(self._written[at], []).append(Span(at, at + 1))

    def _say(
        self,
        code: str,
        message: str,
        span: Span,
        label: str,
        *,
        helps: tuple[str, ...] = (),
        fixes: tuple[Fix, ...] = (),
    ) -> None:
        self._found.append(Diagnostic(code=code, message=message, span=span, label=label, helps=helps, fixes=fixes))


def _arm(word: str, start: int, end: int) -> Token:
    return Token(TokenKind.ARM, word, arm_name(word[len("ARM_") :]), start, end)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def _stray(character: str, spans: list[Span]) -> Diagnostic:
    """Say once what a character is that does not belong to the language."""
    meant = LOOK_ALIKES.get(ord(character))
    shown = f"`{character}`" if character.isprintable() else f"U+{ord(character):04X}"
    more = f"it stands in {len(spans)} places" if len(spans) > 1 else ""
    name = "a blank" if meant == " " else f"`{meant}`"
    return Diagnostic(
        code="E101",
        message=f"{shown} is not a character of RLO" + ("" if character.isprintable() else " programs"),
        span=spans[0],
        label=f"looks like {name}" if meant else _HINTS.get(character, "has no meaning here"),
        notes=(more,) if more else (),
        helps=(f"write {name}",) if meant else (),
        fixes=tuple(Fix(span, meant) for span in spans) if meant else (),
    )
