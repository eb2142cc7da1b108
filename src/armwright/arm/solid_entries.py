"""Solids in files that people write: boxes, cylinders, capsules and spheres, the unit in the key."""

from __future__ import annotations

import numpy as np

from armwright.arm.quantities import number_in, typed_pose, unit_of, vector_in
from armwright.errors import ArmwrightError, FileFormatError
from armwright.files.document import Table
from armwright.spatial.shapes import Box, Capsule, Cylinder, Shape, Solid, Sphere

KINDS = ("box", "capsule", "cylinder", "sphere")
_UNITS = {"m": 1.0, "mm": 1e-3}


def solids_in(table: Table, key: str) -> tuple[Solid, ...]:
    """Read the solids of a body, none where the key is missing: a list of tables of a shape and a pose each.

    Raises:
        FileFormatError: a key is unknown, missing or out of range.
    """
    table.allow(key)
    if key not in table:
        return ()
    return tuple(_solid(entry) for entry in table.tables(key))


def _solid(entry: Table) -> Solid:
    shape = shape_in(entry, entry.choice("kind", KINDS))
    solid = Solid(shape=shape, pose=typed_pose(entry).X, guessed=entry.flag("guess"))
    entry.refuse_unknown_keys()
    return solid


def shape_in(entry: Table, kind: str) -> Shape:
    """Read a shape of a kind: ``size`` of a box, ``diameter`` and ``length`` of the others.

    Raises:
        FileFormatError: a length is missing or out of range.
    """
    try:
        if kind == "box":
            _require(entry, "size")
            return Box(size=vector_in(entry, "size", _UNITS, default=np.zeros(3)))
        radius = _length(entry, "diameter") / 2
        if kind == "sphere":
            return Sphere(radius=radius)
        return (Cylinder if kind == "cylinder" else Capsule)(radius=radius, length=_length(entry, "length"))
    except FileFormatError:
        raise
    except ArmwrightError as error:
        raise entry.error(None, str(error)) from error


def _length(entry: Table, name: str) -> float:
    _require(entry, name)
    return number_in(entry, name, _UNITS, default=0.0, positive=True)


def _require(entry: Table, name: str) -> None:
    """Refuse an entry without a length."""
    if unit_of(entry, name, _UNITS) is None:
        raise entry.error(None, f"missing, expected {name}_mm or {name}_m")
