"""Tables of measurements: CSV whose column names tell the units, read row by row into SI units."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import attrs

from armwright.accuracy.cycles import ASKED, Kind
from armwright.accuracy.measured import ANGLES
from armwright.errors import FileFormatError, closest, shown
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
_TEXTS = ("test", "pose", "path", "condition", "cycle", "direction", "robot")
COMMANDED = "commanded"
# The number of a cycle has fewer.
_CYCLE_DIGITS = 10


class Row(NamedTuple):
    """One line of a table, in SI units; what it does not tell is empty or None.

    Attributes:
        line: of the file.
        test: name of the test.
        name: of the pose or path.
        condition: such as load and speed, in free words.
        cycle: from 1; None for what was commanded.
        direction: of approach, or of a force.
        robot: which one.
        t: time [s].
        load: size of a force [N].
        speed: commanded speed [m/s].
        place: two or three coordinates [m].
        angles: none to three [rad].
        angle_names: about which of a, b, c each of them turns.
    """

    line: int
    test: Kind
    name: str
    condition: str
    cycle: int | None
    direction: str
    robot: str
    t: float | None
    load: float | None
    speed: float | None
    place: tuple[float, ...]
    angles: tuple[float, ...]
    angle_names: tuple[str, ...]


@attrs.frozen(kw_only=True, eq=False)
class Table:
    """A file of measurements.

    Attributes:
        path: where it was read.
        columns: their names.
        rows: in the order of the file.
    """

    path: Path
    columns: tuple[str, ...]
    rows: tuple[Row, ...]


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
    rows = tuple(_Line(path, one, columns).row() for one in of_one_width(path, head, lines))
    return Table(path=path, columns=tuple(columns), rows=rows)


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

    def row(self) -> Row:
        """Return what the line says, in SI units."""
        test = self._text("test").lower()
        kinds: dict[str, Kind] = {kind: kind for kind in ASKED}
        if test not in kinds:
            near = closest(test, kinds)
            hint = f" Did you mean '{near}'?" if near else ""
            raise self._error("test", f"no test '{test}'.{hint} Known: {', '.join(kinds)}")
        name = "pose" if "pose" in self._columns else "path"
        if not self._text(name):
            raise self._error(name, "empty; every row belongs to one")
        return Row(
            line=self._line,
            test=kinds[test],
            name=self._text(name),
            condition=self._text("condition"),
            cycle=self._cycle(),
            direction=self._text("direction"),
            robot=self._text("robot"),
            t=self._number("t"),
            load=self._number("load"),
            speed=self._number("speed"),
            place=self._numbers("xyz"),
            angles=self._numbers(ANGLES),
            angle_names=tuple(name for name in ANGLES if name in self._columns),
        )

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

    def _numbers(self, names: Iterable[str]) -> tuple[float, ...]:
        values = []
        for name in names:
            if name in self._columns:
                value = self._number(name)
                if value is None:
                    raise self._error(self._columns[name].header, "empty; expected a number")
                values.append(value)
        return tuple(values)

    def _number(self, name: str) -> float | None:
        """Return a value in SI units; None where there is none."""
        text = self._text(name)
        if not text:
            return None
        column = self._columns[name]
        return number_in_cell(self._path, self._line, column.header, text) * column.scale

    def _error(self, key: str, message: str) -> FileFormatError:
        return FileFormatError(self._path, self._line, key, message)
