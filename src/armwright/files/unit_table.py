"""Tables whose column names have units: CSV with columns such as ``joint_1_deg`` or ``x nominal [mm]``, read as SI.

A reader says which columns there may be (``Column``); ``read_header`` finds them in a file, whatever their order, units
and spelling; the reader checks what belongs together, and ``Header.rows`` reads the numbers and words. All messages
about columns and cells come from here. docs/tables.md describes the format.
"""

import math
import warnings
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import FileFormatError, IncompleteRowsWarning, closest, counted, shortened, shown
from armwright.files.column_names import WORD, Heading, Schema, headings_of, plain
from armwright.files.rows import Cells, NumberFormat, read_rows

# Of the lines in which a column is empty a message names this many.
_MAX_LINES = 20


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

    def require(self, row: int, names: Iterable[str], reason: str) -> None:
        """Refuse a row whose cells of some columns are empty.

        Raises:
            FileFormatError: one of them is; the text says ``reason``.
        """
        for name in names:
            if not self.word(name, row) and self.number(name, row) is None:
                raise self.error(row, name, f"empty; {reason}")

    def error(self, row: int, name: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of a cell; of a whole row where the name is empty."""
        return FileFormatError(self.path, self.lines[row], _text(self.headings, name), message)


@attrs.frozen(kw_only=True, eq=False)
class Header:
    """The columns of a file whose rows are still to be read.

    Attributes:
        path: the file.
        line: of the names.
        headings: its columns, by their names in the schema.
        schema: the columns that there may be.
    """

    path: Path
    line: int
    headings: Mapping[str, Heading]
    schema: Schema
    _below: Iterator[Cells]
    _separator: str

    def __contains__(self, name: str) -> bool:
        """Whether there is a column of this name."""
        return name in self.headings

    def present(self, names: Iterable[str]) -> tuple[str, ...]:
        """Return which of some columns there are."""
        return tuple(name for name in names if name in self.headings)

    @property
    def listing(self) -> str:
        """The columns, for a message."""
        return ", ".join(heading.text for heading in self.headings.values()) or "no known column"

    def error(self, name: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of a column."""
        return FileFormatError(self.path, self.line, _text(self.headings, name), message)

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
                column = next(column for column in self.schema.columns if column.name == name)
                reason = f"{because}; " if because else ""
                raise self.error(column.proposed, f"no such column; {reason}there are {self.listing}")

    def exactly_one(self, first: str, second: str) -> str:
        """Return which of two columns the file has.

        Raises:
            FileFormatError: it has both, or neither.
        """
        names = self.present((first, second))
        if len(names) != 1:
            there = "both" if names else "neither"
            text = f"expected a column {first} or a column {second}, but the file has {there}: {self.listing}"
            raise self.error(first, text)
        return names[0]

    def rows(
        self, *, filled: Iterable[str], together: Sequence[Sequence[str]] = (), skip_incomplete: bool = False
    ) -> UnitTable:
        """Read the rows.

        Args:
            filled: columns in which no cell may be empty.
            together: groups of columns whose cells are all empty or all filled in every row.
            skip_incomplete: leave out the rows with cells that should not be empty, with a warning.

        Raises:
            FileFormatError: a row is no CSV or has another width; a number is none; cells are empty that should not be.
        """
        needed = [self.headings[name] for name in filled]
        groups = [[self.headings[name] for name in names] for names in together]
        lines, known = array("q"), dict[str, str]()
        numbers: dict[str, array[float]] = {}
        words: dict[str, list[str]] = {}
        for name, heading in self.headings.items():
            if heading.column.quantity is WORD:
                words[name] = []
            else:
                numbers[name] = array("d")
        incomplete, written = _Incomplete(), NumberFormat(self.path, self._separator)
        number_columns = [(self.headings[name], self.headings[name].scale, numbers[name]) for name in numbers]
        word_columns = [(self.headings[name].cell, texts) for name, texts in words.items()]
        for line, cells in self._below:
            empty = [heading for heading in needed if not cells[heading.cell]]
            for group in groups:
                gaps = [heading for heading in group if not cells[heading.cell]]
                if len(gaps) < len(group):
                    empty += gaps
            if empty:
                incomplete.add(line, empty)
                continue
            lines.append(line)
            for heading, scale, values in number_columns:
                text = cells[heading.cell]
                values.append(written.number(line, heading.text, text) * scale if text else math.nan)
            for index, texts in word_columns:
                texts.append(known.setdefault(cells[index], cells[index]))
        incomplete.tell(self.path, len(lines), skip=skip_incomplete)
        return UnitTable(path=self.path, headings=self.headings, lines=lines, numbers=numbers, words=words)


def read_header(
    path: Path | str,
    schema: Schema,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
) -> Header:
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
    paths: Sequence[Path | str],
    schema: Schema,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
) -> list[Header]:
    """Read the names of the columns of several files that belong together; see ``read_header``.

    Raises:
        FileFormatError: as ``read_header``; a name of ``columns`` is in none of the files.
    """
    mapping = {plain(name): (name, target) for name, target in (columns or {}).items()}
    files = [(Path(path), read_rows(path)) for path in paths]
    headers = {plain(text): text for _, rows in files for text in rows.head.cells}
    for key, (name, target) in mapping.items():
        if key not in headers:
            near = closest(key, headers)
            hint = f"; did you mean '{headers[near]}'?" if near else "."
            path, rows = files[0]
            there = ", ".join(rows.head.cells)
            raise FileFormatError(
                path, rows.head.line, name, f"no such column to map to {target}{hint} There are {there}"
            )
    return [
        Header(
            path=path,
            line=rows.head.line,
            headings=headings_of(path, rows.head, schema, mapping, units),
            schema=schema,
            below=rows.below,
            separator=rows.separator,
        )
        for path, rows in files
    ]


