"""Parts that fingers hold, carry and let go."""

from pathlib import Path

import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.model import Cell
from armwright.cell.part_poses import PartPoses, PartTrack
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector
from oracles.arms import random_pose

CELL = """
[arms.ARM_1]
model = "stanford"
hand = [1,0,0, 0,-1,0, 0,0,-1, 0.40, 0.15, 0.05]
[arms.ARM_1.gripper]
opening_mm = 80
[arms.ARM_2]
model = "stanford"
base = [-1,0,0, 0,-1,0, 0,0,1, 1.10, 0.00, 0.00]
hand = [-1,0,0, 0,1,0, 0,0,-1, 0.65, 0.00, 0.25]
[parts.BLOCK]
size_mm = [30, 60, 40]
mass_kg = 0.2
at = [1,0,0, 0,1,0, 0,0,1, 0.40, 0.15, 0.05]
grasp = [1,0,0, 0,-1,0, 0,0,-1, 0,0,0.01]
[visions]
OBJ = { part = "BLOCK" }
"""


@pytest.fixture
def cell(tmp_path: Path) -> Cell:
    (tmp_path / "cell.toml").write_text(CELL)
    return read_cell(tmp_path / "cell.toml")


def hands(X: Array) -> dict[str, Array]:
    return {"ARM_1": X, "ARM_2": homogeneous(np.eye(3), (9.0, 9.0, 9.0))}


def at_grasp(cell: Cell, offset: tuple[float, float, float] = (0.0, 0.0, 0.0), tilt: float = 0.0) -> Array:
    block = cell.parts["BLOCK"]
    return block.pose @ block.grasp @ homogeneous(rotation_from_vector((tilt, 0.0, 0.0)), offset)


def test_a_part_moves_with_the_hand(cell: Cell, rng: np.random.Generator) -> None:
    """A held part keeps its pose on the hand, and stays where it is when the fingers open."""
    parts = PartPoses(cell)
    grasp, later = hands(at_grasp(cell, (0.01, 0.0, 0.0))), hands(random_pose(rng))

    assert parts.close("ARM_1", grasp, 1.0) == "BLOCK"
    before = parts.copy()
    carried = parts.in_world("BLOCK", later)
    assert parts.open("ARM_1", later, 2.0) == ("BLOCK",)

    X_HP = np.linalg.inv(grasp["ARM_1"]) @ cell.parts["BLOCK"].pose
    np.testing.assert_allclose(carried, later["ARM_1"] @ X_HP, atol=1e-12)
    np.testing.assert_allclose(parts.in_world("BLOCK", grasp), carried, atol=1e-12)
    assert (parts.carrier("BLOCK"), before.carrier("BLOCK")) == (None, "ARM_1")
    track = parts.tracks["BLOCK"]
    assert (track.times, track.carriers) == ((0.0, 1.0, 2.0), (None, "ARM_1", None))
    assert [track.at(time)[0] for time in (0.5, 1.0, 1.5, 2.0, 9.0)] == [None, "ARM_1", "ARM_1", None, None]


@pytest.mark.parametrize(
    ("offset", "tilt", "held"),
    [
        ((0.039, 0.0, 0.0), 0.0, True),
        ((0.041, 0.0, 0.0), 0.0, False),
        ((0.0, 0.0, 0.0), np.radians(44.0), True),
        ((0.0, 0.0, 0.0), np.radians(46.0), False),
    ],
)
def test_what_fingers_hold(cell: Cell, offset: tuple[float, float, float], tilt: float, *, held: bool) -> None:
    """A grasp pose within half the opening and 45 degrees of the tool is held, at any angle about its approach."""
    turned = at_grasp(cell, offset, tilt) @ homogeneous(rotation_from_vector((0.0, 0.0, 2.0)), (0.0, 0.0, 0.0))

    assert (PartPoses(cell).close("ARM_1", hands(turned), 0.0) is not None) is held


