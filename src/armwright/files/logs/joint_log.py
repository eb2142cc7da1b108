"""The joint states of a log, as columns: times, positions, speeds and efforts of each joint, by its name.

Logs carry no units: by the definition of their messages all are SI, radians and metres.
"""

from __future__ import annotations

import json
import math
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from armwright.arrays import Array
from armwright.errors import FileFormatError, TooFewError, UnknownNameError, shown
from armwright.files.inputs import file_below, file_path, note_source
from armwright.files.limits import MEGABYTE, limit, limit_message
from armwright.files.logs.joint_decoders import Decoder, JointReading, holds_joint_states, joint_decoder
from armwright.files.logs.line_decoders import LogLine, holds_lines, read_line
from armwright.files.logs.mcap_messages import MAGIC as MCAP, mcap_messages
from armwright.files.logs.raw_message import Channel, RawMessage
from armwright.files.logs.ros_messages import read_ros2
from armwright.files.logs.sqlite_messages import MAGIC as SQLITE, sqlite_messages

# Where armwright says what a log is of.
ABOUT_TOPIC = "/armwright/run"
_SUFFIXES = (".mcap", ".db3")
_LARGEST_TIME = 2**62
# Numbers of all topics together: every joint of a topic has three in each of its rows.
_MAX_NUMBERS = 60_000_000
# Files of a bag at most.
_MAX_FILES = 1000


@attrs.frozen(kw_only=True, eq=False)
class JointStates:
    """The joint states of one topic, in order of time.

    Attributes:
        topic: its name.
        names: of the n joints.
        t: (k,) times since the start of the log [s].
        q: (k, n) positions [rad] or [m]; NaN where a message has none.
        qd: (k, n) speeds; NaN likewise.
        tau: (k, n) efforts [N m] or [N]; NaN likewise.
    """

    topic: str
    names: tuple[str, ...]
    t: Array
    q: Array
    qd: Array
    tau: Array

    def of_joints(self, names: Sequence[str]) -> JointStates:
        """Return the columns of some joints, in their order.

        Raises:
            UnknownNameError: there is no such joint.
        """
        for name in names:
            if name not in self.names:
                raise UnknownNameError("joint", name, self.names)
        columns = [self.names.index(name) for name in names]
        q, qd, tau = (values[:, columns] for values in (self.q, self.qd, self.tau))
        return JointStates(topic=self.topic, names=tuple(names), t=self.t, q=q, qd=qd, tau=tau)


@attrs.frozen(kw_only=True, eq=False)
class JointLog:
    """The joint states of a log.

    Attributes:
        path: the file or folder.
        start: time of the first joint state [ns], since 1970 or since the start of a simulation.
        topics: joint states by topic.
        about: what armwright says of its own log; empty in others.
        lines: of text, such as the trace of a program, in order of time; the first where there are very many.
    """

    path: Path
    start: int
    topics: Mapping[str, JointStates]
    about: Mapping[str, Any]
    lines: tuple[LogLine, ...] = ()


def read_joint_log(path: Path | str) -> JointLog:
    """Read the joint states of a log.

    Args:
        path: an MCAP file; a database ``.db3`` of ROS 2; or the folder of a bag, of which all such files count.

    Returns:
        What topics of type ``sensor_msgs/JointState`` (ROS 2, ROS 1, JSON) and ``foxglove.JointStates`` (JSON,
        Protobuf) hold.

    Raises:
        FileFormatError: it is no log, damaged, beyond a limit, or a joint state cannot be read.
        TooFewError: there is no joint state in it; what there is is listed.
        MissingExtraError: what reads it is not installed.
    """
    path = file_path(path)
    collected = _Collected(path)
    for file in _files(path):
        decoders: dict[Channel, Decoder] = {}
        for message in _messages(file, collected.wanted):
            if message.channel.topic == ABOUT_TOPIC:
                collected.about = _about(message) or collected.about
            elif holds_lines(message.channel):
                collected.add_line(_line(file, message))
            else:
                collected.add(message, _reading(file, message, decoders))
    return collected.log()