def _text(headings: Mapping[str, Heading], name: str) -> str:
    return headings[name].text if name in headings else name


class _Incomplete:
    """Rows with cells that should not be empty."""

    def __init__(self) -> None:
        self._rows = 0
        self._first: tuple[int, Heading] | None = None
        self._columns: dict[str, tuple[int, list[int]]] = {}

    def add(self, line: int, empty: Sequence[Heading]) -> None:
        """Note the empty cells of a row."""
        self._rows += 1
        self._first = self._first or (line, empty[0])
        for heading in empty:
            count, lines = self._columns.get(heading.text, (0, []))
            if len(lines) < _MAX_LINES:
                lines.append(line)
            self._columns[heading.text] = count + 1, lines

    def tell(self, path: Path, complete: int, *, skip: bool) -> None:
        """Refuse the rows, or warn that they are left out.

        Raises:
            FileFormatError: there are some and they are not to be left out, or there are no others.
        """
        if self._first is None:
            return
        line, heading = self._first
        where = "; ".join(f"{text} in {in_lines(lines, count)}" for text, (count, lines) in self._columns.items())
        if skip and complete:
            text = f"{path}: {counted(self._rows, 'row')} omitted because of empty cells, {complete} read: {where}"
            warnings.warn(shortened(text), IncompleteRowsWarning, stacklevel=2)
            return
        if skip:
            raise FileFormatError(path, line, "", f"every row has empty cells: {where}")
        if self._rows == 1 and len(self._columns) == 1:
            kind = "a name" if heading.column.quantity is WORD else "a number"
            raise FileFormatError(
                path, line, heading.text, f"empty; expected {kind}, or --skip-incomplete to omit the row"
            )
        raise FileFormatError(
            path, line, "", f"cells are empty: {where}; --skip-incomplete omits {counted(self._rows, 'row')}"
        )


def in_lines(lines: Sequence[int], count: int | None = None) -> str:
    """Name lines of a file, of which there may be more than are named: ``lines 3, 4 and 7 more``."""
    more = (count or len(lines)) - len(lines)
    return (
        f"line{'s' if len(lines) + more > 1 else ''} {', '.join(map(str, lines))}{f' and {more} more' if more else ''}"
    )
