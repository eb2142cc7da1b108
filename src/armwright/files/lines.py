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


class TwinKeyError(Exception):
    """A key of a JSON object is given twice; JSON lets that pass, and the first value would be lost."""

    def __init__(self, keys: Keys, line: int) -> None:
        """Keep the way to the key, and the line of the second."""
        super().__init__(f"{keys} is given twice, again in line {line}")
        self.keys, self.line = keys, line


def toml_lines(text: str) -> dict[Keys, int]:
    """Return the line, from 1, of every key and table header of a text that is valid TOML."""
    return _Scanner(text, "=").document()


def json_lines(text: str) -> dict[Keys, int]:
    """Return the line, from 1, of every key of a text that is valid JSON.

    Raises:
        TwinKeyError: an object has a key twice.
    """
    scanner = _Scanner(text, ":")
    scanner.blank()
    scanner.value(())
    return scanner.lines


class _Scanner:
    """Walks through a text that a parser has already accepted, so it needs to look only where keys begin."""

    def __init__(self, text: str, separator: str) -> None:
        self._text, self._separator = text, separator
        self._at, self._line = 0, 1
        self.lines: dict[Keys, int] = {}

    def document(self) -> dict[Keys, int]:
        """Walk through TOML: headers, and keys below them."""
        counts: dict[Keys, int] = {}
        table: Keys = ()
        self.blank()
        while self._at < len(self._text):
            if self._text[self._at] == "[":
                table = self._header(counts)
            else:
                self._pair(table)
            self.blank()
        return self.lines

    def blank(self) -> None:
        """Pass over blanks, line ends and comments."""
        self._pass(_BLANK)

    def value(self, keys: Keys) -> None:
        """Pass over a value, and note the keys inside it."""
        first = self._text[self._at]
        if first == "{":
            self._members(keys)
        elif first == "[":
            self._elements(keys)
        elif first in "\"'":
            self._pass(_STRING)
        else:
            self._pass(_SCALAR)

    def _pass(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self._text, self._at)
        assert match, f"cannot scan line {self._line}"  # noqa: S101 - the parser has accepted the text
        self._line += match[0].count("\n")
        self._at = match.end()
        return match[0]

    def _header(self, counts: dict[Keys, int]) -> Keys:
        line = self._line
        array = self._text.startswith("[[", self._at)
        self._at += 2 if array else 1
        names = list(self._key())
        self._at += 2 if array else 1
        keys: Keys = ()
        for name in names[:-1]:
            keys = (*keys, name)
            if keys in counts:
                keys = (*keys, counts[keys] - 1)
            self.lines.setdefault(keys, line)
        keys = (*keys, names[-1])
        if array:
            self.lines.setdefault(keys, line)
            counts[keys] = counts.get(keys, 0) + 1
            keys = (*keys, counts[keys] - 1)
        self.lines[keys] = line
        return keys

    def _pair(self, table: Keys) -> None:
        line = self._line
        keys = table
        for name in self._key():
            keys = (*keys, name)
            if self._separator == ":" and keys in self.lines:
                raise TwinKeyError(keys, line)
            self.lines.setdefault(keys, line)
        self._at += 1  # the separator
        self.blank()
        self.value(keys)

    def _key(self) -> Iterator[str]:
        while True:
            self.blank()
            if self._text[self._at] in "\"'":
                quoted = self._pass(_STRING)
                yield self._unquoted(quoted)
            else:
                yield self._pass(_BARE_KEY)
            self.blank()
            if self._text[self._at] != ".":
                return
            self._at += 1

    def _unquoted(self, quoted: str) -> str:
        # The two know different escapes, and TOML two kinds of quotes: each parser reads its own.
        return str(json.loads(quoted)) if self._separator == ":" else next(iter(tomllib.loads(f"{quoted}=0")))

    def _members(self, keys: Keys) -> None:
        self._at += 1
        self.blank()
        while self._text[self._at] != "}":
            self._pair(keys)
            self._comma()
        self._at += 1

    def _elements(self, keys: Keys) -> None:
        self._at += 1
        self.blank()
        index = 0
        while self._text[self._at] != "]":
            self.lines[*keys, index] = self._line
            self.value((*keys, index))
            self._comma()
            index += 1
        self._at += 1

    def _comma(self) -> None:
        self.blank()
        if self._text[self._at] == ",":
            self._at += 1
            self.blank()
