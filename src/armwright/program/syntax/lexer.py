"""From characters to tokens. Spans count characters of the text as written; comments and blanks leave no token."""

import enum
import re
from collections import Counter

import attrs

from armwright.cell.names import arm_name
from armwright.files.limits import limit, limit_message
from armwright.program.language.diagnostic import Diagnostic, DiagnosticList, Fix
from armwright.program.language.source import Source, Span
from armwright.program.language.units import MAX_NUMBER, UNITS
from armwright.program.language.words import VOCABULARIES, Standard


class TokenKind(enum.Enum):
    """What a token is."""

    NAME = "name"
    KEYWORD = "keyword"
    ARM = "arm"
    NUMBER = "number"
    STRING = "string"
    SYMBOL = "symbol"
    END = "end of text"


# Not frozen, though nothing changes one: a program has a hundred thousand of them, and freezing trebles their price.
@attrs.define
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

    @property
    def gap(self) -> Span:
        """The position right in front of it, where a missing thing belongs."""
        return Span(self.start, self.start)


@attrs.frozen(kw_only=True)
class ScannedText:
    """What became of the characters of a text.

    Attributes:
        tokens: in order, the last being the end of the text; whatever can be guessed is a token all the same.
        comments: where each stands, from its first mark to its last.
        diagnostics: what is wrong.
    """

    tokens: tuple[Token, ...]
    comments: tuple[Span, ...]
    diagnostics: tuple[Diagnostic, ...]


_BLANKS = " \t\r\n\f\v"
_DIGITS = r"[0-9]+ (?:\.[0-9]+)? (?:[Ee][+-]?[0-9]+)?"
_UNIT = "(?:" + "|".join("".join(f"[{letter}{letter.lower()}]" for letter in unit) for unit in UNITS) + ")"
# What other languages write for = <> AND OR is read whole, so that it can be called by its name.
_PATTERN = re.compile(
    rf"""
    [{_BLANKS}]*+ (?:
      ( [^\W\d_] \w* (?: \.[^\W\d_] \w* )* )                                        # a word, or several with points
    | ( := | <= | >= | <> | == | != | && | \|\| | =< | => | [;,)=:\[\]+*<>-] | \.(?![0-9]) | \((?!\*) | /(?![/*]) )
    | ( {_DIGITS} {_UNIT}? (?![\w.]) )
    | ( \{{ [^}}]*+ \}} | //[^\r\n]* )                                              # a comment
    | ( " [^"\r\n]* "? )
    | ( \.?[0-9] (?: [\w.] | (?<=[Ee])[+-](?=[0-9]) )* )                            # like a number
    | ( \{{ | \(\* | /\* )                                                          # a comment that is none
    | ( . )
    )
    """,
    re.VERBOSE | re.DOTALL,
)
_WORD, _SYMBOL, _NUMBER, _COMMENT, _STRING, _MALFORMED_NUMBER, _COMMENT_OPENER, _STRAY_CHARACTER = range(1, 9)

_ARM = re.compile(r"ARM[-_]([0-9]+)(?!\w)", re.IGNORECASE)
_MISSPELT_ARM = re.compile(r"ARM(?:[ \t]*[-_][ \t]*|[ \t]+)[0-9]+(?!\w)|ARM(?!\w)", re.IGNORECASE)
_WITH_UNIT = re.compile(rf"({_DIGITS}){_UNIT}", re.VERBOSE)
# Where a text that is not closed may have been meant to end.
_AFTER_STRING = re.compile(r"[ \t]*\)?[ \t]*;?[ \t]*\Z")

