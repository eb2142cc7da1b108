"""Poses of linkages: positions of the tip of a linkage with two drives, or else the coordinates of its drives.

As CSV, columns ``x, y`` of the tip, or ``angle`` or ``slide`` of the only drive, one row for each pose.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from armwright.arrays import Array, ArrayLike, floats, integer, of_shape
from armwright.clearance.ideal import close_pins
from armwright.clearance.linkage import Linkage
from armwright.clearance.paths import PICK_AND_PLACE, TEST_PATHS, Path as TipPath, named_path
from armwright.clearance.scenario import assembly_guess, close_pins_along
from armwright.errors import InvalidValueError, counted, one_of
from armwright.files.column_names import ANGLE, LENGTH, Column, Schema
from armwright.files.unit_table import read_header

# The name of the path of a single drive that rotates: once round.
TURN = "turn"
_SCHEMA = Schema(
    columns=(
        *(Column(name=name, quantity=LENGTH, group="lengths") for name in ("x", "y")),
        Column(name="angle", quantity=ANGLE),
        Column(name="slide", quantity=LENGTH),
    ),
    ignores_unknown=True,
)
# Drives reach a pose in steps of this at most, so that the linkage does not jump to another assembly [rad, m].
_STEP = 0.1
_MOST_POSES = 1000


def pose_size(linkage: Linkage) -> int:
    """Return how many numbers a pose has: the position of the tip, or the coordinate of the only drive.

    Raises:
        InvalidValueError: the linkage has another number of drives.
    """
    drives = len(linkage.drives)
    if drives not in {1, 2}:
        raise InvalidValueError(
            f"{linkage.name}: expected a linkage with one drive or two, got {counted(drives, 'drive')}"
        )
    return drives


def closed_at(linkage: Linkage, poses: ArrayLike) -> Array:
    """Return coordinates with closed pins at poses.

    Args:
        linkage: with n coordinates, and one or two drives.
        poses: (p, 2) positions of its tip [m], or (p, 1) coordinates of its only drive [rad, m].

    Returns:
        (p, n) coordinates, each reached from the one before.

    Raises:
        InvalidValueError: a pose cannot be reached.
        ShapeError: the poses do not fit.
    """
    goals = of_shape(poses, (pose_size(linkage),), "poses")
    if goals.shape[-1] == 2:
        return closed_at_tips(linkage, goals)
    q = assembly_guess(linkage)
    found = []
    for goal in goals.reshape(-1, 1):
        start = q[list(linkage.driven)]
        steps = max(2, math.ceil(abs(float(goal[0] - start[0])) / _STEP))
        q = close_pins_along(linkage, np.linspace(start, goal, steps), q, by_tip=False)[-1]
        found.append(q)
    return np.array(found)


def closed_at_tips(linkage: Linkage, tips: ArrayLike) -> Array:
    """Return (k, n) closed coordinates with the tip at positions (k, 2) [m], each from the one before."""
    configurations = [assembly_guess(linkage)]
    for position in floats(tips, "positions of the tip").reshape(-1, 2):
        configurations.append(close_pins(linkage, configurations[-1], tip=position))
    return np.array(configurations[1:])


def closed_along(linkage: Linkage, path: TipPath, count: int) -> Array:
    """Return (count, n) coordinates with closed pins along a path, evenly spread in time.

    Args:
        linkage: with n coordinates.
        path: that its tip or its drives follow.
        count: 2 to 1000.

    Raises:
        InvalidValueError: the count is out of its range, or the path cannot be followed.
    """
    goals = path.evaluate(path.duration * _spread(count)).position
    return close_pins_along(linkage, goals, assembly_guess(linkage), by_tip=path.follower == "tip")


def poses_on_path(linkage: Linkage, name: str, count: int) -> Array:
    """Return (count, 2) positions along a path, or (count, 1) coordinates of the only drive, evenly spread in time.

    Args:
        linkage: with one or two drives.
        name: of the path; ``turn`` is the only one of a single drive, which must rotate.
        count: 2 to 1000.

    Raises:
        UnknownNameError: the linkage has no such path.
        InvalidValueError: the count is out of its range, or the only drive slides.
    """
    times = _spread(count)
    if pose_size(linkage) == 2:
        path = named_path(one_of("path", name, (*TEST_PATHS, PICK_AND_PLACE)))
        return path.evaluate(path.duration * times).position
    one_of("path", name, (TURN,))
    if linkage.coordinates[linkage.driven[0]].kind != "angle":
        raise InvalidValueError(f"{linkage.name}: its drive slides and has no turn; specify single poses")
    return linkage.assembly.get(linkage.drives[0].body, 0.0) + 2 * math.pi * times[:, None]


def _spread(count: int) -> Array:
    """Return (count,) parts of a path, from 0 to 1."""
    if integer(count, "poses on the path", least=2) > _MOST_POSES:
        raise InvalidValueError(f"poses on the path: expected 2 to {_MOST_POSES}, got {count}")
    return np.linspace(0.0, 1.0, count)


def read_poses(
    path: Path | str, linkage: Linkage, *, columns: Mapping[str, str] | None = None, skip_incomplete: bool = False
) -> Array:
    """Read a table of poses.

    Args:
        path: the file.
        linkage: with one or two drives.
        columns: names of columns, with unit, by those in the file: ``{"X": "x_mm"}``.
        skip_incomplete: leave out rows with empty cells; an ``IncompleteRowsWarning`` says how many.

    Returns:
        (p, 2) or (p, 1); see ``closed_at``.

    Raises:
        FileFormatError: it is missing or broken, or a column is missing.
    """
    header = read_header(path, _SCHEMA, columns=columns)
    names: tuple[str, ...] = ("x", "y")
    if pose_size(linkage) == 1:
        names = ("angle" if linkage.coordinates[linkage.driven[0]].kind == "angle" else "slide",)
    header.require(names)
    return header.rows(filled=names, skip_incomplete=skip_incomplete).numbers(names)
