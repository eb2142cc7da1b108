"""The configuration of an arm with a wrist of three axes in one point, in the words of its controller."""

import math
from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.export.conventions import ControllerArm
from armwright.kinematics.forward_kinematics import link_poses

# Angles this near zero [rad], and distances this small [m], count as zero.
_ROUNDING = 1e-8


class Posture(NamedTuple):
    """What distinguishes the configurations that reach one pose.

    Attributes:
        behind: whether the wrist centre is behind axis 1, on the side away from where the arm looks.
        bend: angle of the forearm with the upper arm [rad], positive as joint 3 turns.
        angles: (6,) joint positions as the controller counts them [deg], small ones being 0.
    """

    behind: bool
    bend: float
    angles: list[float]


def posture(mapped: ControllerArm, q: Array) -> Posture:
    """Return the posture of an arm at joint positions (6,)."""
    frames = link_poses(mapped.arm, q)
    wrist = _common_point(frames[3], frames[4])
    front = frames[1, :3, :3] @ mapped.front
    upper, fore = frames[2, :3, 3] - frames[1, :3, 3], wrist - frames[2, :3, 3]
    axis = frames[2, :3, 2] * mapped.signs[2]
    upper, fore = upper - axis * (axis @ upper), fore - axis * (axis @ fore)
    shown = mapped.joints(q)
    return Posture(
        behind=bool(front @ (wrist - frames[0, :3, 3]) < -_ROUNDING),
        bend=math.atan2(axis @ np.cross(upper, fore), upper @ fore),
        angles=[0.0 if abs(angle) < _ROUNDING else math.degrees(angle) for angle in shown],
    )


def status_and_turn(mapped: ControllerArm, q: Array) -> tuple[int, int]:
    """Return the status S and the turn T of KRL at joint positions (6,)."""
    behind, bend, angles = posture(mapped, q)
    flipped = angles[4] < 0 if abs(angles[4]) < 180 else angles[4] > 0
    status = behind + 2 * (bend > _ROUNDING) + 4 * flipped
    return status, sum(1 << i for i, angle in enumerate(angles) if angle < 0)


def confdata(mapped: ControllerArm, q: Array) -> tuple[int, int, int, int]:
    """Return cf1, cf4, cf6 and cfx of RAPID at joint positions (6,)."""
    behind, bend, angles = posture(mapped, q)
    quadrants = [math.floor(angles[i] / 90.0) for i in (0, 3, 5)]
    return quadrants[0], quadrants[1], quadrants[2], 4 * behind + 2 * (bend < -_ROUNDING) + (angles[4] < 0)


def _common_point(first: Array, second: Array) -> Array:
    """Return the point (3,) of the z axis of a frame (4, 4) that is nearest to that of another."""
    a, b = first[:3, 2], second[:3, 2]
    apart = second[:3, 3] - first[:3, 3]
    cosine = a @ b
    along = (apart @ a * cosine - apart @ b) / (1.0 - cosine * cosine)
    return np.asarray(second[:3, 3] + along * b)
