"""A motion as glTF: another reader finds the bodies where the arms have them, at every instant."""

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright.arrays import Array
from armwright.cell.reader import read_cell
from armwright.kinematics.forward_kinematics import link_poses
from armwright.program.api import run
from armwright.report.gltf_motion import gltf_motion
from armwright.report.run_data import run_page_data
from armwright.spatial.poses import homogeneous

EXAMPLES = Path(__file__).parents[2] / "examples"
PROGRAMS = [("stacking.rlo", "stanford_cell.toml"), ("stack_by_vision.rlo", "vision_cell.toml")]


class Gltf:
    """A file, read by what the format says."""

    def __init__(self, content: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", content)
        assert (magic, version, length) == (b"glTF", 2, len(content))
        size, kind = struct.unpack_from("<I4s", content, 12)
        assert kind == b"JSON"
        self.json: dict[str, Any] = json.loads(content[20 : 20 + size])
        self._buffer = content[28 + size :]

    def array(self, number: int) -> Array:
        """The values of an accessor, a row each."""
        accessor = self.json["accessors"][number]
        view = self.json["bufferViews"][accessor["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        flat = np.frombuffer(self._buffer, kind, accessor["count"] * width, view["byteOffset"])
        return flat.reshape(-1, width).astype(float)

    def poses(self, name: str) -> tuple[Array, Array]:
        """The times, and the poses (M, 4, 4) of a node in the world of the file, z upwards."""
        (number,) = [i for i, node in enumerate(self.json["nodes"]) if node["name"] == name]
        times = self.array(self.json["animations"][0]["samplers"][0]["input"])[:, 0]
        X = np.tile(np.eye(4), (len(times), 1, 1))
        while number:
            X = self._local(number, len(times)) @ X
            (number,) = [i for i, node in enumerate(self.json["nodes"]) if number in node.get("children", [])]
        return times, X

    def _local(self, number: int, count: int) -> Array:
        node = self.json["nodes"][number]
        moved = {path: np.tile(node[path], (count, 1)) for path in ("translation", "rotation")}
        for channel in self.json["animations"][0]["channels"]:
            if channel["target"]["node"] == number and channel["target"]["path"] in moved:
                output = self.json["animations"][0]["samplers"][channel["sampler"]]["output"]
                moved[channel["target"]["path"]] = self.array(output)
        return homogeneous(Rotation.from_quat(moved["rotation"]).as_matrix(), moved["translation"])


@pytest.mark.parametrize(("program", "cell"), PROGRAMS)
def test_poses(program: str, cell: str) -> None:
    """Links, tools and parts are where the run has them."""
    read = read_cell(EXAMPLES / cell)
    recording = run(EXAMPLES / program, cell=read)
    page = run_page_data(recording, (), "")
    file = Gltf(gltf_motion(page.animation))

    stream = recording.streams[0]
    times, tool = file.poses("ARM_1 tool frame")
    rows = np.minimum(np.round(times / read.period).astype(int), len(stream.q) - 1)
    expected = read.arms["ARM_1"].base @ link_poses(read.arms["ARM_1"].arm, stream.q[rows])
    np.testing.assert_allclose(tool, expected[:, -1], atol=1e-4)
    for i in (1, 4, 6):
        np.testing.assert_allclose(file.poses(f"ARM_1 frame {i}")[1], expected[:, i], atol=1e-4)
    for name, track in recording.parts.items():
        X = file.poses(name)[1]
        for row in (0, len(times) // 2, -1):
            arm, pose = track.at(times[row] + 1e-6)
            np.testing.assert_allclose(X[row], pose if arm is None else tool[row] @ pose, atol=3e-4)
    quaternions = [
        file.array(file.json["animations"][0]["samplers"][channel["sampler"]]["output"])
        for channel in file.json["animations"][0]["channels"]
        if channel["target"]["path"] == "rotation"
    ]
    assert all(((q[1:] * q[:-1]).sum(axis=1) > 0).all() for q in quaternions)


def test_another_reader() -> None:
    """Trimesh reads the file, and finds closed bodies of the right volume."""
    trimesh = pytest.importorskip("trimesh")
    read = read_cell(EXAMPLES / "vision_cell.toml")
    recording = run(EXAMPLES / "stack_by_vision.rlo", cell=read)
    scene = trimesh.load(io.BytesIO(gltf_motion(run_page_data(recording, (), "").animation)), file_type="glb")

    for name, part in read.parts.items():
        (node,) = [each for each in scene.graph.nodes_geometry if each == name]
        X, geometry = scene.graph[node]
        mesh = scene.geometry[geometry].copy()
        mesh.merge_vertices(merge_norm=True)
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(float(np.prod(part.shape.size)), rel=1e-5)
        # The z axis of the world points along y of the file.
        np.testing.assert_allclose(X[:3, 3], part.pose[[0, 2, 1], 3] * (1, 1, -1), atol=1e-6)
