"""Forward kinematics: the pose of every link and of the tool."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armwright.arm.model import Arm, Joint
from armwright.arm.positions import positions
from armwright.arrays import Array, ArrayLike
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import exact_cosine, exact_sine
from armwright.tracing.scalar import Scalar, cos, sin
from armwright.tracing.vectors import Matrix, Vector, add, apply, product


def link_transform(joint: Joint, q: Scalar) -> tuple[Matrix, Vector]:
    """Return rotation and position of frame i seen from frame i-1, over abstract scalars.

    Source:
        Denavit & Hartenberg (1955); TR-83-008 eq. (3), whose fourth column strayed into the rotation.
    """
    if joint.revolute:
        c, s, d = cos(joint.theta + q), sin(joint.theta + q), joint.d
    else:
        c, s, d = exact_cosine(joint.theta), exact_sine(joint.theta), joint.d + q
    if joint.fixed is not None:
        x, y, z, _ = joint.behind.tolist()
        rows = [[c * a - s * b for a, b in zip(x, y, strict=True)], [s * a + c * b for a, b in zip(x, y, strict=True)]]
        return [*(row[:3] for row in rows), z[:3]], [rows[0][3], rows[1][3], d + z[3]]
    ca, sa = exact_cosine(joint.alpha), exact_sine(joint.alpha)
    return [[c, -s * ca, s * sa], [s, c * ca, -c * sa], [0.0, sa, ca]], [joint.a * c, joint.a * s, d]


def link_frames(arm: Arm, q: Sequence[Scalar]) -> list[tuple[Matrix, Vector]]:
    """Return rotation and position of frames 0 to n seen from the base, over abstract scalars.

    Args:
        arm: the arm, with n joints.
        q: joint positions, at most n; the frames of the first ``len(q)`` links come back.
    """
    R: Matrix = arm.base[:3, :3].tolist()
    p: Vector = arm.base[:3, 3].tolist()
    frames = [(R, p)]
    for joint, position in zip(arm.joints[: len(q)], q, strict=True):
        R_link, p_link = link_transform(joint, position)
        p = add(p, apply(R, p_link))
        R = product(R, R_link)
        frames.append((R, p))
    return frames


def tool_frame(arm: Arm, frame: tuple[Matrix, Vector]) -> tuple[Matrix, Vector]:
    """Return rotation and position of the tool, given those of the last link, over abstract scalars."""
    R, p = frame
    return product(R, arm.tool[:3, :3].tolist()), add(p, apply(R, arm.tool[:3, 3].tolist()))


def forward(arm: Arm, q: ArrayLike) -> Array:
    """Return the tool pose in the base frame.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].

    Returns:
        X_BT: (..., 4, 4) homogeneous poses, translations in [m].

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        ShapeError: the last axis of ``q`` is not n long.
        InvalidValueError: a number is NaN or infinite.

    Source:
        Denavit & Hartenberg (1955); TR-83-008 eq. (2).
    """
    q = positions(arm, q)
    return _stack_pose(tool_frame(arm, link_frames(arm, per_joint(q))[-1]), q.shape[:-1])


def link_poses(arm: Arm, q: ArrayLike) -> Array:
    """Return the poses of frames 0 to n, and last of the tool, in the base frame.

    Args:
        arm: the arm, with n joints.
        q: (..., n) joint positions [rad] or [m].

    Returns:
        (..., n + 2, 4, 4) homogeneous poses, translations in [m].

    Raises:
        KindError: ``arm`` is no arm, or ``q`` something else than real numbers.
        ShapeError: the last axis of ``q`` is not n long.
        InvalidValueError: a number is NaN or infinite.
    """
    q = positions(arm, q)
    frames = link_frames(arm, per_joint(q))
    frames.append(tool_frame(arm, frames[-1]))
    return np.stack([_stack_pose(frame, q.shape[:-1]) for frame in frames], axis=-3)


def per_joint(q: Array) -> list[Scalar]:
    """Take (..., n) apart into n scalars: floats for one configuration, arrays of shape (...) for many."""
    return q.tolist() if q.ndim == 1 else list(np.moveaxis(q, -1, 0))


def stack(scalars: Sequence[Scalar], lead: tuple[int, ...]) -> Array:
    """Put k scalars back together to (..., k)."""
    return np.stack([np.broadcast_to(np.asarray(x, dtype=np.float64), lead) for x in scalars], axis=-1)


def _stack_pose(frame: tuple[Matrix, Vector], lead: tuple[int, ...]) -> Array:
    R, p = frame
    return homogeneous(stack([x for row in R for x in row], lead).reshape(*lead, 3, 3), stack(p, lead))
