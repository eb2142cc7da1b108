"""The columns of a file of measurements: what each is of, and the unit that its name tells."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from armwright.arm.model import Arm
from armwright.errors import FileFormatError, closest
from armwright.files.rows import ANGLE_UNITS, LENGTH_UNITS, NOTE, Cells

NAMES = ("name", "pose", "step_order")
POINTS = ("x", "y", "z")
TARGETS = ("x_t", "y_t", "z_t")
OFFSETS = ("x_dif", "y_dif", "z_dif")
RPY = ("roll", "pitch", "yaw")
QUATERNION = ("qw", "qx", "qy", "qz")
DISTANCE = "distance"
# Columns of words.
WORDS = (*NAMES, "set", "frame", "plane", "anchor", "to")
_ALL = (*POINTS, *TARGETS, *OFFSETS, *RPY, *QUATERNION, DISTANCE, *WORDS)
_JOINT = re.compile(r"joint_([1-9]\d?)")


class Column(NamedTuple):
    """A column of a table.

    Attributes:
        place: which it is, from 0.
        unit: of its numbers; empty where they have none, and for words.
        header: its name as it is written.
    """

    place: int
    unit: str
    header: str


def read_columns(path: Path, head: Cells, arm: Arm, stated: tuple[str, str] | None) -> dict[str, Column]:
    """Return the columns by their names without units.

    Args:
        path: the file.
        head: its first line.
        arm: that was measured.
        stated: units of lengths and of angles for columns whose names tell none.

    Raises:
        FileFormatError: a column is missing, unknown, given twice or without unit; joints are not those of the arm.
    """
    found: dict[str, Column] = {}
    for place, header in enumerate(cell.lower() for cell in head.cells):
        if header.startswith(NOTE):
            continue
        name, unit = _named(path, head.line, header, arm)
        if name in found:
            raise FileFormatError(path, head.line, header, f"given twice, as {found[name].header} too")
        found[name] = Column(place, unit, header)
    _complete(path, head.line, found, arm)
    for name, column in found.items():
        units = _units(name, arm)
        if units and not column.unit:
            if stated is None:
                told = " or ".join(f"{name}_{unit}" for unit in units)
                raise FileFormatError(
                    path, head.line, column.header, f"the name tells no unit: write {told}, or state the units"
                )
            found[name] = column._replace(unit=stated[0] if units is LENGTH_UNITS else stated[1])
    groups = ((POINTS, "coordinates"), ((*TARGETS, *OFFSETS), "targets and what was off"), (RPY, "angles"))
    for group, what in groups:
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
        return ANGLE_UNITS if arm.joints[int(joint[1]) - 1].revolute else LENGTH_UNITS
    if name in RPY:
        return ANGLE_UNITS
    return {} if name in (*WORDS, *QUATERNION) else LENGTH_UNITS


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
        if name not in (*known, *_ALL):
            continue
        units = _units(name, arm)
        if told and told not in units:
            if joint and told in {**LENGTH_UNITS, **ANGLE_UNITS}:
                kind = "turns" if units is ANGLE_UNITS else "slides"
                raise FileFormatError(
                    path, line, header, f"joint {joint[1]} of {arm.name} {kind}: expected {_choices(name, units)}"
                )
            raise FileFormatError(path, line, header, f"unknown unit '{told}': expected {_choices(name, units)}")
        return name, told
    choices = [
        *(f"{name}_{'deg' if one.revolute else 'mm'}" for name, one in zip(known, arm.joints, strict=True)),
        *(f"{name}_mm" for name in (*POINTS, *TARGETS, *OFFSETS, DISTANCE)),
        *(f"{name}_deg" for name in RPY),
        *known,
        *QUATERNION,
        *WORDS,
    ]
    near = closest(header, choices)
    hint = f" Did you mean '{near}'?" if near else ""
    raise FileFormatError(
        path,
        line,
        header or "''",
        f"no such column.{hint} Known: {', '.join(choices[: arm.n + 3])}, x_t_mm ... z_dif_mm, roll_deg ... yaw_deg, "
        f"qw ... qz, distance_mm, {', '.join(WORDS)}; note... for what is for people",
    )


def _choices(name: str, units: Mapping[str, float]) -> str:
    return " or ".join(f"{name}_{unit}" for unit in units) if units else name


def _complete(path: Path, line: int, found: Mapping[str, Column], arm: Arm) -> None:
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
    for name in _needed(path, line, found, there):
        if name not in found:
            header = f"{name}_deg" if name in RPY else name if name in QUATERNION else f"{name}_mm"
            raise FileFormatError(path, line, header, f"no such column; there are {there}")
    _related(path, line, found, there)


def _needed(path: Path, line: int, found: Mapping[str, Column], there: str) -> tuple[str, ...]:
    """Return the columns that those which are there cannot be without."""
    points, targets = (any(name in found for name in group) for group in (POINTS, (*TARGETS, *OFFSETS)))
    if points and targets:
        raise FileFormatError(path, line, "x", f"give the points, or targets and what was off, not both: {there}")
    angles, quaternion = (any(name in found for name in group) for group in (RPY, QUATERNION))
    if angles and quaternion:
        raise FileFormatError(path, line, "qw", f"give roll, pitch and yaw, or a quaternion, not both: {there}")
    turn = RPY if angles else QUATERNION if quaternion else ()
    if not points and not targets and not turn and {"plane", DISTANCE} & found.keys():
        return ()
    return (*((*TARGETS, *OFFSETS) if targets else POINTS), *turn)


def _related(path: Path, line: int, found: Mapping[str, Column], there: str) -> None:
    """Refuse columns that lack what they belong to."""
    if len(labels := [name for name in NAMES if name in found]) > 1:
        raise FileFormatError(path, line, labels[1], f"rows have one name, and {labels[0]} tells it")
    if DISTANCE in found and not {"anchor", "to"} & found.keys():
        raise FileFormatError(
            path, line, found[DISTANCE].header, "tell from where: a column anchor, or a column to with names of rows"
        )
    for word in ("anchor", "to"):
        if word in found and DISTANCE not in found:
            raise FileFormatError(path, line, word, f"no column tells the distance; there are {there}")
    if "to" in found and not labels:
        raise FileFormatError(path, line, "to", f"rows need names for that, in a column name; there are {there}")
