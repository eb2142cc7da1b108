"""Logs of runs and simulations, opened by the public readers of their formats: numbers are those of the run."""

import base64
import json
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.cell.reader import read_cell
from armwright.errors import MissingExtraError
from armwright.files.logs.joint_log import read_joint_log
from armwright.kinematics.forward_kinematics import link_poses
from armwright.motion.replay import arms_of, bases_of
from armwright.physics.world import PhysicsCell
from armwright.program import run
from armwright.program.vm.machine import RunError
from armwright.program.vm.recording import Recording
from armwright.report.foxglove_log import mcap_log
from armwright.report.log_content import run_log_content, simulation_log_content
from armwright.report.log_files import log_files, require_log_library
from armwright.report.ros2_log import ros2_bag
from armwright.simulation.simulator import simulate
from armwright.spatial.shapes import Box, Capsule, Mesh
from oracles.stocked_cell import stocked_run

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

EXAMPLES = Path(__file__).parents[2] / "examples"
# Positions are written to a nanometre, quaternions to 1e-12.
POSITION, ROTATION = 1e-9, 1e-9
# What each message of Foxglove must have, by docs.foxglove.dev.
REQUIRED = {
    "foxglove.JointStates": {"timestamp", "joints"},
    "foxglove.FrameTransforms": {"transforms"},
    "foxglove.SceneUpdate": {"deletions", "entities"},
    "foxglove.Log": {"timestamp", "level", "message", "name", "file", "line"},
    "foxglove.CompressedImage": {"timestamp", "frame_id", "data", "format"},
}
PRIMITIVES = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")


class Shown(NamedTuple):
    """A shape of a scene as a viewer reads it: kind, frame, position, rotation, size."""

    kind: str
    frame: str
    position: Array
    rotation: Array
    size: Array


@pytest.fixture(scope="module")
def recording() -> Recording:
    """A run in a cell with physics and a camera."""
    pytest.importorskip("cv2")
    cell = read_cell(EXAMPLES / "vision_cell.toml")
    return run(EXAMPLES / "stack_by_vision.rlo", cell, hardware=lambda one: PhysicsCell(one, seed=1))


