"""The triangles of shapes, for files and films that draw them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array

# Sides of what is round, and rings of half a ball.
_SIDES, _RINGS = 24, 6


def triangles_of(
    shape: Mapping[str, Any],
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], npt.NDArray[np.uint32]]:
    """Return vertices (k, 3), normals (k, 3) and faces (m, 3) of a shape, as of ``shape_table``."""
    match shape["kind"]:
        case "box":
            vertices, normals, faces = _box(np.array(shape["size"], dtype=float))
        case "cylinder":
            r, h = shape["radius"], shape["length"] / 2
            rings = [(0, -h, 0, -1), (r, -h, 0, -1), (r, -h, 1, 0), (r, h, 1, 0), (r, h, 0, 1), (0, h, 0, 1)]
            vertices, normals, faces = _round(rings)
        case "capsule" | "sphere":
            vertices, normals, faces = _round(list(_capsule(shape["radius"], shape.get("length", 0.0))))
        case _:
            vertices, normals, faces = _flat(np.array(shape["vertices"]).reshape(-1, 3), np.array(shape["faces"]))
    return vertices.astype(np.float32), normals.astype(np.float32), faces.astype(np.uint32)


def _box(size: Array) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    vertices: list[Array] = []
    normals: list[Array] = []
    faces: list[int] = []
    for axis in range(3):
        for side in (-1, 1):
            first = len(vertices)
            for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                corner = np.zeros(3)
                corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3] = side, u, v
                vertices.append(corner * size / 2)
                normals.append(np.eye(3)[axis] * side)
            order = (0, 1, 2, 0, 2, 3) if side > 0 else (0, 2, 1, 0, 3, 2)
            faces += [first + i for i in order]
    return np.array(vertices), np.array(normals), np.array(faces).reshape(-1, 3)


def _capsule(radius: float, length: float) -> Iterator[tuple[float, float, float, float]]:
    for side in (-1, 1):
        for k in range(_RINGS + 1):
            angle = (k - _RINGS if side < 0 else k) * math.pi / 2 / _RINGS
            c, s = math.cos(angle), math.sin(angle)
            yield radius * c, radius * s + side * length / 2, c, s


def _round(rings: Sequence[tuple[float, float, float, float]]) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    """Return a surface of revolution about z: rings of radius, height, and radial and axial part of the normal."""
    angles = np.linspace(0, 2 * math.pi, _SIDES + 1)
    radial = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=1)
    vertices = np.concatenate([r * radial + (0, 0, z) for r, z, _, _ in rings])
    normals = np.concatenate([out * radial + (0, 0, along) for _, _, out, along in rings])
    wide = _SIDES + 1
    faces = [
        triangle
        for j in range(len(rings) - 1)
        for i in range(_SIDES)
        for a, b in [(j * wide + i, (j + 1) * wide + i)]
        for triangle in ((a, a + 1, b + 1), (a, b + 1, b))
    ]
    return vertices, normals, np.array(faces)


def _flat(vertices: Array, faces: npt.NDArray[np.int64]) -> tuple[Array, Array, npt.NDArray[np.int64]]:
    """Return a mesh whose triangles have corners of their own."""
    corners = vertices[faces.reshape(-1)]
    a, b, c = corners[0::3], corners[1::3], corners[2::3]
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(lengths > 0, normals / np.where(lengths > 0, lengths, 1.0), (0.0, 0.0, 1.0))
    return corners, np.repeat(normals, 3, axis=0), np.arange(len(corners)).reshape(-1, 3)
