"""The JSON schemas of the messages of an MCAP log: what viewers know by name, and as much of each as we write.

Source:
    docs.foxglove.dev, message schemas; a viewer recognises them by their names.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_Schema = dict[str, Any]

_NUMBER: _Schema = {"type": "number"}
_INTEGER: _Schema = {"type": "integer"}
_TEXT: _Schema = {"type": "string"}


def _object(**properties: _Schema) -> _Schema:
    return {"type": "object", "properties": properties}


def _list(items: _Schema) -> _Schema:
    return {"type": "array", "items": items}


_TIME = {**_object(sec=_INTEGER, nsec=_INTEGER), "title": "time"}
_DURATION = {**_object(sec=_INTEGER, nsec=_INTEGER), "title": "duration"}
_VECTOR = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object(position=_VECTOR, orientation=_QUATERNION)
_COLOUR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_SIZED = {"pose": _POSE, "size": _VECTOR, "color": _COLOUR}

_ENTITY = _object(
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_DURATION,
    frame_locked={"type": "boolean"},
    metadata=_list(_object(key=_TEXT, value=_TEXT)),
    arrows=_list(_object()),
    cubes=_list(_object(**_SIZED)),
    spheres=_list(_object(**_SIZED)),
    cylinders=_list(_object(**_SIZED, bottom_scale=_NUMBER, top_scale=_NUMBER)),
    lines=_list(_object()),
    triangles=_list(
        _object(pose=_POSE, points=_list(_VECTOR), color=_COLOUR, colors=_list(_COLOUR), indices=_list(_INTEGER))
    ),
    texts=_list(_object()),
    models=_list(_object()),
)

# By name.
SCHEMAS: Mapping[str, _Schema] = {
    name: {"title": name, **schema}
    for name, schema in {
        "foxglove.JointStates": _object(
            timestamp=_TIME,
            joints=_list(_object(name=_TEXT, position=_NUMBER, velocity=_NUMBER, acceleration=_NUMBER, effort=_NUMBER)),
        ),
        "foxglove.FrameTransforms": _object(
            transforms=_list(
                _object(
                    timestamp=_TIME,
                    parent_frame_id=_TEXT,
                    child_frame_id=_TEXT,
                    translation=_VECTOR,
                    rotation=_QUATERNION,
                )
            )
        ),
        "foxglove.SceneUpdate": _object(
            deletions=_list(_object(timestamp=_TIME, type=_INTEGER, id=_TEXT)), entities=_list(_ENTITY)
        ),
        "foxglove.Log": _object(timestamp=_TIME, level=_INTEGER, message=_TEXT, name=_TEXT, file=_TEXT, line=_INTEGER),
        "foxglove.CompressedImage": _object(
            timestamp=_TIME, frame_id=_TEXT, data={**_TEXT, "contentEncoding": "base64"}, format=_TEXT
        ),
        "armwright.Run": _object(armwright=_TEXT, program=_TEXT, text=_TEXT, cell=_TEXT, arms=_object()),
    }.items()
}
