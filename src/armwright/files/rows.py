"""Tables in CSV as people send them: rows of cells with their lines, and the numbers in them."""

import csv
import itertools
import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from armwright.arrays import LARGEST
from armwright.errors import FileFormatError, shown
from armwright.files.limits import beyond, limit
from armwright.files.reading import read_lines

# SI values of the units that names of columns end in.
LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
ANGLE_UNITS = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180}
# Columns whose names begin so are for people.
NOTE = "note"
# A number that is written longer is told in short.
_LONGEST = 40


class Cells(NamedTuple):
    """One line of a table.

    Attributes:
        line: of the file, from 1.
        cells: what stands in it, without blanks around.
    """

    line: int
    cells: tuple[str, ...]


def text_cell(text: str) -> str:
    """Return a text as one cell of a table, which no spreadsheet takes for a formula: quoted where it must be."""
    plain = " ".join(text.splitlines()) if len(text.splitlines()) > 1 else text.strip("\r\n")
    if plain.lstrip()[:1] in ("=", "+", "-", "@"):
        plain = f"'{plain}"
    return '"' + plain.replace('"', '""') + '"' if any(sign in plain for sign in ',;"\t') else plain


def read_rows(path: Path | str) -> tuple[Cells, Iterator[Cells]]:
    """Return the names of the columns as they are written, and the rows below; empty lines are left out.

    Rows are read when they are asked for, so that a table of many millions needs no more memory than one row.

    Raises:
        FileFormatError: the file is missing, empty, not separated by commas, has no rows or more columns than the
            limit; and while rows are asked for, that one of them is no CSV, or there are more than the limit.
    """
    path = Path(path)
    lines = _lines(path)
    head = next(lines, None)
    if head is None:
        raise FileFormatError(path, None, "", "the file is empty; its first line should name the columns")
    if len(head.cells) > limit("table_columns"):
        raise FileFormatError(path, head.line, "", f"too many columns: {beyond('table_columns', len(head.cells))}")
    for mark, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(head.cells) == 1 and mark in head.cells[0]:
            raise FileFormatError(
                path,
                head.line,
                "",
                f"columns are separated by {name}; expected commas between columns and points in numbers",
            )
    first = next(lines, None)
    if first is None:
        raise FileFormatError(path, None, "", "no rows below the names of the columns")
    return head, itertools.chain([first], lines)


def _lines(path: Path) -> Iterator[Cells]:
    """Give the lines in which something stands; the first names the columns."""
    reader = csv.reader(read_lines(path))
    count, most = 0, limit("table_rows")
    try:
        for row in reader:
            cells = tuple(cell.strip() for cell in row)
            if any(cells):
                if count > most:
                    raise FileFormatError(path, reader.line_num, "", f"too many rows: {beyond('table_rows')}")
                count += 1
                yield Cells(reader.line_num, cells)
    except csv.Error as error:
        raise FileFormatError(path, reader.line_num, "", f"not valid CSV: {error}") from error


def of_one_width(path: Path | str, head: Cells, rows: Iterable[Cells]) -> Iterator[Cells]:
    """Give the rows of a table, each with as many cells as there are columns, which should be looked at before.

    Raises:
        FileFormatError: a row is longer or shorter.
    """
    for row in rows:
        if len(row.cells) != len(head.cells):
            hint = "; is there a comma in a number?" if len(row.cells) > len(head.cells) else ""
            raise FileFormatError(
                path,
                row.line,
                "",
                f"expected {len(head.cells)} values, as there are columns, got {len(row.cells)}{hint}",
            )
        yield row


def number_in_cell(path: Path | str, line: int, header: str, text: str) -> float:
    """Return the number that stands in a cell.

    Raises:
        FileFormatError: there is none, or none that a robot has.
    """
    if not text:
        raise FileFormatError(path, line, header, "empty; expected a number")
    value = _number(text)
    if value is None:
        hint = "; write a decimal point" if _number(text.replace(",", ".")) is not None else ""
        raise FileFormatError(path, line, header, f"expected a number, got {shown(text)}{hint}")
    if not abs(value) <= LARGEST:
        got = text if len(text) < _LONGEST else f"{value:g}"
        raise FileFormatError(
            path, line, header, f"every number must be finite and no larger than {LARGEST:g}, got {got}"
        )
    return value


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