@pytest.fixture(scope="module")
def mcap(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its log as MCAP."""
    path = tmp_path_factory.mktemp("mcap") / "log.mcap"
    path.write_bytes(mcap_log(run_log_content(recording)))
    return path


@pytest.fixture(scope="module")
def bag(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its log as a bag of ROS 2."""
    folder = tmp_path_factory.mktemp("bag")
    for name, content in ros2_bag(run_log_content(recording)).items():
        (folder / name).write_bytes(content)
    return folder


# Type, time [ns] and content of the messages of each topic.
Messages = dict[str, list[tuple[str, int, Any]]]


@pytest.fixture(scope="module")
def in_mcap(mcap: Path) -> Messages:
    """What is in the MCAP file."""
    return mcap_messages(mcap)


@pytest.fixture(scope="module")
def in_bag(bag: Path) -> Messages:
    """What is in the bag."""
    return bag_messages(bag)


def mcap_messages(path: Path) -> Messages:
    """Return the type, the time and the content of the messages of each topic, as the reader of MCAP gives them."""
    found = defaultdict(list)
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None
            assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
            assert json.loads(schema.data)["title"] == schema.name
            found[channel.topic].append((schema.name, message.log_time, json.loads(message.data)))
    return found


def bag_messages(path: Path) -> Messages:
    """Return the same of a bag, as the reader of rosbags gives it."""
    types, found = get_typestore(Stores.ROS2_HUMBLE), defaultdict(list)
    with Reader(path) as reader:
        for connection, time, data in reader.messages():
            content = types.deserialize_cdr(data, connection.msgtype)
            found[connection.topic].append((connection.msgtype, time, content))
    return found


def test_joint_states(recording: Recording, in_mcap: Messages, in_bag: Messages) -> None:
    """Every servo tick is there, planned and measured, every number to the last bit."""
    streams = {"planned": recording.streams[0], "measured": recording.measured[0]}
    for role, stream in streams.items():
        topic = f"/ARM_1/{role}/joint_states"
        kinds, times, contents = zip(*in_mcap[topic], strict=True)
        assert set(kinds) == {"foxglove.JointStates"}
        np.testing.assert_allclose(np.array(times) / 1e9, stream.t, rtol=0, atol=1e-9)
        for key, values in (("position", stream.q), ("velocity", stream.qd), ("effort", stream.tau)):
            got = [[joint[key] for joint in content["joints"]] for content in contents]
            np.testing.assert_array_equal(got, values)
        kinds, times, contents = zip(*in_bag[topic], strict=True)
        assert set(kinds) == {"sensor_msgs/msg/JointState"}
        for key, values in (("position", stream.q), ("velocity", stream.qd), ("effort", stream.tau)):
            np.testing.assert_array_equal([getattr(content, key) for content in contents], values)
        assert contents[0].name == [f"joint_{i}" for i in range(1, 7)]
        stamps = [content.header.stamp.sec + content.header.stamp.nanosec * 1e-9 for content in contents]
        np.testing.assert_allclose(stamps, stream.t, rtol=0, atol=1e-9)


def transforms(in_mcap: Messages, in_bag: Messages) -> Iterator[list[dict[str, tuple[str, Array]]]]:
    """Give for both formats, at each instant, the parent and the pose of each frame."""
    for messages, read in ((in_mcap, _mcap_transform), (in_bag, _bag_transform)):
        yield [
            dict(read(one) for one in (content["transforms"] if isinstance(content, Mapping) else content.transforms))
            for _, _, content in messages["/tf"]
        ]


def _pose(position: Any, rotation: Any) -> Array:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.from_quat(rotation).as_matrix(), position
    return X


def _mcap_transform(one: Mapping[str, Any]) -> tuple[str, tuple[str, Array]]:
    pose = _pose([one["translation"][k] for k in "xyz"], [one["rotation"][k] for k in "xyzw"])
    return one["child_frame_id"], (one["parent_frame_id"], pose)


def _bag_transform(one: Any) -> tuple[str, tuple[str, Array]]:
    move, turn = one.transform.translation, one.transform.rotation
    pose = _pose([move.x, move.y, move.z], [turn.x, turn.y, turn.z, turn.w])
    return one.child_frame_id, (one.header.frame_id, pose)


def in_world(frames: Mapping[str, tuple[str, Array]], name: str) -> Array:
    """Return the pose of a frame in the world."""
    X = np.eye(4)
    while name != "world":
        name, own = frames[name]
        X = own @ X
    return X


def test_frames(recording: Recording, in_mcap: Messages, in_bag: Messages) -> None:
    """Frames of links, tool and parts are where the kinematics has them, at every instant."""
    cell_arm, measured = recording.cell.arms["ARM_1"], recording.measured[0]
    for instants in transforms(in_mcap, in_bag):
        t = np.append(np.arange(len(instants) - 1) / 30, recording.duration)
        for i in range(0, len(instants), 37):
            q = measured.q[min(round(t[i] / recording.cell.period), len(measured.q) - 1)]
            expected = cell_arm.base @ link_poses(cell_arm.arm, q)
            names = ["base", *(f"link_{k}" for k in range(1, 7)), "tool"]
            for name, X in zip(names, expected, strict=True):
                np.testing.assert_allclose(in_world(instants[i], f"ARM_1/{name}"), X, atol=8 * ROTATION)
        for name, track in recording.parts.items():
            arm, X = track.at(recording.duration)
            assert arm is None
            np.testing.assert_allclose(in_world(instants[-1], f"part/{name}"), X, atol=1e-3)
        assert "base" in {name.lower() for name in instants[-1]}


def shown(in_mcap: Messages, in_bag: Messages) -> Iterator[list[Shown]]:
    """Give the shapes of the scene in both formats."""
    ((kind, _, scene),) = in_mcap["/scene"]
    assert kind == "foxglove.SceneUpdate"
    yield [
        Shown(
            name,
            entity["frame_id"],
            *(np.array(list(one["pose"][key].values())) for key in ("position", "orientation")),
            np.array(list(one.get("size", {}).values())),
        )
        for entity in scene["entities"]
        for name in PRIMITIVES
        for one in entity[name]
    ]
    ((kind, _, scene),) = in_bag["/scene"]
    assert kind == "visualization_msgs/msg/MarkerArray"
    kinds = {1: "cubes", 2: "spheres", 3: "cylinders", 11: "triangles"}
    yield [
        Shown(
            kinds[one.type],
            one.header.frame_id,
            np.array([one.pose.position.x, one.pose.position.y, one.pose.position.z]),
            np.array([one.pose.orientation.x, one.pose.orientation.y, one.pose.orientation.z, one.pose.orientation.w]),
            np.array([one.scale.x, one.scale.y, one.scale.z]),
        )
        for one in scene.markers
    ]


def test_scene(recording: Recording, in_mcap: Messages, in_bag: Messages) -> None:
    """Fixtures and links are there with their sizes, and a capsule ends in two spheres."""
    arm = recording.cell.arms["ARM_1"].arm
    boxes = [it for it in recording.cell.fixtures.values() if isinstance(it.shape, Box)]
    assert boxes
    capsules = [
        (i, solid) for i, link in enumerate(arm.links, 1) for solid in link.solids if isinstance(solid.shape, Capsule)
    ]
    assert capsules
    for shapes in shown(in_mcap, in_bag):
        for box in boxes:
            assert any(
                one.frame == "world"
                and np.allclose(one.position, box.pose[:3, 3], atol=1e-6)
                and np.allclose(one.size, box.shape.size, atol=1e-6)
                for one in shapes
                if one.kind == "cubes"
            )
        for i, solid in capsules:
            for side in (-1, 1):
                end = solid.pose[:3, 3] + side * solid.shape.length / 2 * solid.pose[:3, 2]
                assert any(
                    one.frame == f"ARM_1/link_{i}"
                    and np.allclose(one.position, end, atol=2e-6)
                    and np.allclose(one.size, 2 * solid.shape.radius, atol=2e-6)
                    for one in shapes
                    if one.kind == "spheres"
                )
        assert {one.frame for one in shapes} >= {f"part/{name}" for name in recording.cell.parts}


def test_every_shape(tmp_path: Path) -> None:
    """Boxes, cylinders, a ball and a mesh are in both formats, and two arms and held parts move by their frames."""
    stocked = stocked_run(tmp_path)
    content = run_log_content(stocked)
    (tmp_path / "log.mcap").write_bytes(mcap_log(content))
    for name, data in ros2_bag(content).items():
        (tmp_path / name).write_bytes(data)
    in_mcap, in_bag = mcap_messages(tmp_path / "log.mcap"), bag_messages(tmp_path / "bag.mcap")

    for shapes in shown(in_mcap, in_bag):
        there = {(one.frame, one.kind) for one in shapes}
        assert there >= {("part/BLOCK", "cubes"), ("part/ROD", "cylinders"), ("part/WEDGE", "triangles")}
        sizes = {tuple(np.round(one.size * 1e3, 6)) for one in shapes if one.frame == "world"}
        assert sizes >= {(120, 90, 60), (20, 220, 200), (50, 50, 300), (100, 100, 100)}
    mesh = stocked.cell.parts["WEDGE"].shape
    assert isinstance(mesh, Mesh)
    ((_, _, scene),) = in_mcap["/scene"]
    (triangles,) = next(one for one in scene["entities"] if one["id"] == "part/WEDGE")["triangles"]
    corners = np.array([list(triangles["points"][i].values()) for i in triangles["indices"]])
    np.testing.assert_allclose(corners, mesh.vertices[mesh.faces.ravel()], atol=1e-6)
    ((_, _, scene),) = in_bag["/scene"]
    (marker,) = (one for one in scene.markers if one.ns == "part/WEDGE")
    np.testing.assert_allclose([(one.x, one.y, one.z) for one in marker.points], corners, atol=1e-6)
    assert {"/ARM_1/planned/joint_states", "/ARM_2/planned/joint_states"} <= set(in_mcap)
    for instants in transforms(in_mcap, in_bag):
        carried = [in_world(frames, "part/BLOCK") for frames in instants]
        assert np.ptp([X[2, 3] for X in carried]) > 0.05
        np.testing.assert_allclose(carried[-1][:2, 3], (0.55, 0.28), atol=1e-3)


def test_trace_and_pictures(recording: Recording, in_mcap: Messages, in_bag: Messages) -> None:
    """The trace is there line by line, and each picture byte by byte."""
    trace = recording.trace()
    assert [content["message"] for _, _, content in in_mcap["/log"]] == trace
    assert [content.msg for _, _, content in in_bag["/rosout"]] == trace
    png = [picture.png for picture in recording.pictures]
    camera = recording.pictures[0].camera
    assert png
    images = [content for _, _, content in in_mcap[f"/cameras/{camera}"]]
    assert [base64.b64decode(image["data"]) for image in images] == png
    assert {image["format"] for image in images} == {"png"}
    assert [bytes(one.data) for _, _, one in in_bag[f"/cameras/{camera}/compressed"]] == png


def test_messages_are_whole(in_mcap: Messages, in_bag: Messages) -> None:
    """Every message has what viewers require of its type, and there is one for each of ROS 2."""
    for topic, messages in in_mcap.items():
        for kind, _, content in messages:
            assert REQUIRED.get(kind, set()) <= set(content)
        there = {"/log": "/rosout"}.get(topic, topic)
        assert len(in_bag[f"{there}/compressed" if topic.startswith("/cameras") else there]) == len(messages)
    ((_, _, scene),) = in_mcap["/scene"]
    entity = {"timestamp", "frame_id", "id", "lifetime", "frame_locked", "metadata", *PRIMITIVES}
    assert all(set(one) == entity for one in scene["entities"])


def test_same_bytes(recording: Recording, mcap: Path, bag: Path) -> None:
    """The same run gives the same bytes."""
    content = run_log_content(recording)

    assert mcap_log(content) == mcap.read_bytes()
    assert ros2_bag(content) == {path.name: path.read_bytes() for path in bag.iterdir()}


def test_read_back(recording: Recording, mcap: Path, bag: Path) -> None:
    """Read by armwright, both logs hold the motions, the arm where it stands, and the trace."""
    cell_arm = recording.cell.arms["ARM_1"]
    for path in (mcap, bag):
        log = read_joint_log(path)
        assert arms_of(log) == {"ARM_1": cell_arm.arm}
        np.testing.assert_array_equal(bases_of(log)["ARM_1"], cell_arm.base)
        np.testing.assert_array_equal(log.topics["/ARM_1/measured/joint_states"].q, recording.measured[0].q)
        np.testing.assert_allclose(log.topics["/ARM_1/planned/joint_states"].t, recording.streams[0].t, atol=1e-12)
        assert [line.text for line in log.lines] == recording.trace()
        assert log.about["text"] == (EXAMPLES / "stack_by_vision.rlo").read_text(encoding="utf-8")


def test_failed_run(tmp_path: Path) -> None:
    """The log of a run that failed ends in its error."""
    program = tmp_path / "far.rlo"
    program.write_text("VAR far : FRAME ;\nBEGIN\n  PRINT(1) ;\n  READ VISIONS (far) ;\nEND.\n", encoding="utf-8")
    with pytest.raises(RunError) as caught:
        run(program, EXAMPLES / "stanford_cell.toml")
    assert caught.value.recording is not None
    path = tmp_path / "log.mcap"
    path.write_bytes(mcap_log(run_log_content(caught.value.recording())))

    *_, (_, _, last) = mcap_messages(path)["/log"]

    assert last["level"] == 4
    assert last["message"].startswith(caught.value.diagnostic.code)


def test_simulation(tmp_path: Path) -> None:
    """The log of a simulated motion has its joint states and the moving arm, in both formats."""
    arm = load_arm("puma560")
    simulation = simulate(arm, np.zeros(6), duration=0.2, period=0.002)
    content = simulation_log_content(simulation)
    (tmp_path / "a.mcap").write_bytes(mcap_log(content))
    for name, data in ros2_bag(content).items():
        (tmp_path / name).write_bytes(data)

    for path in (tmp_path / "a.mcap", tmp_path / "bag.mcap"):
        states = read_joint_log(path).topics["/puma560/simulated/joint_states"]
        np.testing.assert_array_equal(states.q, simulation.q)
        np.testing.assert_array_equal(states.tau, simulation.tau)
    frames = mcap_messages(tmp_path / "a.mcap")["/tf"]
    last = dict(_mcap_transform(one) for one in frames[-1][2]["transforms"])
    np.testing.assert_allclose(in_world(last, "puma560/tool"), link_poses(arm, simulation.q[-1])[-1], atol=1e-8)


@pytest.mark.parametrize(("kind", "library"), [("mcap", "mcap"), ("ros2", "rosbags")])
def test_missing_library(kind: Any, library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the library is missing, one line says how it is installed, before anything runs."""
    for module in (library, f"{library}.writer", f"{library}.rosbag2"):
        monkeypatch.setitem(sys.modules, module, None)
    content = simulation_log_content(simulate(load_arm("puma560"), np.zeros(6), duration=0.01))
    for refused in (lambda: require_log_library(kind), lambda: log_files(kind, content)):
        with pytest.raises(
            MissingExtraError, match=rf"needs {library}; install it by: pip install 'armwright\[logs\]'"
        ):
            refused()
