"""The messages of an MCAP file, read from its beginning to its end, never more than one chunk at a time.

The index at the end of the file is not used: it may say anything.

Source:
    MCAP format specification.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

from armwright.errors import FileFormatError
from armwright.extras import import_extra
from armwright.files.limits import MEGABYTE, limit, limit_message
from armwright.files.logs.raw_message import Channel, RawMessage, printable

MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 2, 3, 4, 5, 6, 15
# Of a record: its kind and its length. Of a message: channel, sequence, time of the log and of its sender.
_RECORD, _MESSAGE_HEAD = struct.Struct("<BQ"), struct.Struct("<HIQQ")
# Memory that a chunk may ask for as its window [bytes].
_LARGEST_WINDOW = 1 << 27


class _DamagedError(Exception):
    """What a file says contradicts itself; the text says how."""


def mcap_messages(path: Path, file: BinaryIO, size: int, wanted: Callable[[Channel], bool]) -> Iterator[RawMessage]:
    """Give the messages of some channels of an MCAP file, in the order of the file.

    Args:
        path: of the file, for messages.
        file: the file, open behind its magic bytes.
        size: of the file [bytes].
        wanted: whether the messages of a channel are.

    Raises:
        FileFormatError: the file is damaged, ends early, or is beyond a limit.
        MissingExtraError: the library ``mcap`` is not installed.
    """
    reader = _Reader(path, wanted)
    try:
        yield from reader.messages(file, size - len(MAGIC))
    except _DamagedError as error:
        raise FileFormatError(path, None, "", f"{error}") from None
    except (struct.error, EOFError, KeyError, OverflowError, ValueError) as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(path, None, "", f"a record is damaged: {type(error).__name__}: {error}") from error


class _Reader:
    """Reads records, and remembers what they say of channels."""

    def __init__(self, path: Path, wanted: Callable[[Channel], bool]) -> None:
        self._records: Any = import_extra("mcap.records", "a log in MCAP", "logs")
        self._streams: Any = import_extra("mcap.data_stream", "a log in MCAP", "logs")
        self._end: Any = import_extra("mcap.exceptions", "a log in MCAP", "logs").EndOfFile
        self._path, self._wanted = path, wanted
        self._schemas: dict[int, Any] = {}
        self._channels: dict[int, Channel | None] = {}
        self._largest = limit("log_record_mb") * MEGABYTE
        self._count, self._most_records = 0, limit("log_records")
        self._unpacked, self._most_unpacked = 0, limit("log_unpacked_mb") * MEGABYTE

    def messages(self, file: BinaryIO, size: int) -> Iterator[RawMessage]:
        """Give the messages of the part of a file behind its magic bytes.

        Raises:
            _DamagedError: it contradicts itself.
        """
        for kind, body in self._bodies(file, size):
            if kind in {_DATA_END, _FOOTER}:
                return
            if kind == _CHUNK:
                data = self._unpack(self._read(self._records.Chunk, body))
                for inner, content in self._bodies(io.BytesIO(data), len(data)):
                    yield from self._record(inner, content)
            else:
                yield from self._record(kind, body)
        raise _DamagedError("the file ends before its end record; `mcap recover` mends a log whose recorder was killed")

    def _bodies(self, file: BinaryIO, size: int) -> Iterator[tuple[int, bytes]]:
        """Give kind and content of each record of so many bytes."""
        left = size
        while left:
            head = file.read(_RECORD.size)
            if len(head) < _RECORD.size:
                raise _DamagedError(f"a record ends early, {left} bytes before the end")
            kind, length = _RECORD.unpack(head)
            left -= _RECORD.size
            if length > left:
                raise _DamagedError(f"a record of {length} bytes ends early: {left} bytes are left")
            if length > self._largest:
                self._refuse("log_record_mb", length)
            self._count += 1
            if self._count > self._most_records:
                raise FileFormatError(self._path, None, "", f"too many records: {limit_message('log_records')}")
            yield kind, file.read(length)
            left -= length

    def _record(self, kind: int, body: bytes) -> Iterator[RawMessage]:
        """Take note of a channel, or give a message."""
        if kind == _MESSAGE:
            number, _, time, _ = _MESSAGE_HEAD.unpack_from(body)
            if number not in self._channels:
                raise _DamagedError(f"a message of channel {number}, which the file does not describe before it")
            channel = self._channels[number]
            if channel is not None:
                yield RawMessage(channel, time, body[_MESSAGE_HEAD.size :])
        elif kind == _SCHEMA:
            schema = self._read(self._records.Schema, body)
            self._schemas[schema.id] = schema
        elif kind == _CHANNEL:
            read = self._read(self._records.Channel, body)
            schema = self._schemas.get(read.schema_id)
            name, data = ("", b"") if schema is None else (schema.name, schema.data)
            channel = Channel(printable(read.topic), printable(name), read.message_encoding, data)
            self._channels[read.id] = channel if self._wanted(channel) else None

    def _read(self, record: Any, body: bytes) -> Any:
        try:
            return record.read(self._streams.ReadDataStream(io.BytesIO(body)))
        except self._end:
            raise _DamagedError(f"a record of {len(body)} bytes ends early") from None

    def _unpack(self, chunk: Any) -> bytes:
        """Return the content of a chunk."""
        size = chunk.uncompressed_size
        if size > self._largest:
            self._refuse("log_record_mb", size)
        self._unpacked += size
        if self._unpacked > self._most_unpacked:
            self._refuse("log_unpacked_mb", self._unpacked)
        unpack = _UNPACK.get(chunk.compression)
        if unpack is None:
            known = ", ".join(filter(None, _UNPACK))
            raise _DamagedError(f"a chunk is compressed by {chunk.compression[:20]!r}; expected {known}, or not at all")
        try:
            data = unpack(chunk.data, size)
        except (RuntimeError, ValueError, MemoryError) as error:
            raise _DamagedError(f"a chunk cannot be unpacked: {error}") from error
        if len(data) != size:
            raise _DamagedError(f"a chunk is said to unpack to {size} bytes, and does not")
        if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
            raise _DamagedError("the checksum of a chunk differs from its content")
        return data

    def _refuse(self, name: str, size: int) -> None:
        got = f"{size / MEGABYTE:,.0f} MB"
        raise FileFormatError(self._path, None, "", f"too large: {limit_message(name, got)}")


def unpack_zstd(data: bytes, size: int) -> bytes:
    """Return what zstd compressed, one byte more than so many at most.

    Raises:
        ValueError: it is damaged.
    """
    zstandard = import_extra("zstandard", "a log in MCAP", "logs")
    try:
        with zstandard.ZstdDecompressor(max_window_size=_LARGEST_WINDOW).stream_reader(data) as stream:
            unpacked: bytes = stream.read(size + 1)
            return unpacked
    except zstandard.ZstdError as error:
        raise ValueError(f"{error}") from error


def _unpack_lz4(data: bytes, size: int) -> bytes:
    lz4 = import_extra("lz4.frame", "a log in MCAP", "logs", "lz4")
    unpacked: bytes = lz4.LZ4FrameDecompressor().decompress(data, max_length=size + 1)
    return unpacked


_UNPACK: dict[str, Callable[[bytes, int], bytes]] = {
    "": lambda data, _: data,
    "zstd": unpack_zstd,
    "lz4": _unpack_lz4,
}
