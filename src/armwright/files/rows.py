"""Reading CSV: rows of cells with their line numbers, separated by commas, semicolons or tabs."""

import csv
import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from armwright.arrays import LARGEST
from armwright.errors import FileFormatError, shown
from armwright.files.inputs import file_path, read_lines
from armwright.files.limits import limit, limit_message

# The first is the default for a line with none of them.
_SEPARATORS = (",", ";", "\t")
# A line of these alone is empty.
_BLANKS_AND_SEPARATORS = ' ,;\t\r\n"'
# A number that is written longer is shown rounded.
_MAX_SHOWN_LENGTH = 40


class CsvRow(NamedTuple):
    """One line of a table.

    Attributes:
        line: of the file, from 1.
        cells: their texts, without surrounding blanks.
    """

    line: int
    cells: tuple[str, ...]


class CsvTable(NamedTuple):
    """A table, row by row.

    Attributes:
        head: the names of the columns as they are written.
        rows: the rows, each as wide as the head; they are read when they are asked for, so that a table of many
            millions needs no more memory than one row.
        separator: between cells: a comma, a semicolon or a tab.
    """

    head: CsvRow
    rows: Iterator[CsvRow]
    separator: str


def text_cell(text: str) -> str:
    """Return a text as one cell of a table, which no spreadsheet takes for a formula: quoted where it must be."""
    plain = " ".join(text.splitlines()) if len(text.splitlines()) > 1 else text.strip("\r\n")
    if plain.lstrip()[:1] in ("=", "+", "-", "@"):
        plain = f"'{plain}"
    return '"' + plain.replace('"', '""') + '"' if any(sign in plain for sign in ',;"\t') else plain


def read_rows(path: Path | str) -> CsvTable:
    """Read a table; its first line that is not empty names the columns, and other empty lines are ignored.

    Raises:
        FileFormatError: the file is missing, empty, has no rows or more columns than the limit; and while rows are
            asked for, that a row is no CSV or not as wide as the head, or that there are more than the limit.
    """
    path = file_path(path)
    lines = enumerate(read_lines(path))
    skipped, text = next(((i, text) for i, text in lines if text.strip(_BLANKS_AND_SEPARATORS)), (0, ""))
    # Most columns win: the name of a column may have a sign in it that separates cells elsewhere.
    begin = text[: csv.field_size_limit()]
    separator = max(_SEPARATORS, key=lambda sign: len(next(csv.reader([begin], delimiter=sign))))
    cells = _nonempty_rows(path, itertools.chain([text], (text for _, text in lines)), separator, skipped)
    head = next(cells, None)
    if head is None:
        raise FileFormatError(path, None, "", "the file is empty; expected column names in its first line")
    count = len(head.cells)
    if count > limit("table_columns"):
        raise FileFormatError(path, head.line, "", f"too many columns: {limit_message('table_columns', count)}")
    first = next(cells, None)
    if first is None:
        raise FileFormatError(path, None, "", "no rows after the column names")
    # Some programs write a separator after the last cell, too.
    width = max(i for i, name in enumerate(head.cells, 1) if name)
    rows = _check_widths(path, head, width, itertools.chain([first], cells), separator)
    return CsvTable(CsvRow(head.line, head.cells[:width]), rows, separator)


def _nonempty_rows(path: Path, lines: Iterable[str], separator: str, skipped: int) -> Iterator[CsvRow]:
    """Give the lines that are not empty, counted from those that were skipped; the first names the columns."""
    reader = csv.reader(lines, delimiter=separator)
    count, most = 0, limit("table_rows")
    try:
        for row in reader:
            cells = tuple(cell.strip() for cell in row)
            if any(cells):
                line = skipped + reader.line_num
                if count > most:
                    raise FileFormatError(path, line, "", f"too many rows: {limit_message('table_rows')}")
                count += 1
                yield CsvRow(line, cells)
    except csv.Error as error:
        raise FileFormatError(path, skipped + reader.line_num, "", f"not valid CSV: {error}") from error


def _check_widths(path: Path, head: CsvRow, width: int, rows: Iterable[CsvRow], separator: str) -> Iterator[CsvRow]:
    """Give the rows, each with as many cells as there are columns, without empty cells under empty names at the end.

    Raises:
        FileFormatError: a row is longer or shorter, or has a value under an empty name at the end.
    """
    for row in rows:
        count = len(row.cells)
        if count != len(head.cells):
            hint = "; does a number contain a comma?" if separator == "," and count > len(head.cells) else ""
            raise FileFormatError(path, row.line, "", f"expected {width} values, one per column, got {count}{hint}")
        if any(row.cells[width:]):
            message = f"the last column has no name, but a value in line {row.line}"
            raise FileFormatError(path, head.line, "''", message)
        yield CsvRow(row.line, row.cells[:width])


class NumberFormat:
    """How the numbers of a table are written: with decimal points or, between semicolons or tabs, decimal commas."""

    def __init__(self, path: Path, separator: str) -> None:
        """Expect decimal points between commas; elsewhere the first number decides."""
        self._path, self._comma_separates = path, separator == ","
        self._mark, self._line = "", 0

    def number(self, line: int, header: str, text: str) -> float:
        """Return the number in a cell.

        Raises:
            FileFormatError: it is no number, not finite or too large.
        """
        point = text
        if not self._comma_separates and ("," in text or "." in text):
            point = self._with_point(line, header, text)
        value = _parse_number(point)
        if value is None:
            hint = "; write a decimal point" if _parse_number(text.replace(",", ".")) is not None else ""
            raise FileFormatError(self._path, line, header, f"expected a number, got {shown(text)}{hint}")
        if not abs(value) <= LARGEST:
            got = text if len(text) < _MAX_SHOWN_LENGTH else f"{value:g}"
            message = f"every number must be finite and no larger than {LARGEST:g}, got {got}"
            raise FileFormatError(self._path, line, header, message)
        return value

    def _with_point(self, line: int, header: str, text: str) -> str:
        """Return a number with a decimal point; in a file with both signs, one of them separates thousands.

        Raises:
            FileFormatError: other numbers of the file have the other sign.
        """
        mark = "," if "," in text else "."
        if not self._mark:
            self._mark, self._line = mark, line
        if mark != self._mark:
            expected = f"a decimal {'point' if mark == ',' else 'comma'}, as in line {self._line}"
            message = f"expected {expected}, got {shown(text)}; thousands separators are not allowed"
            raise FileFormatError(self._path, line, header, message)
        return text.replace(",", ".")


def _parse_number(text: str) -> float | None:
    # Python also reads underscores between digits, and digits of other scripts, which no other reader of CSV does.
    try:
        return float(text) if text.isascii() and "_" not in text else None
    except ValueError:
        return None
