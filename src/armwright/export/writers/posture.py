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


def postures(mapped: ControllerArm, q: Array) -> list[Posture]:
    """Return the postures of an arm at k joint positions (k, 6)."""
    frames = link_poses(mapped.arm, q)
    wrists = _common_points(frames[:, 3], frames[:, 4])
    ahead = _along(frames[:, 1, :3, :3] @ mapped.front, wrists - frames[:, 0, :3, 3])
    upper, fore = frames[:, 2, :3, 3] - frames[:, 1, :3, 3], wrists - frames[:, 2, :3, 3]
    axes = frames[:, 2, :3, 2] * mapped.signs[2]
    upper, fore = (link - axes * _along(axes, link)[:, None] for link in (upper, fore))
    bends = np.arctan2(_along(axes, np.cross(upper, fore)), _along(upper, fore))
    shown = mapped.joints(q)
    angles = np.where(np.abs(shown) < _ROUNDING, 0.0, np.degrees(shown))
    return [
        Posture(behind=bool(front < -_ROUNDING), bend=float(bend), angles=row)
        for front, bend, row in zip(ahead, bends, angles.tolist(), strict=True)
    ]


def status_and_turn(posture: Posture) -> tuple[int, int]:
    """Return the status S and the turn T of KRL."""
    behind, bend, angles = posture
    flipped = angles[4] < 0 if abs(angles[4]) < 180 else angles[4] > 0
    status = behind + 2 * (bend > _ROUNDING) + 4 * flipped
    return status, sum(1 << i for i, angle in enumerate(angles) if angle < 0)


def confdata(posture: Posture) -> tuple[int, int, int, int]:
    """Return cf1, cf4, cf6 and cfx of RAPID."""
    behind, bend, angles = posture
    quadrants = [math.floor(angles[i] / 90.0) for i in (0, 3, 5)]
    return quadrants[0], quadrants[1], quadrants[2], 4 * behind + 2 * (bend < -_ROUNDING) + (angles[4] < 0)


def _along(directions: Array, vectors: Array) -> Array:
    """Return the scalar products (k,) of vectors (k, 3)."""
    return np.asarray(np.einsum("ki,ki->k", directions, vectors))


def _common_points(first: Array, second: Array) -> Array:
    """Return the points (k, 3) of the z axes of frames (k, 4, 4) that are nearest to those of others."""
    a, b = first[:, :3, 2], second[:, :3, 2]
    apart = second[:, :3, 3] - first[:, :3, 3]
    cosine = _along(a, b)
    along = (_along(apart, a) * cosine - _along(apart, b)) / (1.0 - cosine * cosine)
    return np.asarray(second[:, :3, 3] + along[:, None] * b)
