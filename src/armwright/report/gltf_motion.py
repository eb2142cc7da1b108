"""A motion as a glTF file: the bodies of a view and their poses over time, for any viewer of 3-D files."""

from __future__ import annotations

import json
import math
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from armwright.arrays import Array
from armwright.report.animation import Animation, ArmFigure, Body
from armwright.report.body_poses import body_change, frame_poses, part_poses
from armwright.report.triangles import triangles_of
from armwright.spatial.poses import from_noap
from armwright.version import __version__

# Linear colours of bodies, by what colours them on a page.
_TINTS = {
    "link": (0.42, 0.48, 0.56),
    "base": (0.24, 0.27, 0.32),
    "joint": (0.73, 0.25, 0.03),
    "fixture": (0.69, 0.64, 0.55),
    "part": (0.02, 0.14, 0.57),
}
# glTF's y axis points up, its z axis towards the viewer.
_UPRIGHT = (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
_FLOAT, _UNSIGNED = 5126, 5125
_ARRAYS, _ELEMENTS = 34962, 34963


def gltf_motion(animation: Animation) -> bytes:
    """Return a binary glTF file (.glb) of a motion, in metres and seconds, with the z axis of the world upwards.

    Args:
        animation: of the view of a page.

    Source:
        Khronos Group (2021), glTF 2.0 specification.
    """
    return _Writer(animation).content()


class _Writer:
    """Collects the nodes, meshes and arrays of a file."""

    def __init__(self, animation: Animation) -> None:
        self._animation = animation
        self._buffer = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._meshes: list[dict[str, Any]] = []
        self._mesh_numbers: dict[tuple[int, str], int] = {}
        self._nodes: list[dict[str, Any]] = [{"name": "WORLD", "rotation": list(_UPRIGHT), "children": []}]
        self._samplers: list[dict[str, Any]] = []
        self._channels: list[dict[str, Any]] = []
        self._triangles = [triangles_of(shape) for shape in animation.shapes]
        self._times = self._accessor(animation.t.astype(np.float32), "SCALAR", bounds=True)

    def content(self) -> bytes:
        """Return the file."""
        animation = self._animation
        for body in animation.fixtures:
            self._node(body.name, from_noap(body.pose)[None], 0, self._mesh(body.shape, "fixture"))
        tools = {name: self._add_arm(name, figure) for name, figure in animation.arms.items()}
        for part in animation.parts:
            self._node(part.name, part_poses(part, animation.t, tools), 0, self._mesh(part.shape, "part"))
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": f"armwright {__version__}"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{key: value for key, value in node.items() if value != []} for node in self._nodes],
            "meshes": self._meshes,
            "materials": [
                {
                    "name": name,
                    "pbrMetallicRoughness": {
                        "baseColorFactor": [*colour, 1.0],
                        "metallicFactor": 0.1,
                        "roughnessFactor": 0.6,
                    },
                }
                for name, colour in _TINTS.items()
            ],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._buffer)}],
        }
        if self._channels:
            document["animations"] = [{"name": "motion", "samplers": self._samplers, "channels": self._channels}]
        return _glb(json.dumps(document, separators=(",", ":")).encode(), bytes(self._buffer))

    def _add_arm(self, name: str, figure: ArmFigure) -> Array:
        """Add an arm: a node for each of its frames, with its bodies below; return the poses (M, 4, 4) of its tool."""
        frames = frame_poses(figure)
        names = [*(f"{name} frame {i}" for i in range(len(figure.joints) + 1)), f"{name} tool frame"]
        nodes = [self._node(each, X, 0) for each, X in zip(names, frames, strict=True)]
        for body in figure.bodies:
            self._add_body(body, figure, nodes[body.frame])
        return frames[-1]

    def _add_body(self, body: Body, figure: ArmFigure, parent: int) -> None:
        X, mesh = from_noap(body.pose)[None], self._mesh(body.shape, body.tint)
        if body.slide:
            X = body_change(body, figure) @ X
        node = self._node(body.name, X, parent, None if body.stretches else mesh)
        if body.stretches:
            # From a length of 1 m about its middle.
            shift = figure.joints[body.frame].d + figure.q[:, body.frame]
            self._stretch(node, X[0, :3, 3], shift, mesh)

    def _stretch(self, node: int, middle_of_one: Array, lengths: Array, mesh: int) -> None:
        scale = np.ones((len(lengths), 3))
        scale[:, 2] = np.abs(lengths)
        middle = np.tile(middle_of_one, (len(lengths), 1))
        middle[:, 2] *= lengths
        self._nodes[node] |= {"mesh": mesh, "translation": middle[0].tolist(), "scale": scale[0].tolist()}
        self._animate(node, "scale", scale)
        self._animate(node, "translation", middle)

    def _node(self, name: str, X: Array, parent: int, mesh: int | None = None) -> int:
        """Add a node with poses (1, 4, 4) or (M, 4, 4) seen from its parent."""
        number = len(self._nodes)
        rotations, places = quaternions(X[:, :3, :3]), X[:, :3, 3]
        self._nodes.append(
            {
                "name": name,
                "translation": places[0].tolist(),
                "rotation": rotations[0].tolist(),
                "children": [],
                **({} if mesh is None else {"mesh": mesh}),
            }
        )
        self._nodes[parent]["children"].append(number)
        self._animate(number, "rotation", rotations)
        self._animate(number, "translation", places)
        return number

    def _animate(self, node: int, path: str, values: Array) -> None:
        """Let a property of a node change over time, if it does."""
        if len(values) < 2 or np.ptp(values, axis=0).max() < 1e-7:
            return
        kind = "VEC4" if path == "rotation" else "VEC3"
        output = self._accessor(values.astype(np.float32), kind)
        self._channels.append({"sampler": len(self._samplers), "target": {"node": node, "path": path}})
        self._samplers.append({"input": self._times, "output": output, "interpolation": "LINEAR"})

    def _mesh(self, shape: int, tint: str) -> int:
        key = shape, tint
        if key not in self._mesh_numbers:
            self._mesh_numbers[key] = len(self._meshes)
            vertices, normals, faces = self._triangles[shape]
            primitive = {
                "attributes": {
                    "POSITION": self._accessor(vertices, "VEC3", bounds=True, target=_ARRAYS),
                    "NORMAL": self._accessor(normals, "VEC3", target=_ARRAYS),
                },
                "indices": self._accessor(faces.reshape(-1), "SCALAR", target=_ELEMENTS),
                "material": list(_TINTS).index(tint),
            }
            self._meshes.append({"primitives": [primitive]})
        return self._mesh_numbers[key]

    def _accessor(self, array: npt.NDArray[Any], kind: str, *, bounds: bool = False, target: int | None = None) -> int:
        """Add an array of floats or of numbers of vertices; return its number."""
        content = np.ascontiguousarray(array)
        view = {"buffer": 0, "byteOffset": len(self._buffer), "byteLength": content.nbytes}
        self._views.append(view if target is None else {**view, "target": target})
        self._buffer += content.tobytes()
        component = _UNSIGNED if content.dtype == np.uint32 else _FLOAT
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": component,
            "count": len(content),
            "type": kind,
        }
        if bounds:
            rows = content.reshape(len(content), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self._accessors.append(accessor)
        return len(self._accessors) - 1


def quaternions(R: Array) -> Array:
    """Return rotations (M, 3, 3) as quaternions x, y, z, w, each on the side of the one before: the short way."""
    from scipy.spatial.transform import Rotation  # noqa: PLC0415 - takes 50 ms

    turned = np.asarray(Rotation.from_matrix(R).as_quat())
    flips = np.cumprod(np.where((turned[1:] * turned[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    turned[1:] *= flips[:, None]
    return turned


def _glb(document: bytes, buffer: bytes) -> bytes:
    """Return a binary file from its JSON and its buffer."""
    chunks = b""
    for kind, content, filler in ((b"JSON", document, b" "), (b"BIN\0", buffer, b"\0")):
        whole = content + filler * (-len(content) % 4)
        chunks += struct.pack("<I", len(whole)) + kind + whole
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks
