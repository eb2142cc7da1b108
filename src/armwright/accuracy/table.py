"""Tables of measured poses and paths: their columns, and their rows in SI units."""

from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import get_args

import attrs

from armwright.accuracy.cycles import REQUIRED_CYCLES, Kind, PathKind
from armwright.accuracy.trace import ANGLES
from armwright.errors import FileFormatError, shown
from armwright.files.column_names import ANGLE, FORCE, LENGTH, TIME, VELOCITY, Column, Schema
from armwright.files.unit_table import CellText, Header, RequiredCells, UnitTable, read_headers

COMMANDED = "commanded"
_COORDINATES = ("x", "y", "z")
_KINDS: dict[str, Kind] = {kind: kind for kind in REQUIRED_CYCLES}
_PATH_TESTS = frozenset(get_args(PathKind))
# Columns in which every attained row of a test has a value.
_REQUIRED_COLUMNS: Mapping[str, tuple[str, ...]] = {
    "multidirectional": ("direction",),
    "exchangeability": ("robot",),
    "compliance": ("direction", "load"),
    **dict.fromkeys(("drift", "settling", "posing", "velocity", "weaving"), ("t",)),
}
_REQUIRED_CELLS: Mapping[str, Sequence[RequiredCells]] = {
    test: [
        RequiredCells((column,), f"the {'time' if column == 't' else column} in every row of test {test}")
        for column in columns
    ]
    for test, columns in _REQUIRED_COLUMNS.items()
}
# The number of a cycle has fewer.
_CYCLE_DIGITS = 10
_SCHEMA = Schema(
    columns=(
        *(Column(name=name) for name in ("test", "pose", "path", "cycle", "condition", "direction", "robot")),
        *(Column(name=name, quantity=LENGTH, group="coordinates") for name in _COORDINATES),
        *(Column(name=name, quantity=ANGLE, group="angles") for name in ANGLES),
        Column(name="t", quantity=TIME),
        Column(name="load", quantity=FORCE),
        Column(name="speed", quantity=VELOCITY),
        *(Column(name=f"{name}_nominal", quantity=LENGTH, group="nominal coordinates") for name in _COORDINATES),
        *(Column(name=f"{name}_nominal", quantity=ANGLE, group="nominal angles") for name in ANGLES),
    )
)


