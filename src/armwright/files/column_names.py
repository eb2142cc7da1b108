"""The names of columns: what a column measures, in which unit, and how the names in a file are understood.

A name is understood whatever its case, gaps and brackets: ``X_nominal_mm``, ``nominal x [mm]`` and ``x (mm) nominal``
are the same column.
"""

import math
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import attrs

from armwright.errors import FileFormatError, closest, one_of
from armwright.files.rows import CsvRow

# Columns whose names begin with this are comments.
NOTE = "note"
# Words in the name of a column that mark commanded and measured values.
_NOMINAL = {"nominal", "nom", "target", "commanded"}
_MEASURED = {"measured", "meas", "actual"}
# What separates words in the name of a column.
_WORD_SEPARATORS = re.compile(r"[\s_\-.,;:\[\](){}]+")
# A minus sign before a name or a word in it, as in ``-x_mm``; a hyphen has a word on its left.
_MINUS = re.compile(r"^\W*-|[\s_(\[{]-(?=\w)")


class Quantity(NamedTuple):
    """What numbers in a column measure.

    Attributes:
        name: as messages call it.
        units: SI values of the units that a column name may end in, the usual one first; none for words and plain
            numbers.
    """

    name: str
    units: Mapping[str, float]


_DEGREE = math.pi / 180
LENGTH = Quantity("length", {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "um": 1e-6, "in": 0.0254})
ANGLE = Quantity("angle", {"deg": _DEGREE, "rad": 1.0, "mrad": 1e-3})
TIME = Quantity("time", {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0})
FORCE = Quantity("force", {"n": 1.0, "kn": 1e3})
TORQUE = Quantity("torque", {"nm": 1.0, "mnm": 1e-3, "knm": 1e3})
MASS = Quantity("mass", {"kg": 1.0})
CURRENT = Quantity("current", {"a": 1.0, "ma": 1e-3})
VELOCITY = Quantity("velocity", {"mm_per_s": 1e-3, "m_per_s": 1.0, "m_per_min": 1 / 60, "mm_per_min": 1e-3 / 60})
ANGULAR_VELOCITY = Quantity("angular velocity", {"deg_per_s": _DEGREE, "rad_per_s": 1.0})
ACCELERATION = Quantity("acceleration", {"mm_per_s2": 1e-3, "m_per_s2": 1.0})
ANGULAR_ACCELERATION = Quantity("angular acceleration", {"deg_per_s2": _DEGREE, "rad_per_s2": 1.0})
NUMBER = Quantity("number", {})
WORD = Quantity("word", {})
_QUANTITIES = (
    LENGTH,
    ANGLE,
    TIME,
    FORCE,
    TORQUE,
    MASS,
    CURRENT,
    VELOCITY,
    ANGULAR_VELOCITY,
    ACCELERATION,
    ANGULAR_ACCELERATION,
)


@attrs.frozen(kw_only=True)
class Column:
    """A column that a table may have.

    Attributes:
        name: without unit.
        quantity: what it measures.
        group: what columns that have one unit in a file are called together; empty where the unit is free.
        synonyms: other names that it may have.
        unit: of a column whose name has none; empty where the name must have one.
        explanation: why it measures that, for the message about a unit of another quantity.
    """

    name: str
    quantity: Quantity = WORD
    group: str = ""
    synonyms: tuple[str, ...] = ()
    unit: str = ""
    explanation: str = ""

    @property
    def name_with_unit(self) -> str:
        """Its name, with the usual unit where it must have one."""
        return self.name if self.unit or not self.quantity.units else f"{self.name}_{next(iter(self.quantity.units))}"

    @property
    def names_with_units(self) -> str:
        """Its name with every unit that it may have."""
        return " or ".join(f"{self.name}_{unit}" for unit in self.quantity.units)


@attrs.frozen(kw_only=True)
class Schema:
    """The columns that a kind of table may have.

    Attributes:
        columns: all of them.
        ignores_unknown: whether a table may have others, which are ignored.
        explain: returns what a message says of an unknown column, given its name in lower case with underscores; may
            be empty.
    """

    columns: Sequence[Column]
    ignores_unknown: bool = False
    explain: Callable[[str], str] = attrs.field(default=lambda _name: "")


class Heading(NamedTuple):
    """A column of a file.

    Attributes:
        cell_index: index of its cell in every row, from 0.
        column: the quantity that it holds.
        unit: unit of its numbers; may be empty.
        text: its name in messages, as it is written, with the name that it is mapped to.
    """

    cell_index: int
    column: Column
    unit: str
    text: str

    @property
    def scale(self) -> float:
        """SI value of its unit."""
        return self.column.quantity.units.get(self.unit, 1.0)


def default_units(length: str, angle: str) -> dict[str, str]:
    """Return the units for columns whose names have none, by quantity.

    Raises:
        UnknownNameError: there is no such unit; the nearest is named.
    """
    return {
        LENGTH.name: one_of("unit of length", length, LENGTH.units),
        ANGLE.name: one_of("unit of angle", angle, ANGLE.units),
    }


