"""Tables of measurements: CSV whose column names tell the units, read row by row into SI units."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import attrs

from armwright.accuracy.cycles import ASKED, Kind
from armwright.accuracy.trace import ANGLES
from armwright.errors import FileFormatError, closest, shown
from armwright.files.columns import Columns
from armwright.files.rows import ANGLE_UNITS, LENGTH_UNITS, NOTE, Cells, number_in_cell, of_one_width, read_rows

# SI values of the units that names of columns end in.
_TIMES = {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}
_LOADS = {"n": 1.0, "kn": 1e3}
_SPEEDS = {"m_per_s": 1.0, "mm_per_s": 1e-3, "m_per_min": 1 / 60, "mm_per_min": 1e-3 / 60}
_UNITS: dict[str, Mapping[str, float]] = {
    **dict.fromkeys("xyz", LENGTH_UNITS),
    **dict.fromkeys(ANGLES, ANGLE_UNITS),
    "t": _TIMES,
    "load": _LOADS,
    "speed": _SPEEDS,
}
_WORDS = ("test", "pose", "path", "condition", "direction", "robot")
_TEXTS = (*_WORDS, "cycle")
# Every row tells them, where there is such a column.
_ALWAYS = (*"xyz", *ANGLES)
_KINDS: dict[str, Kind] = {kind: kind for kind in ASKED}
COMMANDED = "commanded"
# The number of a cycle has fewer.
_CYCLE_DIGITS = 10


class Row:
    """One line of a table, in SI units; what it does not tell is empty or None."""

    __slots__ = ("_at", "_table")

    def __init__(self, table: "Table", at: int) -> None:
        """Look at a row of a table, counted from 0."""
        self._table, self._at = table, at

    def error(self, key: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of this row."""
        return FileFormatError(self.path, self.line, key, message)

    @property
    def path(self) -> Path:
        """The file."""
        return self._table.path

    @property
    def line(self) -> int:
        """The line of the file."""
        return self._table.columns.lines[self._at]

    @property
    def test(self) -> Kind:
        """Name of the test."""
        return _KINDS[self._word("test")]

    @property
    def name(self) -> str:
        """Name of the pose or path."""
        return self._word("pose") or self._word("path")

    @property
    def condition(self) -> str:
        """Such as load and speed, in free words."""
        return self._word("condition")

    @property
    def cycle(self) -> int | None:
        """Number of the cycle, from 1; None for what was commanded."""
        number = self._number("cycle")
        return None if number is None else int(number)

    @property
    def direction(self) -> str:
        """Direction of approach, or of a force."""
        return self._word("direction")

    @property
    def robot(self) -> str:
        """Which robot."""
        return self._word("robot")

    @property
    def t(self) -> float | None:
        """Time [s]."""
        return self._number("t")

    @property
    def load(self) -> float | None:
        """Size of a force [N]."""
        return self._number("load")

    @property
    def speed(self) -> float | None:
        """Commanded speed [m/s]."""
        return self._number("speed")

    @property
    def place(self) -> tuple[float, ...]:
        """Two or three coordinates [m]."""
        return self._numbers(self._table.place_names)

    @property
    def angles(self) -> tuple[float, ...]:
        """None to three [rad]."""
        return self._numbers(self.angle_names)

    @property
    def angle_names(self) -> tuple[str, ...]:
        """About which of a, b, c each of the angles turns."""
        return self._table.angle_names

    def _word(self, name: str) -> str:
        return self._table.columns.word(name, self._at)

    def _number(self, name: str) -> float | None:
        return self._table.columns.number(name, self._at)

    def _numbers(self, names: tuple[str, ...]) -> tuple[float, ...]:
        numbers = self._table.columns.numbers
        return tuple(numbers[name][self._at] for name in names)


@attrs.frozen(kw_only=True, eq=False)
class Table:
    """A file of measurements.

    Attributes:
        path: where it was read.
        columns: its rows, in the order of the file.
        place_names: x, y and, in space, z.
        angle_names: those of a, b, c that it tells.
    """

    path: Path
    columns: Columns
    place_names: tuple[str, ...]
    angle_names: tuple[str, ...]

    def rows(self) -> Iterator[Row]:
        """Give its rows."""
        return (Row(self, at) for at in range(len(self.columns)))


class _Column(NamedTuple):
    place: int
    scale: float
    header: str


def read_table(path: Path | str) -> Table:
    """Read a file of measurements; docs/iso9283.md has the format.

    Raises:
        FileFormatError: the file is missing, empty, not separated by commas, or a column or value is not what it should
            be; the text has file, line and column.
    """
    path = Path(path)
    head, lines = read_rows(path)
    columns = _columns(path, head)
    rows = Columns.of([one for one in (*_UNITS, "cycle") if one in columns], [one for one in _WORDS if one in columns])
    for one in of_one_width(path, head, lines):
        line = _Line(path, one, columns)
        rows.add(one.line, line.numbers(), line.words())
    return Table(
        path=path,
        columns=rows,
        place_names=tuple(name for name in "xyz" if name in columns),
        angle_names=tuple(name for name in ANGLES if name in columns),
    )


