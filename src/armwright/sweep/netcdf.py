"""Writing netCDF row by row: plain numbers at known places, so that a file larger than the memory can be written.

It is the classic format with 64-bit offsets, which every netCDF library reads. HDF5, below netCDF-4, does not survive
a full disk: the process that met one may crash at its next file.

Source:
    Rew et al., NetCDF Classic and 64-bit Offset File Formats (NASA ESDS-RFC-011v2.0, 2011).
"""

import struct
from collections.abc import Mapping, Sequence
from math import prod
from typing import IO, Any

import attrs
import numpy as np
import numpy.typing as npt

# What a variable or an attribute is made of: the number of the type, and how it is written.
_TYPES = {"i1": (1, ">i1"), "S1": (2, "S1"), "i4": (4, ">i4"), "f8": (6, ">f8")}
_DIMENSION, _VARIABLE, _ATTRIBUTE = 10, 11, 12
# A variable of this format has less [bytes].
LONGEST = 2**32 - 4


@attrs.frozen(kw_only=True)
class Variable:
    """An array in a file.

    Attributes:
        name: of it.
        dims: names of its axes.
        kind: of its numbers, "f8", "i4" or "i1"; "S1" for bytes of text.
        attributes: texts, or arrays of numbers.
    """

    name: str
    dims: tuple[str, ...]
    kind: str
    attributes: Mapping[str, str | npt.NDArray[Any]]


class Writer:
    """Writes one file, rows of any variable in any order."""

    def __init__(
        self, file: IO[bytes], sizes: Mapping[str, int], attributes: Mapping[str, str], variables: Sequence[Variable]
    ) -> None:
        """Write all but the numbers.

        Args:
            file: open for writing, empty.
            sizes: by axis, its length.
            attributes: of the whole file.
            variables: what it has.
        """
        self._file = file
        self._kinds = {one.name: one.kind for one in variables}
        self._shapes = {one.name: tuple(sizes[dim] for dim in one.dims) for one in variables}
        lengths = {name: _padded(prod(shape) * _width(self._kinds[name])) for name, shape in self._shapes.items()}
        begins = dict.fromkeys(lengths, 0)
        header = _header(sizes, attributes, variables, lengths, begins)
        end = len(header)  # which does not depend on the places that it tells
        for name, length in lengths.items():
            begins[name] = end
            end += length
        self._begins = begins
        file.write(_header(sizes, attributes, variables, lengths, begins))
        file.truncate(end)

    def put(self, name: str, rows: npt.ArrayLike, first: int = 0) -> None:
        """Write rows of a variable.

        Args:
            name: of the variable.
            rows: (m, ...) as many as there are.
            first: which row of the variable the first of them is.
        """
        kind, shape = self._kinds[name], self._shapes[name]
        numbers = np.asarray(rows, dtype=_TYPES[kind][1])
        assert numbers.shape[1:] == shape[1:]  # noqa: S101 - the caller is this folder
        assert first + len(numbers) <= shape[0]  # noqa: S101
        self._file.seek(self._begins[name] + first * prod(shape[1:]) * _width(kind))
        self._file.write(numbers.tobytes())


def _header(
    sizes: Mapping[str, int],
    attributes: Mapping[str, str],
    variables: Sequence[Variable],
    lengths: Mapping[str, int],
    begins: Mapping[str, int],
) -> bytes:
    """Return the first bytes of the file; the grammar is that of the source."""
    parts = [b"CDF\x02", _whole(0), _whole(_DIMENSION), _whole(len(sizes))]
    for name, size in sizes.items():
        parts += [_name(name), _whole(size)]
    parts += [_attributes(attributes), _whole(_VARIABLE), _whole(len(variables))]
    places = {name: number for number, name in enumerate(sizes)}
    for one in variables:
        parts += [_name(one.name), _whole(len(one.dims)), *(_whole(places[dim]) for dim in one.dims)]
        parts += [_attributes(one.attributes), _whole(_TYPES[one.kind][0])]
        parts += [struct.pack(">I", lengths[one.name]), struct.pack(">q", begins[one.name])]
    return b"".join(parts)


def _attributes(attributes: Mapping[str, str | npt.NDArray[Any]]) -> bytes:
    if not attributes:
        return _whole(0) + _whole(0)
    parts = [_whole(_ATTRIBUTE), _whole(len(attributes))]
    for name, value in attributes.items():
        if isinstance(value, str):
            number, count, content = _TYPES["S1"][0], len(value.encode()), value.encode()
        else:
            number, kind = _TYPES[value.dtype.str[1:]]
            count, content = value.size, value.astype(kind).tobytes()
        parts += [_name(name), _whole(number), _whole(count), content.ljust(_padded(len(content)), b"\0")]
    return b"".join(parts)


def _name(name: str) -> bytes:
    encoded = name.encode()
    return _whole(len(encoded)) + encoded.ljust(_padded(len(encoded)), b"\0")


def _whole(number: int) -> bytes:
    return struct.pack(">i", number)


def _padded(length: int) -> int:
    """Return a length up to the next multiple of four."""
    return -(-length // 4) * 4


def _width(kind: str) -> int:
    return np.dtype(kind).itemsize
