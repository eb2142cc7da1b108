"""Moves of an arm without a closed form: seven joints, solved step by step."""

from pathlib import Path

import attrs
import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.moves import cartesian_move
from armwright.motion.obstruction import PathError
from armwright.motion.plan import Manner, StageGoal, plan
from armwright.motion.straight import straight_line
from armwright.spatial.rotations import rotation_from_vector

EXAMPLE = Path(__file__).parents[2] / "examples" / "seven_joints.urdf"
START = np.array([0.1, 0.5, 0.2, 1.2, 0.3, 1.0, 0.2])


@pytest.fixture(scope="module")
def seven() -> Arm:
    """The example of a URDF arm, with what a robot file of that kind does not say."""
    arm = load_arm(EXAMPLE)
    joints = [attrs.evolve(j, limits=attrs.evolve(j.limits, acceleration=5.0)) for j in arm.joints]
    return attrs.evolve(arm, joints=joints, reach=1.0, tool_speed=1.0)


def test_line_and_point_to_point(seven: Arm) -> None:
    """A move there point to point and back along a line ends where it should, and the line is straight."""
    X = forward(seven, START)
    Y = X.copy()
    Y[:3, 3] += (-0.1, 0.15, -0.1)

    there, back = plan(
        seven,
        START,
        [StageGoal(kind="PTP", poses=Y[None]), StageGoal(kind="LINE", poses=X[None])],
        Manner(deviation=1e-3),
    )

    np.testing.assert_allclose(forward(seven, there.trajectory(there.trajectory.duration)), Y, atol=1e-6)
    hand = forward(seven, back.trajectory(np.linspace(0, back.trajectory.duration, 2000)))[:, :3, 3]
    way = X[:3, 3] - Y[:3, 3]
    s = np.clip((hand - Y[:3, 3]) @ way / (way @ way), 0, 1)
    assert np.linalg.norm(hand - Y[:3, 3] - s[:, None] * way, axis=-1).max() <= 1e-3
    np.testing.assert_allclose(hand[-1], X[:3, 3], atol=1e-6)


def test_certified_line(seven: Arm) -> None:
    """A redundant arm gets its certificate too."""
    X = forward(seven, START).copy()
    X[:3, 3] += (-0.05, 0.1, -0.1)

    assert straight_line(seven, START, X, deviation=1e-4).certificate.holds


def test_a_robot_file_without_speed() -> None:
    """An arm whose file says nothing of its hand runs lines by its length, 1 m/s at most."""
    arm = load_arm(EXAMPLE)
    X = forward(arm, START).copy()
    X[2, 3] -= 0.1

    line = straight_line(arm, START, X, speed=120)

    assert line.certificate.holds
    assert line.trajectory.duration > 0.1 / 1.0


def test_a_turn_that_few_joints_cannot_make() -> None:
    """An arm whose hand stays upright refuses to tilt it, in a moment, though the place itself is in reach."""
    limits = Limits(lower=-2.5, upper=2.5, speed=3.0, acceleration=20.0)
    turning = Joint(kind="revolute", d=0.3, a=0.4, limits=limits)
    slide = Joint(kind="prismatic", limits=attrs.evolve(limits, lower=0.0, upper=0.4))
    last = Joint(kind="revolute", limits=limits)
    scara = Arm(name="scara", joints=(turning, turning, slide, last), reach=0.8, tool_speed=1.0)
    q = np.array([0.3, 0.5, 0.2, 0.1])
    X = forward(scara, [q, q])
    X[1, :3, :3] = X[0, :3, :3] @ rotation_from_vector((0.0, 1.0, 0.0))

    with pytest.raises(
        PathError, match=r"'scara', an arm of 4 joints, cannot turn its tool to the pose: .* deg away"
    ) as stopped:
        cartesian_move(scara, X, near=q)

    assert stopped.value.cause == "reach"