def _columns(path: Path, head: Cells) -> dict[str, _Column]:
    """Return the columns by their name without the unit."""
    found: dict[str, _Column] = {}
    for place, header in enumerate(cell.lower() for cell in head.cells):
        if header.startswith(NOTE):
            continue
        name, scale = _named(path, head.line, header)
        if name in found:
            raise FileFormatError(path, head.line, header, f"given twice, as {found[name].header} too")
        found[name] = _Column(place, scale, header)
    _complete(path, head.line, found)
    return found


def _named(path: Path, line: int, header: str) -> tuple[str, float]:
    """Return name and SI value of the unit of a column."""
    if header in _TEXTS:
        return header, 1.0
    name, _, unit = header.partition("_")
    if name not in _UNITS:
        known = [*_TEXTS, *(f"{one}_{next(iter(units))}" for one, units in _UNITS.items())]
        near = closest(header, known)
        hint = f" Did you mean '{near}'?" if near else ""
        raise FileFormatError(
            path, line, header or "''", f"no such column.{hint} Known: {', '.join(known)}; note for what is for people"
        )
    units = _UNITS[name]
    if unit not in units:
        told = " or ".join(f"{name}_{one}" for one in units)
        said = "the name must tell the unit" if not unit else f"unknown unit '{unit}'"
        raise FileFormatError(path, line, header, f"{said}: {told}")
    return name, units[unit]


def _complete(path: Path, line: int, found: Mapping[str, _Column]) -> None:
    """Refuse what lacks a column, and groups of columns in different units."""
    for names, what in ((("x", "y", "z"), "coordinates"), (ANGLES, "angles")):
        given = [found[name] for name in names if name in found]
        for one in given:
            if one.scale != given[0].scale:
                raise FileFormatError(
                    path, line, one.header, f"{what} have one unit in a file, and {given[0].header} has another"
                )
    for name, expected in (("test", "test"), ("cycle", "cycle"), ("x", "x_mm"), ("y", "y_mm")):
        if name not in found:
            raise FileFormatError(
                path, line, expected, f"no such column; there are {', '.join(one.header for one in found.values())}"
            )
    if ("pose" in found) == ("path" in found):
        both = "there are both" if "pose" in found else "there is neither"
        raise FileFormatError(path, line, "pose", f"expected a column pose or a column path, {both}")


class _Line:
    """One line of a table while it is read."""

    def __init__(self, path: Path, cells: Cells, columns: Mapping[str, _Column]) -> None:
        self._path, self._columns = path, columns
        self._line, self._cells = cells

    def words(self) -> dict[str, str]:
        """Return the words of the line, the test among them."""
        test = self._text("test").lower()
        if test not in _KINDS:
            near = closest(test, _KINDS)
            hint = f" Did you mean '{near}'?" if near else ""
            raise self._error("test", f"no test '{test}'.{hint} Known: {', '.join(_KINDS)}")
        name = "pose" if "pose" in self._columns else "path"
        if not self._text(name):
            raise self._error(name, "empty; every row belongs to one")
        return {**{one: self._text(one) for one in _WORDS}, "test": test}

    def numbers(self) -> dict[str, float | None]:
        """Return the numbers of the line in SI units, its cycle among them."""
        numbers: dict[str, float | None] = {"cycle": self._cycle()}
        for name in _UNITS:
            if name in self._columns:
                numbers[name] = self._number(name)
                if numbers[name] is None and name in _ALWAYS:
                    raise self._error(self._columns[name].header, "empty; expected a number")
        return numbers

    def _text(self, name: str) -> str:
        return self._cells[self._columns[name].place] if name in self._columns else ""

    def _cycle(self) -> int | None:
        text = self._text("cycle")
        if text.lower() == COMMANDED:
            return None
        # Nine digits at most: Python reads no number of many thousand.
        if not (text.isascii() and text.isdigit() and len(text) < _CYCLE_DIGITS and int(text) > 0):
            raise self._error("cycle", f"expected 1, 2, 3 ... or the word {COMMANDED}, got {shown(text)}")
        return int(text)

    def _number(self, name: str) -> float | None:
        """Return a value in SI units; None where there is none."""
        text = self._text(name)
        if not text:
            return None
        column = self._columns[name]
        return number_in_cell(self._path, self._line, column.header, text) * column.scale

    def _error(self, key: str, message: str) -> FileFormatError:
        return FileFormatError(self._path, self._line, key, message)
