"""STL files, binary and text: triangles without a unit, each with its own three corners.

Source:
    3D Systems (1988), StereoLithography Interface Specification.
"""

from __future__ import annotations

from array import array
from pathlib import Path

import numpy as np

from armwright.arrays import Array
from armwright.errors import FileFormatError, shown
from armwright.spatial.meshes.text_lines import three_numbers, words_of_lines
from armwright.spatial.meshes.triangles import Triangles, refuse_too_many

_HEADER, _RECORD = 84, 50
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
# What a text may have beside its vertices, by the first word of a line.
_WORDS = frozenset({b"solid", b"facet", b"outer", b"vertex", b"endloop", b"endfacet", b"endsolid"})


def read_stl(path: Path, data: bytes) -> Triangles:
    """Return the triangles of an STL file; those of several solids in a text are taken together.

    Raises:
        FileFormatError: the file is broken, or has more triangles than the limit.
    """
    # Binary files may begin with the word of text files, so their length decides.
    count = int.from_bytes(data[80:_HEADER], "little")
    if len(data) >= _HEADER and len(data) == _HEADER + _RECORD * count:
        corners = _binary(path, data, count)
    elif data[:512].lstrip()[:5].lower() == b"solid":
        corners = _text(path, data)
    elif len(data) < _HEADER:
        raise FileFormatError(path, None, "", f"no STL: expected {_HEADER} bytes or more, or text, got {len(data)}")
    else:
        expected = _HEADER + _RECORD * count
        raise FileFormatError(
            path, None, "", f"expected {expected:,} bytes for the {count:,} triangles announced, got {len(data):,}"
        )
    return Triangles(corners, np.arange(len(corners)).reshape(-1, 3))


def _binary(path: Path, data: bytes, count: int) -> Array:
    refuse_too_many(path, count)
    corners = np.frombuffer(data, _TRIANGLE, count, _HEADER)["corners"].astype(np.float64)
    finite = np.isfinite(corners).all(axis=(1, 2))
    if not finite.all():
        number = int(np.argmin(finite)) + 1
        raise FileFormatError(path, None, f"triangle {number}", "expected finite numbers")
    return corners.reshape(-1, 3)


def _text(path: Path, data: bytes) -> Array:
    numbers = array("d")
    last, in_loop = b"", 0
    for line, words in words_of_lines(path, data):
        last = words[0].lower()
        if last == b"vertex":
            numbers.extend(three_numbers(path, line, "vertex", words[1:]))
            in_loop += 1
        elif last == b"endloop":
            if in_loop != 3:
                raise FileFormatError(path, line, "endloop", f"expected 3 vertices before it, got {in_loop}")
            in_loop = 0
            refuse_too_many(path, len(numbers) // 9)
        elif last not in _WORDS:
            word = last.decode("utf-8", "replace")
            raise FileFormatError(path, line, "", f"expected a word of STL such as facet or vertex, got {shown(word)}")
    if last != b"endsolid" or in_loop:
        raise FileFormatError(path, None, "", "expected endsolid at the end; the file is not complete")
    return np.array(numbers).reshape(-1, 3)
