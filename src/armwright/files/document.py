"""Reading TOML and JSON that people write: a cursor that checks what it reads and names file, line and key."""

import json
import math
import tomllib
from collections.abc import Collection, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from armwright.arrays import Array
from armwright.errors import FileFormatError, closest
from armwright.files.inputs import read_text
from armwright.files.limits import beyond, limit
from armwright.files.lines import Keys, Line, TwinKeyError, json_lines, longest_dotted_key, toml_lines

_MISSING: Any = object()
# No quantity of a robot is larger, and products of three such numbers are still numbers.
_LARGEST = 1e100
# Of a text that is not what was expected, a message shows this many characters.
_SHOWN_TEXT = 60


class Document:
    """A file of keys and values, with the line of every key.

    Attributes:
        path: where it was read.
        text: of the file, its line ends line feeds.
        root: the cursor at its top.
    """

    def __init__(self, path: Path, text: str, data: Mapping[str, Any], *, is_json: bool) -> None:
        """Keep a parsed text; ``read`` does the parsing."""
        self.path, self.text = path, text
        self._is_json = is_json
        self.root = Table(self, (), data)

    @classmethod
    def read(cls, path: Path | str) -> "Document":
        """Read a file: JSON when it ends in .json or begins with a brace, TOML otherwise.

        Raises:
            FileFormatError: it is missing, a folder, not UTF-8, has a slip of syntax, or is beyond a limit.
        """
        path = Path(path)
        text = read_text(path)
        is_json = path.suffix.lower() == ".json" or (path.suffix.lower() != ".toml" and text.lstrip().startswith("{"))
        data = _parsed(path, text, is_json=is_json)
        if not isinstance(data, dict):
            raise FileFormatError(path, 1, "", f"expected keys and values in braces, got {_kind(data)}")
        return cls(path, text, data, is_json=is_json)

    def line(self, keys: Keys) -> int | None:
        """Return the line of a key, or of the nearest table around it."""
        return self._lines.of(keys)

    @cached_property
    def _lines(self) -> Line:
        # Only who has something to say of a key asks where it stands.
        return json_lines(self.text) if self._is_json else toml_lines(self.text)


