"""Logs as other people's programs write them: by the public libraries, and by hand."""

import json
import sqlite3
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, Writer

from armwright.arrays import Array

NAMES = ("shoulder", "elbow", "wrist")
# 2023-11-14 in nanoseconds.
EPOCH = 1_700_000_000 * 10**9
ROS2 = "sensor_msgs/msg/JointState"


def motion(t: Array, late: float = 0.0) -> Array:
    """Return positions (k, 3) over time."""
    x = t - late
    return np.stack([np.sin(x), 0.5 * np.cos(1.3 * x), 0.2 * np.sin(2.1 * x + 1)], axis=1)


def ros_types(release: str = "ROS2_HUMBLE") -> Any:
    """Return the types of a release of ROS."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores[release])


def ros_state(types: Any, time: int, q: Sequence[float], names: Sequence[str] = NAMES, *, more: bool = True) -> Any:
    """Return a JointState; with speeds of ten times and efforts of minus the positions, or without."""
    header: dict[str, Any] = {"stamp": types.types["builtin_interfaces/msg/Time"](time // 10**9, time % 10**9)}
    if types.types["std_msgs/msg/Header"].__dataclass_fields__.get("seq"):
        header["seq"] = 0
    position = np.array(q, dtype=np.float64)
    return types.types[ROS2](
        header=types.types["std_msgs/msg/Header"](**header, frame_id=""),
        name=list(names),
        position=position,
        velocity=10 * position if more else np.empty(0),
        effort=-position if more else np.empty(0),
    )


def mcap_file(
    path: Path,
    channels: Sequence[tuple[str, str, str, str, bytes]],
    messages: Sequence[tuple[int, int, bytes]],
    *,
    compression: CompressionType = CompressionType.ZSTD,
    chunk_size: int = 1 << 20,
) -> Path:
    """Write an MCAP file.

    Args:
        path: of the file.
        channels: topic, type, encoding of messages, encoding and text of the definition.
        messages: channel, time [ns], bytes.
        compression: of the chunks.
        chunk_size: size from which on a chunk is closed.
    """
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, chunk_size=chunk_size)
        writer.start()
        numbers = [
            writer.register_channel(topic, encoding, writer.register_schema(kind, how, definition))
            for topic, kind, encoding, how, definition in channels
        ]
        for channel, time, data in messages:
            writer.add_message(numbers[channel], log_time=time, publish_time=time, data=data)
        writer.finish()
    return path


def json_log(path: Path, t: Array, q: Array, *, topic: str = "/joint_states", names: Sequence[str] = NAMES) -> Path:
    """Write joint states as JSON of Foxglove, without speeds and efforts."""
    messages = []
    for time, row in zip((EPOCH + np.round(t * 1e9).astype(np.int64)).tolist(), q.tolist(), strict=True):
        joints = [{"name": name, "position": x} for name, x in zip(names, row, strict=True)]
        state = {"timestamp": {"sec": time // 10**9, "nsec": time % 10**9}, "joints": joints}
        messages.append((0, time, json.dumps(state).encode()))
    return mcap_file(path, [(topic, "foxglove.JointStates", "json", "jsonschema", b"{}")], messages)


def database(path: Path, t: Array, q: Array) -> Path:
    """Write a bag of ROS 2 in SQLite as its recorder does, by hand."""
    types = ros_types()
    base = sqlite3.connect(path)
    base.execute("CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT)")
    base.execute("CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
    base.execute("INSERT INTO topics VALUES (1, '/joint_states', ?, 'cdr')", (ROS2,))
    for time, row in zip((EPOCH + np.round(t * 1e9).astype(np.int64)).tolist(), q, strict=True):
        data = bytes(types.serialize_cdr(ros_state(types, time, row), ROS2))
        base.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (1, ?, ?)", (time, data))
    base.commit()
    base.close()
    return path


def record(kind: int, body: bytes) -> bytes:
    """Return a record of an MCAP file."""
    return struct.pack("<BQ", kind, len(body)) + body


def chunk(data: bytes, compression: str, size: int) -> bytes:
    """Return the record of a chunk that is said to unpack to some size, without a checksum."""
    name = compression.encode()
    head = struct.pack("<QQQI", 0, 0, size, 0) + struct.pack("<I", len(name)) + name
    return record(6, head + struct.pack("<Q", len(data)) + data)