def resolve_headings(
    path: Path, head: CsvRow, schema: Schema, mapping: Mapping[str, tuple[str, str]], units: Mapping[str, str] | None
) -> dict[str, Heading]:
    """Return the columns of a file by their names in the schema.

    Args:
        path: the file.
        head: its first line.
        schema: the columns that there may be.
        mapping: by ``normalised_name``, the name in the column map and the name with unit that it is mapped to.
        units: for columns whose names have none, by quantity; None where a reader takes none.

    Raises:
        FileFormatError: a column is unknown, there twice or without unit, or has another unit than its group.
    """
    names = _NameResolver(path, head.line, schema)
    headings: dict[str, Heading] = {}
    for cell, written in enumerate(head.cells):
        _, target = mapping.get(normalised_name(written), ("", ""))
        text = f"{written} as {target}" if target else written
        if (target or written).strip().lower().startswith(NOTE):
            continue
        column, unit = names.resolve(target or written, text, mapped=bool(target)) or (None, "")
        if column is None:
            continue
        if _MINUS.search(unicodedata.normalize("NFKC", target or written)):
            raise names.error(text, "a minus sign in the name of a column does not apply to its numbers; negate them")
        unit = unit or (units or {}).get(column.quantity.name, "") or column.unit
        if column.quantity.units and not unit:
            where = f"in the file or by {'--columns' if units is None else '--columns or --units'}"
            raise names.error(text, f"the name has no unit: expected {column.names_with_units}, {where}")
        if column.name in headings:
            raise names.error(text, f"a second column for this quantity, after {headings[column.name].text}")
        headings[column.name] = Heading(cell, column, unit, text)
    first: dict[str, Heading] = {}
    for heading in headings.values():
        group = heading.column.group
        other = first.setdefault(group or heading.column.name, heading)
        if other.unit != heading.unit:
            raise names.error(heading.text, f"{group} must have one unit in a file, but {other.text} has another")
    return headings


class _NameResolver:
    """The names that the columns of a schema may have in a file."""

    def __init__(self, path: Path, line: int, schema: Schema) -> None:
        self._path, self._line, self._schema = path, line, schema
        self._own = {column.name: [column] for column in schema.columns}
        self._all = {name: list(columns) for name, columns in self._own.items()}
        for column in schema.columns:
            for synonym in dict.fromkeys("_".join(_words(synonym)) for synonym in column.synonyms):
                if synonym != column.name:
                    self._all.setdefault(synonym, []).append(column)

    def error(self, text: str, message: str) -> FileFormatError:
        """Return the error that says ``message`` of a column."""
        return FileFormatError(self._path, self._line, text or "''", message)

    def resolve(self, header: str, text: str, *, mapped: bool) -> tuple[Column, str] | None:
        """Return which column a header is, and its unit, which may be empty; None where it is ignored.

        Args:
            header: the name of a column.
            text: as messages show it.
            mapped: whether it comes from a column map, in which a name of the schema comes before a synonym.

        Raises:
            FileFormatError: there is no such column or unit, or several columns may be meant.
        """
        words = _words(header)
        base_words = [word for word in words if word not in _NOMINAL | _MEASURED]
        nominal = ["nominal"] if _NOMINAL & set(words) else []
        # The longest name counts, as a name may begin with another: x_t_mm is no x.
        splits = [(words[:end], words[end:]) for end in range(len(words), 0, -1)]
        if len(base_words) < len(words):
            splits = [split for split in splits if set(split[1]).isdisjoint(_NOMINAL | _MEASURED)]
            splits += [(base_words[:end] + nominal, base_words[end:]) for end in range(len(base_words), 0, -1)]
        lenient = self._schema.ignores_unknown and not mapped
        for name, unit in (map("_".join, split) for split in splits):
            columns = (self._own.get(name) if mapped else None) or self._all.get(name)
            if not columns:
                continue
            if len(columns) > 1:
                either = " and ".join(column.name for column in columns)
                raise self.error(text, f"{name} is a name of {either}; specify which is meant by --columns")
            if not unit or unit in columns[0].quantity.units:
                return columns[0], unit
            # What is longer than a unit belongs to the name of a column that there is not.
            if columns[0].quantity.units and ("_" not in unit or "_per_" in unit) and not lenient:
                raise self.error(text, _unit_error_text(columns[0], unit))
        if lenient:
            return None
        raise self.error(text, self._schema.explain("_".join(words)) or self._unknown_name_text("_".join(words)))

    def _unknown_name_text(self, name: str) -> str:
        spellings = [
            f"{key}_{unit}".rstrip("_")
            for key, columns in self._all.items()
            for unit in columns[0].quantity.units or ("",)
        ]
        near = closest(name, spellings)
        hint = f" Did you mean '{near}'?" if near else ""
        known = ", ".join(column.name_with_unit for column in self._schema.columns)
        return f"no such column.{hint} Known: {known}; comments are columns named note..."


def normalised_name(header: str) -> str:
    """Return the name of a column without what makes no difference in a column map: case and blanks."""
    return " ".join(header.lower().split())


def _words(header: str) -> list[str]:
    """Return the words of a name, its unit among them: ``X nominal [µm]`` is x, nominal, um."""
    text = unicodedata.normalize("NFKC", header).lower()
    for sign, word in (("μ", "u"), ("°", "deg"), ("/", "_per_"), ("^", "")):
        text = text.replace(sign, word)
    return [word for word in _WORD_SEPARATORS.split(text) if word]


def _unit_error_text(column: Column, unit: str) -> str:
    """Return the message that a column has no such unit."""
    other = next((quantity.name for quantity in _QUANTITIES if unit in quantity.units), None)
    if other is None:
        return f"unknown unit '{unit}': expected {column.names_with_units}"
    explanation = f", and {column.explanation}" if column.explanation else ""
    return f"{unit} is a unit of {other}{explanation}: expected {column.names_with_units}"