class Table:
    """A cursor at one table of a document: every key is read once, with its kind, and what is left over is refused.

    Tables that are not there read as empty ones, so that optional tables need no special case.
    """

    def __init__(self, document: Document, keys: Keys, data: Mapping[str, Any]) -> None:
        """Stand at ``keys`` of a document."""
        self._document, self.keys, self._data = document, keys, data
        self._read: set[str] = set()

    def __contains__(self, key: str) -> bool:
        """Whether the key is given."""
        return key in self._data

    def error(self, key: str | None, message: str, index: int | None = None) -> FileFormatError:
        """Return the error that says ``message`` of a key here.

        Args:
            key: None for the table itself.
            message: what is wrong.
            index: which entry of the list under ``key`` is meant, from 0.
        """
        return self._error_at(() if key is None else (key,) if index is None else (key, index), message)

    def number(self, key: str, default: Any = _MISSING, *, lower: float = -math.inf, upper: float = math.inf) -> float:
        """Return a finite number between ``lower`` and ``upper``.

        Raises:
            FileFormatError: it is missing without a default, no number, not finite, or out of range.
        """
        value = self._value(key, default, "a number")
        if value is default:
            return float(default)
        self._require_number((key,), value)
        if not lower <= value <= upper:
            above, below = f"{lower:g} or more", f"{upper:g} or less"
            expected = above if math.isinf(upper) else below if math.isinf(lower) else f"{lower:g} to {upper:g}"
            raise self.error(key, f"expected {expected}, got {value:g}")
        return float(value)

    def positive(self, key: str, default: Any = _MISSING) -> float:
        """Return a finite number above 0.

        Raises:
            FileFormatError: it is missing without a default, no number, or not above 0.
        """
        value = self.number(key, default)
        if key in self and not value > 0:
            raise self.error(key, f"expected a number above 0, got {value:g}")
        return value

    def vector(self, key: str, length: int | Collection[int], default: Any = _MISSING) -> Array:
        """Return an array of that many finite numbers; several lengths may be allowed.

        Raises:
            FileFormatError: it is missing without a default, or not such an array.
        """
        value = self._value(key, default, f"a list of {_counted(length)}")
        return np.asarray(default, dtype=np.float64) if value is default else self._numbers((key,), value, length)

    def vectors(self, key: str, length: int) -> list[Array]:
        """Return a list of arrays of that many finite numbers each.

        Raises:
            FileFormatError: it is missing, or not such a list.
        """
        expected = f"a list of lists of {length} numbers"
        value = self._value(key, _MISSING, expected)
        if not isinstance(value, list):
            raise self.error(key, f"expected {expected}, got {_kind(value)}")
        return [self._numbers((key, i), row, length) for i, row in enumerate(value)]

    def text(self, key: str, default: Any = _MISSING) -> str:
        """Return a string.

        Raises:
            FileFormatError: it is missing without a default, or no string.
        """
        value = self._value(key, default, "a text in quotes")
        if value is not default and not isinstance(value, str):
            raise self.error(key, f"expected a text in quotes, got {_kind(value)}")
        return str(value)

    def texts(self, key: str) -> list[str]:
        """Return a list of strings.

        Raises:
            FileFormatError: it is missing, or not such a list.
        """
        value = self._value(key, _MISSING, "a list of texts in quotes")
        if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
            raise self.error(key, f"expected a list of texts in quotes, got {_kind(value)}")
        return value

    def choice(self, key: str, choices: Collection[str], default: Any = _MISSING) -> str:
        """Return a string that is one of ``choices``.

        Raises:
            FileFormatError: it is missing without a default, or none of them; the nearest is named.
        """
        value = self._value(key, default, f"one of {', '.join(sorted(choices))}")
        value = value if value is default else self.text(key)
        if value not in choices:
            near = closest(value, choices)
            hint = f"; did you mean '{near}'?" if near else ""
            raise self.error(key, f"expected one of {', '.join(sorted(choices))}, got {_kind(value)}{hint}")
        return str(value)

    def table(self, key: str, *, required: bool = False) -> "Table":
        """Return the cursor at a table below; an empty one when it is missing and not required.

        Raises:
            FileFormatError: it is required and missing, or no table.
        """
        value = self._value(key, _MISSING if required else {}, "a table")
        if not isinstance(value, dict):
            raise self.error(key, f"expected a table, got {_kind(value)}")
        return Table(self._document, (*self.keys, key), value)

    def tables(self, key: str, bound: str = "entries") -> list["Table"]:
        """Return the cursors at the tables of an array such as ``[[joint]]``.

        Args:
            key: of the array.
            bound: the name of the limit of how many there may be.

        Raises:
            FileFormatError: it is missing, empty, no array of tables, or has more than the limit.
        """
        value = self._value(key, _MISSING, f"one or more tables [[{key}]]")
        if not isinstance(value, list) or not value or not all(isinstance(row, dict) for row in value):
            raise self.error(key, f"expected one or more tables [[{key}]], got {_kind(value)}")
        most = limit(bound)
        if len(value) > most:
            raise self.error(key, f"too many: {beyond(bound, len(value))}", most)
        return [Table(self._document, (*self.keys, key, i), row) for i, row in enumerate(value)]

    def free_keys(self) -> Iterator[str]:
        """Walk through the keys of a table whose names are free, such as those of frames."""
        yield from self._data

    def is_table(self, key: str) -> bool:
        """Whether the value of a key is a table."""
        return isinstance(self._data.get(key), dict)

    def allow(self, *keys: str) -> None:
        """Make keys known that need not be given: ``finish`` may name them as the nearest to a misspelt one."""
        self._read.update(keys)

    def finish(self) -> None:
        """Refuse the first key that nobody has read.

        Raises:
            FileFormatError: there is one; the nearest known key is named.
        """
        for key in self._data:
            if key not in self._read:
                left = self._read - set(self._data)
                near = closest(key, left) or next((one for one in sorted(left) if one.startswith(f"{key}_")), None)
                known = f"known keys: {', '.join(sorted(self._read))}" if self._read else "no keys are allowed here"
                hint = f"did you mean '{near}'?" if near else known
                raise self.error(key, f"unknown key; {hint}")

    def _value(self, key: str, default: Any, expected: str) -> Any:
        self._read.add(key)
        if key in self._data:
            return self._data[key]
        if default is _MISSING:
            near = closest(key, set(self._data) - self._read)
            hint = f"; was '{near}' meant?" if near else ""
            raise self.error(key, f"missing, expected {expected}{hint}")
        return default

    def _require_number(self, keys: Keys, value: Any) -> None:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self._error_at(keys, f"expected a number, got {_kind(value)}")
        if isinstance(value, float) and not math.isfinite(value):
            raise self._error_at(keys, f"expected a finite number, got {value}")
        if abs(value) > _LARGEST:
            got = f"{value:g}" if isinstance(value, float) else "an integer of many digits"
            raise self._error_at(keys, f"expected a number no larger than {_LARGEST:g}, got {got}")

    def _numbers(self, keys: Keys, value: Any, length: int | Collection[int]) -> Array:
        if not isinstance(value, list):
            raise self._error_at(keys, f"expected a list of {_counted(length)}, got {_kind(value)}")
        for i, item in enumerate(value):
            self._require_number((*keys, i), item)
        if len(value) not in ((length,) if isinstance(length, int) else length):
            raise self._error_at(keys, f"expected {_counted(length)}, got {len(value)}")
        return np.array(value, dtype=np.float64)

    def _error_at(self, below: Keys, message: str) -> FileFormatError:
        keys = (*self.keys, *below)
        return FileFormatError(self._document.path, self._document.line(keys), _shown(keys), message)


