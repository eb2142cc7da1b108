"""Tables whose column names have units: CSV with columns such as ``joint_1_deg`` or ``x nominal [mm]``, read as SI.

A reader says which columns there may be (``Column``); ``read_header`` finds them in a file, whatever their order, units
and spelling; the reader checks what belongs together, and ``Header.rows`` reads the numbers and words. All messages
about columns and cells come from here. docs/tables.md describes the format.
"""

import math
import warnings
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple, TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import FileFormatError, IncompleteRowsWarning, closest, counted, shortened, shown
from armwright.files.column_names import WORD, Heading, Schema, normalised_name, resolve_headings
from armwright.files.inputs import file_path
from armwright.files.rows import CsvTable, NumberFormat, read_rows

# Of the lines in which a column is empty a message names this many.
_MAX_LINES = 20


class RequiredCells(NamedTuple):
    """Cells of a row of which at least one must not be empty.

    Attributes:
        columns: their names in the schema.
        expected: what should be there, for a message.
    """

    columns: tuple[str, ...]
    expected: str


# The text of a cell of one row by the name of its column; empty where the file has no such column.
CellText: TypeAlias = Callable[[str], str]
# Names of columns by those in a file, or names of units by quantities.
NameMap: TypeAlias = Mapping[str, str] | None


