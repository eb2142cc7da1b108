"""Solids in files that people write: boxes, cylinders, capsules, spheres and the meshes of other files."""

from __future__ import annotations

from pathlib import PurePath

import attrs
import numpy as np

from armwright.arm.quantities import number_in, typed_pose, unit_of, vector_in
from armwright.errors import ArmwrightError, FileFormatError, InvalidValueError
from armwright.files.document import Table
from armwright.files.inputs import file_below
from armwright.files.limits import limit, limit_message
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere

KINDS = ("box", "capsule", "cylinder", "mesh", "sphere")
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
    """Read a shape of a kind: ``size`` of a box, the files of a ``mesh``, ``diameter`` and ``length`` of the others.

    Raises:
        FileFormatError: a length is missing or out of range, or a mesh cannot be read.
    """
    if kind == "mesh":
        return _mesh(entry)
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


def _mesh(entry: Table) -> Mesh:
    """Read a mesh, and the convex pieces that replace it in collisions."""
    from armwright.spatial.meshes.reader import UNITS, has_unit  # noqa: PLC0415 - few files have meshes

    unit = entry.choice("unit", UNITS) if "unit" in entry else None
    entry.allow("unit", "pieces")
    mesh = _mesh_file(entry, "mesh", entry.text("mesh"), unit)
    if "pieces" not in entry:
        return mesh
    names = entry.texts("pieces")
    if len(names) > limit("bodies"):
        raise entry.error("pieces", f"too many: {limit_message('bodies', len(names))}")
    # The unit is that of files without one.
    pieces = [_mesh_file(entry, "pieces", name, None if has_unit(PurePath(name)) else unit) for name in names]
    return attrs.evolve(mesh, pieces=pieces)


def _mesh_file(entry: Table, key: str, name: str, unit: str | None) -> Mesh:
    from armwright.spatial.meshes.reader import read_mesh  # noqa: PLC0415 - few files have meshes

    try:
        mesh = read_mesh(file_below(entry.path.parent, name), unit=unit)
    except InvalidValueError as error:
        raise entry.error("unit", str(error).removeprefix("unit: ")) from error
    except FileFormatError as error:
        raise entry.error(key, str(error)) from error
    entry.add_amount("file_triangles", len(mesh.faces), key)
    return mesh


def _length(entry: Table, name: str) -> float:
    _require(entry, name)
    return number_in(entry, name, _UNITS, default=0.0, positive=True)


def _require(entry: Table, name: str) -> None:
    """Refuse an entry without a length."""
    if unit_of(entry, name, _UNITS) is None:
        raise entry.error(None, f"missing, expected {name}_mm or {name}_m")
