"""Reading TOML and JSON: tables that check their values, with errors that name file, line and key."""

import itertools
import json
import math
import tomllib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from armwright.arrays import LARGEST, Array
from armwright.errors import FileFormatError, closest, shown
from armwright.files.inputs import file_path, read_text
from armwright.files.key_lines import DuplicateKeyError, Keys, LineTree, json_lines, longest_dotted_key, toml_lines
from armwright.files.limits import limit, limit_message

_MISSING: Any = object()


class Document:
    """A file of keys and values, with the line of every key.

    Attributes:
        path: where it was read.
        text: of the file, its line ends line feeds.
        root: its table at the top.
    """

    def __init__(self, path: Path, text: str, data: Mapping[str, Any], *, is_json: bool) -> None:
        """Keep a parsed text; ``read`` does the parsing."""
        self.path, self.text = path, text
        # How much of what is limited for a whole file has been read so far, by the name of the limit.
        self.amounts: Counter[str] = Counter()
        self._is_json = is_json
        self.root = Table(self, (), data)

    @classmethod
    def read(cls, path: Path | str) -> "Document":
        """Read a file: JSON when it ends in .json or begins with a brace, TOML otherwise.

        Raises:
            FileFormatError: it is missing, a folder, not UTF-8, has a slip of syntax, or is beyond a limit.
        """
        path = file_path(path)
        text = read_text(path)
        is_json = path.suffix.lower() == ".json" or (path.suffix.lower() != ".toml" and text.lstrip().startswith("{"))
        return cls.parse(path, text, is_json=is_json)

    @classmethod
    def parse(cls, path: Path, text: str, *, is_json: bool) -> "Document":
        """Parse a text that was read from a file.

        Raises:
            FileFormatError: it has a slip of syntax, is beyond a limit, or is no table.
        """
        data = _parse(path, text, is_json=is_json)
        if not isinstance(data, dict):
            raise FileFormatError(path, 1, "", f"expected keys and values in braces, got {_value_text(data)}")
        return cls(path, text, data, is_json=is_json)

    def line(self, keys: Keys) -> int | None:
        """Return the line of a key, or of the nearest table around it."""
        return self._lines.line_of(keys)

    @cached_property
    def _lines(self) -> LineTree:
        # Lines are needed for messages only.
        return json_lines(self.text) if self._is_json else toml_lines(self.text)


