"""Entries of a table of a TOML file, changed in its text: all else stays as it is, to the byte."""

from __future__ import annotations

import re
import tomllib
from typing import Any, NamedTuple

from armwright.errors import ArmwrightError

_HEADER = re.compile(r"[ \t]*\[[ \t]*([^\[\]\n]+?)[ \t]*\][ \t]*(?:#.*)?$")
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_PAIR = re.compile(r"[ \t]*(\"[^\"\n]*\"|'[^'\n]*'|[A-Za-z0-9_.\- \t\"']+?)[ \t]*=[ \t]*")
_OPEN, _CLOSED = "[{", "]}"


class TomlLayoutError(ArmwrightError, ValueError):
    """A file is laid out so that an entry cannot be changed by itself."""


class _Pair(NamedTuple):
    """A key and its value in a text.

    Attributes:
        path: of the key, from the root, as it is written.
        start: where its line begins.
        key: where its key stands.
        value: where its value stands.
        end: where its last line ends, behind what ends it.
    """

    path: tuple[str, ...]
    start: int
    key: tuple[int, int]
    value: tuple[int, int]
    end: int


class _Header(NamedTuple):
    """The header of a table in a text: its path, where its name stands, and where its line begins and ends."""

    path: tuple[str, ...]
    name: tuple[int, int]
    start: int
    end: int


def entries_of(text: str, table: str) -> dict[str, Any]:
    """Return what stands in a table at the root of a TOML text; nothing where there is no such table."""
    entries: dict[str, Any] = tomllib.loads(text).get(table, {})
    return entries


def with_entry(text: str, table: tuple[str, ...], key: str, value: str) -> str:
    """Return a text with a value for a key of a table; a table at the root is made where it is missing.

    Args:
        text: of a TOML file.
        table: its path, bare keys.
        key: a bare key; of one that is there already, the value alone is changed.
        value: as TOML.

    Raises:
        TomlLayoutError: the file is laid out so that something else would change with it.
    """
    pairs, headers = _scan(text)
    for pair in pairs:
        if pair.path == (*table, key):
            a, b = pair.value
            return _checked(text, text[:a] + value + text[b:], table, key, value)
    line = f"{key} = {value}\n"
    own = next((header for header in headers if header.path == table), None)
    if own is None:
        separator = "" if not text else "\n" if text.endswith("\n") else "\n\n"
        # A header in brackets ends with the next one: the new one stands last.
        return _checked(text, f"{text}{separator}[{'.'.join(table)}]\n{line}", table, key, value)
    inside = [pair.end for pair in pairs if pair.start >= own.end and _header_of(headers, pair.start) == own]
    place = max(inside, default=own.end)
    before = text[:place] if text[:place].endswith("\n") else f"{text[:place]}\n"
    return _checked(text, before + line + text[place:], table, key, value)


def without_entry(text: str, table: tuple[str, ...], key: str) -> str:
    """Return a text without an entry of a table.

    Raises:
        TomlLayoutError: the entry does not stand by itself.
    """
    pairs, headers = _scan(text)
    gone = [(pair.start, pair.end) for pair in pairs if pair.path[: len(table) + 1] == (*table, key)]
    gone += [(header.start, header.end) for header in headers if header.path[: len(table) + 1] == (*table, key)]
    changed = text
    for a, b in sorted(gone, reverse=True):
        changed = changed[:a] + changed[b:]
    return _checked(text, changed, table, key, None)


def with_name(text: str, table: str, key: str, name: str) -> str:
    """Return a text in which an entry of a table at the root has another key.

    Raises:
        TomlLayoutError: the key cannot be found.
    """
    pairs, headers = _scan(text)
    spans = [pair.key for pair in pairs if pair.path[:2] == (table, key) and _writes(text, pair.key, key)]
    spans += [header.name for header in headers if header.path[:2] == (table, key)]
    if not spans:
        raise TomlLayoutError(f"{table}.{key} is not found in the file; rename it by hand")
    changed = text
    for a, b in sorted(spans, reverse=True):
        changed = changed[:a] + _replaced(changed[a:b], key, name) + changed[b:]
    before, after = tomllib.loads(text), tomllib.loads(changed)
    expected = {name if old == key else old: value for old, value in before[table].items()}
    if list(after[table].items()) != list(expected.items()):
        raise TomlLayoutError(f"{table}.{key} is spread over the file; rename it by hand")
    return changed