def _parsed(path: Path, text: str, *, is_json: bool) -> Any:
    """Return what a text says, in tables and lists that are not deeper than the limit.

    Raises:
        FileFormatError: it has a slip of syntax, or is beyond a limit.
    """
    too_deep = FileFormatError(path, None, "", f"nested too deeply: {beyond('nesting')}")
    if not is_json and longest_dotted_key(text) > limit("nesting"):
        raise too_deep
    try:
        data = json.loads(text, object_pairs_hook=_object) if is_json else tomllib.loads(text)
    except _TwinError as error:
        raise _twin(path, text) or too_deep from error
    except tomllib.TOMLDecodeError as error:
        raise _toml_error(path, text, error) from error
    except json.JSONDecodeError as error:
        raise FileFormatError(path, error.lineno, "", f"not valid JSON: {error.msg}, column {error.colno}") from error
    except RecursionError as error:
        raise too_deep from error
    except ValueError as error:  # what remains: Python reads no integers of many thousand digits
        raise _too_many_digits(path) from error
    if not _measured(path, data):
        raise too_deep
    return data


class _TwinError(Exception):
    """A key of a JSON object is given twice; JSON lets that pass, and the first value would be lost."""


def _object(members: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(members)
    if len(found) < len(members):
        raise _TwinError
    return found


def _twin(path: Path, text: str) -> FileFormatError | None:
    try:
        json_lines(text)
    except TwinKeyError as error:
        return FileFormatError(path, error.line, _shown(error.keys), "this key occurs twice")
    except RecursionError:
        pass
    return None


def _measured(path: Path, data: Any) -> bool:
    """Whether nothing is deeper than the limit.

    Raises:
        FileFormatError: a whole number has more digits than the limit.
    """
    largest = 10 ** limit("digits")
    row = [data]
    for _ in range(limit("nesting") + 1):
        if any(type(value) is int and abs(value) >= largest for value in row):
            raise _too_many_digits(path)
        row = [
            below
            for value in row
            if isinstance(value, dict | list)
            for below in (value.values() if isinstance(value, dict) else value)
        ]
        if not row:
            return True
    return False


def _too_many_digits(path: Path) -> FileFormatError:
    return FileFormatError(path, None, "", f"an integer in it has too many digits: {beyond('digits')}")


def _toml_error(path: Path, text: str, error: tomllib.TOMLDecodeError) -> FileFormatError:
    """Take the line out of the parser's message, where it tells one, and put it in front."""
    message, _, place = str(error).partition(" (at ")
    line = None
    if place.startswith("line "):
        line = int(place.removeprefix("line ").partition(",")[0])
        message += f", {place.partition(', ')[2].rstrip(')')}"
    elif place:
        line = text.rstrip("\n").count("\n") + 1
        message += ", at the end of the file"
    return FileFormatError(path, line, "", f"not valid TOML: {message}")


def _shown(keys: Keys) -> str:
    """Write a way as people would: ``joint 3, mass_kg`` counts from 1; a key that cannot be seen is quoted."""
    words: list[str] = []
    for key in keys:
        if isinstance(key, int):
            words[-1] += f" {key + 1}"
        else:
            words.append(key if key.isprintable() and key.strip() else _quoted(key))
    return ", ".join(words)


def _counted(length: int | Collection[int]) -> str:
    return f"{length if isinstance(length, int) else ' or '.join(map(str, length))} numbers"


def _quoted(text: str) -> str:
    """Write a text on one line, not too long."""
    return repr(text if len(text) <= _SHOWN_TEXT else f"{text[:_SHOWN_TEXT]}...")


def _kind(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return f"the truth value {str(value).lower()}"
    if isinstance(value, str):
        return f"the text {_quoted(value)}"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "a table"
    return f"{value}"