class Table:
    """A table of a document whose keys are read one by one, each with its type; keys that were not read are refused.

    Tables that are not there read as empty ones, so that optional tables need no special case.
    """

    def __init__(self, document: Document, keys: Keys, data: Mapping[str, Any]) -> None:
        """Take the table at ``keys`` of a document."""
        self._document, self.keys, self._data = document, keys, data
        self._read: set[str] = set()

    @property
    def path(self) -> Path:
        """The file."""
        return self._document.path

    def __contains__(self, key: str) -> bool:
        """Whether the table has the key."""
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

    def whole(self, key: str, lower: float, upper: float = math.inf, default: Any = _MISSING) -> int:
        """Return a whole number from ``lower`` to ``upper``.

        Raises:
            FileFormatError: it is missing without a default, no whole number, or out of range.
        """
        value = self.number(key, default, lower=lower, upper=upper)
        if value != round(value):
            raise self.error(key, f"expected a whole number, got {value:g}")
        return round(value)

    def flag(self, key: str, *, default: bool = False) -> bool:
        """Return ``true`` or ``false``.

        Raises:
            FileFormatError: it is neither of them.
        """
        value = self._value(key, default, "true or false")
        if not isinstance(value, bool):
            raise self.error(key, f"expected true or false, got {_value_text(value)}")
        return value

    def vector(
        self, key: str, length: int | Collection[int], default: Any = _MISSING, *, infinite: bool = False
    ) -> Array:
        """Return an array of that many finite numbers; several lengths may be allowed, and ``inf``.

        Raises:
            FileFormatError: it is missing without a default, or not such an array.
        """
        value = self._value(key, default, f"a list of {_numbers_text(length)}")
        if value is default:
            return np.asarray(default, dtype=np.float64)
        return self._numbers((key,), value, length, infinite=infinite)

    def numbers(self, key: str) -> Array:
        """Return an array of finite numbers, of any length.

        Raises:
            FileFormatError: it is missing, or not such an array.
        """
        value = self._value(key, _MISSING, "a list of numbers")
        return self._numbers((key,), value, len(value) if isinstance(value, list) else 0)

    def vectors(self, key: str, length: int) -> list[Array]:
        """Return a list of arrays of that many finite numbers each.

        Raises:
            FileFormatError: it is missing, or not such a list.
        """
        expected = f"a list of lists of {length} numbers"
        value = self._value(key, _MISSING, expected)
        if not isinstance(value, list):
            raise self.error(key, f"expected {expected}, got {_value_text(value)}")
        return [self._numbers((key, i), row, length) for i, row in enumerate(value)]

    def text(self, key: str, default: Any = _MISSING) -> str:
        """Return a string.

        Raises:
            FileFormatError: it is missing without a default, or no string.
        """
        value = self._value(key, default, "a text in quotes")
        if value is not default and not isinstance(value, str):
            raise self.error(key, f"expected a text in quotes, got {_value_text(value)}")
        return str(value)

    def texts(self, key: str) -> list[str]:
        """Return a list of strings.

        Raises:
            FileFormatError: it is missing, or not such a list.
        """
        value = self._value(key, _MISSING, "a list of texts in quotes")
        if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
            raise self.error(key, f"expected a list of texts in quotes, got {_value_text(value)}")
        return value

    def text_rows(self, key: str, length: int) -> list[list[str]]:
        """Return a list of rows of that many strings each; an empty one when it is missing.

        Raises:
            FileFormatError: it is no such list, or longer than the limit of entries.
        """
        expected = f"a list of lists of {length} texts in quotes"
        value = self._value(key, [], expected)
        if not isinstance(value, list):
            raise self.error(key, f"expected {expected}, got {_value_text(value)}")
        if len(value) > limit("entries"):
            raise self.error(key, f"too many: {limit_message('entries', len(value))}")
        for i, row in enumerate(value):
            if not isinstance(row, list) or len(row) != length or not all(isinstance(text, str) for text in row):
                raise self.error(key, f"expected {length} texts in quotes, got {_value_text(row)}", i)
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
            raise self.error(key, f"expected one of {', '.join(sorted(choices))}, got {_value_text(value)}{hint}")
        return str(value)

    def table(self, key: str, *, required: bool = False) -> "Table":
        """Return a table in this one; an empty one when it is missing and not required.

        Raises:
            FileFormatError: it is required and missing, or no table.
        """
        value = self._value(key, _MISSING if required else {}, "a table")
        if not isinstance(value, dict):
            raise self.error(key, f"expected a table, got {_value_text(value)}")
        return Table(self._document, (*self.keys, key), value)

    def tables(self, key: str, bound: str = "entries") -> list["Table"]:
        """Return the tables of an array such as ``[[joint]]``.

        Args:
            key: of the array.
            bound: the name of the limit of how many there may be.

        Raises:
            FileFormatError: it is missing, empty, no array of tables, or has more than the limit.
        """
        value = self._value(key, _MISSING, f"one or more tables [[{key}]]")
        if not isinstance(value, list) or not value or not all(isinstance(row, dict) for row in value):
            raise self.error(key, f"expected one or more tables [[{key}]], got {_value_text(value)}")
        most = limit(bound)
        if len(value) > most:
            raise self.error(key, f"too many: {limit_message(bound, len(value))}", most)
        return [Table(self._document, (*self.keys, key, i), row) for i, row in enumerate(value)]

    def __iter__(self) -> Iterator[str]:
        """Give the keys, for tables whose keys have any name, such as those of frames."""
        return iter(self._data)

    def is_table(self, key: str) -> bool:
        """Whether the value of a key is a table."""
        return isinstance(self._data.get(key), dict)

    def is_empty(self, key: str) -> bool:
        """Whether the value of a key is an empty list."""
        return self._data.get(key) == []

    def is_text(self, key: str) -> bool:
        """Whether the value of a key is a text."""
        return isinstance(self._data.get(key), str)

    def add_amount(self, bound: str, amount: int, key: str) -> None:
        """Add to how much of something all keys of the file have read together.

        Args:
            bound: name of its limit.
            amount: that a key has read.
            key: the key.

        Raises:
            FileFormatError: it is more than the limit.
        """
        self._document.amounts[bound] += amount
        if (total := self._document.amounts[bound]) > limit(bound):
            raise self.error(key, f"too many in this file: {limit_message(bound, total)}")

    def allow(self, *keys: str) -> None:
        """Make optional keys known: ``refuse_unknown_keys`` may name them as the nearest to a misspelt one."""
        self._read.update(keys)

    def refuse_unknown_keys(self) -> None:
        """Refuse the first key that was not read.

        Raises:
            FileFormatError: there is one; the nearest known key is named.
        """
        for key in self._data:
            if key not in self._read:
                unused = self._read - set(self._data)
                longer = sorted(name for name in unused if name.startswith(f"{key}_"))
                near = closest(key, unused) or next(iter(longer), None)
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
            raise self._error_at(keys, f"expected a number, got {_value_text(value)}")
        if isinstance(value, float) and not math.isfinite(value):
            raise self._error_at(keys, f"expected a finite number, got {value}")
        if abs(value) > LARGEST:
            got = f"{value:g}" if isinstance(value, float) else "an integer of many digits"
            raise self._error_at(keys, f"expected a number no larger than {LARGEST:g}, got {got}")

    def _numbers(self, keys: Keys, value: Any, length: int | Collection[int], *, infinite: bool = False) -> Array:
        if not isinstance(value, list):
            raise self._error_at(keys, f"expected a list of {_numbers_text(length)}, got {_value_text(value)}")
        for i, item in enumerate(value):
            if not (infinite and item == math.inf):
                self._require_number((*keys, i), item)
        if len(value) not in ((length,) if isinstance(length, int) else length):
            raise self._error_at(keys, f"expected {_numbers_text(length)}, got {len(value)}")
        return np.array(value, dtype=np.float64)

    def _error_at(self, below: Keys, message: str) -> FileFormatError:
        keys = (*self.keys, *below)
        return FileFormatError(self._document.path, self._document.line(keys), _keys_text(keys), message)


