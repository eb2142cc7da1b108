"""What was measured of an arm: joint positions and where the tool was, from CSV whose column names tell the units.

One row for each measurement: ``joint_1_deg, joint_2_deg, ..., x_mm, y_mm, z_mm``. Where a file has targets and how far
the tool was from them, ``x_t_mm, ..., x_dif_mm, ...`` stand in place of ``x_mm, ...``. A column ``set`` tells the rows
that are kept to check with, and a column ``name`` names the rows. Units may be left out of the names and stated.
"""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import degrees_by_mistake
from armwright.arrays import Array, Flags, read_only
from armwright.errors import FileFormatError, closest, one_of
from armwright.files.rows import Cells, number_in_cell, read_rows, refuse_other_widths

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180}
_NAMES = ("name", "pose", "step_order")
_SETS = ("fit", "check")
# Columns whose names begin so are for people.
_NOTE = "note"
_POINTS = ("x", "y", "z")
_TARGETS = ("x_t", "y_t", "z_t")
_OFFSETS = ("x_dif", "y_dif", "z_dif")
_JOINT = re.compile(r"joint_([1-9]\d?)")
# A joint whose positions differ by less has not moved [rad], [m].
_MOVED = 1e-6
# Limits of a slide that are gone beyond by so many times its way are in another unit.
_BEYOND = 20.0
# Turning joints that all stay within so many degrees may be in radians [deg].
_RADIANS = 2 * math.pi
# How many lines a warning names.
_SHOWN = 5


@attrs.frozen(kw_only=True, eq=False)
class Measurements:
    """What was measured of an arm.

    Attributes:
        path: where it was read.
        q: (m, n) joint positions [rad] or [m].
        points: (m, 3) where the tool was [m].
        names: of the measurements; their lines in the file where it names none.
        check: (m,) whether each is kept to check with, not to fit.
        warnings: what is odd but may be so.
    """

    path: Path
    q: Array = attrs.field(converter=read_only)
    points: Array = attrs.field(converter=read_only)
    names: tuple[str, ...]
    check: Flags = attrs.field(converter=read_only)
    warnings: tuple[str, ...]


class _Column(NamedTuple):
    place: int
    unit: str
    header: str


def read_measurements(path: Path | str, arm: Arm, *, units: tuple[str, str] | None = None) -> Measurements:
    """Read a file of measurements.

    Args:
        path: the file.
        arm: that was measured, with n joints.
        units: of lengths and of angles, such as ``("mm", "deg")``, for columns whose names tell none.

    Raises:
        FileFormatError: the file is missing, empty, not separated by commas; a column is missing, unknown, given twice
            or without unit; joints are not those of the arm; a value is no number; positions look like another unit.
            The text has file, line and column.
        UnknownNameError: ``units`` are none.
    """
    path = Path(path)
    stated = (
        None
        if units is None
        else (one_of("unit of length", units[0], LENGTHS), one_of("unit of angle", units[1], ANGLES))
    )
    head, rows = read_rows(path)
    columns = _columns(path, head, arm, stated)
    refuse_other_widths(path, head, rows)
    joints = [f"joint_{i + 1}" for i in range(arm.n)]
    q = _numbers(path, rows, columns, joints)
    if _OFFSETS[0] in columns:
        points = _numbers(path, rows, columns, _TARGETS) + _numbers(path, rows, columns, _OFFSETS)
    else:
        points = _numbers(path, rows, columns, _POINTS)
    lines = [row.line for row in rows]
    _refuse_other_units(path, arm, q, lines, [columns[joint] for joint in joints])
    label = next((name for name in _NAMES if name in columns), None)
    return Measurements(
        path=path,
        q=q,
        points=points,
        names=tuple(row.cells[columns[label].place] if label else str(row.line) for row in rows),
        check=_checks(path, rows, columns),
        warnings=_warnings(arm, q, points, lines, [columns[joint] for joint in joints]),
    )


# ---- columns -------------------------------------------------------------------------------------------------------


def _columns(path: Path, head: Cells, arm: Arm, stated: tuple[str, str] | None) -> dict[str, _Column]:
    """Return the columns by their names without units."""
    found: dict[str, _Column] = {}
    for place, header in enumerate(cell.lower() for cell in head.cells):
        if header.startswith(_NOTE):
            continue
        name, unit = _named(path, head.line, header, arm)
        if name in found:
            raise FileFormatError(path, head.line, header, f"given twice, as {found[name].header} too")
        found[name] = _Column(place, unit, header)
    _complete(path, head.line, found, arm)
    for name, column in found.items():
        units = _units(name, arm)
        if units and not column.unit:
            if stated is None:
                told = " or ".join(f"{name}_{unit}" for unit in units)
                raise FileFormatError(
                    path, head.line, column.header, f"the name tells no unit: write {told}, or state the units"
                )
            found[name] = column._replace(unit=stated[0] if units is LENGTHS else stated[1])
    for group, what in ((_POINTS, "coordinates"), ((*_TARGETS, *_OFFSETS), "targets and what was off")):
        given = [found[name] for name in group if name in found]
        for one in given:
            if one.unit != given[0].unit:
                raise FileFormatError(
                    path, head.line, one.header, f"{what} have one unit in a file, and {given[0].header} has another"
                )
    return found


