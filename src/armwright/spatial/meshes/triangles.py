"""Triangles as files have them, before they are a solid, and how many a file may have."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.errors import FileFormatError
from armwright.files.limits import limit, limit_message


class Triangles(NamedTuple):
    """Triangles in the unit of their file.

    Attributes:
        vertices: (k, 3), not all of which need be used; several may be at one point.
        faces: (m, 3) the numbers of the vertices of each triangle, from 0.
    """

    vertices: Array
    faces: npt.NDArray[np.int64]


def refuse_too_many(path: Path, count: int) -> None:
    """Refuse more triangles than the limit.

    Raises:
        FileFormatError: there are more.
    """
    if count > limit("mesh_triangles"):
        raise FileFormatError(path, None, "", f"too many triangles: {limit_message('mesh_triangles', count)}")


def joined(parts: list[Triangles]) -> Triangles:
    """Return several lists of triangles as one."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([np.zeros((0, 3)), *(part.vertices for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    return Triangles(vertices, np.concatenate([np.zeros((0, 3), dtype=np.int64), *faces]))
