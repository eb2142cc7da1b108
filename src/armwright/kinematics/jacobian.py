"""The Jacobian: how fast the tool moves and turns for given joint speeds."""

from collections.abc import Sequence
from typing import Literal

from armwright.arm.model import Arm
from armwright.arrays import Array, ArrayLike, joint_array
from armwright.errors import InvalidValueError
from armwright.kinematics.forward import link_frames, per_joint, stack, tool_frame
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Vector, apply, cross, subtract, transpose


def jacobian_columns(arm: Arm, q: Sequence[Scalar]) -> list[Vector]:
    """Return n columns of six, over abstract scalars: speed of the tool point, then angular speed, base axes.

    A joint acts along or about the z axis of the frame before it.

    Source:
        Whitney (1972).
    """
    frames = link_frames(arm, q)
    _, p_tool = tool_frame(arm, frames[-1])
    columns = []
    for joint, (R, p) in zip(arm.joints, frames[:-1], strict=True):
        z = [row[2] for row in R]
        columns.append([*cross(z, subtract(p_tool, p)), *z] if joint.revolute else [*z, 0.0, 0.0, 0.0])
    return columns


def jacobian(arm: Arm, q: ArrayLike, frame: Literal["base", "tool"] = "base") -> Array:
    """Return the geometric Jacobian of the tool point.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        frame: whose axes the rows are seen along; the point is the tool point in both.

    Returns:
        (..., 6, n): rows 0-2 linear [m/s per joint speed], rows 3-5 angular [rad/s per joint speed].

    Raises:
        ShapeError: the last axis of ``q`` is not n long.
        InvalidValueError: ``frame`` is neither ``base`` nor ``tool``.
    """
    if frame not in ("base", "tool"):
        raise InvalidValueError(f"frame: expected 'base' or 'tool', got {frame!r}")
    q = joint_array(q, arm.n)
    scalars = per_joint(q)
    columns = jacobian_columns(arm, scalars)
    if frame == "tool":
        R_BT, _ = tool_frame(arm, link_frames(arm, scalars)[-1])
        R_TB = transpose(R_BT)
        columns = [apply(R_TB, column[:3]) + apply(R_TB, column[3:]) for column in columns]
    rows = [column[i] for i in range(6) for column in columns]
    return stack(rows, q.shape[:-1]).reshape(*q.shape[:-1], 6, arm.n)