# Characters of other keyboards that stand for one of the language; each takes one position, like the one it stands for.
# Those of `"` and `}` are none: they may stand in a text or a comment without ending it.
CONFUSABLES = {0xFF01 + i: chr(0x21 + i) for i in range(94) if chr(0x21 + i) not in '"}'} | {
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
    **dict.fromkeys("'\u201c\u201d", 'a text stands between two `"`'),
    "!": "a comment is written { ... } or // ...",
    "#": "a comment is written { ... } or // ...",
    "}": "no comment is open here",
}
# A text between the quotation marks of other languages, and of programs that set them by themselves.
_FOREIGN_STRING = re.compile(
    '[\u201c\u201d\u201e\uff02\u00ab][^"\u201c\u201d\u201e\uff02\u00bb\r\n]*["\u201c\u201d\uff02\u00bb]'
    "|(?<!\\w)['`\u2018][^\"'`\u2019\r\n]*['`\u2019]"
)
# What means nothing, neither here nor in other languages.
_MEANINGLESS = re.compile(
    rf"""[^\w\s;,()=:\[\]+*<>./{{"'`#!&|\u2018\u201c\u201d\u201e\u00ab\uff02{"".join(map(chr, CONFUSABLES))}-]+"""
)
_FOREIGN_COMMENT = re.compile(r"[#!](?=[ \t#!])[^\r\n]*")


def scan(source: Source, text: str, standard: Standard = Standard.RLO_2, first: int = 0) -> ScannedText:
    """Cut a text into tokens.

    Args:
        source: the program as written.
        text: the same, as long, with line numbers blanked out.
        standard: which words are reserved.
        first: the character to begin at.
    """
    return _Scanner(source, text, standard).scan(first)


