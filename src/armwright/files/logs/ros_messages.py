"""Messages of ROS out of their bytes, by the definitions that the library ``rosbags`` brings."""

from __future__ import annotations

import struct
from functools import cache
from typing import Any

from armwright.extras import import_extra

# What reading bytes raises that are not what they should be, whichever library reads them.
MISTAKES = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    MemoryError,
    RecursionError,
    struct.error,
    TypeError,
    ValueError,
)


def read_ros2(data: bytes, kind: str) -> Any:
    """Return a message of ROS 2 out of its CDR.

    Raises:
        ValueError: the bytes are damaged.
        MissingExtraError: the library is not installed.
    """
    try:
        return _store("ROS2_HUMBLE").deserialize_cdr(data, kind)
    except (*MISTAKES, _library_error()) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error


def read_ros1(data: bytes, kind: str) -> Any:
    """Return a message of ROS 1 out of its bytes.

    Raises:
        ValueError: the bytes are damaged.
        MissingExtraError: the library is not installed.
    """
    try:
        return _store("ROS1_NOETIC").deserialize_ros1(data, kind)
    except (*MISTAKES, _library_error()) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error


@cache
def _store(name: str) -> Any:
    types = import_extra("rosbags.typesys", "a log of ROS", "logs")
    return types.get_typestore(types.Stores[name])


@cache
def _library_error() -> type[Exception]:
    error: type[Exception] = import_extra("rosbags.serde", "a log of ROS", "logs").SerdeError
    return error
