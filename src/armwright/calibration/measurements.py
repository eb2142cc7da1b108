"""Measurements of an arm, from CSV whose column names have units.

One row for each measurement: ``joint_1_deg, joint_2_deg, ...`` and what was measured in that joint configuration:

- ``x_mm, y_mm, z_mm``, the position of the tool; or ``x_nominal_mm, ..., x_deviation_mm, ...``, of which it is the sum.
  With ``frame``, the word for the frame of these coordinates, where there are several;
- with it ``roll_deg, pitch_deg, yaw_deg`` (about fixed x, y, z) or ``qw, qx, qy, qz``, its orientation;
- ``plane``, the word for a plane that the tool touched;
- ``distance_mm`` from an ``anchor``, or ``to`` the tool in the row of that name.

With ``payload_kg`` what the tool held, and with ``payload_x_mm`` and so on its centre of mass in the frame of the tool.

Cells may be empty where a row has something else. ``set`` marks the rows that are held out to check with, and ``name``
names the rows. docs/tables.md describes the names of columns.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import degrees_by_mistake
from armwright.arrays import Array, Flags, read_only
from armwright.calibration.columns import (
    DEVIATIONS,
    DISTANCE,
    NAMES,
    NOMINAL,
    PAYLOAD,
    RPY,
    joint_columns,
    read_columns,
)
from armwright.calibration.readings import Readings, number_labels
from armwright.errors import FileFormatError, closest
from armwright.files.column_names import Heading, default_units
from armwright.files.unit_table import CellText, Header, RequiredCells, UnitTable, lines_text
from armwright.spatial.euler import from_rpy
from armwright.spatial.rotations import rotation_from_quaternion

_SETS = ("fit", "check")
# A joint whose positions differ by less has not moved [rad], [m].
_MIN_MOTION = 1e-6
# A prismatic joint is in another unit if it exceeds its limits by this multiple of its range.
_MAX_LIMIT_EXCESS = 20.0
# Revolute joints that all stay within this angle may be in radians [deg].
_MAX_RADIANS = 2 * math.pi
# How many lines a warning names.
_SHOWN = 5
# Rows that are compared at once.
_BLOCK_ROWS = 10_000
# A unit quaternion that is written with four digits.
_QUATERNION_TOLERANCE = 1e-3


@attrs.frozen(kw_only=True, eq=False)
class Measurements:
    """Measurements of an arm.

    Attributes:
        path: of the file.
        readings: m of them.
        names: of the readings; their lines in the file where it names none.
        check: (m,) whether each is reserved for validation.
        warnings: of unusual readings.
    """

    path: Path
    readings: Readings
    names: tuple[str, ...]
    check: Flags = attrs.field(converter=read_only)
    warnings: tuple[str, ...]

    @property
    def q(self) -> Array:
        """(m, n) joint positions [rad] or [m]."""
        return self.readings.q

    @property
    def points(self) -> Array:
        """(m, 3) positions of the tool; NaN where they were not measured [m]."""
        return self.readings.points


def read_measurements(
    path: Path | str,
    arm: Arm,
    *,
    units: tuple[str, str] | None = None,
    columns: Mapping[str, str] | None = None,
    skip_incomplete: bool = False,
) -> Measurements:
    """Read a file of measurements.

    Args:
        path: the file.
        arm: that was measured, with n joints.
        units: of lengths and of angles, such as ``("mm", "deg")``, for columns whose names have none.
        columns: names of columns, with unit, by those in the file: ``{"A1": "joint_1_deg"}``.
        skip_incomplete: leave out rows with cells that should not be empty; an ``IncompleteRowsWarning`` says how many.

    Raises:
        FileFormatError: the file is missing or empty; a column is missing, unknown, there twice or without unit; joints
            are not those of the arm; a value is no number; a row has no measurement; positions look like another unit.
            The text has file, line and column.
        UnknownNameError: there are no such ``units``.
    """
    default = default_units(*units) if units else {}
    header, position, orientation = read_columns(path, arm, columns=columns, units=default)
    joints = joint_columns(arm)
    table = header.rows(
        filled=[*joints, *header.columns_present(["set"])],
        required=partial(_required_cells, header, position, orientation),
        skip_incomplete=skip_incomplete,
    )
    readings = _readings(table, table.numbers(joints), position, orientation)
    headings = [table.headings[joint] for joint in joints]
    _refuse_other_units(table, arm, readings.q, headings)
    return Measurements(
        path=table.path,
        readings=readings,
        names=_names(table),
        check=_check_flags(table),
        warnings=tuple(_warnings(arm, readings, table.lines, headings)),
    )


# ---- rows ----------------------------------------------------------------------------------------------------------


def _required_cells(
    header: Header, position: Sequence[str], orientation: Sequence[str], cell_text: CellText
) -> Iterator[RequiredCells]:
    """Give the cells that a row requires, for it has one of a position, a plane and a distance, and that completely."""
    others = header.columns_present(("plane", DISTANCE))
    has_position, has_orientation = any(map(cell_text, position)), any(map(cell_text, orientation))
    if has_position or has_orientation or not others:
        yield from (RequiredCells((name,), "a number") for name in position)
    elif not any(map(cell_text, others)):
        yield RequiredCells((*position[:1], *others), "a position, a plane or a distance")
    if has_orientation:
        yield from (RequiredCells((name,), "a number") for name in orientation)
    if has_position and "frame" in header:
        yield RequiredCells(("frame",), "a name; where one point has a frame all points have one")
    if cell_text(DISTANCE):
        yield RequiredCells(("anchor", "to"), "the anchor of the distance, or the name of another row")
    elif cell_text("anchor") or cell_text("to"):
        yield RequiredCells((DISTANCE,), "the length of the distance")


def _names(table: UnitTable) -> tuple[str, ...]:
    """Return the names of the rows; their lines where the file names none."""
    label = next((name for name in NAMES if name in table), None)
    return tuple(table.words(label)) if label else tuple(map(str, table.lines))


def _readings(table: UnitTable, q: Array, position: Sequence[str], orientation: Sequence[str]) -> Readings:
    points = np.full((len(q), 3), np.nan)
    if DEVIATIONS[0] in position:
        points = table.numbers(NOMINAL) + table.numbers(DEVIATIONS)
    elif position:
        points = table.numbers(position)
    rotations = _rotations(table, points, orientation)
    has_point = np.isfinite(points[:, 0])
    frames = [word if known else None for word, known in zip(table.words("frame"), has_point.tolist(), strict=True)]
    planes, anchors = ([word or None for word in table.words(name)] for name in ("plane", "anchor"))
    labels = number_labels(frame=frames, plane=planes, anchor=anchors)
    distances = table.numbers([DISTANCE])[:, 0] if DISTANCE in table else np.full(len(q), np.nan)
    other = _other_configurations(table, q, distances)
    return Readings(
        q=q,
        points=points,
        rotations=rotations,
        distances=distances,
        other=other,
        payload=_payloads(table),
        **labels,
    )


def _payloads(table: UnitTable) -> Array:
    """Return (m, 4) mass and centre of mass of what the tool held; 0 where a cell is empty."""
    columns = [
        np.nan_to_num(table.numbers([name])[:, 0]) if name in table else np.zeros(len(table)) for name in PAYLOAD
    ]
    masses = columns[0]
    for i in np.flatnonzero(masses < 0).tolist():
        raise table.error(i, PAYLOAD[0], f"expected a mass of 0 kg or more, got {masses[i]:g} kg")
    return np.stack(columns, axis=1)


def _rotations(table: UnitTable, points: Array, orientation: Sequence[str]) -> Array:
    """Return (m, 3, 3) orientations of the tool; NaN where they were not measured."""
    if not orientation:
        return np.broadcast_to(np.nan, (len(points), 3, 3))
    numbers = table.numbers(orientation)
    rotations = np.full((len(points), 3, 3), np.nan)
    for i in np.flatnonzero(np.isfinite(numbers[:, 0])):
        if orientation is RPY:
            roll, pitch, yaw = numbers[i]
            rotations[i] = from_rpy(roll, pitch, yaw)
            continue
        length = float(np.linalg.norm(numbers[i]))
        if abs(length - 1) > _QUATERNION_TOLERANCE:
            raise table.error(int(i), "qw", f"expected a quaternion of length 1, got one of {length:.6g}")
        rotations[i] = rotation_from_quaternion(numbers[i])
    return rotations


def _other_configurations(table: UnitTable, q: Array, distances: Array) -> Array:
    """Return (m, n) the joint configurations that distances are from; NaN where they are from an anchor or absent."""
    if DISTANCE not in table:
        return np.broadcast_to(np.nan, q.shape)
    other, names = np.full(q.shape, np.nan), _names(table)
    rows_by_name: dict[str, list[int]] = {to: [] for to in table.words("to")}
    for k, name in enumerate(names):
        if name in rows_by_name:
            rows_by_name[name].append(k)
    for i, (to, anchor) in enumerate(zip(table.words("to"), table.words("anchor"), strict=True)):
        if to and anchor:
            raise table.error(i, DISTANCE, "expected a distance from an anchor or from another row, got one from both")
        if distances[i] < 0:
            raise table.error(i, DISTANCE, f"expected a distance, got {distances[i]:g} m")
        if not to:
            continue
        rows = rows_by_name[to]
        if len(rows) != 1:
            near = closest(to, names)
            hint = f"; did you mean {near}?" if near and not rows else ""
            raise table.error(i, "to", f"expected the name of one row, got '{to}', which {len(rows)} rows have{hint}")
        if rows[0] == i:
            raise table.error(i, "to", "expected the name of another row, got that of the row itself")
        other[i] = q[rows[0]]
    return other


def _check_flags(table: UnitTable) -> Flags:
    """Return which rows are held out for validation."""
    if "set" not in table:
        return np.zeros(len(table), dtype=np.bool_)
    check = np.array([table.choice("set", i, _SETS) == "check" for i in range(len(table))], dtype=np.bool_)
    if check.all():
        raise FileFormatError(table.path, None, "set", "every row is held out for validation; none is left to fit")
    return check


def _refuse_other_units(table: UnitTable, arm: Arm, q: Array, headings: Sequence[Heading]) -> None:
    """Refuse joint positions that look as if they were in another unit."""
    for i, (joint, heading) in enumerate(zip(arm.joints, headings, strict=True)):
        worst = int(np.argmax(np.abs(q[:, i])))
        position, lower, upper = q[worst, i], joint.limits.lower, joint.limits.upper
        mistake = ""
        if joint.revolute and heading.unit == "rad":
            mistake = degrees_by_mistake(arm, np.where(np.arange(arm.n) == i, position, 0.0))
        elif not joint.revolute and max(position - upper, lower - position) > _MAX_LIMIT_EXCESS * (upper - lower):
            limits = f"{lower:.4g} to {upper:.4g} m"
            mistake = f"{arm.joint_label(i)} of {arm.name} is at {position:.4g} m, and its limits are {limits}"
        if mistake:
            raise table.error(worst, heading.column.name, f"{mistake}; are the units right?")


def _warnings(arm: Arm, readings: Readings, lines: Sequence[int], headings: Sequence[Heading]) -> Iterator[str]:
    """Give warnings of unusual readings."""
    q = readings.q
    for i, (joint, heading) in enumerate(zip(arm.joints, headings, strict=True)):
        scale, unit = heading.scale, heading.unit
        if len(q) > 1 and np.ptp(q[:, i]) < _MIN_MOTION:
            yield (
                f"{arm.joint_label(i)} never moved: it is at {q[0, i] / scale:.6g} {unit} in all {len(q)} rows. Its "
                f"errors cannot be distinguished from those of its neighbours"
            )
        beyond = (q[:, i] < joint.limits.lower - _MIN_MOTION) | (q[:, i] > joint.limits.upper + _MIN_MOTION)
        if beyond.any():
            yield (
                f"{arm.joint_label(i)} is beyond its limits of {joint.limits.lower / scale:.6g} to "
                f"{joint.limits.upper / scale:.6g} {unit} in {_lines_of_rows(np.flatnonzero(beyond).tolist(), lines)}"
            )
    revolute = [i for i, joint in enumerate(arm.joints) if joint.revolute]
    if revolute and all(headings[i].unit == "deg" for i in revolute) and len(q) > 1:
        largest = float(np.degrees(np.abs(q[:, revolute]).max()))
        if largest < _MAX_RADIANS:
            yield f"no joint is farther than {largest:.3g} degrees from 0; are these radians?"
    yield from _duplicate_warnings(readings, lines)


def _duplicate_warnings(readings: Readings, lines: Sequence[int]) -> Iterator[str]:
    """Give a warning of rows that are equal to the last digit, which independent measurements never are."""
    quantities = [
        readings.q,
        readings.payload,
        readings.points,
        readings.plane[:, None],
        readings.distances[:, None],
        readings.other,
    ]

    def row_bytes(rows: slice) -> list[bytes]:
        return [row.tobytes() for row in np.hstack([part[rows] for part in quantities]) + 0.0]  # -0.0 + 0.0 is 0.0

    # Whole rows are compared where their hashes agree alone: those of a million rows take little room.
    blocks = (slice(start, start + _BLOCK_ROWS) for start in range(0, len(readings), _BLOCK_ROWS))
    hashes = np.fromiter((hash(row) for rows in blocks for row in row_bytes(rows)), dtype=np.int64, count=len(readings))
    _, which, count = np.unique(hashes, return_inverse=True, return_counts=True)
    first: dict[bytes, int] = {}
    alike = np.flatnonzero(count[which] > 1).tolist()
    originals = {i: first.setdefault(row_bytes(slice(i, i + 1))[0], i) for i in alike}
    copies = {i: original for i, original in originals.items() if original != i}
    if copies:
        equal = f"{'equals' if len(copies) == 1 else 'equal'} {_lines_of_rows([*copies.values()], lines)}"
        reason = "a copied row adds weight, but no information"
        yield f"{_lines_of_rows([*copies], lines)} {equal} to the last digit: {reason}"


def _lines_of_rows(numbers: Sequence[int], lines: Sequence[int]) -> str:
    """Name the lines of rows, not too many of them."""
    return lines_text([lines[i] for i in numbers[:_SHOWN]], len(numbers))