def _units(name: str, arm: Arm) -> Mapping[str, float]:
    """Return the units that a column may have; none for texts."""
    joint = _JOINT.fullmatch(name)
    if joint:
        return ANGLES if arm.joints[int(joint[1]) - 1].revolute else LENGTHS
    return {} if name in (*_NAMES, "set") else LENGTHS


def _named(path: Path, line: int, header: str, arm: Arm) -> tuple[str, str]:
    """Return what a column is of, and the unit that its name tells."""
    known = [f"joint_{i + 1}" for i in range(arm.n)]
    base, _, unit = header.rpartition("_")
    for name, told in ((header, ""), (base, unit)):
        joint = _JOINT.fullmatch(name)
        if joint and int(joint[1]) > arm.n:
            raise FileFormatError(
                path, line, header, f"{arm.name} has {arm.n} joints; is this a measurement of another arm?"
            )
        if name not in (*known, *_POINTS, *_TARGETS, *_OFFSETS, *_NAMES, "set"):
            continue
        units = _units(name, arm)
        if told and told not in units:
            if joint and told in {**LENGTHS, **ANGLES}:
                kind = "turns" if units is ANGLES else "slides"
                raise FileFormatError(
                    path, line, header, f"joint {joint[1]} of {arm.name} {kind}: expected {_choices(name, units)}"
                )
            raise FileFormatError(path, line, header, f"unknown unit '{told}': expected {_choices(name, units)}")
        return name, told
    choices = [
        *(f"{name}_{'deg' if one.revolute else 'mm'}" for name, one in zip(known, arm.joints, strict=True)),
        *(f"{name}_mm" for name in (*_POINTS, *_TARGETS, *_OFFSETS)),
        *known,
        *_NAMES,
        "set",
    ]
    near = closest(header, choices)
    hint = f" Did you mean '{near}'?" if near else ""
    raise FileFormatError(
        path,
        line,
        header or "''",
        f"no such column.{hint} Known: {', '.join(choices[: arm.n + 3])}, x_t_mm ... z_dif_mm, {', '.join(_NAMES)}, "
        f"set; note... for what is for people",
    )


def _choices(name: str, units: Mapping[str, float]) -> str:
    return " or ".join(f"{name}_{unit}" for unit in units) if units else name


def _complete(path: Path, line: int, found: Mapping[str, _Column], arm: Arm) -> None:
    """Refuse what lacks a column, and points that are told twice."""
    there = ", ".join(one.header for one in found.values())
    joints = sum(1 for name in found if _JOINT.fullmatch(name))
    for i, joint in enumerate(arm.joints):
        if f"joint_{i + 1}" not in found:
            raise FileFormatError(
                path,
                line,
                f"joint_{i + 1}_{'deg' if joint.revolute else 'mm'}",
                f"no such column; {arm.name} has {arm.n} joints, and the file has {joints}: {there}",
            )
    both = [any(name in found for name in group) for group in (_POINTS, (*_TARGETS, *_OFFSETS))]
    if all(both):
        raise FileFormatError(path, line, "x", f"give the points, or targets and what was off, not both: {there}")
    for name in (*_TARGETS, *_OFFSETS) if both[1] else _POINTS:
        if name not in found:
            raise FileFormatError(path, line, f"{name}_mm", f"no such column; there are {there}")
    if len(labels := [name for name in _NAMES if name in found]) > 1:
        raise FileFormatError(path, line, labels[1], f"rows have one name, and {labels[0]} tells it")


# ---- rows ----------------------------------------------------------------------------------------------------------


def _numbers(path: Path, rows: Sequence[Cells], columns: Mapping[str, _Column], names: Sequence[str]) -> Array:
    """Return (m, k) numbers in SI units."""
    wanted = [columns[name] for name in names]
    scales = [{**LENGTHS, **ANGLES}[one.unit] for one in wanted]
    table = [[number_in_cell(path, row.line, one.header, row.cells[one.place]) for one in wanted] for row in rows]
    return np.array(table, dtype=np.float64) * scales


