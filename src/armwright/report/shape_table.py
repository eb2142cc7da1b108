"""The shapes that a page draws: each once, and meshes as fine as a screen shows them."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Shape, Sphere

# Triangles of one mesh at most, and of all meshes of a page.
_TRIANGLES, _ALL_TRIANGLES = 3_000, 20_000
# A grid has so many cells along the longest side of a mesh at first, and then this part of them.
_CELLS, _COARSER = 192, 0.8
# Makes one number of the place in a grid, which has less cells along each side.
_ROW_OF_GRID = np.array([1_000_000, 1_000, 1])
# Decimals of lengths [m].
_DECIMALS = 6


class ShapeTable:
    """Collects shapes, and gives each a number."""

    def __init__(self) -> None:
        """Begin without a shape."""
        self._shapes: list[Shape] = []
        self._numbers: dict[object, int] = {}

    def number(self, shape: Shape) -> int:
        """Return the number of a shape, from 0; equal shapes have the same."""
        # A mesh is itself: it stays alive here, so its identity stays its own.
        key: object = id(shape) if isinstance(shape, Mesh) else repr(_lengths(shape))
        if key not in self._numbers:
            self._numbers[key] = len(self._shapes)
            self._shapes.append(shape)
        return self._numbers[key]

    def as_data(self) -> list[dict[str, Any]]:
        """Return all shapes in order, as ``shape_data`` does; the meshes share the triangles that a page can hold."""
        meshes = sum(isinstance(shape, Mesh) for shape in self._shapes)
        most = min(_TRIANGLES, _ALL_TRIANGLES // max(meshes, 1))
        return [shape_data(shape, most) for shape in self._shapes]


def shape_data(shape: Shape, triangles: int = _TRIANGLES) -> dict[str, Any]:
    """Return a shape as plain data: its kind and its lengths [m]; of a mesh, vertices and faces as flat lists.

    Args:
        shape: the shape.
        triangles: of a mesh, at most; a finer one is made coarser.
    """
    if not isinstance(shape, Mesh):
        return _lengths(shape)
    vertices, faces = coarse_mesh(shape, triangles)
    return {
        "kind": "mesh",
        "name": shape.name,
        "vertices": _rounded(vertices),
        "faces": faces.reshape(-1).tolist(),
    }


def _lengths(shape: Box | Cylinder | Capsule | Sphere) -> dict[str, Any]:
    lengths = attrs.asdict(shape, recurse=False)
    return {
        "kind": type(shape).__name__.lower(),
        **{name: _rounded(x) if isinstance(x, np.ndarray) else round(x, _DECIMALS) for name, x in lengths.items()},
    }


def coarse_mesh(mesh: Mesh, most: int) -> tuple[Array, npt.NDArray[np.int32]]:
    """Return vertices (k, 3) and faces (m, 3) of a mesh of so many triangles at most: near vertices become one.

    Args:
        mesh: the mesh.
        most: number of triangles; below 12 it may become its bounding box.

    Source:
        Rossignac & Borrel (1993), Multi-resolution 3D approximations for rendering complex scenes.
    """
    vertices, faces = mesh.vertices, mesh.faces
    low = vertices.min(axis=0)
    longest = float((vertices.max(axis=0) - low).max()) or 1.0
    cells = float(_CELLS)
    while len(faces) > most:
        grid = np.floor((mesh.vertices - low) / longest * cells).astype(np.int64)
        _, numbers = np.unique(grid @ _ROW_OF_GRID, return_inverse=True)
        count = np.bincount(numbers)
        vertices = np.stack([np.bincount(numbers, mesh.vertices[:, k]) / count for k in range(3)], axis=1)
        faces = numbers[mesh.faces].astype(np.int32)
        a, b, c = faces.T
        faces = faces[(a != b) & (b != c) & (c != a)]
        cells *= _COARSER
    return (vertices, faces) if len(faces) else _bounding_box(mesh)


def _bounding_box(mesh: Mesh) -> tuple[Array, npt.NDArray[np.int32]]:
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))]
    return low + corners * (high - low), np.array(faces, dtype=np.int32)


def _rounded(values: Array) -> list[float]:
    rounded: list[float] = (np.round(values.reshape(-1), _DECIMALS) + 0.0).tolist()  # adding 0 turns -0 into 0
    return rounded
