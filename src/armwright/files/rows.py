"""Tables in CSV as people send them: rows of cells with their lines, and the numbers in them."""

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from armwright.arrays import LARGEST
from armwright.errors import FileFormatError, shown
from armwright.files.document import read_text

# SI values of the units that names of columns end in.
LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
ANGLE_UNITS = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180}
# Columns whose names begin so are for people.
NOTE = "note"


class Cells(NamedTuple):
    """One line of a table.

    Attributes:
        line: of the file, from 1.
        cells: what stands in it, without blanks around.
    """

    line: int
    cells: tuple[str, ...]


def read_rows(path: Path | str) -> tuple[Cells, Sequence[Cells]]:
    """Return the names of the columns as they are written, and the rows below; empty lines are left out.

    Raises:
        FileFormatError: the file is missing, empty, not separated by commas, or has no rows.
    """
    path = Path(path)
    reader = csv.reader(read_text(path).splitlines())
    try:
        lines = [
            Cells(reader.line_num, tuple(cell.strip() for cell in row))
            for row in reader
            if any(cell.strip() for cell in row)
        ]
    except csv.Error as error:
        raise FileFormatError(path, reader.line_num, "", f"not valid CSV: {error}") from error
    if not lines:
        raise FileFormatError(path, None, "", "the file is empty; its first line should name the columns")
    head, *rows = lines
    for mark, name in ((";", "semicolons"), ("\t", "tabs")):
        if len(head.cells) == 1 and mark in head.cells[0]:
            raise FileFormatError(
                path,
                head.line,
                "",
                f"columns are separated by {name}; expected commas between columns and points in numbers",
            )
    if not rows:
        raise FileFormatError(path, None, "", "no rows below the names of the columns")
    return head, rows


def refuse_other_widths(path: Path | str, head: Cells, rows: Sequence[Cells]) -> None:
    """Refuse a table whose rows have not as many cells as there are columns; its columns should be looked at before.

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
        raise FileFormatError(
            path, line, header, f"every number must be finite and no larger than {LARGEST:g}, got {text}"
        )
    return value


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
