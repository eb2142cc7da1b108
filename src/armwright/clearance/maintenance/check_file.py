"""Past checks of a wearing linkage, as CSV: readings of its resting tip, or clearances, after numbers of strokes.

One row for each reading: ``strokes, commanded_x_mm, commanded_y_mm, x_mm, y_mm``; or one for each clearance:
``strokes, pin, clearance_mm, deviation_mm``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TypeAlias

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.clearance.estimation.measurement_file import refuse_large_errors
from armwright.clearance.linkage import Linkage
from armwright.clearance.maintenance.belief import Measured
from armwright.clearance.maintenance.maintained_linkage import MaintainedLinkage
from armwright.clearance.maintenance.readings import read_offsets
from armwright.clearance.maintenance.wear_history import Places
from armwright.clearance.poses import closed_at_tips
from armwright.errors import UnknownNameError
from armwright.files.column_names import LENGTH, NUMBER, Column, Schema
from armwright.files.limits import limit, limit_message
from armwright.files.unit_table import UnitTable, read_header

_READINGS = ("strokes", "commanded_x", "commanded_y", "x", "y")
_CLEARANCES = ("strokes", "pin", "clearance", "deviation")
_SCHEMA = Schema(
    columns=(
        Column(name="strokes", quantity=NUMBER),
        Column(name="pin"),
        *(
            Column(name=name, quantity=LENGTH, group="lengths", synonyms=(f"{name[-1]}_nominal",) * (len(name) > 1))
            for name in _READINGS[1:]
        ),
        *(Column(name=name, quantity=LENGTH, group="lengths") for name in _CLEARANCES[2:]),
    )
)
# Lengths in a file, and their deviations [m]: nobody measures better than to a nanometre.
_LARGEST, _FINEST = 1.0, 1e-9


@attrs.frozen(kw_only=True, eq=False)
class RestCheck:
    """Readings of the resting tip.

    Attributes:
        strokes: after which they were made.
        poses: (k, 2) commanded positions of the tip [m].
        offsets: (k, 2) of the tip from these, means of the readings [m].
        readings: (k,) their numbers.
    """

    strokes: float
    poses: Array
    offsets: Array
    readings: Array

    def measured(self, machine: MaintainedLinkage, noise: float, believed: tuple[Array, Array]) -> Measured:
        """Return what the readings say of the clearances.

        Args:
            machine: that was measured.
            noise: standard deviation of one coordinate of a reading [m].
            believed: (p,) mean clearances of the new pins before, and (s, p) samples of their growths [m].

        Raises:
            InvalidValueError: a pose cannot be reached, or a pin carries no force there.
        """
        poses = Places.of(machine.linkage, closed_at_tips(machine.linkage, self.poses))
        gaps = machine.history.gaps(poses)
        before = believed[0][None], believed[1][None]
        return read_offsets(machine.linkage, poses, gaps, self.offsets[None], self.readings, noise, before)[0]


@attrs.frozen(kw_only=True, eq=False)
class ClearanceCheck:
    """Measured clearances.

    Attributes:
        strokes: after which they were measured.
        pins: numbers of the pins, k of them.
        clearances: (k,) [m].
        deviations: (k,) standard deviations of these [m].
    """

    strokes: float
    pins: tuple[int, ...]
    clearances: Array
    deviations: Array

    def measured(self, machine: MaintainedLinkage, noise: float, believed: tuple[Array, Array]) -> Measured:
        """Return what they say of all clearances; they need neither poses nor the noise of readings."""
        del machine, noise, believed
        pins = list(self.pins)
        return Measured(
            predicted=lambda new, growths: (new + growths)[..., pins],
            values=self.clearances,
            covariance=np.diag(self.deviations**2),
        )


PastCheck: TypeAlias = RestCheck | ClearanceCheck


def read_checks(
    path: Path | str, linkage: Linkage, *, columns: Mapping[str, str] | None = None, skip_incomplete: bool = False
) -> tuple[PastCheck, ...]:
    """Read a file of checks, in the order of their strokes.

    Args:
        path: the file.
        linkage: that was measured.
        columns: names of columns, with unit, by those in the file.
        skip_incomplete: leave out rows with empty cells; an ``IncompleteRowsWarning`` says how many.

    Raises:
        FileFormatError: it is missing or broken; columns are missing or in mixed units; a cell is no number; a number
            is out of its range; there is no such pin. The text has file and line.
    """
    header = read_header(path, _SCHEMA, columns=columns)
    by_pin = header.either_column("pin", "commanded_x") == "pin"
    expected = _CLEARANCES if by_pin else _READINGS
    header.require(expected)
    table = header.rows(filled=expected, skip_incomplete=skip_incomplete)
    strokes = table.numbers(("strokes",))[:, 0]
    for row in np.flatnonzero(strokes < 0)[:1]:
        raise table.error(int(row), "strokes", f"expected 0 or more, got {strokes[row]:g}")
    moments = np.unique(strokes)
    if len(moments) > limit("entries"):
        raise table.error(0, "strokes", f"too many: {limit_message('entries')}")
    groups = {float(n): np.flatnonzero(strokes == n).tolist() for n in moments}
    if by_pin:
        return tuple(_clearance_check(table, linkage, n, rows) for n, rows in groups.items())
    return tuple(_rest_check(table, n, rows) for n, rows in groups.items())


def _clearance_check(table: UnitTable, linkage: Linkage, strokes: float, rows: list[int]) -> ClearanceCheck:
    names = tuple(linkage.clearances)
    values = table.numbers(("clearance", "deviation"))[rows]
    pins = []
    for row, (clearance, deviation) in zip(rows, values, strict=True):
        name = table.word("pin", row)
        if name not in names:
            raise table.error(row, "pin", str(UnknownNameError("pin", name, names)))
        if not 0 <= clearance <= _LARGEST:
            raise table.error(row, "clearance", f"expected 0 to {_LARGEST * 1e3:g} mm, got {clearance * 1e3:g} mm")
        if not _FINEST <= deviation <= _LARGEST:
            raise table.error(
                row, "deviation", f"expected {_FINEST * 1e3:g} to {_LARGEST * 1e3:g} mm, got {deviation * 1e3:g} mm"
            )
        pins.append(names.index(name))
    return ClearanceCheck(strokes=strokes, pins=tuple(pins), clearances=values[:, 0], deviations=values[:, 1])


def _rest_check(table: UnitTable, strokes: float, rows: list[int]) -> RestCheck:
    numbers = table.numbers(_READINGS[1:])[rows]
    errors = numbers[:, 2:] - numbers[:, :2]
    refuse_large_errors(table, rows[0], f"check after {strokes:g} strokes", errors)
    poses, which = np.unique(numbers[:, :2], axis=0, return_inverse=True)
    groups = [errors[which.ravel() == k] for k in range(len(poses))]
    return RestCheck(
        strokes=strokes,
        poses=poses,
        offsets=np.array([group.mean(axis=0) for group in groups]),
        readings=np.array([float(len(group)) for group in groups]),
    )