def _replaced(written: str, key: str, name: str) -> str:
    return re.sub(rf"(?<![A-Za-z0-9_-]){re.escape(key)}(?![A-Za-z0-9_-])", name, written, count=1)


def _writes(text: str, span: tuple[int, int], key: str) -> bool:
    """Whether a key is written in full where a pair stands, and not in the header above."""
    return _replaced(text[span[0] : span[1]], key, "") != text[span[0] : span[1]]


def value_spans(text: str, table: str) -> list[tuple[tuple[str, ...], tuple[int, int]]]:
    """Return the paths of all values in a table at the root, and where they stand in the text."""
    return [(pair.path, pair.value) for pair in _scan(text)[0] if pair.path[0] == table]


def _checked(before: str, after: str, table: tuple[str, ...], key: str, value: str | None) -> str:
    """Return a changed text, if nothing but the entry has become another one."""
    expected = tomllib.loads(before)
    entries: Any = expected
    for part in table:
        entries = entries.setdefault(part, {})
    if value is None:
        entries.pop(key, None)
        if not expected[table[0]]:
            # A table whose entries are tables of their own goes with the last of them.
            expected |= {table[0]: tomllib.loads(after).get(table[0])}
    else:
        entries[key] = tomllib.loads(f"it = {value}")["it"]
    try:
        found = tomllib.loads(after)
    except tomllib.TOMLDecodeError:
        found = {}
    if found != {name: entry for name, entry in expected.items() if entry is not None}:
        name = ".".join((*table, key))
        raise TomlLayoutError(f"{name} cannot be changed by itself as the file is laid out; change it by hand")
    return after


def _header_of(headers: list[_Header], place: int) -> _Header | None:
    return next((header for header in reversed(headers) if header.end <= place), None)


def _scan(text: str) -> tuple[list[_Pair], list[_Header]]:
    """Return the pairs and the headers of a TOML text that is valid."""
    pairs: list[_Pair] = []
    headers: list[_Header] = []
    place, above = 0, tuple[str, ...]()
    while place < len(text):
        end = text.find("\n", place) + 1 or len(text)
        line = text[place:end].rstrip("\r\n")
        if match := _HEADER.match(line):
            above = _path(match[1])
            headers.append(_Header(above, (place + match.start(1), place + match.end(1)), place, end))
        elif line.lstrip().startswith("[["):
            above = ("",)
        elif (match := _PAIR.match(line)) and not line.lstrip().startswith("#"):
            value = place + match.end(), _value_end(text, place + match.end())
            end = text.find("\n", value[1]) + 1 or len(text)
            key = place + match.start(1), place + match.end(1)
            pairs.append(_Pair((*above, *_path(match[1])), place, key, value, end))
        place = end
    return pairs, headers


def _path(written: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in written.split("."))


def _value_end(text: str, place: int) -> int:
    """Return where a value ends that begins at a place."""
    depth = 0
    while place < len(text):
        if text.startswith(('"""', "'''"), place):
            place = text.index(text[place : place + 3], place + 3) + 3
        elif text[place] in "\"'":
            place = _string_end(text, place)
        elif text[place] == "#" or (text[place] == "\n" and not depth):
            if not depth:
                break
            place = text.find("\n", place)
        else:
            depth += (text[place] in _OPEN) - (text[place] in _CLOSED)
            place += 1
            continue
        if not depth and text[place - 1] in "\"'":
            break
    return len(text[:place].rstrip())


def _string_end(text: str, place: int) -> int:
    quote, place = text[place], place + 1
    while text[place] != quote:
        place += 1 + (quote == '"' and text[place] == "\\")
    return place + 1
