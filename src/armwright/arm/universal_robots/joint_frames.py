"""Frames of the joints of an arm, which may slide along the axes of their joints and rotate about them.

The pose of the tool is base X_0 R(q_1) X_1 R(q_2) ... R(q_n) X_n tool, R being the rotation of a joint about z. A shift
along z and a rotation about z commute with R: what one X gains behind it, the next one may lose before it. So the same
arm has many tables, and three of them are of use here:

- ``with_near_frames`` keeps each frame next to its nominal one, where masses and solids are described.
- ``with_table`` is in the convention of Denavit and Hartenberg. Axes that are parallel but for a milliradian have their
  common normal hundreds of metres away, so that two numbers d of hundreds of metres cancel, as in the files of robots.
- ``description_frames`` is that of the robot description of ROS, which pulls the long links back to where they are.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import attrs
import numpy as np

from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.spatial.poses import homogeneous, inverse_pose
from armwright.spatial.rotations import elementary_rotation

# Sine of the angle between axes below which they are parallel: a normal farther away costs as much as it is worth.
_PARALLEL = 1e-8
# A frame that is as near its nominal one is that one [m] and [rad].
_ROUNDING = 1e-15


def joint_transforms(arm: Arm, tilts: Sequence[float] | None = None) -> Array:
    """Return (n, 4, 4) what follows the rotation of each joint, up to that of the next.

    Args:
        arm: the arm, with n revolute joints.
        tilts: n rotations about y behind the rows of its table [rad]; none when left out.
    """
    angles = [0.0] * arm.n if tilts is None else tilts
    return np.array(
        [
            _screw(joint.theta, joint.d) @ joint.behind @ homogeneous(elementary_rotation(1, tilt), np.zeros(3))
            for joint, tilt in zip(arm.joints, angles, strict=True)
        ]
    )


def with_near_frames(nominal: Arm, transforms: Array) -> Arm:
    """Return an arm with other geometry, each frame as near its nominal one as it can be.

    Args:
        nominal: the arm, with n revolute joints; what is described in its frames is kept as it is.
        transforms: (n + 1, 4, 4) what stands before the rotation of the first joint, and behind that of each joint.
    """
    targets = [np.eye(4), *joint_transforms(nominal)]
    placed: list[Array] = []
    rest: Array = np.eye(4)
    for transform, target in zip(transforms, targets, strict=True):
        X = rest @ transform
        is_last = len(placed) == nominal.n
        E = target[:3, :3].T @ X[:3, :3]
        turn = math.atan2(E[0, 1] - E[1, 0], E[0, 0] + E[1, 1])
        shift = _screw(0.0 if is_last else turn, 0.0 if is_last else float(X[:3, 2] @ (target[:3, 3] - X[:3, 3])))
        placed.append(X @ shift)
        rest = inverse_pose(shift)
    joints = [
        joint if np.allclose(X, target, rtol=0, atol=_ROUNDING) else _fixed_joint(joint, X)
        for joint, X, target in zip(nominal.joints, placed[1:], targets[1:], strict=True)
    ]
    return attrs.evolve(nominal, joints=joints, base=nominal.base @ placed[0])


def with_table(nominal: Arm, transforms: Array) -> Arm:
    """Return an arm with other geometry as a table of Denavit and Hartenberg; its last row has neither a nor alpha.

    What the table has no numbers for is part of its tool. Masses and solids are not of its frames.

    Args:
        nominal: the arm, with n revolute joints; of two common normals the one nearer to its own counts.
        transforms: (n, 4, 4) what follows the rotation of each joint.
    """
    joints: list[Joint] = []
    rest: Array = np.eye(4)
    for joint, M in zip(nominal.joints, transforms, strict=True):
        X = rest @ M
        if len(joints) + 1 < nominal.n:
            row = _table_row(joint, X)
        else:
            theta = math.atan2(X[1, 0] - X[0, 1], X[0, 0] + X[1, 1])
            row = attrs.evolve(joint, theta=theta, d=float(X[2, 3]), a=0.0, alpha=0.0, fixed=None)
        joints.append(row)
        rest = inverse_pose(_screw(row.theta, row.d) @ row.behind) @ X
    return attrs.evolve(nominal, joints=joints, tool=rest @ nominal.tool)


def description_frames(table: Arm) -> Array:
    """Return (n, 4, 4) the frame of each joint in that of the joint before, as the robot description of ROS has them.

    Upper arm and forearm begin at their joints, with their x axes towards the joints behind them.

    Args:
        table: an arm of n = 6 rows, the last of which has neither a nor alpha.

    Source:
        ``ur_calibration`` of Universal_Robots_ROS2_Driver, ``doc/algorithm.rst``.
    """
    screws = [(joint.theta, joint.d) for joint in table.joints]
    behind = [joint.behind for joint in table.joints]
    for i in (1, 2):
        theta, d = screws[i]
        if d == 0.0:
            continue
        X = _screw(theta, d) @ behind[i]
        # Where the next axis meets the plane z = 0 of this joint.
        along = -X[2, 3] / X[2, 2]
        x, y, _ = X[:3, 3] + along * X[:3, 2]
        turned = math.atan2(-y, -x)
        screws[i], screws[i + 1] = (turned, 0.0), (screws[i + 1][0], screws[i + 1][1] - along)
        R = elementary_rotation(2, theta - turned) @ behind[i][:3, :3]
        behind[i] = homogeneous(R, (-math.hypot(x, y), 0.0, 0.0))
    before = [np.eye(4), *behind[:-1]]
    return np.array([X @ _screw(theta, d) for X, (theta, d) in zip(before, screws, strict=True)])


def _table_row(nominal: Joint, X: Array) -> Joint:
    """Return the row whose x axis is a common normal of z and the z axis of a pose (4, 4)."""
    zx, zy, zz = X[:3, 2].tolist()
    x, y, z = X[:3, 3].tolist()
    sine = math.hypot(zx, zy)
    if sine < _PARALLEL:
        a = math.copysign(math.hypot(x, y), nominal.a or 1.0)
        theta = math.atan2(y / a, x / a) if a else nominal.theta
        return attrs.evolve(nominal, theta=theta, d=nominal.d, a=a, alpha=math.atan2(0.0, zz), fixed=None)
    theta = math.atan2(zx, -zy)
    # The other end of the common normal is as good: where the axes cross, the twist tells, elsewhere the angle.
    crosses = abs(math.sin(nominal.alpha)) > 0.5
    if nominal.alpha < 0 if crosses else math.cos(theta - nominal.theta) < 0:
        theta, sine = math.atan2(-zx, zy), -sine
    c, s = math.cos(theta), math.sin(theta)
    along = (y * c - x * s) / sine
    alpha = math.atan2(sine, zz)
    return attrs.evolve(nominal, theta=theta, d=z + along * zz, a=x * c + y * s, alpha=alpha, fixed=None)


def _fixed_joint(joint: Joint, X: Array) -> Joint:
    return attrs.evolve(joint, theta=0.0, d=0.0, a=0.0, alpha=0.0, fixed=X)


def _screw(angle: float, shift: float) -> Array:
    """Return the pose (4, 4) of a rotation about z and a shift along it."""
    return homogeneous(elementary_rotation(2, angle), (0.0, 0.0, shift))
