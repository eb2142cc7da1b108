"""Where the keys of a TOML or JSON text stand: the line of every key, which the parsers do not tell."""

import json
import re
import tomllib
from collections.abc import Iterator
from typing import TypeAlias

# The way to a value from the top of the document: names of keys and, in arrays, numbers.
Keys: TypeAlias = tuple[str | int, ...]

_BLANK = re.compile(r"(?:[ \t\r\n]+|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_SCALAR = re.compile(r"[^,\]}\n#]*")
_STRING = re.compile(r'"""(?:[^\\]|\\.)*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'', re.DOTALL)
# A string, a comment, a chain of keys with points between, or one letter of something else. Nothing is tried twice:
# what is matched is not given back, so a text of any kind is passed in one walk.
_QUOTED = r'"(?:[^"\\\n]|\\.)*+"?+|\'[^\'\n]*+\'?+'
_NAME = rf"(?:[A-Za-z0-9_-]++|{_QUOTED})"
_CHAINS = re.compile(
    r'"""(?:[^\\"]|\\.|"(?!""))*+(?:"{3,5}+)?+|\'\'\'(?:[^\']|\'(?!\'\'))*+(?:\'{3,5}+)?+|#[^\n]*+|'
    rf"({_NAME}(?:[ \t]*+\.[ \t]*+{_NAME})*+)",
    re.DOTALL,
)
_NAMES = re.compile(_NAME, re.DOTALL)


class TwinKeyError(Exception):
    """A key of a JSON object is given twice; JSON lets that pass, and the first value would be lost."""

    def __init__(self, keys: Keys, line: int) -> None:
        """Keep the way to the key, and the line of the second."""
        super().__init__(f"{keys} occurs twice, again in line {line}")
        self.keys, self.line = keys, line


class Line:
    """Where a value stands, and the values in it: a tree, so that a long way to a value costs no more than its end.

    Attributes:
        line: from 1.
        below: by key, or by number in a list: the line of a value that has nothing in it, else its tree.
        tables: how many tables of an array such as ``[[joint]]`` there are so far.
    """

    __slots__ = ("below", "line", "tables")

    def __init__(self, line: int) -> None:
        """Stand on a line."""
        self.line = line
        self.below: dict[str | int, Line | int] = {}
        self.tables = 0

    def of(self, keys: Keys) -> int | None:
        """Return the line of what stands there, or of the nearest around it; None where that is the whole document."""
        here, found = self, None
        for key in keys:
            below = here.below.get(key)
            if below is None:
                break
            if isinstance(below, int):
                return below
            here, found = below, below.line
        return found

    def child(self, key: str | int, line: int) -> "Line":
        """Return the tree below a key; one that is new stands on ``line``."""
        found = self.below.get(key)
        if not isinstance(found, Line):
            found = self.below[key] = Line(line if found is None else found)
        return found


def longest_dotted_key(text: str) -> int:
    """Return of how many names the longest dotted key of a text consists, strings and comments left out.

    It may be a text of any kind: a parser of TOML, which would take the square of the time for such a key, has not seen
    it yet.
    """
    longest = 0
    for match in _CHAINS.finditer(text):
        chain = match[1]
        if chain and chain.count(".") >= longest:
            longest = max(longest, len(_NAMES.findall(chain)))
    return longest


def toml_lines(text: str) -> Line:
    """Return the line, from 1, of every key and table header of a text that is valid TOML."""
    return _Scanner(text, "=").document()


def json_lines(text: str) -> Line:
    """Return the line, from 1, of every key of a text that is valid JSON.

    Raises:
        TwinKeyError: an object has a key twice.
    """
    scanner = _Scanner(text, ":")
    scanner.blank()
    return scanner.whole()


class _Scanner:
    """Walks through a text that a parser has already accepted, so it needs to look only where keys begin."""

    def __init__(self, text: str, separator: str) -> None:
        self._text, self._separator = text, separator
        self._at, self._line = 0, 1

    def document(self) -> Line:
        """Walk through TOML: headers, and keys below them."""
        top = table = Line(1)
        self.blank()
        while self._at < len(self._text):
            if self._text[self._at] == "[":
                table = self._header(top)
            else:
                self._pair(table, ())
            self.blank()
        return top

    def whole(self) -> Line:
        """Walk through JSON: one value."""
        top = Line(1)
        self._value(top, 0, (), 1)
        first = top.below[0]
        return first if isinstance(first, Line) else Line(1)

    def blank(self) -> None:
        """Pass over blanks, line ends and comments."""
        self._pass(_BLANK)

    def _value(self, around: Line, key: str | int, way: Keys, line: int) -> None:
        """Pass over a value, and note where it and the keys inside it stand."""
        first = self._text[self._at]
        if first == "{":
            self._members(around.child(key, line), way)
        elif first == "[":
            self._elements(around.child(key, line), way)
        else:
            around.below.setdefault(key, line)
            self._pass(_STRING if first in "\"'" else _SCALAR)

    def _pass(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self._text, self._at)
        assert match, f"cannot scan line {self._line}"  # noqa: S101 - the parser has accepted the text
        self._line += match[0].count("\n")
        self._at = match.end()
        return match[0]

    def _header(self, top: Line) -> Line:
        line = self._line
        array = self._text.startswith("[[", self._at)
        self._at += 2 if array else 1
        names = list(self._key())
        self._at += 2 if array else 1
        here = top
        for name in names[:-1]:
            here = here.child(name, line)
            if here.tables:
                here = here.child(here.tables - 1, line)
        here = here.child(names[-1], line)
        if array:
            here.tables += 1
            here = here.child(here.tables - 1, line)
        here.line = line
        return here

    def _pair(self, table: Line, way: Keys) -> None:
        line = self._line
        *around, last = self._key()
        for name in around:
            table = table.child(name, line)
        if self._separator == ":" and last in table.below:
            raise TwinKeyError((*way, last), line)
        self._at += 1  # the separator
        self.blank()
        self._value(table, last, (*way, last) if self._separator == ":" else (), line)

    def _key(self) -> Iterator[str]:
        while True:
            self.blank()
            if self._text[self._at] in "\"'":
                quoted = self._pass(_STRING)
                yield self._unquoted(quoted) if "\\" in quoted else quoted[1:-1]
            else:
                yield self._pass(_BARE_KEY)
            self.blank()
            if self._text[self._at] != ".":
                return
            self._at += 1

    def _unquoted(self, quoted: str) -> str:
        # The two know different escapes, and TOML two kinds of quotes: each parser reads its own.
        return str(json.loads(quoted)) if self._separator == ":" else next(iter(tomllib.loads(f"{quoted}=0")))

    def _members(self, table: Line, way: Keys) -> None:
        self._at += 1
        self.blank()
        while self._text[self._at] != "}":
            self._pair(table, way)
            self._comma()
        self._at += 1

    def _elements(self, row: Line, way: Keys) -> None:
        self._at += 1
        self.blank()
        index = 0
        while self._text[self._at] != "]":
            self._value(row, index, (*way, index), self._line)
            self._comma()
            index += 1
        self._at += 1

    def _comma(self) -> None:
        self.blank()
        if self._text[self._at] == ",":
            self._at += 1
            self.blank()