class _Collected:
    """What was read of a log so far."""

    def __init__(self, path: Path) -> None:
        self.about: dict[str, Any] = {}
        self._path = path
        self._topics: dict[str, _TopicRows] = {}
        self._seen: dict[str, str] = {}
        self._lines: list[LogLine] = []
        self._count, self._most = 0, limit("log_rows")

    def wanted(self, channel: Channel) -> bool:
        """Return whether the messages of a channel are read."""
        self._seen.setdefault(channel.topic, channel.kind)
        return channel.topic == ABOUT_TOPIC or holds_joint_states(channel) or holds_lines(channel)

    def add_line(self, line: LogLine) -> None:
        """Add a line of text; there are as many as may be."""
        if len(self._lines) < limit("entries"):
            self._lines.append(line)

    def add(self, message: RawMessage, reading: JointReading) -> None:
        """Add a joint state.

        Raises:
            FileFormatError: there are too many, or its names and numbers do not fit.
        """
        topic = message.channel.topic
        self._count += 1
        if self._count > self._most:
            raise FileFormatError(self._path, None, topic, f"too many joint states: {limit_message('log_rows')}")
        if topic not in self._topics:
            self._topics[topic] = _TopicRows(self._path, topic)
        self._topics[topic].add(reading, reading.stamp or message.time)

    def log(self) -> JointLog:
        """Return all of it.

        Raises:
            TooFewError: there is no joint state.
            FileFormatError: columns of all joints would hold too many numbers.
        """
        if not self._topics:
            topics = ", ".join(f"{topic} ({kind or 'no type'})" for topic, kind in list(self._seen.items())[:10])
            raise TooFewError(f"{self._path}: no joint states; topics of the log: {topics or 'none'}")
        numbers = sum(rows.numbers for rows in self._topics.values())
        if numbers > _MAX_NUMBERS:
            message = f"too many joint states: {numbers:,} numbers, expected {_MAX_NUMBERS:,}"
            raise FileFormatError(self._path, None, "", message)
        start = min(rows.first_time for rows in self._topics.values())
        return JointLog(
            path=self._path,
            start=start,
            topics={topic: rows.joint_states(start) for topic, rows in sorted(self._topics.items())},
            about=self.about,
            lines=tuple(sorted(self._lines, key=lambda line: line.time)),
        )


class _TopicRows:
    """The rows of a topic, as they come: messages may name other joints than those before."""

    def __init__(self, path: Path, topic: str) -> None:
        self._path, self._topic = path, topic
        self._columns: dict[str, int] = {}
        # By names of joints: times [ns], and of each row positions, speeds and efforts.
        self._rows: dict[tuple[str, ...], tuple[array[int], array[float]]] = {}

    def add(self, reading: JointReading, time: int) -> None:
        """Add a row.

        Raises:
            FileFormatError: names are missing, doubled or too many, or there is not one number for each.
        """
        if reading.names not in self._rows:
            self._check_names(reading.names)
        times, numbers = self._rows.setdefault(reading.names, (array("q"), array("d")))
        if not -_LARGEST_TIME <= time < _LARGEST_TIME:
            raise FileFormatError(self._path, None, self._topic, f"{time} ns is no time")
        n = len(reading.names)
        for name, values in (
            ("positions", reading.position),
            ("speeds", reading.velocity),
            ("efforts", reading.effort),
        ):
            if len(values) not in {0, n}:
                message = f"{len(values)} {name} of {n} joints; expected one for each, or none"
                raise FileFormatError(self._path, None, self._topic, message)
        times.append(time)
        for values in (reading.position, reading.velocity, reading.effort):
            numbers.extend(values if len(values) else [math.nan] * n)

    def _check_names(self, names: tuple[str, ...]) -> None:
        if len(set(names)) < len(names) or not all(names):
            message = f"expected names of joints, each once, got {shown(list(names[:8]))}"
            raise FileFormatError(self._path, None, self._topic, message)
        for name in names:
            self._columns.setdefault(name, len(self._columns))
        if len(self._columns) > limit("joints"):
            raise FileFormatError(self._path, None, self._topic, f"too many joints: {limit_message('joints')}")

    @property
    def first_time(self) -> int:
        """The earliest time [ns]."""
        return min(min(times) for times, _ in self._rows.values())

    @property
    def numbers(self) -> int:
        """How many numbers the columns of all its joints hold."""
        return 3 * len(self._columns) * sum(len(times) for times, _ in self._rows.values())

    def joint_states(self, start: int) -> JointStates:
        """Return all rows in order of time, from a time on [ns]."""
        n = len(self._columns)
        counts = [len(times) for times, _ in self._rows.values()]
        t, values = np.empty(sum(counts)), np.full((sum(counts), 3, n), np.nan)
        first = 0
        for names, (times, numbers) in self._rows.items():
            end = first + len(times)
            # A difference of whole numbers: of nanoseconds since 1970 a float would lose some.
            t[first:end] = (np.frombuffer(times, dtype=np.int64) - np.int64(start)) / 1e9
            rows = np.frombuffer(numbers).reshape(len(times), 3, len(names))
            values[first:end, :, [self._columns[name] for name in names]] = rows
            first = end
        order = np.argsort(t, kind="stable")
        q, qd, tau = (np.ascontiguousarray(values[order, i]) for i in range(3))
        return JointStates(topic=self._topic, names=tuple(self._columns), t=t[order], q=q, qd=qd, tau=tau)


