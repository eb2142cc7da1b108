"""The bodies of a world: what parts weigh and how they turn, where bases stand, what a gripper leaves of a link."""

from pathlib import Path

import attrs
import mujoco
import numpy as np
import pytest
import trimesh

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.cell.model import Cell, CellArm
from armwright.cell.part_poses import PartPoses
from armwright.cell.reader import read_cell
from armwright.cell.scene import Part
from armwright.physics.cell_bodies import arm_bodies
from armwright.physics.hand_solids import before_hand
from armwright.physics.placed_bodies import CellBodies
from armwright.physics.world import PhysicsCell
from armwright.physics.world_model import world_model
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from armwright.spatial.shapes import Capsule, Mesh, Solid

START = np.array([0, -1.5, 0.4, 0, 0.5, 0])


def random_pose(rng: np.random.Generator, reach: float) -> Array:
    return homogeneous(rotation_from_vector(rng.uniform(-1.5, 1.5, 3)), rng.uniform(-reach, reach, 3))


def test_parts_have_the_inertia_of_their_meshes(rng: np.random.Generator, tmp_path: Path) -> None:
    """Mass, centre and moments of a skew part in MuJoCo are those that trimesh computes of its triangles."""
    (tmp_path / "cell.toml").write_text("[arms.ARM_1]\njoint_positions = [0, -1.5, 0.4, 0, 0.5, 0]\n", encoding="utf-8")
    cell = read_cell(tmp_path / "cell.toml")
    for _ in range(5):
        hull = trimesh.convex.convex_hull(rng.uniform(0, 0.1, (12, 3)) * (1, 2, 3))
        mass, X = float(rng.uniform(0.1, 2)), homogeneous(np.eye(3), (2.0, 2.0, 2.0))
        part = Part(name="BLOCK", shape=Mesh(vertices=hull.vertices, faces=np.array(hull.faces)), mass=mass, pose=X)

        body = world_model(attrs.evolve(cell, parts={"BLOCK": part}), {"BLOCK": part}).model.body("BLOCK")

        R = np.empty(9)
        mujoco.mju_quat2Mat(R, body.iquat)
        moments = R.reshape(3, 3) @ np.diag(body.inertia) @ R.reshape(3, 3).T
        assert body.mass[0] == pytest.approx(mass)
        np.testing.assert_allclose(body.ipos, hull.center_mass, atol=1e-9)
        np.testing.assert_allclose(moments, mass / hull.volume * hull.moment_inertia, rtol=1e-6, atol=1e-9)


def test_a_base_stands_in_the_base_frame(rng: np.random.Generator) -> None:
    """Wherever the first frame of the table of an arm is, solids of its base are told in the base frame."""
    stanford = load_arm("stanford")
    for _ in range(3):
        arm, base = attrs.evolve(stanford, base=random_pose(rng, 0.5)), random_pose(rng, 1.0)
        cell = Cell(name="one", arms={"ARM_1": CellArm(arm=arm, base=base, start=START)})
        data = PhysicsCell(cell)._data
        (solid,) = arm.base_solids
        geom = data.geom("ARM_1/base/solid1")
        np.testing.assert_allclose(geom.xpos, (base @ solid.pose)[:3, 3], atol=1e-12)
        np.testing.assert_allclose(np.abs(geom.xmat.reshape(3, 3)[:, 2] @ (base @ solid.pose)[:3, 2]), 1.0, atol=1e-12)
        # For collisions it is told in the first frame, which `arm.base` puts into the base frame.
        (body,) = (body for body in arm_bodies("ARM_1", arm) if body.link == 0)
        np.testing.assert_allclose(arm.base @ body.solid.pose, solid.pose, atol=1e-12)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    ("middle", "ends"),
    [
        # A capsule of 200 mm, 20 mm in radius, so far behind the tool point; the gripper reaches 80 mm behind it.
        (-0.25, (-0.35, -0.15)),
        (-0.15, (-0.25, -0.10)),
        (-0.05, (-0.15, -0.10)),
        (0.05, None),
    ],
)
def test_a_link_ends_where_the_gripper_begins(middle: float, ends: tuple[float, float] | None, turned: bool) -> None:  # noqa: FBT001 - a case
    """Of a guessed capsule remains what is behind the gripper, whichever way the capsule is told."""
    arm = load_arm("stanford")
    R = rotation_from_vector(np.array([np.pi if turned else 0.0, 0.0, 0.0]))
    pose = arm.tool @ homogeneous(R, (0.0, 0.0, middle))

    left = before_hand(Solid(shape=Capsule(radius=0.02, length=0.2), pose=pose, guessed=True), arm, 0.08)

    if ends is None:
        assert left is None
        return
    assert left is not None
    assert isinstance(left.shape, Capsule)
    half = left.shape.length / 2 * left.pose[:3, 2]
    heights = [float((np.linalg.inv(arm.tool) @ [*(left.pose[:3, 3] + side * half), 1.0])[2]) for side in (-1, 1)]
    np.testing.assert_allclose(sorted(heights), ends, atol=1e-9)


def test_every_link_is_checked_against_what_stands() -> None:
    """Fixtures and parts are checked against each link and the gripper of an arm, and not against its base."""
    path = Path(__file__).parents[2] / "examples" / "vision_cell.toml"
    bodies = CellBodies(cell := read_cell(path))
    arranged = bodies.arranged(PartPoses(cell))

    pairs = {frozenset((arranged[i].name, arranged[j].name)) for i, j in bodies.pairs(arranged)}

    moving = {"ARM_1 finger", "ARM_1 palm", *(f"ARM_1 link {number}" for number in range(1, 7))}
    assert {"ARM_1 base", *moving} == {body.name for body in arranged if body.arm}
    for other in ("TABLE", "BLOCK_1", "BLOCK_2", "BLOCK_3"):
        assert {name for name in (*moving, "ARM_1 base") if frozenset((name, other)) in pairs} == moving