def _checks(path: Path, rows: Sequence[Cells], columns: Mapping[str, _Column]) -> Flags:
    """Return which rows are kept to check with."""
    if "set" not in columns:
        return np.zeros(len(rows), dtype=np.bool_)
    place = columns["set"].place
    for row in rows:
        word = row.cells[place].lower()
        if word not in _SETS:
            near = closest(word, _SETS)
            hint = f"; did you mean {near}?" if near else ""
            raise FileFormatError(path, row.line, "set", f"expected fit or check, got '{row.cells[place]}'{hint}")
    check = np.array([row.cells[place].lower() == "check" for row in rows], dtype=np.bool_)
    if check.all():
        raise FileFormatError(path, None, "set", "every row is kept to check with; none is left to fit")
    return check


def _refuse_other_units(path: Path, arm: Arm, q: Array, lines: Sequence[int], columns: Sequence[_Column]) -> None:
    """Refuse positions of joints that look as if they were in another unit."""
    for i, (joint, column) in enumerate(zip(arm.joints, columns, strict=True)):
        worst = int(np.argmax(np.abs(q[:, i])))
        if joint.revolute:
            alone = np.zeros(arm.n)
            alone[i] = q[worst, i]
            mistake = degrees_by_mistake(arm, alone) if column.unit == "rad" else ""
            if mistake:
                raise FileFormatError(path, lines[worst], column.header, f"{mistake}; are the units right?")
            continue
        lower, upper = joint.limits.lower, joint.limits.upper
        if math.isfinite(upper - lower) and max(q[worst, i] - upper, lower - q[worst, i]) > _BEYOND * (upper - lower):
            raise FileFormatError(
                path,
                lines[worst],
                column.header,
                f"joint {i + 1} of {arm.name} stands at {q[worst, i]:.4g} m, and its limits are {lower:.4g} to "
                f"{upper:.4g} m; are the units right?",
            )


def _warnings(arm: Arm, q: Array, points: Array, lines: Sequence[int], columns: Sequence[_Column]) -> tuple[str, ...]:
    """Return what is odd but may be so."""
    texts = []
    for i, (joint, column) in enumerate(zip(arm.joints, columns, strict=True)):
        scale, unit = {**LENGTHS, **ANGLES}[column.unit], column.unit
        if len(q) > 1 and np.ptp(q[:, i]) < _MOVED:
            texts.append(
                f"joint {i + 1} never moved: it stands at {q[0, i] / scale:.6g} {unit} in all {len(q)} rows. What it "
                f"and its neighbours are off by cannot be told apart"
            )
        beyond = (q[:, i] < joint.limits.lower - _MOVED) | (q[:, i] > joint.limits.upper + _MOVED)
        if beyond.any():
            texts.append(
                f"joint {i + 1} is beyond its limits of {joint.limits.lower / scale:.6g} to "
                f"{joint.limits.upper / scale:.6g} {unit} in {_in_lines(np.flatnonzero(beyond).tolist(), lines)}"
            )
    turning = [i for i, (joint, column) in enumerate(zip(arm.joints, columns, strict=True)) if joint.revolute]
    if turning and all(columns[i].unit == "deg" for i in turning) and len(q) > 1:
        largest = float(np.degrees(np.abs(q[:, turning]).max()))
        if largest < _RADIANS:
            texts.append(f"no joint is farther than {largest:.3g} degrees from 0; are these radians?")
    texts.extend(_copies(q, points, lines))
    return tuple(texts)


def _copies(q: Array, points: Array, lines: Sequence[int]) -> list[str]:
    """Return a warning of rows that say the same to the last digit, which no second measurement does."""
    first: dict[bytes, int] = {}
    copies: list[int] = []
    originals: list[int] = []
    for i, row in enumerate(np.hstack([q, points]) + 0.0):  # -0.0 + 0.0 is 0.0
        original = first.setdefault(row.tobytes(), i)
        if original != i:
            copies.append(i)
            originals.append(original)
    if not copies:
        return []
    return [
        (
            f"{_in_lines(copies, lines)} {'says' if len(copies) == 1 else 'say'} to the last digit what "
            f"{_in_lines(originals, lines)} said: a copy counts twice and tells nothing"
        )
    ]


def _in_lines(numbers: Sequence[int], lines: Sequence[int]) -> str:
    """Name lines of the file, not too many of them."""
    told = ", ".join(str(lines[i]) for i in numbers[:_SHOWN])
    more = f" and {len(numbers) - _SHOWN} more" if len(numbers) > _SHOWN else ""
    return f"line{'s' if len(numbers) > 1 else ''} {told}{more}"
