"""The arrays of numbers in the buffers of a glTF file."""

from __future__ import annotations

import base64
import binascii
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from armwright.arrays import Array
from armwright.errors import FileFormatError, shown
from armwright.files.document import Table
from armwright.files.inputs import file_below, read_bytes
from armwright.files.limits import MEGABYTE, limit, limit_message

# How many numbers an element has, and of which kinds, by their codes.
_KINDS = {"SCALAR": (1, {5121: "u1", 5123: "<u2", 5125: "<u4"}), "VEC3": (3, {5126: "<f4"})}


def tables_in(table: Table, key: str) -> list[Table]:
    """Return the tables of a list, none where the key is missing or the list empty."""
    return table.tables(key) if key in table and not table.is_empty(key) else []


def index_in(table: Table, key: str, count: int) -> int:
    """Return the number, from 0, of one of ``count`` things.

    Raises:
        FileFormatError: there is no thing of that number.
    """
    number = table.number(key)
    if not (0 <= number < count and number == int(number)):
        raise table.error(key, f"expected a number below {count:,}, from 0, got {number:g}")
    return int(number)


class Arrays:
    """The arrays of a file, read from its buffers when they are asked for."""

    def __init__(self, path: Path, root: Table, binary: bytes | None) -> None:
        """Take a file.

        Args:
            path: of the file, beside which its buffers are.
            root: the table at the top of its JSON.
            binary: the buffer in the file itself; None where there is none.
        """
        self._path, self._binary = path, binary
        self._accessors = tables_in(root, "accessors")
        self._views = tables_in(root, "bufferViews")
        self._buffers = tables_in(root, "buffers")
        self._data: dict[int, bytes] = {}

    def count(self, table: Table, key: str) -> int:
        """Return how many elements the array has whose number is under a key."""
        return self._accessor(table, key).whole("count", 0)

    def read(self, table: Table, key: str, kind: str) -> Array:
        """Return an array, (count, size), as floating-point numbers.

        Args:
            table: where the number of the array is.
            key: under which it is.
            kind: ``SCALAR`` or ``VEC3``.

        Raises:
            FileFormatError: the array is of another kind, goes beyond its buffer, or has a number that is not finite.
        """
        accessor = self._accessor(table, key)
        accessor.choice("type", (kind,))
        if "sparse" in accessor or "bufferView" not in accessor:
            raise accessor.error(None, "sparse arrays and those without a bufferView are not read")
        (size, kinds), code = _KINDS[kind], accessor.number("componentType")
        if code not in kinds:
            raise accessor.error("componentType", f"expected {' or '.join(map(str, kinds))}, got {code:g}")
        dtype = np.dtype(kinds[int(code)])
        view = self._views[index_in(accessor, "bufferView", len(self._views))]
        data = self._view(view)
        stride = view.whole("byteStride", 0) if "byteStride" in view else dtype.itemsize * size
        start, count = accessor.whole("byteOffset", 0, default=0), accessor.whole("count", 0)
        end = start + stride * (count - 1) + dtype.itemsize * size if count else start
        if end > len(data) or stride < dtype.itemsize * size:
            raise accessor.error(
                "count", f"its {count:,} elements go beyond the {len(data):,} bytes of their bufferView"
            )
        raw = np.ndarray((count, size), dtype, data, start, (stride, dtype.itemsize)) if count else np.zeros((0, size))
        numbers = raw.astype(np.float64)
        if not np.isfinite(numbers).all():
            raise accessor.error(None, "expected finite numbers")
        return numbers

    def _accessor(self, table: Table, key: str) -> Table:
        return self._accessors[index_in(table, key, len(self._accessors))]

    def _view(self, view: Table) -> memoryview:
        """Return the bytes of a part of a buffer."""
        data = self._buffer(index_in(view, "buffer", len(self._buffers)))
        start, length = view.whole("byteOffset", 0, default=0), view.whole("byteLength", 0)
        if start + length > len(data):
            raise view.error("byteLength", f"{start + length:,} bytes go beyond the {len(data):,} of the buffer")
        return memoryview(data)[start : start + length]

    def _buffer(self, number: int) -> bytes:
        if number not in self._data:
            buffer = self._buffers[number]
            data = self._content(buffer)
            if len(data) < buffer.whole("byteLength", 0):
                raise buffer.error("byteLength", f"got {len(data):,} bytes, fewer than announced")
            self._data[number] = data
            total = sum(map(len, self._data.values()))
            if total > limit("mesh_mb") * MEGABYTE:
                raise buffer.error(None, f"buffers are too large: {limit_message('mesh_mb')}")
        return self._data[number]

    def _content(self, buffer: Table) -> bytes:
        """Return what is in a buffer: the file itself, its text, or a file below its folder."""
        if "uri" not in buffer:
            if self._binary is None:
                raise buffer.error("uri", "missing, and the file has no buffer of its own")
            return self._binary
        uri = buffer.text("uri")
        if uri.startswith("data:"):
            header, _, text = uri.partition(",")
            if not header.endswith(";base64"):
                raise buffer.error("uri", "expected data in base64")
            try:
                return base64.b64decode(text, validate=True)
            except (binascii.Error, ValueError) as error:
                raise buffer.error("uri", "its data are no base64") from error
        if ":" in uri:
            raise buffer.error(
                "uri", f"expected the name of a file beside this one; nothing is fetched from {shown(uri)}"
            )
        try:
            return read_bytes(file_below(self._path.parent, unquote(uri)), "mesh_mb")
        except FileFormatError as error:
            raise buffer.error("uri", str(error)) from error