def _files(path: Path) -> list[Path]:
    """Return the files of a log."""
    if not path.is_dir():
        return [path]
    try:
        names = sorted(entry.name for entry in path.iterdir() if entry.suffix in _SUFFIXES)
    except OSError as error:
        raise FileFormatError(path, None, "", f"cannot be read: {error.strerror}") from error
    if not names:
        raise FileFormatError(path, None, "", "expected the folder of a bag; there is no .mcap or .db3 file in it")
    if len(names) > _MAX_FILES:
        raise FileFormatError(path, None, "", f"expected up to {_MAX_FILES} files of a bag, got {len(names)}")
    return [file_below(path, name) for name in names]


def _messages(path: Path, wanted: Callable[[Channel], bool]) -> Iterator[RawMessage]:
    """Give the messages of one file of a log."""
    try:
        size = path.stat().st_size
        if size > limit("log_mb") * MEGABYTE:
            message = f"too large: {limit_message('log_mb', f'{size / MEGABYTE:,.0f} MB')}"
            raise FileFormatError(path, None, "", message)
        with path.open("rb") as file:
            note_source(path)
            head = file.read(len(SQLITE))
            if not head.startswith((MCAP, SQLITE)):
                _refuse(path, head)
            if head.startswith(MCAP):
                file.seek(len(MCAP))
                yield from mcap_messages(path, file, size, wanted)
            else:
                yield from sqlite_messages(path, wanted)
    except FileNotFoundError:
        raise FileFormatError(path, None, "", "no such file") from None
    except OSError as error:
        if isinstance(error, FileFormatError):
            raise
        raise FileFormatError(path, None, "", f"cannot be read: {error.strerror or error}") from error


def _refuse(path: Path, head: bytes) -> None:
    """Refuse a file that is no log; say what helps where it is known for what it is."""
    hints = {
        b"#ROSBAG": "got a bag of ROS 1; rosbags-convert makes one of ROS 2 of it",
        b"\x28\xb5\x2f\xfd": "got a file compressed by zstd; unpack it by zstd -d",
    }
    hint = next((text for begin, text in hints.items() if head.startswith(begin)), f"got {head[:8]!r}")
    raise FileFormatError(path, None, "", f"expected an MCAP file or a .db3 of ROS 2, {hint}")


def _about(message: RawMessage) -> dict[str, Any]:
    """Return what armwright says of a log; nothing where somebody else has used its topic."""
    try:
        text = (
            read_ros2(message.data, "std_msgs/msg/String").data if message.channel.encoding == "cdr" else message.data
        )
        content = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _line(path: Path, message: RawMessage) -> LogLine:
    try:
        return read_line(message)
    except ValueError as error:
        text = f"a message of {message.channel.kind} cannot be read: {str(error)[:200]}"
        raise FileFormatError(path, None, message.channel.topic, text) from error


def _reading(path: Path, message: RawMessage, decoders: dict[Channel, Decoder]) -> JointReading:
    """Return what a message says of joints."""
    channel = message.channel
    try:
        if channel not in decoders:
            decoders[channel] = joint_decoder(channel)
        return decoders[channel](message.data)
    except ValueError as error:
        text = f"a message of {channel.kind} cannot be read: {str(error)[:200]}"
        raise FileFormatError(path, None, channel.topic, text) from error