def test_openings(cell: Cell) -> None:
    """Fingers close to the width of the part across them, each as far out as its farther side, or to nothing."""
    parts = PartPoses(cell)
    assert parts.opening("ARM_1") == 0.08
    parts.close("ARM_1", hands(at_grasp(cell)), 0.0)
    assert parts.opening("ARM_1") == pytest.approx(0.06)
    parts.open("ARM_1", hands(at_grasp(cell)), 1.0, 0.07)
    assert parts.opening("ARM_1") == 0.07
    parts.close("ARM_1", hands(at_grasp(cell, (0.0, 0.005, 0.0))), 2.0)
    assert parts.opening("ARM_1") == pytest.approx(0.07)
    parts.open("ARM_1", hands(at_grasp(cell)), 3.0)
    parts.close("ARM_1", hands(at_grasp(cell, (0.5, 0.0, 0.0))), 4.0)
    assert parts.opening("ARM_1") == 0.0


def test_the_other_arm_takes_it(cell: Cell) -> None:
    """A part that two grippers close on belongs to the one that closed last."""
    parts, both = PartPoses(cell), dict.fromkeys(("ARM_1", "ARM_2"), at_grasp(cell))

    parts.close("ARM_1", both, 1.0)
    parts.close("ARM_2", both, 1.0)
    assert (parts.held_by("ARM_1"), parts.held_by("ARM_2")) == ((), ("BLOCK",))
    assert parts.open("ARM_1", both, 2.0) == ()
    assert isinstance(parts.tracks["BLOCK"], PartTrack)
    assert parts.tracks["BLOCK"].times == (0.0, 1.0)


def test_the_camera_sees_where_it_is(cell: Cell) -> None:
    """The simulated camera answers with the grasp pose of a part, again and again, also in a copy."""
    simulator = Simulator(cell)
    block = cell.parts["BLOCK"]

    for _ in range(2):
        X, time = simulator.locate("OBJ", 0.0)
        np.testing.assert_allclose(X, block.pose @ block.grasp, atol=1e-12)
        assert time == 0.1
    simulator.move_fingers("ARM_1", 0.5, closed=True)
    copied = simulator.copy()
    copied.move_fingers("ARM_1", 0.6, closed=False)
    assert simulator.part_poses().carrier("BLOCK") == "ARM_1"
    assert copied.part_poses().carrier("BLOCK") is None
    np.testing.assert_allclose(simulator.locate("OBJ", 1.0)[0], block.pose @ block.grasp, atol=1e-9)


def test_parts_that_are_said_to_be_somewhere(cell: Cell, rng: np.random.Generator) -> None:
    """Parts that are arranged as others are go on as those do: carried, released and held again, with open fingers."""
    grasp, later = hands(at_grasp(cell, (0.01, 0.0, 0.0))), hands(random_pose(rng))
    parts = PartPoses(cell)
    parts.close("ARM_1", grasp, 1.0)
    said = {"BLOCK": (parts.carrier("BLOCK"), np.array(parts.pose("BLOCK")))}
    openings = {name: parts.opening(name) for name in cell.arms}

    arranged = PartPoses.arranged(cell, said, openings)

    assert arranged.held_by("ARM_1") == ("BLOCK",)
    assert [arranged.opening(name) for name in cell.arms] == [parts.opening(name) for name in cell.arms]
    np.testing.assert_array_equal(arranged.in_world("BLOCK", later), parts.in_world("BLOCK", later))
    # Neither what was said nor what was copied from is changed by what happens later.
    said["BLOCK"][1][:3, 3], openings["ARM_1"] = 0.0, 0.0
    for each in (arranged, parts):
        assert each.open("ARM_1", later, 2.0) == ("BLOCK",)
    np.testing.assert_array_equal(arranged.in_world("BLOCK", later), parts.in_world("BLOCK", later))
    assert arranged.carrier("BLOCK") is None
    at_part = hands(arranged.in_world("BLOCK", later) @ cell.parts["BLOCK"].grasp)
    assert arranged.close("ARM_1", at_part, 3.0) == "BLOCK"
    # In the world a part stands at the pose that is said.
    X = random_pose(rng)
    np.testing.assert_array_equal(PartPoses.arranged(cell, {"BLOCK": (None, X)}, openings).in_world("BLOCK", later), X)
