"""The line number of every key of a TOML or JSON text, which the parsers of Python do not return."""

import json
import re
import tomllib
from collections.abc import Iterator
from typing import TypeAlias

# The path to a value from the top of the document: names of keys and, in arrays, numbers.
Keys: TypeAlias = tuple[str | int, ...]

_BLANK = re.compile(r"(?:[ \t\r\n]+|#[^\n]*)*")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_SCALAR = re.compile(r"[^,\]}\n#]*")
_STRING = re.compile(r'"""(?:[^\\]|\\.)*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'', re.DOTALL)
# A string, a comment, a chain of keys with points between, or one letter of something else. Nothing is tried twice:
# what is matched is not given back, so a text of any kind is passed in one walk.
_QUOTED = r'"(?:[^"\\\n]|\\.)*+"?+|\'[^\'\n]*+\'?+'
_NAME = rf"(?:[A-Za-z0-9_-]++|{_QUOTED})"
_DOTTED_KEYS = re.compile(
    r'"""(?:[^\\"]|\\.|"(?!""))*+(?:"{3,5}+)?+|\'\'\'(?:[^\']|\'(?!\'\'))*+(?:\'{3,5}+)?+|#[^\n]*+|'
    rf"({_NAME}(?:[ \t]*+\.[ \t]*+{_NAME})*+)",
    re.DOTALL,
)
_KEY_NAMES = re.compile(_NAME, re.DOTALL)


class DuplicateKeyError(Exception):
    """A key of a JSON object occurs twice; JSON permits that, and the first value would be lost."""

    def __init__(self, keys: Keys = (), line: int = 1) -> None:
        """Keep the path to the key, and the line of the second, as far as they are known."""
        super().__init__(f"{keys} occurs twice, again in line {line}")
        self.keys, self.line = keys, line


class LineTree:
    """The line of a value and of the values in it, as a tree, so that a long path to a value takes little memory.

    Attributes:
        line: from 1.
        children: by key, or by number in a list: the line of a value that has nothing in it, else its tree.
        tables: how many tables of an array such as ``[[joint]]`` there are so far.
    """

    __slots__ = ("children", "line", "tables")

    def __init__(self, line: int) -> None:
        """Begin a tree for a value on a line."""
        self.line = line
        self.children: dict[str | int, LineTree | int] = {}
        self.tables = 0

    def line_of(self, keys: Keys) -> int | None:
        """Return the line of a value, or of the nearest value around it; None for the whole document."""
        tree, line = self, None
        for key in keys:
            child = tree.children.get(key)
            if child is None:
                break
            if isinstance(child, int):
                return child
            tree, line = child, child.line
        return line

    def child(self, key: str | int, line: int) -> "LineTree":
        """Return the tree of a key; a new one is on ``line``."""
        tree = self.children.get(key)
        if not isinstance(tree, LineTree):
            tree = self.children[key] = LineTree(line if tree is None else tree)
        return tree


def longest_dotted_key(text: str) -> int:
    """Return of how many names the longest dotted key of a text consists, strings and comments left out.

    It may be a text of any kind: a parser of TOML, which would take the square of the time for such a key, has not seen
    it yet.
    """
    longest = 0
    for match in _DOTTED_KEYS.finditer(text):
        chain = match[1]
        if chain and chain.count(".") >= longest:
            longest = max(longest, len(_KEY_NAMES.findall(chain)))
    return longest


def toml_lines(text: str) -> LineTree:
    """Return the line, from 1, of every key and table header of a text that is valid TOML."""
    return _Scanner(text, "=").scan_toml()


def json_lines(text: str) -> LineTree:
    """Return the line, from 1, of every key of a text that is valid JSON.

    Raises:
        DuplicateKeyError: an object has a key twice.
    """
    return _Scanner(text, ":").scan_json()


class _Scanner:
    """A scanner of a text that a parser has already accepted, so that only the beginnings of keys matter."""

    def __init__(self, text: str, separator: str) -> None:
        self._text, self._separator = text, separator
        self._offset, self._line = 0, 1

    def scan_toml(self) -> LineTree:
        """Scan TOML: headers, and keys below them."""
        top = table = LineTree(1)
        self._skip_blanks()
        while self._offset < len(self._text):
            if self._text[self._offset] == "[":
                table = self._scan_header(top)
            else:
                self._scan_pair(table, ())
            self._skip_blanks()
        return top

    def scan_json(self) -> LineTree:
        """Scan JSON: one value."""
        top = LineTree(1)
        self._skip_blanks()
        self._scan_value(top, 0, (), 1)
        first = top.children[0]
        return first if isinstance(first, LineTree) else LineTree(1)

    def _skip_blanks(self) -> None:
        """Skip blanks, line ends and comments."""
        self._match(_BLANK)

    def _scan_value(self, parent: LineTree, key: str | int, path: Keys, line: int) -> None:
        """Scan a value, and store its line and those of the keys in it."""
        first = self._text[self._offset]
        if first in "{[":
            self._scan_container(parent.child(key, line), path, "}" if first == "{" else "]")
        else:
            parent.children.setdefault(key, line)
            self._match(_STRING if first in "\"'" else _SCALAR)

    def _match(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self._text, self._offset)
        assert match, f"cannot scan line {self._line}"  # noqa: S101 - the parser has accepted the text
        self._line += match[0].count("\n")
        self._offset = match.end()
        return match[0]

    def _scan_header(self, top: LineTree) -> LineTree:
        line = self._line
        array = self._text.startswith("[[", self._offset)
        self._offset += 2 if array else 1
        names = list(self._scan_key())
        self._offset += 2 if array else 1
        tree = top
        for name in names[:-1]:
            tree = tree.child(name, line)
            if tree.tables:
                tree = tree.child(tree.tables - 1, line)
        tree = tree.child(names[-1], line)
        if array:
            tree.tables += 1
            tree = tree.child(tree.tables - 1, line)
        tree.line = line
        return tree

    def _scan_pair(self, table: LineTree, path: Keys) -> None:
        line = self._line
        *parent, last = self._scan_key()
        for name in parent:
            table = table.child(name, line)
        if self._separator == ":" and last in table.children:
            raise DuplicateKeyError((*path, last), line)
        self._offset += 1  # the separator
        self._skip_blanks()
        self._scan_value(table, last, (*path, last) if self._separator == ":" else (), line)

    def _scan_key(self) -> Iterator[str]:
        while True:
            self._skip_blanks()
            if self._text[self._offset] in "\"'":
                quoted = self._match(_STRING)
                yield self._unquote(quoted) if "\\" in quoted else quoted[1:-1]
            else:
                yield self._match(_BARE_KEY)
            self._skip_blanks()
            if self._text[self._offset] != ".":
                return
            self._offset += 1

    def _unquote(self, quoted: str) -> str:
        # The two know different escapes, and TOML two kinds of quotes: each parser reads its own.
        return str(json.loads(quoted)) if self._separator == ":" else next(iter(tomllib.loads(f"{quoted}=0")))

    def _scan_container(self, tree: LineTree, path: Keys, end: str) -> None:
        """Scan a table or a list up to its closing brace or bracket."""
        self._offset += 1
        self._skip_blanks()
        index = 0
        while self._text[self._offset] != end:
            if end == "}":
                self._scan_pair(tree, path)
            else:
                self._scan_value(tree, index, (*path, index), self._line)
            self._skip_blanks()
            if self._text[self._offset] == ",":
                self._offset += 1
                self._skip_blanks()
            index += 1
        self._offset += 1