@attrs.frozen(kw_only=True, eq=False)
class UnitTable:
    """The rows of a table by columns: a number takes eight bytes, and a word is kept once, however often written.

    Objects of Python for every cell of a million rows would take a gigabyte.

    Attributes:
        path: the file.
        headings: its columns, by their names in the schema.
        lines: of each row, its line in the file.
    """

    path: Path
    headings: Mapping[str, Heading]
    lines: "array[int]"
    _numbers: Mapping[str, "array[float]"]
    _words: Mapping[str, list[str]]

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.lines)

    def __contains__(self, name: str) -> bool:
        """Whether there is a column of this name."""
        return name in self.headings

    def numbers(self, names: Sequence[str]) -> Array:
        """Return (m, k) numbers of some columns in SI units; NaN where cells are empty."""
        return np.column_stack([np.frombuffer(self._numbers[name]) for name in names])

    def number(self, name: str, row: int) -> float | None:
        """Return a number of a row in SI units; None where the cell is empty, or there is no such column."""
        value = self._numbers[name][row] if name in self._numbers else math.nan
        return None if math.isnan(value) else value

    def words(self, name: str) -> Sequence[str]:
        """Return the words of a column; empty ones where there is no such column."""
        return self._words[name] if name in self._words else [""] * len(self)

    def word(self, name: str, row: int) -> str:
        """Return a word of a row; empty where the cell is, or there is no such column."""
        return self._words[name][row] if name in self._words else ""

    def choice(self, name: str, row: int, known: Sequence[str]) -> str:
        """Return a word of a row in lower case, which should be one of those known.

        Raises:
            FileFormatError: it is none of them; the nearest is named.
        """
        word = self.word(name, row)
        if word.lower() not in known:
            near = closest(word.lower(), known)
            hint = f"; did you mean '{near}'?" if near else ""
            expected = " or ".join(known) if len(known) == 2 else f"one of {', '.join(known)}"
            raise self.error(row, name, f"expected {expected}, got {shown(word)}{hint}")
        return word.lower()

    def error(self, row: int, name: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of a cell; of a whole row where the name is empty."""
        return FileFormatError(self.path, self.lines[row], _column_text(self.headings, name), message)


@attrs.frozen(kw_only=True, eq=False)
class Header:
    """The columns of a file whose rows are still to be read.

    Attributes:
        path: the file.
        headings: its columns, by their names in the schema.
        schema: the columns that there may be.
    """

    path: Path
    headings: Mapping[str, Heading]
    schema: Schema
    _table: CsvTable

    def __contains__(self, name: str) -> bool:
        """Whether there is a column of this name."""
        return name in self.headings

    def columns_present(self, names: Iterable[str]) -> tuple[str, ...]:
        """Return those of some columns that the file has."""
        return tuple(name for name in names if name in self.headings)

    @property
    def listing(self) -> str:
        """The columns, for a message."""
        return ", ".join(heading.text for heading in self.headings.values()) or "no known columns"

    def error(self, name: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of a column."""
        return FileFormatError(self.path, self._table.head.line, _column_text(self.headings, name), message)

    def require(self, names: Iterable[str], because: str = "") -> None:
        """Refuse a file that lacks a column.

        Args:
            names: of the columns.
            because: why they should be there; may be empty.

        Raises:
            FileFormatError: one is missing.
        """
        for name in names:
            if name not in self.headings:
                reason = f"{because}; " if because else ""
                raise self.error(self.name_with_unit(name), f"no such column; {reason}there are {self.listing}")

    def name_with_unit(self, name: str) -> str:
        """Return the name of a column of the schema with its usual unit."""
        return next(column.name_with_unit for column in self.schema.columns if column.name == name)

    def either_column(self, first: str, second: str) -> str:
        """Return which of two columns the file has.

        Raises:
            FileFormatError: it has both, or neither.
        """
        names = self.columns_present((first, second))
        if len(names) != 1:
            there = "both" if names else "neither"
            text = f"expected a column {first} or a column {second}, but the file has {there}: {self.listing}"
            raise self.error(first, text)
        return names[0]

    def rows(
        self,
        *,
        filled: Iterable[str],
        required: Callable[[CellText], Iterable[RequiredCells]] | None = None,
        skip_incomplete: bool = False,
    ) -> UnitTable:
        """Read the rows.

        Args:
            filled: columns in which no cell may be empty.
            required: returns the other cells that a row requires because of what it has in some of its cells.
            skip_incomplete: leave out the rows with cells that should not be empty, with a warning.

        Raises:
            FileFormatError: a row is no CSV or has another width; a number is none; cells are empty that should not be;
                a row requires a cell of a column that the file lacks.
        """
        needed = [self.headings[name] for name in filled]
        lines, known = array("q"), dict[str, str]()
        words = {name: list[str]() for name, heading in self.headings.items() if heading.column.quantity is WORD}
        numbers = {name: array("d") for name in self.headings if name not in words}
        incomplete, written = _IncompleteRows(), NumberFormat(self.path, self._table.separator)
        number_columns = [(self.headings[name], self.headings[name].scale, values) for name, values in numbers.items()]
        word_columns = [(self.headings[name].cell_index, texts) for name, texts in words.items()]
        for line, cells in self._table.rows:
            empty = [
                (heading.text, "a name" if heading.column.quantity is WORD else "a number")
                for heading in needed
                if not cells[heading.cell_index]
            ]
            if required:
                empty += self._empty_cells(line, cells, required)
            if empty:
                incomplete.add(line, empty)
                continue
            lines.append(line)
            for heading, scale, values in number_columns:
                text = cells[heading.cell_index]
                values.append(written.number(line, heading.text, text) * scale if text else math.nan)
            for index, texts in word_columns:
                texts.append(known.setdefault(cells[index], cells[index]))
        incomplete.report(self.path, len(lines), skip=skip_incomplete)
        return UnitTable(path=self.path, headings=self.headings, lines=lines, numbers=numbers, words=words)

    def _cell_text(self, cells: Sequence[str], name: str) -> str:
        return cells[self.headings[name].cell_index] if name in self.headings else ""

    def _empty_cells(
        self, line: int, cells: Sequence[str], required: Callable[[CellText], Iterable[RequiredCells]]
    ) -> Iterator[tuple[str, str]]:
        """Give the columns of a row whose required cells are empty, and what was expected in them."""
        cell_text = partial(self._cell_text, cells)
        for names, expected in required(cell_text):
            columns = self.columns_present(names)
            if not columns:
                message = f"no such column; expected {expected}; there are {self.listing}"
                raise FileFormatError(self.path, line, self.name_with_unit(names[0]), message)
            if not any(map(cell_text, columns)):
                yield " or ".join(self.headings[name].text for name in columns), expected


def read_header(path: Path | str, schema: Schema, *, columns: NameMap = None, units: NameMap = None) -> Header:
    """Read the names of the columns of a file.

    Args:
        path: the file.
        schema: the columns that there may be.
        columns: names of the schema, with unit, by the names in the file: ``{"A1": "joint_1_deg"}``; a column that is
            called ``note`` is passed over.
        units: for columns whose names have none, by quantity, such as ``{"length": "mm"}``; None where the caller takes
            none.

    Raises:
        FileFormatError: the file is missing or empty; a column is unknown, there twice or without unit, or has another
            unit than the rest of its group; a name of ``columns`` is not in the file.
    """
    return read_headers([path], schema, columns=columns, units=units)[0]


def read_headers(
    paths: Sequence[Path | str], schema: Schema, *, columns: NameMap = None, units: NameMap = None
) -> list[Header]:
    """Read the names of the columns of several files that belong together; see ``read_header``.

    Raises:
        FileFormatError: as ``read_header``; a name of ``columns`` is in none of the files.
    """
    files = [(file_path(path), read_rows(path)) for path in paths]
    first, head = files[0][0], files[0][1].head

    def error(name: str, message: str) -> FileFormatError:
        return FileFormatError(first, head.line, shown(name).strip("'\""), message)

    mapping: dict[str, tuple[str, str]] = {}
    for name, target in (columns or {}).items():
        twin, _ = mapping.setdefault(normalised_name(name), (name, target))
        if twin != name:
            raise error(name, f"this name in the column map differs from {shown(twin)} only in case or blanks")
    headers = {normalised_name(text): text for _, table in files for text in table.head.cells}
    for key, (name, target) in mapping.items():
        if key not in headers:
            near = closest(key, headers)
            hint = f"; did you mean '{headers[near]}'?" if near else "."
            raise error(name, f"no such column to map to {target}{hint} There are {', '.join(head.cells)}")
    return [
        Header(
            path=path, headings=resolve_headings(path, table.head, schema, mapping, units), schema=schema, table=table
        )
        for path, table in files
    ]


def _column_text(headings: Mapping[str, Heading], name: str) -> str:
    return headings[name].text if name in headings else name


class _IncompleteRows:
    """Rows with cells that should not be empty."""

    def __init__(self) -> None:
        self._rows = 0
        self._first: tuple[int, str, str] | None = None
        self._columns: dict[str, tuple[int, list[int]]] = {}

    def add(self, line: int, empty: Sequence[tuple[str, str]]) -> None:
        """Add a row with its empty cells: the text of their column, and what was expected."""
        self._rows += 1
        self._first = self._first or (line, *empty[0])
        for text, _ in empty:
            count, lines = self._columns.get(text, (0, []))
            if len(lines) < _MAX_LINES:
                lines.append(line)
            self._columns[text] = count + 1, lines

    def report(self, path: Path, complete: int, *, skip: bool) -> None:
        """Refuse the rows, or warn that they are left out.

        Raises:
            FileFormatError: there are some and they are not to be left out, or there are no others.
        """
        if self._first is None:
            return
        line, column, expected = self._first
        where = "; ".join(f"{text} in {lines_text(lines, count)}" for text, (count, lines) in self._columns.items())
        rows = counted(self._rows, "row")
        if skip and complete:
            text = f"{path}: {rows} omitted because of empty cells, {complete} read: {where}"
            warnings.warn(shortened(text), IncompleteRowsWarning, stacklevel=2)
            return
        if skip:
            raise FileFormatError(path, line, "", f"every row has empty cells: {where}")
        if self._rows == 1 and len(self._columns) == 1:
            message = f"empty; expected {expected}, or --skip-incomplete to omit the row"
            raise FileFormatError(path, line, column, message)
        raise FileFormatError(path, line, "", f"cells are empty: {where}; --skip-incomplete omits {rows}")


def lines_text(lines: Sequence[int], count: int | None = None) -> str:
    """Name lines of a file, of which there may be more than are named: ``lines 3, 4 and 7 more``."""
    count = count or len(lines)
    more = f" and {count - len(lines)} more" if count > len(lines) else ""
    return f"line{'s' if count > 1 else ''} {', '.join(map(str, lines))}{more}"
