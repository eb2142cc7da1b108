"""The joint axes of an arm as lines in space, and which of them are parallel or meet."""

from __future__ import annotations

import math

import attrs
import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import link_frames, tool_frame
from armwright.spatial.poses import homogeneous

# Lines this close to a right angle, to one direction or to one point are so: typed numbers multiplied a few times
# [rad] and [m].
SAME = 1e-10


@attrs.frozen(kw_only=True, eq=False)
class Axes:
    """The joint axes at joint positions 0, in the base frame.

    Attributes:
        kinds: one letter per joint, R or P.
        points: (n, 3) a point on each axis [m].
        directions: (n, 3) unit vectors.
        X_BT: (4, 4) the tool at joint positions 0.
    """

    kinds: str
    points: Array
    directions: Array
    X_BT: Array


def joint_axes(arm: Arm) -> Axes:
    """Return the joint axes of an arm at joint positions 0."""
    frames = link_frames(arm, [0.0] * arm.n)
    return Axes(
        kinds="".join("R" if joint.revolute else "P" for joint in arm.joints),
        points=np.array([p for _, p in frames[:-1]]),
        directions=np.array([[row[2] for row in R] for R, _ in frames[:-1]]),
        X_BT=homogeneous(*tool_frame(arm, frames[-1])),
    )


def are_parallel(u: Array, v: Array) -> bool:
    """Whether two unit vectors have one direction or opposite ones."""
    return float(np.linalg.norm(np.cross(u, v))) < SAME


def are_perpendicular(u: Array, v: Array) -> bool:
    """Whether two unit vectors are at a right angle."""
    return abs(float(u @ v)) < SAME


def meeting(p: Array, u: Array, q: Array, v: Array) -> Array | None:
    """Return the point (3,) where the line through p along u meets that through q along v; None where they do not.

    Parallel lines do not meet, not even when they are one.
    """
    normal = np.cross(u, v)
    square = float(normal @ normal)
    if math.sqrt(square) < SAME or abs(float((q - p) @ normal)) > SAME * math.sqrt(square):
        return None
    return np.asarray(p + u * (np.cross(q - p, v) @ normal) / square)