class Row:
    """One line of a table, in SI units; what it does not have is empty or None."""

    __slots__ = ("_nominal", "_row", "_table")

    def __init__(self, table: "Table", row: int, *, nominal: bool = False) -> None:
        """Refer to a row of a table, counted from 0, or to the pose of its nominal columns."""
        self._table, self._row, self._nominal = table, row, nominal

    def error(self, name: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of this row."""
        return self._table.columns.error(self._row, name, message)

    @property
    def path(self) -> Path:
        """The file."""
        return self._table.columns.path

    @property
    def line(self) -> int:
        """The line of the file."""
        return self._table.columns.lines[self._row]

    @property
    def test(self) -> Kind:
        """Name of the test."""
        return _KINDS[self.word("test").lower() or "pose"]

    @property
    def name(self) -> str:
        """Name of the pose or path."""
        return self.word("pose") or self.word("path")

    @property
    def cycle(self) -> int | None:
        """Number of the cycle, from 1; None for what was commanded."""
        return None if self._nominal else self._table.cycles[self._row] or None

    @property
    def position(self) -> tuple[float, ...]:
        """Two or three coordinates [m]."""
        return self._numbers(self._table.coordinates)

    @property
    def angles(self) -> tuple[float, ...]:
        """None to three [rad]."""
        return self._numbers(self.angle_names)

    @property
    def angle_names(self) -> tuple[str, ...]:
        """The axes a, b, c that the angles are about."""
        return self._table.angles

    def word(self, name: str) -> str:
        """Return the word in a column of words; empty where the file has none."""
        return self._table.columns.word(name, self._row)

    def number(self, name: str) -> float | None:
        """Return the number in a column of numbers, SI; None where the file has none."""
        return self._table.columns.number(name, self._row)

    def _numbers(self, names: tuple[str, ...]) -> tuple[float, ...]:
        suffix = "_nominal" if self._nominal else ""
        values = (self._table.columns.number(f"{name}{suffix}", self._row) for name in names)
        return tuple(value for value in values if value is not None)


@attrs.frozen(kw_only=True, eq=False)
class Table:
    """A file of measurements.

    Attributes:
        columns: its cells, in SI units.
        cycles: of each row, from 1; 0 for what was commanded.
        coordinates: x, y and, in space, z.
        angles: those of a, b, c that it has.
        nominal: whether every row has a commanded pose beside the attained one.
    """

    columns: UnitTable
    cycles: Sequence[int]
    coordinates: tuple[str, ...]
    angles: tuple[str, ...]
    nominal: bool

    def rows(self) -> Iterator[Row]:
        """Give its rows; where there are nominal columns, before the first of a pose what was commanded.

        Raises:
            FileFormatError: a pose has several nominal poses.
        """
        commanded: dict[tuple[str, ...], Row] = {}
        for i in range(len(self.columns)):
            row = Row(self, i)
            if self.nominal:
                goal = Row(self, i, nominal=True)
                first = commanded.setdefault((row.test, row.name, row.word("condition")), goal)
                if first is goal:
                    yield goal
                elif (goal.position, goal.angles) != (first.position, first.angles):
                    raise row.error("x_nominal", f"{row.name} has other nominal coordinates in line {first.line}")
            yield row


def read_tables(
    paths: Sequence[Path | str], *, columns: Mapping[str, str] | None = None, skip_incomplete: bool = False
) -> Iterator[Table]:
    """Read files of measurements that belong together; docs/iso9283.md has the columns.

    Args:
        paths: of the files.
        columns: names of columns, with unit, by those in the files.
        skip_incomplete: leave out rows with cells that should not be empty, with a warning.

    Raises:
        FileFormatError: a file is missing or empty, or a column or value is not what it should be; the text has file,
            line and column.
    """
    for header in read_headers(paths, _SCHEMA, columns=columns):
        yield _read_table(header, skip_incomplete=skip_incomplete)


def _read_table(header: Header, *, skip_incomplete: bool) -> Table:
    name, nominal = _name_column(header), header.columns_present(f"{name}_nominal" for name in (*_COORDINATES, *ANGLES))
    header.require(("x", "y") if nominal else ("test", "cycle", "x", "y"))
    measured = header.columns_present((*_COORDINATES, *ANGLES))
    if nominal:
        because = "either all measured columns have nominal columns, or none has"
        header.require((f"{name}_nominal" for name in measured), because)
        header.require((name.removesuffix("_nominal") for name in nominal), "it is nominal")
    filled = (*header.columns_present(("test", "cycle")), name, *measured, *nominal)
    columns = header.rows(filled=filled, required=_required_cells(), skip_incomplete=skip_incomplete)
    for row in range(len(columns)) if "test" in columns else ():
        columns.choice("test", row, tuple(_KINDS))
    return Table(
        columns=columns,
        cycles=_read_cycles(columns) if "cycle" in columns else _count_cycles(columns, name),
        coordinates=header.columns_present(_COORDINATES),
        angles=header.columns_present(ANGLES),
        nominal=bool(nominal),
    )


def _required_cells() -> Callable[[CellText], Sequence[RequiredCells]]:
    """Return a function that gives, row by row, the cells that a row of a test requires."""
    timed_runs: set[tuple[str, ...]] = set()

    def required_cells(cell_text: CellText) -> Sequence[RequiredCells]:
        test, cycle = cell_text("test").lower() or "pose", cell_text("cycle")
        if cycle.lower() == COMMANDED:
            return []
        if test in _PATH_TESTS and test not in _REQUIRED_CELLS:
            run = (test, cell_text("path"), cell_text("pose"), cell_text("condition"), cycle)
            if cell_text("t"):
                timed_runs.add(run)
            elif run in timed_runs:
                return [RequiredCells(("t",), "the time, as in the rows of the run before")]
        return _REQUIRED_CELLS.get(test, [])

    return required_cells


def _name_column(header: Header) -> str:
    """Return which column names what was measured: pose or path.

    Raises:
        FileFormatError: neither does, or both; or a path has nominal columns.
    """
    name = header.either_column("pose", "path")
    nominal = header.columns_present(f"{name}_nominal" for name in _COORDINATES)
    if name == "path" and nominal:
        message = f"only poses have nominal columns; a path is commanded by rows of cycle {COMMANDED}"
        raise header.error(nominal[0], message)
    return name


def _read_cycles(columns: UnitTable) -> "array[int]":
    """Return the numbers of the cycles; 0 for what was commanded.

    Raises:
        FileFormatError: one is none.
    """
    cycles = array("q")
    for row, text in enumerate(columns.words("cycle")):
        # Nine digits at most: Python reads no number of many thousand.
        number = int(text) if text.isascii() and text.isdigit() and len(text) < _CYCLE_DIGITS else 0
        if not number and text.lower() != COMMANDED:
            raise columns.error(row, "cycle", f"expected 1, 2, 3 ... or the word {COMMANDED}, got {shown(text)}")
        if not number and "x_nominal" in columns:
            raise columns.error(row, "cycle", f"{COMMANDED} is what the nominal columns say; leave the row out")
        cycles.append(number)
    return cycles


def _count_cycles(columns: UnitTable, name: str) -> "array[int]":
    """Return the numbers of the cycles where a file does not have them: rows of one pose, counted."""
    counts: dict[tuple[str | float | None, ...], int] = {}
    cycles = array("q")
    for row in range(len(columns)):
        words = (columns.word(word, row) for word in ("test", name, "condition", "direction", "robot"))
        part = (*words, columns.number("t", row), columns.number("load", row))
        counts[part] = counts.get(part, 0) + 1
        cycles.append(counts[part])
    return cycles
