"""Joints that have names are called by them, wherever a motion says which joint it is about."""

import re

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.motion.certificate import slower
from armwright.motion.detour import line_or_detour
from armwright.motion.obstruction import PathError, too_fast
from armwright.motion.plan import Obstacle
from armwright.motion.quintic_polynomials import point_to_point
from armwright.motion.straight import straight_line
from armwright.motion.time_optimal_path import time_optimal
from armwright.program.vm.move_diagnostics import obstacle_message
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector

NAMES = ("waist", "shoulder", "elbow", "roll", "bend", "flange")
CALLED = re.compile(r"joint (\d)( \('(\w+)'\))?")


def named(name: str) -> Arm:
    """Return an arm of the catalogue whose joints have names."""
    arm = load_arm(name)
    return attrs.evolve(arm, joints=[attrs.evolve(one, name=two) for one, two in zip(arm.joints, NAMES, strict=True)])


def all_called(text: str) -> bool:
    """Whether a text speaks of joints, each with its number and its name."""
    found = CALLED.findall(text)
    return bool(found) and all(name == NAMES[int(number) - 1] for number, _, name in found)


PUMA = named("puma560-seed")
Q = np.array([0.0, 0.3, 0.2, 0.0, 0.8, 0.0])


def test_certificate() -> None:
    """Which joint comes nearest to a limit, and for which one a line is slowed."""
    X = forward(PUMA, Q).copy()
    X[:3, 3] += (0.0, 0.05, 0.05)

    line = straight_line(PUMA, Q, X, speed=120)

    assert all_called(str(line.certificate))
    assert slower(PUMA, 2.0, ("effort", 2)) == "2.00 times slower, limited by the effort of joint 3 ('elbow')"
    assert slower(load_arm("ur5"), 2.0, ("speed", 0)) == "2.00 times slower, limited by the speed of joint 1"


def test_what_stops_a_line() -> None:
    """A limit on a line, and a joint that would have to rush at a singularity."""
    beyond = forward(PUMA, [2.9, 0.3, 0.2, 0.0, 0.8, 0.0])
    with pytest.raises(PathError) as limits:
        straight_line(PUMA, [2.7, 0.3, 0.2, 0.0, 0.8, 0.0], beyond)
    # The wrist is nearly straight half way: the tool turns from one side to the other, beside it by a milliradian.
    straight = forward(PUMA, [0.0, 0.3, 0.2, 0.0, 0.0, 0.0])
    start, goal = (
        straight
        @ homogeneous(rotation_from_vector(np.array([turn, 0.0, 0.0])), np.array([turn / 10, 0.0, 0.0]))
        @ homogeneous(rotation_from_vector(np.array([0.0, 1e-3, 0.0])), np.zeros(3))
        for turn in (0.3, -0.3)
    )
    with pytest.raises(PathError) as singular:
        straight_line(PUMA, inverse(PUMA, start).best.q, goal)

    assert (limits.value.cause, singular.value.cause) == ("limits", "singular")
    assert all_called(str(limits.value))
    assert all_called(str(singular.value))
    assert too_fast(PUMA, 5, 70) == "joint 5 ('bend') would have to move 70 times as fast as its limit"


def test_detour() -> None:
    """What stopped a line that is gone round."""
    beyond = forward(PUMA, [2.9, 0.3, 0.2, 0.0, 0.8, 0.0])
    with pytest.raises(PathError) as error:
        line_or_detour(PUMA, [2.7, 0.3, 0.2, 0.0, 0.8, 0.0], beyond, method="damped")

    assert all_called(str(error.value))


def test_time_optimal() -> None:
    """Which joint binds for which part of the time."""
    run = time_optimal(PUMA, point_to_point(PUMA, Q, Q + 0.3))

    assert all_called(str(run))


def test_program() -> None:
    """What stops a MOVE of a program."""
    obstacle = Obstacle(
        cause="limits", reason="", joint=3, pose=0, fraction=0.5, length=0.2, place=np.zeros(3), certain=False
    )

    message = obstacle_message(obstacle, "f", "ARM_1", PUMA)
    assert message == "the path to `f` leads joint 3 ('elbow') of ARM_1 beyond its limits"
