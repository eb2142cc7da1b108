"""The Jacobian: the linear and angular velocity of the tool for joint speeds, and its derivative along a motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypeAlias

import numpy as np

from armwright.arm.model import Arm
from armwright.arm.positions import positions
from armwright.arrays import Array, ArrayLike, broadcast_rows, joint_array
from armwright.errors import InvalidValueError, shown
from armwright.kinematics.forward_kinematics import link_frames, per_joint, stack, tool_frame
from armwright.tracing.scalar import Scalar
from armwright.tracing.vectors import Matrix, Vector, add, apply, cross, scale, subtract, transpose

Axes: TypeAlias = Literal["base", "tool"]


def jacobian_columns(arm: Arm, q: Sequence[Scalar]) -> list[Vector]:
    """Return n columns of six, over abstract scalars: speed of the tool point, then angular speed, base axes.

    A joint acts along or about the z axis of the frame before it.

    Source:
        Whitney (1972).
    """
    frames = link_frames(arm, q)
    return frame_columns(arm, frames, tool_frame(arm, frames[-1])[1])


def tool_columns(arm: Arm, q: Sequence[Scalar]) -> list[Vector]:
    """Return the columns of ``jacobian_columns`` along the axes of the tool, over abstract scalars."""
    R_TB = _base_rotation_in_tool(arm, q)
    return [_rotated(R_TB, column) for column in jacobian_columns(arm, q)]


def frame_columns(arm: Arm, frames: Sequence[tuple[Matrix, Vector]], p_tool: Vector) -> list[Vector]:
    """Return the columns of ``jacobian_columns``, given the frames 0 to n and the tool point."""
    columns = []
    for joint, (R, p) in zip(arm.joints, frames[:-1], strict=True):
        z = [row[2] for row in R]
        columns.append([*cross(z, subtract(p_tool, p)), *z] if joint.revolute else [*z, 0.0, 0.0, 0.0])
    return columns


def jacobian_rate_columns(arm: Arm, q: Sequence[Scalar], qd: Sequence[Scalar]) -> list[Vector]:
    """Return the time derivatives of the n columns of ``jacobian_columns``, over abstract scalars, base axes.

    The axis of joint i is carried by link i-1, so it rotates with that link; the lever from the joint to the tool
    changes with the speeds of its two ends.

    Source:
        The columns of Whitney (1972), differentiated.
    """
    frames = link_frames(arm, q)
    _, p_tool = tool_frame(arm, frames[-1])
    # The speed of the origin of frame i-1 and the angular speed of its link; then, of each joint, its axis, its lever
    # to the tool and those two.
    v: Vector = [0.0, 0.0, 0.0]
    w: Vector = [0.0, 0.0, 0.0]
    motions = []
    for joint, rate, (R, p), (_, p_next) in zip(arm.joints, qd, frames[:-1], frames[1:], strict=True):
        z = [row[2] for row in R]
        motions.append((z, subtract(p_tool, p), w, v))
        if joint.revolute:
            w = add(w, scale(rate, z))
            v = add(v, cross(w, subtract(p_next, p)))
        else:
            v = add(v, cross(w, subtract(p_next, p)), scale(rate, z))
    v_tool = add(v, cross(w, subtract(p_tool, frames[-1][1])))
    columns = []
    for joint, (z, lever, w_joint, v_joint) in zip(arm.joints, motions, strict=True):
        z_rate = cross(w_joint, z)
        if joint.revolute:
            columns.append([*add(cross(z_rate, lever), cross(z, subtract(v_tool, v_joint))), *z_rate])
        else:
            columns.append([*z_rate, 0.0, 0.0, 0.0])
    return columns


def jacobian(arm: Arm, q: ArrayLike, frame: Axes = "base") -> Array:
    """Return the geometric Jacobian of the tool point.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        frame: whose axes the rows are seen along; the point is the tool point in both.

    Returns:
        (..., 6, n): rows 0-2 linear [m/s per joint speed], rows 3-5 angular [rad/s per joint speed].

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: the last axis of ``q`` is not n long.
        InvalidValueError: a number is NaN or infinite, or ``frame`` is neither ``base`` nor ``tool``.

    Source:
        Whitney (1972).
    """
    known_axes(frame)
    q = positions(arm, q)
    scalars = per_joint(q)
    columns = tool_columns(arm, scalars) if frame == "tool" else jacobian_columns(arm, scalars)
    return _stack_columns(columns, q.shape[:-1])


def jacobian_rate(arm: Arm, q: ArrayLike, qd: ArrayLike, frame: Axes = "base") -> Array:
    """Return the time derivative of the geometric Jacobian of the tool point.

    With it the acceleration of the tool is J(q) qdd + J_rate(q, qd) qd; in tool axes that is the rate of change of
    the components, as an observer on the tool sees them.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint speeds [rad/s] or [m/s].
        frame: whose axes the rows are seen along; the point is the tool point in both.

    Returns:
        (..., 6, n): rows 0-2 linear, rows 3-5 angular, per second.

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: the last axis of ``q`` or ``qd`` is not n long, or their leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite, or ``frame`` is neither ``base`` nor ``tool``.

    Source:
        The Jacobian of Whitney (1972), differentiated; tool axes by d/dt (Rᵀ x) = Rᵀ (dx/dt - w × x).
    """
    known_axes(frame)
    q, qd = broadcast_rows("q, qd", positions(arm, q), joint_array(qd, arm.n, "qd"))
    scalars, rates = per_joint(q), per_joint(qd)
    columns = jacobian_rate_columns(arm, scalars, rates)
    if frame == "tool":
        own = jacobian_columns(arm, scalars)
        w = add(*(scale(rate, column[3:]) for rate, column in zip(rates, own, strict=True)))
        R_TB = _base_rotation_in_tool(arm, scalars)
        columns = [
            _rotated(R_TB, subtract(column, [*cross(w, still[:3]), *cross(w, still[3:])]))
            for column, still in zip(columns, own, strict=True)
        ]
    return _stack_columns(columns, q.shape[:-1])


def tool_twist(arm: Arm, q: ArrayLike, qd: ArrayLike, frame: Axes = "base") -> Array:
    """Return the linear and angular velocity of the tool.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].
        qd: (..., n) joint speeds [rad/s] or [m/s].
        frame: whose axes it is seen along; the point is the tool point in both.

    Returns:
        (..., 6): speed of the tool point [m/s], then angular speed [rad/s].

    Raises:
        KindError: ``arm`` is no arm, or an array is something else than real numbers.
        ShapeError: the last axis of ``q`` or ``qd`` is not n long, or their leading axes do not fit together.
        InvalidValueError: a number is NaN or infinite, or ``frame`` is neither ``base`` nor ``tool``.
    """
    known_axes(frame)
    q, qd = broadcast_rows("q, qd", positions(arm, q), joint_array(qd, arm.n, "qd"))
    return np.asarray((jacobian(arm, q, frame) @ qd[..., None])[..., 0])


def known_axes(frame: str) -> None:
    """Refuse axes that are neither the base's nor the tool's.

    Raises:
        InvalidValueError: they are not.
    """
    if not isinstance(frame, str) or frame not in {"base", "tool"}:
        raise InvalidValueError(f"frame: expected 'base' or 'tool', got {shown(frame)}")


def _base_rotation_in_tool(arm: Arm, q: Sequence[Scalar]) -> Matrix:
    R_BT, _ = tool_frame(arm, link_frames(arm, q)[-1])
    return transpose(R_BT)


def _rotated(R: Matrix, column: Vector) -> Vector:
    return apply(R, column[:3]) + apply(R, column[3:])


def _stack_columns(columns: Sequence[Vector], lead: tuple[int, ...]) -> Array:
    rows = [column[i] for i in range(6) for column in columns]
    return stack(rows, lead).reshape(*lead, 6, len(columns))
