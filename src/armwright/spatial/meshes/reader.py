"""Reading meshes and assemblies from STL, OBJ, glTF and STEP files."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path, PurePath

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array, exact_shape
from armwright.errors import FileFormatError, InvalidValueError, KindError, closest
from armwright.files.inputs import file_path, read_bytes, regular_file
from armwright.files.limits import limit, limit_message
from armwright.spatial.meshes.gltf import Assembly, read_gltf
from armwright.spatial.meshes.obj import read_obj
from armwright.spatial.meshes.step import read_step
from armwright.spatial.meshes.stl import read_stl
from armwright.spatial.meshes.triangles import Triangles
from armwright.spatial.shapes import LARGEST_SIZE, Mesh, is_closed, volume

# Lengths by the units in which files without one may be.
UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254}
_WITHOUT_UNIT: dict[str, Callable[[Path, bytes], Triangles]] = {".stl": read_stl, ".obj": read_obj}
_ASSEMBLIES: dict[str, Callable[[Path, bytes], Assembly]] = {
    ".gltf": read_gltf,
    ".glb": read_gltf,
    ".step": read_step,
    ".stp": read_step,
}
# The endings of the names of files that are meshes, and of those that have named components.
MESH_SUFFIXES = (*_WITHOUT_UNIT, *_ASSEMBLIES)
ASSEMBLY_SUFFIXES = tuple(_ASSEMBLIES)
# A mesh that is shorter than this is in another unit [m].
_SMALLEST = 1e-4
# A mesh is flat where it is thinner than this part of its length: no solid.
_FLAT = 1e-6
# A closed mesh with less than this part of the volume of the box around it encloses nothing, but for rounding.
_EMPTY = 1e-9


def read_mesh(path: Path | str, *, unit: str | None = None, scale: Sequence[float] = (1.0, 1.0, 1.0)) -> Mesh:
    """Return the solid in an STL, OBJ, glTF or STEP file.

    Corners at one point become one vertex, triangles without an area between different vertices are dropped, and the
    triangles of a closed mesh are oriented: counterclockwise as seen from outside. An assembly is one mesh.

    Args:
        path: the file; the ending of its name is its format.
        unit: ``m``, ``mm``, ``cm`` or ``in``, required for STL and OBJ; glTF is in metres, and STEP has its unit.
        scale: factors of x, y and z, as URDF has them.

    Returns:
        The mesh in metres, named after its file.

    Raises:
        KindError: ``path`` is no path.
        InvalidValueError: the unit is unknown, missing where the file has none, or given where it has one.
        MissingExtraError: it is STEP, and cascadio is not installed.
        FileFormatError: the file is missing, broken, beyond a limit, flat, or probably in another unit.
    """
    path = regular_file(file_path(path))
    suffix = _suffix(path, MESH_SUFFIXES)
    factors = exact_shape(scale, (3,), "scale", LARGEST_SIZE)
    if not factors.all():
        raise InvalidValueError(f"scale: expected numbers other than 0, got {factors.tolist()}")
    factors = factors * _metres(path, suffix, unit)
    data = read_bytes(path, "mesh_mb")
    if suffix in _WITHOUT_UNIT:
        triangles = _WITHOUT_UNIT[suffix](path, data)
    else:
        triangles = _ASSEMBLIES[suffix](path, data).triangles()
    vertices, faces = _merged(triangles)
    if len(faces) < 4:
        raise FileFormatError(path, None, "", f"expected 4 triangles or more with an area, got {len(faces)}")
    vertices = vertices * factors
    _check_size(path, vertices, unit)
    if np.prod(factors) < 0:
        faces = faces[:, ::-1]
    mesh = Mesh(vertices=vertices, faces=faces, name=path.name)
    inside = volume(mesh) if is_closed(mesh) else math.inf
    if abs(inside) < _EMPTY * float(np.ptp(vertices, axis=0).prod()):
        raise FileFormatError(path, None, "", "its triangles enclose no volume")
    return Mesh(vertices=vertices, faces=faces[:, ::-1], name=path.name) if inside < 0 else mesh


def has_unit(path: PurePath) -> bool:
    """Whether the files of a format have their unit, by the name of one."""
    return path.suffix.lower() in _ASSEMBLIES


def read_assembly(path: Path | str) -> Assembly:
    """Return the components of a STEP or glTF file, in metres.

    Raises:
        KindError: ``path`` is no path.
        MissingExtraError: it is STEP, and cascadio is not installed.
        FileFormatError: the file is missing, broken, or beyond a limit.
    """
    path = regular_file(file_path(path))
    return _ASSEMBLIES[_suffix(path, ASSEMBLY_SUFFIXES)](path, read_bytes(path, "mesh_mb"))


def _suffix(path: Path, known: Sequence[str]) -> str:
    suffix = path.suffix.lower()
    if suffix not in known:
        near = closest(suffix, known)
        hint = f"; did you mean {near}?" if near and suffix else ""
        raise FileFormatError(path, None, "", f"expected a name that ends in one of {', '.join(known)}{hint}")
    return suffix


def _metres(path: Path, suffix: str, unit: str | None) -> float:
    """Return the length of the unit of a file [m]."""
    if unit is not None and not isinstance(unit, str):
        raise KindError(f"unit: expected one of {', '.join(UNITS)}, got {unit!r}")
    if suffix not in _WITHOUT_UNIT:
        if unit is not None:
            raise InvalidValueError(f"unit: {path.name} has its unit; omit it")
        return 1.0
    if unit is None:
        kind = suffix.removeprefix(".").upper()
        raise InvalidValueError(f"unit: missing, as {kind} files have none; expected one of {', '.join(UNITS)}")
    if unit not in UNITS:
        raise InvalidValueError(f"unit: expected one of {', '.join(UNITS)}, got '{unit}'")
    return UNITS[unit]


def _merged(triangles: Triangles) -> tuple[Array, npt.NDArray[np.int64]]:
    """Return the vertices in use, each once, and the triangles of three different ones."""
    used, faces = np.unique(triangles.faces, return_inverse=True)
    # -0.0 + 0.0 is 0.0, so that both are one.
    vertices, numbers = np.unique(triangles.vertices[used] + 0.0, axis=0, return_inverse=True)
    faces = numbers.reshape(-1)[faces.reshape(-1, 3)]
    a, b, c = faces.T
    return vertices, faces[(a != b) & (b != c) & (c != a)]


def _check_size(path: Path, vertices: Array, unit: str | None) -> None:
    """Refuse meshes that are probably in another unit, lie far away, or are flat.

    Raises:
        FileFormatError: it is one of those.
    """
    longest = float(np.ptp(vertices, axis=0).max())
    if not _SMALLEST <= longest <= limit("mesh_m"):
        others = {other: longest / UNITS[unit] * UNITS[other] for other in UNITS} if unit in UNITS else {}
        likely = [f'unit = "{other}" gives {length:.3g} m' for other, length in others.items() if 1e-3 <= length <= 5]
        hint = f"; {', '.join(likely)}" if likely else ""
        raise FileFormatError(
            path,
            None,
            "",
            f"{longest:.3g} m long, probably in another unit{hint}; expected {_SMALLEST * 1e3:g} mm or more, and "
            f"{limit_message('mesh_m')}",
        )
    if np.abs(vertices).max() > LARGEST_SIZE:
        raise FileFormatError(path, None, "", f"expected vertices no farther than {LARGEST_SIZE:g} m from the origin")
    centred = vertices - vertices.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    if np.ptp(centred @ axes[:, 0]) < _FLAT * longest:
        raise FileFormatError(path, None, "", "flat; expected a solid, with a thickness")
