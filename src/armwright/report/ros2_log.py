"""A log as a bag of ROS 2 that needs no ROS to be written: CDR messages in MCAP, and its ``metadata.yaml``.

Source:
    rosbags (Ternaris), whose message definitions are those of ROS 2 Humble.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from armwright.cell.observations import Picture
from armwright.extras import import_extra
from armwright.report.foxglove_log import cap_position
from armwright.report.log_content import (
    Entity,
    Frames,
    JointsPayload,
    LogContent,
    LogEvent,
    Payload,
    Scene,
    SceneShape,
    Transform,
    timed_messages,
)

_INFO, _ERROR = 20, 40
_NAME, _VERSION = "bag", 9
# Topics that ROS calls otherwise.
_TOPICS = {"/log": "/rosout"}
# Of a marker: its kinds, and the list of triangles.
_CUBE, _SPHERE, _CYLINDER, _TRIANGLES = 1, 2, 3, 11


def ros2_bag(content: LogContent) -> dict[str, bytes]:
    """Return a log as the files of a bag; the same log gives the same bytes.

    Raises:
        MissingExtraError: the library ``rosbags`` is not installed.
    """
    bags = import_extra("rosbags.rosbag2", "a log in ROS 2", "logs")
    types = import_extra("rosbags.typesys", "a log in ROS 2", "logs")
    store = types.get_typestore(types.Stores.ROS2_HUMBLE)
    messages = _Messages(store.types)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / _NAME
        writer = bags.Writer(path, version=_VERSION, storage_plugin=bags.StoragePlugin.MCAP)
        writer.set_compression(bags.CompressionMode.STORAGE, bags.CompressionFormat.ZSTD)
        connections: dict[str, Any] = {}
        with writer:
            for time, name, payload in timed_messages(content):
                topic = f"{name}/compressed" if isinstance(payload, Picture) else _TOPICS.get(name, name)
                message = messages.message(time, payload)
                kind = message.__msgtype__
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=store)
                writer.write(connections[topic], time, store.serialize_cdr(message, kind))
        return {file.name: file.read_bytes() for file in sorted(path.iterdir())}


class _Primitive(NamedTuple):
    """A marker: its kind, its size along its axes [m], and its position [m]."""

    kind: int
    scale: list[float]
    position: list[float]


class _Messages:
    """Makes messages of the types of ROS."""

    def __init__(self, types: Mapping[str, Any]) -> None:
        self._types = types

    def message(self, time: int, payload: Payload) -> Any:
        """Return a message at a time [ns]."""
        stamp = self._new("builtin_interfaces/Time", sec=time // 10**9, nanosec=time % 10**9)
        match payload:
            case JointsPayload():
                return self._new(
                    "sensor_msgs/JointState",
                    header=self._header(stamp, ""),
                    name=list(payload.names),
                    position=np.array(payload.q),
                    velocity=np.array(payload.qd),
                    effort=np.array(payload.tau),
                )
            case LogEvent():
                return self._new(
                    "rcl_interfaces/Log",
                    stamp=stamp,
                    level=_ERROR if payload.is_error else _INFO,
                    name=payload.process,
                    msg=payload.text,
                    file=payload.file,
                    function="",
                    line=payload.line,
                )
            case Picture():
                data = np.frombuffer(payload.png, dtype=np.uint8)
                header = self._header(stamp, payload.camera)
                return self._new("sensor_msgs/CompressedImage", header=header, format="png", data=data)
            case str():
                return self._new("std_msgs/String", data=payload)
            case Frames(transforms):
                return self._new(
                    "tf2_msgs/TFMessage", transforms=[self._transform(stamp, frame) for frame in transforms]
                )
            case Scene(entities):
                markers = [marker for entity in entities for marker in self._markers(stamp, entity)]
                return self._new("visualization_msgs/MarkerArray", markers=markers)

    def _new(self, kind: str, /, **fields: Any) -> Any:
        package, _, name = kind.partition("/")
        return self._types[f"{package}/msg/{name}"](**fields)

    def _header(self, stamp: Any, frame: str) -> Any:
        return self._new("std_msgs/Header", stamp=stamp, frame_id=frame)

    def _transform(self, stamp: Any, frame: Transform) -> Any:
        translation = self._new("geometry_msgs/Vector3", **dict(zip("xyz", frame.position, strict=True)))
        rotation = self._new("geometry_msgs/Quaternion", **dict(zip("xyzw", frame.rotation, strict=True)))
        return self._new(
            "geometry_msgs/TransformStamped",
            header=self._header(stamp, frame.parent),
            child_frame_id=frame.child,
            transform=self._new("geometry_msgs/Transform", translation=translation, rotation=rotation),
        )

    def _markers(self, stamp: Any, entity: Entity) -> Iterator[Any]:
        """Give the markers of an entity, numbered under its name."""
        number = 0
        for shape in entity.shapes:
            for primitive in _primitives(shape):
                marker = self._marker(self._header(stamp, entity.frame), primitive, shape)
                marker.ns, marker.id = entity.name, number
                yield marker
                number += 1

    def _marker(self, header: Any, primitive: _Primitive, shape: SceneShape) -> Any:
        kind, scale, position = primitive
        point = self._new("geometry_msgs/Point", **dict(zip("xyz", position, strict=True)))
        turned = self._new("geometry_msgs/Quaternion", **dict(zip("xyzw", shape.rotation, strict=True)))
        nothing = self._new("std_msgs/Header", stamp=header.stamp, frame_id="")
        return self._new(
            "visualization_msgs/Marker",
            header=header,
            ns="",
            id=0,
            type=kind,
            action=0,
            pose=self._new("geometry_msgs/Pose", position=point, orientation=turned),
            scale=self._new("geometry_msgs/Vector3", **dict(zip("xyz", scale, strict=True))),
            color=self._new("std_msgs/ColorRGBA", **dict(zip("rgba", (*shape.colour, 1.0), strict=True))),
            lifetime=self._new("builtin_interfaces/Duration", sec=0, nanosec=0),
            frame_locked=True,
            points=self._corners(shape) if kind == _TRIANGLES else [],
            colors=[],
            texture_resource="",
            texture=self._new(
                "sensor_msgs/CompressedImage", header=nothing, format="", data=np.empty(0, dtype=np.uint8)
            ),
            uv_coordinates=[],
            text="",
            mesh_resource="",
            mesh_file=self._new("visualization_msgs/MeshFile", filename="", data=np.empty(0, dtype=np.uint8)),
            mesh_use_embedded_materials=False,
        )

    def _corners(self, shape: SceneShape) -> list[Any]:
        """Return the corners of the triangles of a mesh, three for each."""
        vertices = np.array(shape.shape["vertices"]).reshape(-1, 3)
        corners = vertices[np.array(shape.shape["faces"])]
        return [self._new("geometry_msgs/Point", x=x, y=y, z=z) for x, y, z in corners.tolist()]


def _primitives(shape: SceneShape) -> Iterator[_Primitive]:
    """Give the markers that a shape consists of."""
    it, position = shape.shape, shape.position
    match it["kind"]:
        case "box":
            yield _Primitive(_CUBE, it["size"], position)
        case "sphere":
            yield _Primitive(_SPHERE, [2 * it["radius"]] * 3, position)
        case "mesh":
            yield _Primitive(_TRIANGLES, [1.0, 1.0, 1.0], position)
        case kind:
            wide = 2 * it["radius"]
            yield _Primitive(_CYLINDER, [wide, wide, it["length"]], position)
            if kind == "capsule":
                yield from (_Primitive(_SPHERE, [wide] * 3, cap_position(shape, side)) for side in (-1, 1))
