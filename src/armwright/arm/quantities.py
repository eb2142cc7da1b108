"""Quantities and poses in files that people write: the key tells the unit."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np

from armwright.arrays import Array
from armwright.files.document import Table
from armwright.spatial.euler import from_rpy, from_zyz
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import nearest_rotation, orthonormality_error, rotation_from_quaternion

_Quantity = TypeVar("_Quantity", float, Array)
# Factors to SI by the ending of the key.
ANGLE = {"deg": math.pi / 180, "rad": 1.0}
LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
# Rotations typed with two digits are off by up to 0.018; they are made exact. More is a mistake. Those that are
# computed are off by rounding, and are kept as they are.
_TYPED_ROTATION = 2e-2
_COMPUTED_ROTATION = 1e-12
# A unit quaternion typed with two digits.
_TYPED_QUATERNION = 2e-2


class TypedPose(NamedTuple):
    """A pose out of a file.

    Attributes:
        X: (4, 4), its rotation exact.
        change: by how much the largest entry of the rotation was changed for that.
    """

    X: Array
    change: float


def typed_pose(table: Table) -> TypedPose:
    """Read a pose: a position, and an orientation in one of several forms.

    The position is ``xyz``. The orientation is ``rpy`` (roll, pitch, yaw about fixed x, y, z), ``zyz`` (Euler angles),
    ``rotation`` (three rows), or ``quaternion_wxyz``; none for that of the frame itself.

    Raises:
        FileFormatError: the orientation is given twice or is none, or a unit is missing.
    """
    position = vector_in(table, "xyz", LENGTH, default=np.zeros(3))
    forms = {form: f"{form}_{unit}" for form in ("rpy", "zyz") if (unit := unit_of(table, form, ANGLE))}
    forms |= {form: form for form in ("rotation", "quaternion_wxyz") if form in table}
    if len(forms) > 1:
        (first, _), (second, key), *_ = forms.items()
        raise table.error(key, f"the rotation is specified twice, as {first} and as {second}")
    rpy = vector_in(table, "rpy", ANGLE, default=np.zeros(3))
    zyz = vector_in(table, "zyz", ANGLE, default=np.zeros(3))
    table.allow("rotation", "quaternion_wxyz")
    change = 0.0
    match [*forms]:
        case ["zyz"]:
            R = from_zyz(zyz)
        case ["rotation"]:
            R, change = _rotation(table)
        case ["quaternion_wxyz"]:
            R = _quaternion(table)
        case _:
            R = from_rpy(*rpy)
    return TypedPose(homogeneous(R, position), change)


def pose_in(table: Table) -> Array:
    """Read a table that is a pose and nothing else, (4, 4); see ``typed_pose``."""
    X = typed_pose(table).X
    table.refuse_unknown_keys()
    return X


def per(units: dict[str, float], time: str) -> dict[str, float]:
    """Return units per time, such as ``deg_per_s``."""
    return {f"{unit}_{time}": factor for unit, factor in units.items()}


def unit_of(table: Table, name: str, units: dict[str, float]) -> str | None:
    """Return the ending with which a quantity is given.

    Raises:
        FileFormatError: it is given in two units, or without one.
    """
    if name in table:
        known = [f"{name}_{unit}" for unit in units]
        raise table.error(name, f"the key must contain the unit: {', '.join(known[:-1])} or {known[-1]}")
    present = [unit for unit in units if f"{name}_{unit}" in table]
    if len(present) > 1:
        raise table.error(f"{name}_{present[1]}", f"{name} is specified twice, in {present[0]} and in {present[1]}")
    return present[0] if present else None


def number_in(table: Table, name: str, units: dict[str, float], *, default: float, positive: bool = False) -> float:
    """Read a quantity in SI units, by whatever unit its key tells."""
    return _quantity_in(table, name, units, table.positive if positive else table.number, default)


def vector_in(table: Table, name: str, units: dict[str, float], *, default: Array) -> Array:
    """Read three quantities in SI units, by whatever unit their key tells."""
    return _quantity_in(table, name, units, lambda key: table.vector(key, 3), default)


def _quantity_in(
    table: Table, name: str, units: dict[str, float], read: Callable[[str], _Quantity], default: _Quantity
) -> _Quantity:
    unit = unit_of(table, name, units)
    if unit is None:
        table.allow(*(f"{name}_{unit}" for unit in units))
        return default
    return read(f"{name}_{unit}") * units[unit]


def _rotation(table: Table) -> tuple[Array, float]:
    rows = table.vectors("rotation", 3)
    if len(rows) != 3:
        raise table.error("rotation", f"expected 3 rows of 3 numbers, got {len(rows)}")
    typed = np.array(rows)
    error = float(orthonormality_error(typed))
    if error > _TYPED_ROTATION:
        message = f"expected the rows of a rotation matrix, got an orthonormality error of {error:.2g}"
        raise table.error("rotation", message)
    if error < _COMPUTED_ROTATION:
        return typed, 0.0
    R = nearest_rotation(typed)
    return R, float(np.abs(R - typed).max())


def _quaternion(table: Table) -> Array:
    typed = table.vector("quaternion_wxyz", 4)
    length = float(np.linalg.norm(typed))
    if abs(length - 1) > _TYPED_QUATERNION:
        raise table.error("quaternion_wxyz", f"expected a quaternion of length 1, got one of length {length:.3g}")
    return rotation_from_quaternion(typed)
