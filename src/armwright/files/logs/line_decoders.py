"""Lines of text out of messages: ``rcl_interfaces/msg/Log`` of ROS 2, and ``foxglove.Log`` in JSON."""

from __future__ import annotations

import json
from typing import NamedTuple

from armwright.files.logs.raw_message import Channel, RawMessage
from armwright.files.logs.ros_messages import read_ros2

_FOXGLOVE, _ROS = ("json", "foxglove.Log"), ("cdr", "rcl_interfaces/msg/Log")
# From these levels on a line tells of an error.
_ERROR = {_FOXGLOVE: 4, _ROS: 40}
# Characters of a line that are kept.
_LONGEST = 1000


class LogLine(NamedTuple):
    """A line of text in a log.

    Attributes:
        time: when [ns].
        text: the line.
        name: of what wrote it.
        line: in the source, from 1; 0 where it is not known.
        is_error: whether it tells of an error.
    """

    time: int
    text: str
    name: str
    line: int
    is_error: bool


def holds_lines(channel: Channel) -> bool:
    """Whether the messages of a channel are lines of text."""
    return (channel.encoding, channel.kind) in _ERROR


def read_line(message: RawMessage) -> LogLine:
    """Return the line of a message.

    Raises:
        ValueError: it is damaged.
        MissingExtraError: what reads it is not installed.
    """
    key = message.channel.encoding, message.channel.kind
    text, name, line, level = _json(message.data) if key == _FOXGLOVE else _cdr(message.data)
    return LogLine(message.time, text[:_LONGEST], name[:_LONGEST], line, level >= _ERROR[key])


def _json(data: bytes) -> tuple[str, str, int, int]:
    try:
        content = json.loads(data)
        numbers = int(content.get("line", 0)), int(content.get("level", 0))
        return str(content.get("message", "")), str(content.get("name", "")), *numbers
    except (AttributeError, TypeError, RecursionError, OverflowError) as error:
        raise ValueError(f"{error}") from error


def _cdr(data: bytes) -> tuple[str, str, int, int]:
    content = read_ros2(data, _ROS[1])
    return content.msg, content.name, content.line, content.level