class _Scanner:
    """One pass over a text."""

    def __init__(self, source: Source, text: str, standard: Standard) -> None:
        self._source_text = source.text
        self._text = text if text.isascii() else text.translate(CONFUSABLES)
        # A look-alike inside a comment is nobody's business, so they are looked for token by token.
        self._has_confusables = not text.isascii()
        self._standard, self._reserved = standard, VOCABULARIES[standard].reserved
        self._max_tokens = limit("words")
        self._unclosed = False
        # Most words of a program stand there more than once: what they are is found out the first time.
        self._known: dict[str, tuple[TokenKind, str]] = {}
        self._tokens: list[Token] = []
        self._comments: list[Span] = []
        self._diagnostics = DiagnosticList()
        self._report = self._diagnostics.report
        # Of each character that does not belong to the language where the first stands, of those with a cure all.
        self._strays: dict[str, list[Span]] = {}
        self._counts: Counter[str] = Counter()
        # By the number of tokens in front of such characters, where the last of them ends.
        self._stray_ends: dict[int, int] = {}
        self._reported_names: set[str] = set()

    def scan(self, position: int) -> ScannedText:
        # Blanks at the end would be tried in vain from each of them.
        last = len(self._text.rstrip(_BLANKS))
        while position < last:
            position = self._scan_tokens(position, last)
        end = len(self._text)
        self._tokens.append(Token(TokenKind.END, "", "", end, end, damaged=self._unclosed))
        for character, spans in self._strays.items():
            self._report_stray(character, spans, max(len(spans), self._counts[character]))
        self._mark_damaged()
        return ScannedText(
            tokens=tuple(self._tokens), comments=tuple(self._comments), diagnostics=tuple(self._diagnostics)
        )

    def _scan_tokens(self, position: int, last: int) -> int:
        """Read tokens one behind the other; return where the text goes on behind one that needs a closer look."""
        known, tokens, has_confusables, max_tokens = self._known, self._tokens, self._has_confusables, self._max_tokens
        add = tokens.append
        for match in _PATTERN.finditer(self._text, position, last):
            what = match.lastindex or _STRAY_CHARACTER
            word = match[what]
            start, end = match.span(what)
            if len(tokens) >= max_tokens:
                return self._report_too_long(start, end, last)
            if has_confusables:
                # Of a comment only the blanks in front, of a text only its marks.
                inside = what in (_COMMENT, _STRING)
                self._note_confusables(match.start(), start + (what == _STRING) if inside else end)
            if (plain := known.get(word)) is not None:
                add(Token(plain[0], word, plain[1], start, end))
                continue
            resume = self._scan_new_word(what, word, start, end)
            if resume != end:
                return resume
        return last

    def _report_too_long(self, start: int, end: int, last: int) -> int:
        """Say that the text has too many words; what follows is passed over."""
        # Nothing is said of the end that is not read.
        self._unclosed = True
        self._report("E119", f"the program is too long: {limit_message('words')}", Span(start, end), "read up to here")
        return last

    def _scan_new_word(self, what: int, word: str, start: int, end: int) -> int:
        """Make a token of a word seen for the first time; return where the text goes on."""
        if what == _COMMENT:
            self._comments.append(Span(start, end))
            return end
        if what == _COMMENT_OPENER:
            return self._scan_comment(word, start)
        if what == _STRAY_CHARACTER:
            return self._scan_stray_character(start, end)
        if what == _STRING:
            token = self._scan_string(start, end)
        elif what == _WORD:
            token = self._scan_word(word, start, end)
        elif what == _SYMBOL:
            token = Token(TokenKind.SYMBOL, word, word, start, end)
        else:
            token = self._scan_number(word, start, end, malformed=what == _MALFORMED_NUMBER)
        self._tokens.append(token)
        if not token.damaged and token.text == word and what != _STRING:
            self._known[word] = token.kind, token.key
        return token.end

    def _scan_word(self, word: str, start: int, end: int) -> Token:
        key = word.upper()
        if key.startswith("ARM"):
            if match := _ARM.match(self._text, start):
                return Token(TokenKind.ARM, match[0], arm_name(match[1]), start, match.end())
            if match := _MISSPELT_ARM.match(self._text, start):
                return self._scan_misspelt_arm(match[0], start, match.end())
        if "." in word and not self._is_qualified(key):
            return self._scan_word(word[: word.index(".")], start, start + word.index("."))
        if word.isascii():
            return Token(TokenKind.KEYWORD if key in self._reserved else TokenKind.NAME, word, key, start, end)
        if key not in self._reported_names:
            self._reported_names.add(key)
            foreign = next(character for character in word if not character.isascii())
            label = "names are made of the letters A to Z, digits and `_`"
            self._report("E101", f"a name cannot contain `{foreign}`", Span(start, end), label)
        return Token(TokenKind.NAME, word, key, start, end, damaged=True)

    def _is_qualified(self, key: str) -> bool:
        """Whether words with points between them are one name; behind a keyword the point ends the program."""
        return self._standard is Standard.RLO_2 and key.partition(".")[0] not in self._reserved

    def _scan_number(self, word: str, start: int, end: int, *, malformed: bool) -> Token:
        match = _WITH_UNIT.fullmatch(word)
        digits = match[1] if match else word
        # In another unit of length a number has up to a thousand times the digits.
        largest = MAX_NUMBER * 1e-3 if match else MAX_NUMBER
        if (match or not malformed) and float(digits) <= largest:
            return Token(TokenKind.NUMBER, word, digits, start, end)
        why = f"too large: {largest:g} at most" if _is_number(digits) else "not a number"
        advice, fixes, span = "", tuple[Fix, ...](), Span(start, end)
        if _is_number(word) and "." in (word[0], word[-1]):
            cured = f"0{word}" if word[0] == "." else f"{word}0"
            why, advice, fixes = "a digit is missing next to the decimal point", f"write `{cured}`", (Fix(span, cured),)
        self._report("E113", f"`{word}` is not a number of RLO", span, why, advice=advice, fixes=fixes)
        return Token(TokenKind.NUMBER, word, "0", start, end, damaged=True)

    def _scan_string(self, start: int, end: int) -> Token:
        written = self._source_text[start:end]
        if len(written) > 1 and self._text[end - 1] == '"':
            return Token(TokenKind.STRING, written, written, start, end)
        match = _AFTER_STRING.search(self._text, start + 1, end)
        end = match.start() if match else end
        self._report("E120", "this text is not closed", Span(start, end), "opened here", advice='close it with `"`')
        return Token(TokenKind.STRING, f'{self._source_text[start:end]}"', '"', start, end, damaged=True)

    def _scan_misspelt_arm(self, word: str, start: int, end: int) -> Token:
        digits = word[3:].strip(" \t-_")
        key = arm_name(digits or "1")
        message, label, fixes = "`ARM` alone is not a name", "which arm?", tuple[Fix, ...]()
        if digits:
            message, label = f"`{word}` is not the name of an arm", "no blanks in the name of an arm"
            fixes = (Fix(Span(start, end), key),)
        self._report("E106", message, Span(start, end), label, advice=f"write `{key}`", fixes=fixes)
        return Token(TokenKind.ARM, word, key, start, end, damaged=True)

    def _scan_comment(self, opening: str, start: int) -> int:
        """Say what is wrong with a comment; return where the text goes on."""
        closing = "}" if opening == "{" else opening[::-1].replace("(", ")")
        end = self._text.find(closing, start + len(opening))
        here = Span(start, start + len(opening))
        if end < 0:
            self._unclosed = True
            self._report("E102", "this comment is not closed", here, "opened here", advice=f"close it with `{closing}`")
            return len(self._text)
        inside = self._text[start + 2 : end]
        fixes = () if "}" in inside else (Fix(here, "{"), Fix(Span(end, end + 2), "}"))
        self._report("E101", f"`{opening}` does not open a comment in RLO", here, "write `{ ... }`", fixes=fixes)
        self._comments.append(Span(start, end + 2))
        return end + 2

    def _scan_stray_character(self, start: int, end: int) -> int:
        """Take note of a character that does not belong to the language; return where the text goes on."""
        if run := _MEANINGLESS.match(self._source_text, start):
            self._count_strays(run[0], start)
            return run.end()
        text = _FOREIGN_STRING.match(self._source_text, start)
        if text is None:
            character = self._source_text[start]
            if ord(character) in CONFUSABLES:
                self._strays.setdefault(character, []).append(Span(start, end))
            else:
                self._count_strays(character, start)
            comment = _FOREIGN_COMMENT.match(self._source_text, start)
            return comment.end() if comment else end
        first, last = Span(start, start + 1), Span(text.end() - 1, text.end())
        fixes = (Fix(first, '"'), *([Fix(last, '"')] if text[0][-1] != '"' else []))
        self._report("E101", f"`{text[0][0]}` does not open a text in RLO", first, 'write `"..."`', fixes=fixes)
        self._tokens.append(Token(TokenKind.STRING, f'"{text[0][1:-1]}"', '"', start, text.end(), damaged=True))
        return text.end()

    def _report_stray(self, character: str, spans: list[Span], count: int) -> None:
        """Say once what a character is that does not belong to the language, and in how many places it stands."""
        meant = CONFUSABLES.get(ord(character))
        shown = f"`{character}`" if character.isprintable() else f"U+{ord(character):04X}"
        text = f"{shown} is not a character of RLO" + ("" if character.isprintable() else " programs")
        note = f"it occurs in {count} places" if count > 1 else ""
        if meant is None:
            self._report("E101", text, spans[0], _HINTS.get(character, "has no meaning here"), note=note)
            return
        name, fixes = "a blank" if meant == " " else f"`{meant}`", tuple(Fix(span, meant) for span in spans)
        self._report("E101", text, spans[0], f"looks like {name}", note=note, advice=f"write {name}", fixes=fixes)

    def _count_strays(self, characters: str, start: int) -> None:
        """Count characters that mean nothing."""
        self._counts.update(characters)
        for character in set(characters) - self._strays.keys():
            first = start + characters.index(character)
            self._strays[character] = [Span(first, first + 1)]
        self._stray_ends[len(self._tokens)] = start + len(characters)

    def _mark_damaged(self) -> None:
        """Take what stands behind such a character, in its line, for something that has been told of."""
        for index, end in self._stray_ends.items():
            token = self._tokens[index]
            token.damaged |= self._source_text.find("\n", end, token.start) < 0

    def _note_confusables(self, start: int, end: int) -> None:
        if self._source_text[start:end] == self._text[start:end]:
            return
        for index in range(start, end):
            # Line numbers have been blanked out and are no look-alikes.
            if ord(self._source_text[index]) in CONFUSABLES:
                self._strays.setdefault(self._source_text[index], []).append(Span(index, index + 1))


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word
