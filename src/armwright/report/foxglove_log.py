"""A log as an MCAP file with the schemas of Foxglove, which Foxglove, Lichtblick and Rerun show.

Source:
    MCAP format specification; ``schemas/jsonschema`` of github.com/foxglove/foxglove-sdk.
"""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from armwright.cell.observations import Picture
from armwright.extras import import_extra
from armwright.report.foxglove_schemas import SCHEMAS
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
from armwright.version import __version__

_INFO, _ERROR = 2, 4
# By kind of shape, the list of an entity that holds it.
_LISTS = {"box": "cubes", "sphere": "spheres", "cylinder": "cylinders", "capsule": "cylinders", "mesh": "triangles"}


def mcap_log(content: LogContent) -> bytes:
    """Return a log as the bytes of an MCAP file; the same log gives the same bytes.

    Raises:
        MissingExtraError: the library ``mcap`` is not installed.
    """
    writing = import_extra("mcap.writer", "a log in MCAP", "logs")
    file = io.BytesIO()
    writer = writing.Writer(file)
    writer.start(profile="", library=f"armwright {__version__}")
    schemas: dict[str, int] = {}
    channels: dict[str, int] = {}
    for number, (time, topic, payload) in enumerate(timed_messages(content)):
        name, message = _message(time, payload)
        if topic not in channels:
            if name not in schemas:
                data = json.dumps(SCHEMAS[name]).encode()
                schemas[name] = writer.register_schema(name=name, encoding="jsonschema", data=data)
            channels[topic] = writer.register_channel(topic=topic, message_encoding="json", schema_id=schemas[name])
        text = json.dumps(message, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
        writer.add_message(channels[topic], log_time=time, publish_time=time, data=text.encode(), sequence=number)
    writer.finish()
    return file.getvalue()


def _message(time: int, payload: Payload) -> tuple[str, Mapping[str, Any]]:
    """Return the name of the schema of a message, and the message."""
    stamp = {"sec": time // 10**9, "nsec": time % 10**9}
    match payload:
        case JointsPayload():
            return "foxglove.JointStates", {"timestamp": stamp, "joints": _joints(payload)}
        case LogEvent():
            return "foxglove.Log", {
                "timestamp": stamp,
                "level": _ERROR if payload.is_error else _INFO,
                "message": payload.text,
                "name": payload.process,
                "file": payload.file,
                "line": payload.line,
            }
        case Picture():
            data = base64.b64encode(payload.png).decode("ascii")
            image = {"timestamp": stamp, "frame_id": payload.camera, "data": data, "format": "png"}
            return "foxglove.CompressedImage", image
        case str():
            return "armwright.Run", json.loads(payload)
        case Frames(transforms):
            return "foxglove.FrameTransforms", {"transforms": [_transform(stamp, frame) for frame in transforms]}
        case Scene(entities):
            return "foxglove.SceneUpdate", {"deletions": [], "entities": [_entity(stamp, one) for one in entities]}


def _joints(state: JointsPayload) -> list[dict[str, Any]]:
    columns: dict[str, Sequence[Any]] = {"name": state.names, "position": state.q, "velocity": state.qd}
    if state.qdd is not None:
        columns["acceleration"] = state.qdd
    columns["effort"] = state.tau
    return [dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)]


def _transform(stamp: Mapping[str, int], frame: Transform) -> dict[str, Any]:
    return {
        "timestamp": stamp,
        "parent_frame_id": frame.parent,
        "child_frame_id": frame.child,
        "translation": dict(zip("xyz", frame.position, strict=True)),
        "rotation": dict(zip("xyzw", frame.rotation, strict=True)),
    }


def _entity(stamp: Mapping[str, int], entity: Entity) -> dict[str, Any]:
    lists: dict[str, list[Any]] = {
        name: [] for name in ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    }
    for shape in entity.shapes:
        kind = shape.shape["kind"]
        lists[_LISTS[kind]].append(_PRIMITIVES[kind](shape))
        if kind == "capsule":
            lists["spheres"] += [_cap(shape, side) for side in (-1, 1)]
    return {
        "timestamp": stamp,
        "frame_id": entity.frame,
        "id": entity.name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [],
        **lists,
    }


def _posed(shape: SceneShape, more: Mapping[str, Any], position: Sequence[float] | None = None) -> dict[str, Any]:
    pose = {
        "position": dict(zip("xyz", position or shape.position, strict=True)),
        "orientation": dict(zip("xyzw", shape.rotation, strict=True)),
    }
    return {"pose": pose, **more, "color": dict(zip("rgba", (*shape.colour, 1.0), strict=True))}


def _size(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def _box(shape: SceneShape) -> dict[str, Any]:
    return _posed(shape, {"size": _size(*shape.shape["size"])})


def _sphere(shape: SceneShape) -> dict[str, Any]:
    return _posed(shape, {"size": _size(*[2 * shape.shape["radius"]] * 3)})


def _cylinder(shape: SceneShape) -> dict[str, Any]:
    wide = 2 * shape.shape["radius"]
    return _posed(shape, {"size": _size(wide, wide, shape.shape["length"]), "bottom_scale": 1.0, "top_scale": 1.0})


def _cap(shape: SceneShape, side: int) -> dict[str, Any]:
    """Return the sphere at one end of a capsule."""
    return _posed(shape, {"size": _size(*[2 * shape.shape["radius"]] * 3)}, cap_position(shape, side))


def cap_position(shape: SceneShape, side: int) -> list[float]:
    """Return the middle (3,) of the sphere at one end of a capsule: behind half its length along its z axis."""
    x, y, z, w = shape.rotation
    along = (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y))
    half = side * shape.shape["length"] / 2
    return [p + half * a for p, a in zip(shape.position, along, strict=True)]


def _mesh(shape: SceneShape) -> dict[str, Any]:
    corners = iter(shape.shape["vertices"])
    points = [_size(x, y, z) for x, y, z in zip(corners, corners, corners, strict=True)]
    more = {"points": points, "colors": [], "indices": shape.shape["faces"]}
    return _posed(shape, more)


_PRIMITIVES: Mapping[str, Callable[[SceneShape], dict[str, Any]]] = {
    "box": _box,
    "sphere": _sphere,
    "cylinder": _cylinder,
    "capsule": _cylinder,
    "mesh": _mesh,
}
