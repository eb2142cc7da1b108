"""What the controller of an arm reads, tick by tick, and what counts as being between its fingers."""

from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

from armwright.arrays import Array
from armwright.cell.control import Sensors
from armwright.cell.model import Cell
from armwright.cell.reader import read_cell
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.contacts import Contacts
from armwright.physics.world import PhysicsCell
from armwright.spatial.poses import homogeneous
from armwright.spatial.shapes import Box

CELL = """[arms.ARM_1]
joint_positions = [0, -1.5, 0.4, 0, 0.5, 0]
gripper = {{ kind = "{kind}", opening_mm = 80 }}

[parts.BLOCK]
size_mm = [20, {width}, 20]
mass_kg = 0.2
at = [1,0,0, 0,1,0, 0,0,1, 1,1,1]
"""


def bench(folder: Path, kind: str = "fingers", width: float = 40) -> Cell:
    path = folder / "cell.toml"
    path.write_text(CELL.format(kind=kind, width=width), encoding="utf-8")
    return read_cell(path)


@pytest.mark.parametrize("delay", [0, 1, 3])
@pytest.mark.parametrize("counts", [0.0, 1e7])
def test_readings_are_late_by_whole_ticks(delay: int, counts: float, tmp_path: Path) -> None:
    """The position that a controller reads is that of so many ticks before, to half a count of its encoder."""
    cell, read = bench(tmp_path), list[Array]()
    arm = attrs.evolve(cell.arms["ARM_1"], sensors=Sensors(counts=counts, delay=delay))

    def falls(_t: float, q: Array, _qd: Array, _reference: Any) -> Array:
        read.append(np.array(q))
        return np.zeros(6)

    world = PhysicsCell(attrs.evolve(cell, arms={"ARM_1": arm}), laws={"ARM_1": falls})
    true = []
    for tick in range(30):
        true.append(world._data.qpos[world._servos["ARM_1"].indices.positions].copy())
        world.advance((tick + 1) * cell.period)

    # What a program reads is what the controller reads.
    if counts or delay:
        np.testing.assert_array_equal(world.configuration("ARM_1", world.now), read[-1])
    late = np.array([true[max(0, tick - delay)] for tick in range(30)])
    turns = np.where([joint.revolute for joint in arm.arm.joints], 2 * np.pi, 1.0)
    count = turns / (counts * np.abs(arm.arm.motor_values("gear_ratio"))) if counts else np.zeros(6)
    assert (np.abs(np.array(read) - late) <= count / 2 + 1e-15).all()
    # In a tick the arm falls farther than that.
    assert np.abs(np.diff(true, axis=0)[20:]).max() > 3 * count.max()


@pytest.mark.parametrize(
    ("width", "aside", "gripped"), [(80.6, 0.0, True), (40.6, 20.0, False), (40.6, -20.0, False), (40.0, 0.0, False)]
)
def test_a_part_is_gripped_by_both_fingers(width: float, aside: float, gripped: bool, tmp_path: Path) -> None:  # noqa: FBT001 - a case
    """A part that one finger touches is not in the hand; one that both touch is. Between open fingers are 80 mm."""
    cell = bench(tmp_path, width=width)
    arm = cell.arms["ARM_1"]
    X = arm.base @ forward(arm.arm, arm.start) @ homogeneous(np.eye(3), (0.0, aside * 1e-3, -0.012))
    world = PhysicsCell(cell, parts={"BLOCK": attrs.evolve(cell.parts["BLOCK"], pose=X)})

    touching = Contacts(world._world)

    assert touching.gripped(world._data, "ARM_1") == ("BLOCK" if gripped else None)
    assert touching.touching_arms(world._data, "BLOCK") == (("ARM_1",) if gripped or aside else ())


def test_a_cup_pulls_at_its_own_axis(tmp_path: Path) -> None:
    """A cup pulls a part and its arm together along its axis, however far from the middle of the part it lies."""
    cell = bench(tmp_path, kind="suction", width=60)
    arm = cell.arms["ARM_1"]
    tool = arm.base @ forward(arm.arm, arm.start)
    plate = Box(size=(0.06, 0.06, 0.02))
    part = attrs.evolve(cell.parts["BLOCK"], shape=plate, pose=tool @ homogeneous(np.eye(3), (0.0, 0.015, 0.0098)))
    world = PhysicsCell(cell, parts={"BLOCK": part})
    world.move_fingers("ARM_1", 0.0, closed=True)
    world.advance(2e-3)

    data = world._data
    here, hand = data.body("BLOCK").id, data.body("ARM_1/tool").id
    place = data.xpos[hand]
    for body, sign in ((here, -1.0), (hand, 1.0)):
        force, torque = data.xfrc_applied[body, :3], data.xfrc_applied[body, 3:]
        np.testing.assert_allclose(force, sign * 30.0 * tool[:3, 2], atol=0.05)
        moment = torque + np.cross(data.xipos[body] - place, force)
        # The arm has moved by less than a tenth of a millimetre since.
        np.testing.assert_allclose(moment, 0.0, atol=30.0 * 1e-4)
