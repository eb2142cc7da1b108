"""OBJ files: vertices and polygons without a unit. Materials and textures are not opened.

Source:
    Wavefront Technologies (1995), Advanced Visualizer manual, appendix B1: Object files.
"""

from __future__ import annotations

import itertools
from array import array
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from armwright.errors import FileFormatError, shown
from armwright.spatial.meshes.text_lines import three_numbers, words_of_lines
from armwright.spatial.meshes.triangles import Triangles, refuse_too_many


def read_obj(path: Path, data: bytes) -> Triangles:
    """Return the triangles of all objects and groups of an OBJ file; polygons are cut from their first corner.

    Raises:
        FileFormatError: the file is broken, or has more triangles than the limit.
    """
    vertices, faces = array("d"), array("q")
    for line, words in words_of_lines(path, data):
        if words[0] == b"v":
            vertices.extend(three_numbers(path, line, "v", words[1:]))
            # A solid has half as many vertices as triangles; one file may have vertices that are not used.
            refuse_too_many(path, len(vertices) // 9)
        elif words[0] == b"f":
            corners = _corners(path, line, words[1:], len(vertices) // 3)
            refuse_too_many(path, len(faces) // 3 + len(corners) - 2)
            for second, third in itertools.pairwise(corners[1:]):
                faces.extend((corners[0], second, third))
    if not faces:
        raise FileFormatError(path, None, "", "expected lines of vertices (v) and faces (f); there is no face")
    return Triangles(np.array(vertices).reshape(-1, 3), np.array(faces).reshape(-1, 3))


def _corners(path: Path, line: int, words: Sequence[bytes], known: int) -> list[int]:
    """Return the numbers from 0 of the vertices of a polygon; negative ones in the file count back from the last."""
    if len(words) < 3:
        raise FileFormatError(path, line, "f", f"expected 3 vertices or more, got {len(words)}")
    corners = []
    for word in words:
        digits = word.partition(b"/")[0]
        unsigned = digits.removeprefix(b"-")
        number = int(digits) if unsigned.isdigit() and len(unsigned) < 12 else 0
        if not 1 <= abs(number) <= known:
            text = word.decode("utf-8", "replace")
            raise FileFormatError(
                path, line, "f", f"expected numbers of the {known:,} vertices before it, from 1, got {shown(text)}"
            )
        corners.append(number - 1 if number > 0 else known + number)
    return corners
