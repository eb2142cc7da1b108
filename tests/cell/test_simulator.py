"""The simulated cell does what its file says."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.cell.hardware import DeviceError, Hardware
from armwright.cell.model import Cell, CellArm, ContactPlane
from armwright.cell.reader import read_cell
from armwright.cell.simulator import Simulator
from armwright.errors import ShapeError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.quintic_polynomials import quintic
from armwright.motion.trajectory import hold
from armwright.spatial.poses import homogeneous

BENCH = """name = "bench"
[arms.ARM_1]
joint_positions = [0, 0, 0.3, 0, 0, 0]
open_s = 0.2
grasp_s = 0.5
[arms.ARM_2]
base = [-1,0,0, 0,-1,0, 0,0,1, 2,0,0]
joint_positions = [1, 0, 0.3, 0, 0, 0]
[camera]
pose = [0,1,0, -1,0,0, 0,0,1, 1,0,0]
time_s = 0.25
[visions]
OBJ = [[1,0,0, 0,1,0, 0,0,1, 0.1,0,0], [1,0,0, 0,1,0, 0,0,1, 0.2,0,0]]
EMPTY = []
"""
DEVICES = "[devices]\nPRESS = {}\nLAMP = {}\n"


def bench(tmp_path: Path, text: str = BENCH) -> Cell:
    (tmp_path / "bench.toml").write_text(text)
    return read_cell(tmp_path / "bench.toml")


def test_camera_answers_one_after_the_other(tmp_path: Path) -> None:
    """The camera gives its answers in the order of the file; where the cell says so, the last one for ever after."""
    hardware: Hardware = Simulator(
        bench(tmp_path, BENCH.replace("time_s = 0.25", 'time_s = 0.25\nafter_last = "same"'))
    )

    places = [hardware.locate("OBJ", 0.0)[0][:3, 3] for _ in range(4)]

    # The camera stands at x = 1 and is turned a quarter to the left: 0.1 m along its x is 0.1 m along y of the world.
    np.testing.assert_allclose(places, [(1, 0.1, 0), (1, 0.2, 0), (1, 0.2, 0), (1, 0.2, 0)], atol=1e-12)
    assert hardware.locate("OBJ", 0.0)[1] == 0.25


def test_camera_answers_run_out(tmp_path: Path) -> None:
    """After its last answer the camera finds nothing more, and says how many there were."""
    hardware = Simulator(bench(tmp_path))
    hardware.locate("OBJ", 0.0)
    hardware.locate("OBJ", 0.0)

    with pytest.raises(DeviceError, match=r"the camera found nothing more for OBJ: cell 'bench' has 2 answers for it"):
        hardware.locate("OBJ", 0.0)


def test_two_simulators_of_one_cell(tmp_path: Path) -> None:
    """What one simulator has seen and switched does not change what another one finds."""
    place = bench(tmp_path)
    first = Simulator(place)
    first.locate("OBJ", 0.0)
    first.operate("PRESS", on=True)

    second = Simulator(place)

    assert second.locate("OBJ", 0.0)[0][1, 3] == pytest.approx(0.1)
    assert second.active_devices() == frozenset()


@pytest.mark.parametrize("frame", ["EMPTY", "CUP"])
def test_camera_that_finds_nothing(frame: str, tmp_path: Path) -> None:
    """A frame without an answer is not found; the message lists what the camera knows."""
    with pytest.raises(DeviceError, match=f"the camera found nothing for {frame}; in cell 'bench' it finds EMPTY, OBJ"):
        Simulator(bench(tmp_path)).locate(frame, 0.0)


def test_camera_without_any_answer(tmp_path: Path) -> None:
    """In a cell that lists no visions the camera finds nothing at all."""
    text = "[arms.ARM_1]\njoint_positions = [0, 0, 0.3, 0, 0, 0]\n"

    with pytest.raises(DeviceError, match=r"in cell 'bench\.toml' it finds nothing"):
        Simulator(bench(tmp_path, text)).locate("OBJ", 0.0)


def test_any_device_where_none_is_listed(tmp_path: Path) -> None:
    """A cell that says nothing of devices has whatever a program asks for."""
    hardware = Simulator(bench(tmp_path))

    assert hardware.operate("TORCH", on=True) == 0
    assert hardware.operate("PRESS", on=True) == 0
    assert hardware.active_devices() == {"TORCH", "PRESS"}
    hardware.operate("TORCH", on=False)
    hardware.operate("TORCH", on=False)
    assert hardware.active_devices() == {"PRESS"}


def test_only_listed_devices(tmp_path: Path) -> None:
    """A cell that lists its devices has no others, and names the nearest."""
    hardware = Simulator(bench(tmp_path, BENCH + DEVICES))

    hardware.operate("LAMP", on=True)
    with pytest.raises(DeviceError, match=r"cell 'bench' has no device PERSS; did you mean PRESS\?"):
        hardware.operate("PERSS", on=True)
    assert hardware.active_devices() == {"LAMP"}


def test_no_devices_at_all(tmp_path: Path) -> None:
    """An empty list of devices is not the same as none: nothing can be switched."""
    with pytest.raises(DeviceError, match=r"cell 'bench' has no device PRESS$"):
        Simulator(bench(tmp_path, BENCH + "[devices]\n")).operate("PRESS", on=True)


def test_arms_move_alone(tmp_path: Path) -> None:
    """An arm ends where its trajectory ends, the other stays, and nobody can bend a configuration from outside."""
    hardware = Simulator(bench(tmp_path))
    goal = [0.5, -0.2, 0.4, 0.1, 0.2, 0.3]

    motion = quintic(hardware.configuration("ARM_1", 5.0), goal, 2.0)
    hardware.start_motion("ARM_1", motion, 5.0, np.eye(4))

    np.testing.assert_array_equal(hardware.configuration("ARM_1", 6.0), motion(1.0))
    for later in (7.0, 100.0):
        np.testing.assert_allclose(hardware.configuration("ARM_1", later), goal, atol=1e-12)
        np.testing.assert_array_equal(hardware.configuration("ARM_2", later), (1, 0, 0.3, 0, 0, 0))
    hardware.configuration("ARM_1", 7.0)[0] = 9
    np.testing.assert_allclose(hardware.configuration("ARM_1", 7.0), goal, atol=1e-12)


def test_a_trajectory_that_begins_elsewhere(tmp_path: Path) -> None:
    """A trajectory that does not begin where the arm stands is a fault of the program that planned it."""
    hardware = Simulator(bench(tmp_path))
    start = np.array((0.1, 0, 0.3, 0, 0, 0))

    with pytest.raises(AssertionError, match=r"ARM_1 is 0\.1 away from the start of its trajectory"):
        hardware.start_motion("ARM_1", quintic(start, start, 1.0), 0.0, np.eye(4))


def test_the_plane_stops_what_comes_down(tmp_path: Path) -> None:
    """The force of the plane grows with the depth of the hand in it, and stays while it stands there."""
    cell = bench(tmp_path)
    start = cell.arms["ARM_1"].start
    arm = cell.arms["ARM_1"].arm
    X_WB = cell.arms["ARM_1"].base
    goal = start + np.array([0, 0, 0.1, 0, 0, 0])
    motion = quintic(start, goal, 2.0)
    heights = [(X_WB @ forward(arm, motion(t)))[2, 3] for t in (0.0, 1.0, 2.0)]
    down = heights[2] < heights[0]
    motion = motion if down else quintic(start, start - np.array([0, 0, 0.1, 0, 0, 0]), 2.0)
    plane = (X_WB @ forward(arm, motion(1.0)))[2, 3]
    hardware = Simulator(attrs.evolve(cell, contact=ContactPlane(height=plane, stiffness=1000.0)))

    hardware.start_motion("ARM_1", motion, 3.0, np.eye(4))

    assert hardware.contact_time("ARM_1") == pytest.approx(4.0, abs=1e-9)
    assert hardware.contact_wrench("ARM_1", 4.0)[2] == pytest.approx(0, abs=1e-6)
    for later, local in ((4.5, 1.5), (5.0, 2.0), (60.0, 2.0)):
        np.testing.assert_array_equal(hardware.configuration("ARM_1", later), motion(local))
        depth = plane - (X_WB @ forward(arm, motion(local)))[2, 3]
        np.testing.assert_allclose(hardware.contact_wrench("ARM_1", later), (0, 0, 1000 * depth, 0, 0, 0), atol=1e-6)
        np.testing.assert_allclose(hardware.peak_contact("ARM_1", later)[:2], (depth, 1000 * depth), atol=1e-9)
    # Deeper than 5 mm it has come on the first tick at which it is.
    heights = np.array([(X_WB @ forward(arm, motion(k * 1e-3)))[2, 3] for k in range(2001)])
    assert hardware.excess_depth_time("ARM_1") == pytest.approx(3.0 + np.flatnonzero(heights < plane - 5e-3)[0] * 1e-3)

    # On its way out it presses less and less; what is let go does not press at all.
    hardware.start_motion("ARM_1", motion.reversed(), 60.0, np.eye(4))
    assert hardware.contact_time("ARM_1") is None
    assert hardware.excess_depth_time("ARM_1") is None
    depth = plane - (X_WB @ forward(arm, motion(1.5)))[2, 3]
    np.testing.assert_allclose(hardware.contact_wrench("ARM_1", 60.5), (0, 0, 1000 * depth, 0, 0, 0), atol=1e-6)
    assert not hardware.contact_wrench("ARM_1", 61.001).any()


def test_what_is_let_go_does_not_press(tmp_path: Path) -> None:
    """A part that an arm has pressed on the plane presses on with any motion of the arm, until the fingers open."""
    cell = bench(tmp_path)
    arm, X_WB, start = (getattr(cell.arms["ARM_1"], name) for name in ("arm", "base", "start"))
    X_HP = homogeneous(np.eye(3), (0.0, 0.0, 0.05))
    ends = [start, start + np.array([0, 0, 0.1, 0, 0, 0])]
    ends.sort(key=lambda q: -(X_WB @ forward(arm, q) @ X_HP)[2, 3])
    motion = quintic(*ends, 1.0)
    plane = float((X_WB @ forward(arm, motion(0.9)) @ X_HP)[2, 3])
    low = attrs.evolve(cell.arms["ARM_1"], start=ends[0])
    hardware = Simulator(attrs.evolve(cell, arms={"ARM_1": low}, contact=ContactPlane(height=plane)))
    hardware.start_motion("ARM_1", motion, 0.0, X_HP)
    pressed = hardware.contact_wrench("ARM_1", 1.0)[2]
    assert pressed > 1

    hardware.start_motion("ARM_1", hold(motion(1.0), 1.0), 1.0, np.eye(4))
    assert hardware.contact_wrench("ARM_1", 2.0)[2] == pytest.approx(pressed, rel=1e-9)
    hardware.move_fingers("ARM_1", 0.0, closed=False)
    assert hardware.contact_wrench("ARM_1", 2.0)[2] == 0


def test_fingers_take_their_time(tmp_path: Path) -> None:
    """Opening and closing take as long as the cell file says, and 0.3 s where it says nothing."""
    hardware = Simulator(bench(tmp_path))

    assert (hardware.move_fingers("ARM_1", 0.0, closed=False), hardware.move_fingers("ARM_1", 0.0, closed=True)) == (
        0.2,
        0.5,
    )
    assert (hardware.move_fingers("ARM_2", 0.0, closed=False), hardware.move_fingers("ARM_2", 0.0, closed=True)) == (
        0.3,
        0.3,
    )


def test_a_start_that_does_not_fit_the_arm(tmp_path: Path) -> None:
    """Five joint positions for an arm of six joints are refused."""
    arm = bench(tmp_path).arms["ARM_1"].arm

    with pytest.raises(ShapeError, match=r"start: expected 6 numbers, one per joint, got shape \(5,\)"):
        CellArm(arm=arm, start=[0, 0, 0.3, 0, 0])