def _parse(path: Path, text: str, *, is_json: bool) -> Any:
    """Return the data of a text, in tables and lists that are not deeper than the limit.

    Raises:
        FileFormatError: it has a slip of syntax, or is beyond a limit.
    """
    too_deep = FileFormatError(path, None, "", f"nested too deeply: {limit_message('nesting')}")
    if not is_json and longest_dotted_key(text) > limit("nesting"):
        raise too_deep
    try:
        data = json.loads(text, object_pairs_hook=_object_without_duplicates) if is_json else tomllib.loads(text)
    except DuplicateKeyError as error:
        raise _duplicate_key_error(path, text) or too_deep from error
    except tomllib.TOMLDecodeError as error:
        raise _toml_error(path, text, error) from error
    except json.JSONDecodeError as error:
        raise FileFormatError(path, error.lineno, "", f"not valid JSON: {error.msg}, column {error.colno}") from error
    except RecursionError as error:
        raise too_deep from error
    except ValueError as error:  # what remains: Python reads no integers of many thousand digits
        raise _digits_error(path) from error
    if not _is_within_nesting_limit(path, data):
        raise too_deep
    return data


def _object_without_duplicates(members: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(members)
    if len(result) < len(members):
        raise DuplicateKeyError
    return result


def _duplicate_key_error(path: Path, text: str) -> FileFormatError | None:
    """Return the error with the path and the line of the key, which the parser does not know; None if too deep."""
    try:
        json_lines(text)
    except DuplicateKeyError as error:
        return FileFormatError(path, error.line, _keys_text(error.keys), "this key occurs twice")
    except RecursionError:
        pass
    return None


def _is_within_nesting_limit(path: Path, data: Any) -> bool:
    """Whether nothing is deeper than the limit.

    Raises:
        FileFormatError: a whole number has more digits than the limit.
    """
    largest = 10 ** limit("digits")
    row = [data]
    for _ in range(limit("nesting") + 1):
        if any(type(value) is int and abs(value) >= largest for value in row):
            raise _digits_error(path)
        containers = [
            value.values() if isinstance(value, dict) else value for value in row if isinstance(value, dict | list)
        ]
        row = [*itertools.chain.from_iterable(containers)]
    return not row


def _digits_error(path: Path) -> FileFormatError:
    return FileFormatError(path, None, "", f"an integer in it has too many digits: {limit_message('digits')}")


def _toml_error(path: Path, text: str, error: tomllib.TOMLDecodeError) -> FileFormatError:
    """Return the error of the parser with the line of its message in front, if it has one."""
    message, _, location = str(error).partition(" (at ")
    line = None
    if location.startswith("line "):
        line = int(location.removeprefix("line ").partition(",")[0])
        message += f", {location.partition(', ')[2].rstrip(')')}"
    elif location:
        line = text.rstrip("\n").count("\n") + 1
        message += ", at the end of the file"
    return FileFormatError(path, line, "", f"not valid TOML: {message}")


def _keys_text(keys: Keys) -> str:
    """Return keys as text, ``joint 3, mass_kg``: numbers count from 1, and invisible keys are quoted."""
    words: list[str] = []
    for key in keys:
        if isinstance(key, int):
            words[-1] += f" {key + 1}"
        else:
            words.append(key if key.isprintable() and key.strip() else shown(key))
    return ", ".join(words)


def _numbers_text(length: int | Collection[int]) -> str:
    return f"{length if isinstance(length, int) else ' or '.join(map(str, length))} numbers"


def _value_text(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return f"the truth value {str(value).lower()}"
    if isinstance(value, str):
        return f"the text {shown(value)}"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return "a table" if isinstance(value, dict) else f"{value}"
