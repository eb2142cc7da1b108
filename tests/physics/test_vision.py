"""What the cameras of a cell answer: frames where they are, and in words why one is not seen."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.errors import InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.markers import add_marker
from armwright.physics.pictures import Photographer, add_camera, add_lights
from armwright.physics.vision import Look, camera_in_world, look, marker_name
from armwright.physics.world import PhysicsCell
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.rotations import elementary_rotation, rotation_from_vector

pytest.importorskip("cv2")

CELL = """[arms.ARM_1]
hand = [1,0,0, 0,-1,0, 0,0,-1, 0.45,0,0.25]
[scene]
table = { z = 0.03, from = [0.15, -0.7], to = [1.35, 0.7] }
markers = [{ name = "GOAL", id = 7, size_mm = 60, at = [0,1,0, -1,0,0, 0,0,1, 0.6,0.2,0.03] }]
[parts.BLOCK]
size_mm = [40, 60, 80]
mass_kg = 0.2
at = [1,0,0, 0,0,1, 0,-1,0, 0.5,0.05,0.06]
grasp = [1,0,0, 0,-1,0, 0,0,-1, 0,0,0.01]
marker = { id = 3, size_mm = 28, at = [1,0,0, 0,0,-1, 0,1,0, 0,0.03,0.01] }
[cameras.TOP]
pose = [1,0,0, 0,-1,0, 0,0,-1, 0.5,0.1,0.8]
width = 640
height = 480
fovy_deg = 42
distortion = [-0.1, 0.02, 0.001, -0.001, 0]
[cameras.WRIST]
on = "ARM_1"
pose = [0.96,0,0.28, 0,1,0, -0.28,0,0.96, 0.1,0,-0.1]
width = 640
height = 480
fovy_deg = 60
[visions]
OBJ  = { part = "BLOCK", camera = "TOP" }
ANY  = { part = "BLOCK", camera = "TOP", on = "free" }
NEAR = { part = "BLOCK", camera = "WRIST" }
GOAL = { marker = "GOAL", camera = "TOP", at = [1,0,0, 0,-1,0, 0,0,-1, 0,0,0.05] }
"""


class Scene:
    """The world of the cell without its arm: table, block, both cameras, and a hand that can be put anywhere."""

    def __init__(self, cell: Cell) -> None:
        import mujoco

        self.cell, self.mujoco, spec = cell, mujoco, mujoco.MjSpec()
        add_lights(spec)
        box, table, part = mujoco.mjtGeom.mjGEOM_BOX, cell.fixtures["TABLE"], cell.parts["BLOCK"]
        spec.worldbody.add_geom(name="TABLE", type=box, size=table.shape.size / 2, pos=table.pose[:3, 3])
        block = spec.worldbody.add_body(name="BLOCK", mocap=True)
        block.add_geom(type=box, size=part.shape.size / 2, rgba=(0.8, 0.5, 0.2, 1))
        add_marker(spec, block, part.marker, marker_name("BLOCK"))
        goal = spec.worldbody.add_body(name="GOAL", mocap=True)
        add_marker(spec, goal, attrs.evolve(cell.markers["GOAL"], pose=np.eye(4)), marker_name("GOAL"))
        hand = spec.worldbody.add_body(name="ARM_1 hand", mocap=True)
        hand.add_geom(type=box, size=(0.03, 0.03, 0.03), rgba=(0.3, 0.3, 0.3, 1))
        add_camera(spec.worldbody, cell.cameras["TOP"])
        add_camera(spec.worldbody.add_body(name="ARM_1", mocap=True), cell.cameras["WRIST"])
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.taking = Photographer(self.model, cell.cameras)
        q = cell.arms["ARM_1"].start
        self.poses: dict[str, Array] = {
            "BLOCK": part.pose,
            "GOAL": cell.markers["GOAL"].pose,
            "ARM_1 hand": homogeneous(np.eye(3), (0, 0, 5)),
            "ARM_1": cell.arms["ARM_1"].base @ forward(cell.arms["ARM_1"].arm, q),
        }

    def look(self, frame: str, **moved: Array) -> Look:
        """What a camera answers after bodies were moved."""
        for name, X in (self.poses | {name.replace("_hand", " hand"): X for name, X in moved.items()}).items():
            number = self.model.body(name).mocapid[0]
            self.data.mocap_pos[number] = X[:3, 3]
            self.mujoco.mju_mat2Quat(self.data.mocap_quat[number], np.ascontiguousarray(X[:3, :3]).ravel())
        self.mujoco.mj_forward(self.model, self.data)
        camera = self.cell.cameras[str(self.cell.sights[frame].camera)]
        X_WC = camera_in_world(self.cell, camera, self.cell.arms["ARM_1"].start)
        return look(self.taking, self.data, self.cell, frame, X_WC)


@pytest.fixture(scope="module")
def scene(opengl: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scene]:
    assert opengl
    path = tmp_path_factory.mktemp("cell") / "cell.toml"
    path.write_text(CELL, encoding="utf-8")
    made = Scene(read_cell(path))
    yield made
    made.taking.close()


def turned(yaw: float, x: float, y: float, X: Array) -> Array:
    """A pose that was rotated about the vertical and shifted to x and y."""
    return homogeneous(elementary_rotation(2, yaw) @ X[:3, :3], (x, y, X[2, 3]))


@pytest.mark.parametrize("frame", ["OBJ", "ANY", "NEAR"])
def test_the_grasp_of_a_part(frame: str, scene: Scene, rng: np.random.Generator) -> None:
    """A part that lies on its side is found by either camera, and the answer is where a tool goes to."""
    for _ in range(3):
        block = turned(rng.uniform(-3, 3), *rng.uniform((0.48, -0.02), (0.55, 0.08)), scene.poses["BLOCK"])

        seen = scene.look(frame, BLOCK=block)

        assert seen.message == ""
        assert seen.pose is not None
        off = inverse(block @ scene.cell.parts["BLOCK"].grasp) @ seen.pose
        assert np.linalg.norm(off[:3, 3]) < (1e-3 if frame == "ANY" else 1e-4)
        np.testing.assert_allclose(off[:3, :3], np.eye(3), atol=0.02 if frame == "ANY" else 2e-3)


def test_a_marker_of_the_scene(scene: Scene) -> None:
    """A marker that was moved is found where it is, with the frame over it."""
    goal = turned(1.0, 0.55, 0.15, scene.poses["GOAL"])

    seen = scene.look("GOAL", GOAL=goal).pose

    assert seen is not None
    np.testing.assert_allclose(seen[:3, 3], goal[:3, 3] + (0, 0, 0.05), atol=5e-5)
    np.testing.assert_allclose(seen[:3, 2], (0, 0, -1), atol=1e-9)


FLAT = rotation_from_vector((0, np.radians(87), 0))


@pytest.mark.parametrize(
    ("frame", "moved", "why"),
    [
        ("OBJ", {"ARM_1_hand": homogeneous(np.eye(3), (0.5, 0.05, 0.3))}, "ARM_1 hand is in front of it"),
        ("OBJ", {"ARM_1_hand": homogeneous(np.eye(3), (0.5, 0.084, 0.15))}, "ARM_1 hand is in front of it"),
        ("GOAL", {"BLOCK": turned(0, 0.6, 0.2, homogeneous(np.eye(3), (0, 0, 0.07)))}, "BLOCK is in front of it"),
        ("GOAL", {"GOAL": homogeneous(np.eye(3), (0.6, 0.2, 0.01))}, "TABLE is in front of it"),
        ("GOAL", {"GOAL": homogeneous(np.eye(3), (0.9, 0.2, 0.03))}, "it is not wholly in the picture"),
        ("GOAL", {"GOAL": homogeneous(np.eye(3), (0.6, 0.2, 0.9))}, "it is behind the camera"),
        ("GOAL", {"GOAL": homogeneous(np.diag((1.0, -1, -1)), (0.6, 0.2, 0.1))}, "it faces away from the camera"),
        ("GOAL", {"GOAL": homogeneous(FLAT, (0.5, 0.15, 0.1))}, "it is looked at under an angle of only 3 degrees"),
    ],
)
def test_why_a_marker_is_not_seen(frame: str, moved: Mapping[str, Array], why: str, scene: Scene) -> None:
    """The answer names what is in front of a marker, or where it is."""
    number, name = (3, "BLOCK") if frame == "OBJ" else (7, "GOAL")

    seen = scene.look(frame, **moved)

    assert seen.pose is None
    assert seen.message == f"camera TOP does not see marker {number} of {name}: {why}"
    assert seen.picture.shape == (480, 640, 3)


def test_a_part_that_fell_over(scene: Scene) -> None:
    """A part that does not stand as it began is seen, but its orientation is not guessed."""
    fallen = homogeneous(rotation_from_vector((0.6, 0, 0)) @ scene.poses["BLOCK"][:3, :3], (0.5, 0.05, 0.06))

    seen = scene.look("OBJ", BLOCK=fallen)

    assert (seen.pose, seen.message) == (
        None,
        "marker 3 of BLOCK is seen, but tilted: BLOCK does not stand as at the start",
    )
    assert scene.look("ANY", BLOCK=fallen).pose is not None


def test_darkness_and_distance(scene: Scene) -> None:
    """In the dark nothing is found, and neither is a marker of a few pixels."""
    camera = scene.cell.cameras["TOP"]
    for changed, why in (
        (attrs.evolve(camera, light=0.02, noise=3), "it is dark"),
        (
            attrs.evolve(camera, pose=homogeneous(camera.pose[:3, :3], (0.5, 0.05, 6))),
            "it is too small in the picture, wi",
        ),
    ):
        other = Scene(attrs.evolve(scene.cell, cameras={**scene.cell.cameras, "TOP": changed}))
        message = other.look("OBJ").message
        other.taking.close()
        assert message.startswith(f"camera TOP does not see marker 3 of BLOCK: {why}")


def test_part_without_a_marker(tmp_path: Path) -> None:
    """A cell with physics in which a camera looks for a part without a marker is refused before anything runs."""
    (tmp_path / "cell.toml").write_text(CELL.replace("marker = { id = 3, size_mm", "#"), encoding="utf-8")
    with pytest.raises(InvalidValueError, match="a camera cannot find BLOCK: it has no marker; expected one in"):
        PhysicsCell(read_cell(tmp_path / "cell.toml"))
