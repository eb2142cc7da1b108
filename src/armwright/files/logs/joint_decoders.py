"""Joint states out of messages: of ROS 2, of ROS 1, and of Foxglove in JSON and Protobuf."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

from armwright.extras import import_extra
from armwright.files.logs.raw_message import Channel
from armwright.files.logs.ros_messages import MISTAKES, read_ros1, read_ros2


class JointReading(NamedTuple):
    """The state of joints in one message.

    Attributes:
        stamp: when [ns]; 0 where the message does not say.
        names: of the joints.
        position: of each; empty where the message has none.
        velocity: the same of speeds.
        effort: the same of efforts.
    """

    stamp: int
    names: tuple[str, ...]
    position: Sequence[float]
    velocity: Sequence[float]
    effort: Sequence[float]


Decoder: TypeAlias = Callable[[bytes], JointReading]

_ROS = {"sensor_msgs/msg/JointState", "sensor_msgs/JointState"}
_FOXGLOVE = {"foxglove.JointStates"}


def holds_joint_states(channel: Channel) -> bool:
    """Whether the messages of a channel are joint states that can be read."""
    encodings = {"cdr": _ROS, "ros1": _ROS, "json": _ROS | _FOXGLOVE, "protobuf": _FOXGLOVE}
    return channel.kind in encodings.get(channel.encoding, ())


def joint_decoder(channel: Channel) -> Decoder:
    """Return what reads the messages of a channel that holds joint states; a ``ValueError`` says that one is damaged.

    Raises:
        MissingExtraError: what reads them is not installed.
        ValueError: the definition of the messages is damaged.
    """
    if channel.encoding == "json":
        return _from_json
    if channel.encoding == "protobuf":
        return _protobuf_decoder(channel)
    read = read_ros2 if channel.encoding == "cdr" else read_ros1
    return lambda data: _of_ros(read(data, "sensor_msgs/msg/JointState"))


def _of_ros(message: Any) -> JointReading:
    stamp = message.header.stamp
    return JointReading(
        stamp.sec * 10**9 + stamp.nanosec, tuple(message.name), message.position, message.velocity, message.effort
    )


def _from_json(data: bytes) -> JointReading:
    try:
        return _of_json(json.loads(data))
    except MISTAKES as error:
        raise ValueError(f"{type(error).__name__}: {error}") from error


def _of_json(content: object) -> JointReading:
    message = _mapping(content)
    if "joints" in message:
        joints = [_mapping(joint) for joint in _sequence(message["joints"])]
        columns = ([_number(joint.get(key)) for joint in joints] for key in ("position", "velocity", "effort"))
        names = tuple(str(joint.get("name", "")) for joint in joints)
        return JointReading(_json_stamp(message.get("timestamp")), names, *columns)
    names = tuple(str(name) for name in _sequence(message.get("name", [])))
    columns = ([_number(x) for x in _sequence(message.get(key) or [])] for key in ("position", "velocity", "effort"))
    return JointReading(_json_stamp(_mapping(message.get("header") or {}).get("stamp")), names, *columns)


def _json_stamp(stamp: object) -> int:
    if not isinstance(stamp, Mapping):
        return 0
    parts = stamp.get("sec", 0), stamp.get("nsec", stamp.get("nanosec", 0))
    if not all(isinstance(part, int) for part in parts):
        raise TypeError("a time stamp is no pair of whole numbers")
    return int(parts[0]) * 10**9 + int(parts[1])


def _mapping(value: object) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise TypeError("expected an object of JSON")
    return value


def _sequence(value: object) -> Sequence[Any]:
    if not isinstance(value, list):
        raise TypeError("expected a list of JSON")
    return value


def _number(value: object) -> float:
    return math.nan if value is None else float(value)  # type: ignore[arg-type]


def _protobuf_decoder(channel: Channel) -> Decoder:
    """Return what reads messages by the definition that stands in the file."""
    descriptors = import_extra("google.protobuf.descriptor_pb2", "joint states in Protobuf", "logs", "protobuf")
    pools = import_extra("google.protobuf.descriptor_pool", "joint states in Protobuf", "logs", "protobuf")
    factory = import_extra("google.protobuf.message_factory", "joint states in Protobuf", "logs", "protobuf")
    errors = import_extra("google.protobuf.message", "joint states in Protobuf", "logs", "protobuf")
    try:
        pool = pools.DescriptorPool()
        for file in descriptors.FileDescriptorSet.FromString(channel.schema).file:
            pool.Add(file)
        kind = factory.GetMessageClass(pool.FindMessageTypeByName(channel.kind))
    except (*MISTAKES, errors.DecodeError) as error:
        raise ValueError(f"the definition of {channel.kind} cannot be read: {error}") from error

    def decoded(data: bytes) -> JointReading:
        try:
            message = kind.FromString(data)
            joints = list(message.joints)
            columns = ([_field(joint, key) for joint in joints] for key in ("position", "velocity", "effort"))
            stamp = message.timestamp.seconds * 10**9 + message.timestamp.nanos
            return JointReading(stamp, tuple(joint.name for joint in joints), *columns)
        except (*MISTAKES, errors.DecodeError) as error:
            raise ValueError(f"{type(error).__name__}: {error}") from error

    return decoded


def _field(joint: Any, key: str) -> float:
    """Return a number of a joint, NaN where it is not there."""
    field = joint.DESCRIPTOR.fields_by_name.get(key)
    if field is None or (field.has_presence and not joint.HasField(key)):
        return math.nan
    return float(getattr(joint, key))
