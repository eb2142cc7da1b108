"""Which closed form fits an arm, read from its joint axes as lines in space.

Two tables of Denavit-Hartenberg numbers may describe one arm: twists of the other sign, angles counted from
elsewhere, frames slid along parallel axes. The lines are the same.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.kinematics.inverse_kinematics.axes import (
    SAME,
    Axes,
    are_parallel,
    are_perpendicular,
    joint_axes,
    meeting,
)
from armwright.kinematics.inverse_kinematics.geometry import ClosedFormGeometry, Family, rotated_about_y
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import nearest_rotation

# From a frame whose z, y, z turns the last three joints of a spherical wrist are, to one whose y, z, y turns those of
# three parallel axes are: z and y change places, x turns round.
_SWAP = np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]])


@lru_cache(maxsize=64)  # asked for at every solve, and an arm does not change
def find_geometry(arm: Arm) -> ClosedFormGeometry | None:
    """Return the build of an arm that has a closed-form inverse, or None.

    Six joints, the first a revolute joint at a right angle to the axis of the second, and then one of

    - ``puma``: joint 3 parallel to joint 2; joints 4 to 6 a spherical wrist;
    - ``stanford``: joint 3 a slide at a right angle to the axis of joint 2; joints 4 to 6 a spherical wrist;
    - ``parallel``: joints 2 to 4 parallel, joint 5 at a right angle to them, joint 6 meeting joint 5 at a right angle.

    A spherical wrist is three axes that meet in one point, the middle one at a right angle to both others. Nothing
    else matters: not the signs of the twists, nor where joint angles count from, nor an offset of the shoulder from
    the first axis, nor the direction of the forearm, nor base and tool.

    Args:
        arm: any arm.
    """
    return geometry_of(joint_axes(arm)) if arm.n == 6 else None


def geometry_of(axes: Axes) -> ClosedFormGeometry | None:
    """Return the build that six joint axes have, as ``find_geometry`` does of an arm."""
    w = axes.directions
    if axes.kinds not in ("RRRRRR", "RRPRRR") or not are_perpendicular(w[0], w[1]) or not are_perpendicular(w[4], w[5]):
        return None
    if (wrist := _wrist_centre(axes)) is not None:
        if axes.kinds == "RRPRRR":
            return _with_slide(axes, wrist) if are_perpendicular(w[1], w[2]) else None
        if are_parallel(w[1], w[2]):
            return _with_elbow(axes, wrist)
    three = axes.kinds == "RRRRRR" and are_parallel(w[1], w[2]) and are_parallel(w[1], w[3])
    if three and are_perpendicular(w[3], w[4]):
        crossing = meeting(axes.points[4], w[4], axes.points[5], w[5])
        return None if crossing is None else _with_parallel_axes(axes, crossing)
    return None


def _wrist_centre(axes: Axes) -> Array | None:
    p, w = axes.points, axes.directions
    if not are_perpendicular(w[3], w[4]):
        return None
    centre = meeting(p[3], w[3], p[4], w[4])
    if centre is None or float(np.linalg.norm(np.cross(p[5] - centre, w[5]))) > SAME:
        return None
    return centre


class _ShoulderView:
    """The axes seen from the shoulder frame of an arm whose wrist centre is at ``centre``."""

    def __init__(self, axes: Axes, centre: Array) -> None:
        p, z, y = axes.points, axes.directions[0], axes.directions[1]
        origin = p[0] + z * float((p[1] - p[0]) @ z)
        if float((centre - origin) @ y) < -SAME:
            y = -y
        R = nearest_rotation(np.stack([np.cross(y, z), y, z], axis=-1))
        self.X_BS = homogeneous(R, origin)
        self.points = (p - origin) @ R
        self.directions = axes.directions @ R
        self.centre = (centre - origin) @ R
        self.shoulder_offset, self.plane_offset = float(self.points[1, 0]), float(self.centre[1])
        self.R_TS = axes.X_BT[:3, :3].T @ R
        self.p_TW = axes.X_BT[:3, :3].T @ (centre - axes.X_BT[:3, 3])

    def segment(self, start: Array, end: Array) -> tuple[float, float]:
        """Return (x, z) from one point to another, seen along y."""
        x, _, z = end - start
        return float(x), float(z)

    def sign(self, joint: int) -> float:
        """Say whether an axis parallel to y points along it."""
        return math.copysign(1.0, float(self.directions[joint - 1, 1]))

    def geometry(self, family: Family, *, R_SW: Array, **lengths_and_angles: Any) -> ClosedFormGeometry:
        """Put the geometry together; ``R_SW`` is the last frame of the wrist at joint positions 0."""
        return ClosedFormGeometry(
            family=family,
            X_BS=self.X_BS,
            shoulder_offset=self.shoulder_offset,
            plane_offset=self.plane_offset,
            R_T6=nearest_rotation(self.R_TS @ R_SW),
            p_TW=self.p_TW,
            **lengths_and_angles,
        )


def _with_elbow(axes: Axes, wrist: Array) -> ClosedFormGeometry | None:
    view = _ShoulderView(axes, wrist)
    upper = view.segment(view.points[1], view.points[2])
    fore = view.segment(view.points[2], view.centre)
    if min(math.hypot(*upper), math.hypot(*fore)) < SAME:
        return None
    raised = _heading(*upper)
    axis_4 = view.directions[3]
    # The forearm's own z is the axis of joint 4, where that stays in the plane of the arm.
    flat = abs(float(axis_4[1])) < SAME
    folded = math.atan2(axis_4[0], axis_4[2]) if flat else raised
    R_3W, offset_4, offset_5, R_SW = _wrist(view, folded, flat)
    return view.geometry(
        "puma",
        signs=(1, view.sign(2), view.sign(3), 1, 1, 1),
        offsets=(0, raised, folded - raised, offset_4, offset_5, 0),
        upper_arm=math.hypot(*upper),
        forearm=tuple(map(float, rotated_about_y(-folded, *fore))),
        R_3W=R_3W,
        R_SW=R_SW,
    )


def _with_slide(axes: Axes, wrist: Array) -> ClosedFormGeometry:
    view = _ShoulderView(axes, wrist)
    along = view.directions[2]
    raised = math.atan2(along[0], along[2])
    beside, length = rotated_about_y(-raised, *view.segment(view.points[1], view.centre))
    R_3W, offset_4, offset_5, R_SW = _wrist(view, raised, are_parallel(view.directions[3], along))
    return view.geometry(
        "stanford",
        signs=(1, view.sign(2), 1, 1, 1, 1),
        offsets=(0, raised, length, offset_4, offset_5, 0),
        forearm=(float(beside) if abs(beside) > SAME else 0.0, 0.0),
        R_3W=R_3W,
        R_SW=R_SW,
    )


def _with_parallel_axes(axes: Axes, crossing: Array) -> ClosedFormGeometry | None:
    view = _ShoulderView(axes, crossing)
    upper = view.segment(view.points[1], view.points[2])
    fore = view.segment(view.points[2], view.points[3])
    if min(math.hypot(*upper), math.hypot(*fore)) < SAME:
        return None
    raised, folded = _heading(*upper), _heading(*fore)
    axis_5 = view.directions[4]
    y = np.array((0.0, 1.0, 0.0))
    A = np.stack([np.cross(y, axis_5), y, axis_5], axis=-1)
    across, along, _ = A.T @ view.directions[5]
    offset_5 = math.atan2(-across, along)
    return view.geometry(
        "parallel",
        signs=(1, view.sign(2), view.sign(3), view.sign(4), 1, 1),
        offsets=(0, raised, folded - raised, -folded, offset_5, 0),
        upper_arm=math.hypot(*upper),
        forearm=(math.hypot(*fore), 0.0),
        wrist_link=view.segment(view.points[3], view.centre),
        tilt=math.atan2(axis_5[0], axis_5[2]),
        R_3W=_SWAP,
        R_SW=A @ _about_z(offset_5) @ _SWAP,
    )


def _wrist(view: _ShoulderView, raised: float, aligned: bool) -> tuple[Array, float, float, Array]:  # noqa: FBT001
    """Return the rotation from forearm to wrist, the offsets of joints 4 and 5, and the last wrist frame at zero.

    ``raised`` is the angle of the forearm from x, all joints at 0; ``aligned``: whether its z is the axis of joint 4.
    """
    axis_4, axis_5, axis_6 = view.directions[3:]
    forearm = _about_y(raised)
    A = forearm if aligned else np.stack([np.cross(axis_5, axis_4), axis_5, axis_4], axis=-1)
    x, y, _ = A.T @ axis_5
    offset_4 = math.atan2(-x, y)
    A_4 = A @ _about_z(offset_4)
    x, _, z = A_4.T @ axis_6
    offset_5 = math.atan2(x, z)
    R_3W = np.eye(3) if aligned else nearest_rotation(forearm.T @ A)
    return R_3W, offset_4, offset_5, A_4 @ _about_y(offset_5)


def _heading(x: float, z: float) -> float:
    """Return the rotation about y that brings the x axis onto (x, z)."""
    return math.atan2(-z, x)


def _about_y(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def _about_z(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
