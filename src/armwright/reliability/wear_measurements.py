"""What was measured of a linkage while it wore: its clearances, AP or RP after some strokes, as a table.

One row for each measurement: ``strokes, measure, value_mm, standard_error_mm``; a measure is the name of a pin, whose
clearance it is, or ``AP`` or ``RP``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.errors import closest, shown
from armwright.files.column_names import LENGTH, NUMBER, Column, Schema
from armwright.files.limits import limit, limit_message
from armwright.files.unit_table import read_header
from armwright.reliability.linkage_wear import WearingLinkage

_COLUMNS = ("strokes", "measure", "value", "standard_error")
_SCHEMA = Schema(
    columns=(
        Column(name="strokes", quantity=NUMBER, synonyms=("cycles",)),
        Column(name="measure"),
        Column(name="value", quantity=LENGTH, group="lengths"),
        Column(name="standard_error", quantity=LENGTH, group="lengths"),
    )
)
# Accuracy and repeatability at the worst pose.
TIP_MEASURES = ("AP", "RP")
# Strokes of a life at most, and the largest length that is measured [m].
MOST_STROKES, _LARGEST = 1e15, 1.0
# Nobody measures better than to a nanometre [m].
_FINEST = 1e-9


class WearMeasurement(NamedTuple):
    """A measurement of a worn linkage.

    Attributes:
        strokes: done before.
        measure: name of a pin, whose clearance it is, or ``AP`` or ``RP``.
        value: [m].
        error: standard error of the value [m].
    """

    strokes: float
    measure: str
    value: float
    error: float


def read_wear_measurements(
    path: Path | str,
    pins: Sequence[str],
    *,
    columns: Mapping[str, str] | None = None,
    skip_incomplete: bool = False,
) -> tuple[WearMeasurement, ...]:
    """Read a table of measurements.

    Args:
        path: the file.
        pins: their names.
        columns: names of columns, with unit, by those in the file.
        skip_incomplete: leave out rows with empty cells; an ``IncompleteRowsWarning`` says how many.

    Raises:
        FileFormatError: it is missing or broken, or a cell is out of its range. The text has file and line.
    """
    header = read_header(path, _SCHEMA, columns=columns)
    header.require(_COLUMNS)
    table = header.rows(filled=_COLUMNS, skip_incomplete=skip_incomplete)
    if len(table) > limit("entries"):
        raise table.error(limit("entries"), "", f"too many: {limit_message('entries')}")
    known = (*pins, *TIP_MEASURES)
    found = []
    for row, (strokes, value, error) in enumerate(table.numbers(("strokes", "value", "standard_error")).tolist()):
        name = table.word("measure", row)
        if name not in known:
            near = closest(name, known)
            hint = f"; did you mean '{near}'?" if near else ""
            raise table.error(row, "measure", f"expected one of {', '.join(known)}, got {shown(name)}{hint}")
        if not 0 <= strokes <= MOST_STROKES:
            raise table.error(row, "strokes", f"expected 0 to {MOST_STROKES:g}, got {strokes:g}")
        if not 0 <= value <= _LARGEST:
            raise table.error(row, "value", f"expected 0 to {_LARGEST * 1e3:g} mm, got {value * 1e3:g} mm")
        if not _FINEST <= error <= _LARGEST:
            raise table.error(
                row, "standard_error", f"expected {_FINEST * 1e3:g} to {_LARGEST * 1e3:g} mm, got {error * 1e3:g} mm"
            )
        found.append(WearMeasurement(strokes, name, value, error))
    return tuple(found)


def measured_residuals(wearing: WearingLinkage, measured: Sequence[WearMeasurement], z: Array) -> Array:
    """Return (n, r) residuals of r measurements, in standard errors, for linkages that numbers (n, size) describe.

    Args:
        wearing: the linkage.
        measured: r measurements.
        z: (n, size) standard normal numbers.
    """
    pins = list(wearing.linkage.clearances)
    residuals = []
    for each in measured:
        strokes = np.full(len(z), each.strokes)
        if each.measure in TIP_MEASURES:
            found = wearing.measure("RP" if each.measure == "RP" else "error", z, strokes).max(axis=1)
        else:
            found = wearing.worn_clearances(z, strokes)[:, pins.index(each.measure)]
        residuals.append((found - each.value) / each.error)
    return np.stack(residuals, axis=1)
