"""Joint axes as a Denavit-Hartenberg table: frames are put where the convention wants them.

Frame i stands on the axis of joint i+1, where the common normal of the axes of the joints i and i+1 meets it. Two
parallel axes have any number of common normals: that through the origin the file gives to joint i+1 is taken.

Axes that are nearly parallel are the hard case. Their common normal is far away, 100 km for an angle of 1e-5 rad and
axes 1 m apart, and dynamics seen from there lose twice as many digits as the distance has. Where the convention would
put a frame farther from its joint than the arm is long, it stands at the joint instead, and the row has a fixed
transform in place of the four numbers. Nothing is bent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate

import attrs
import numpy as np

from armwright.arm.dh import carry, twist
from armwright.arm.model import Joint, Link
from armwright.arrays import Array
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.rotations import elementary_rotation

# Angles this close to a right one, and lengths this close to 0 beside the size of the arm, are so: typed numbers of
# twelve digits, multiplied a few times.
ROUNDING = 1e-11
# What a few products of rotations leave in place of a zero.
_NOISE = 1e-14
_RIGHT_ANGLE = math.pi / 2


@attrs.frozen(kw_only=True)
class Row:
    """A row of the table: the four numbers of one joint, at joint position 0, or a fixed transform (4, 4)."""

    theta: float = 0.0
    d: float = 0.0
    a: float = 0.0
    alpha: float = 0.0
    fixed: Array | None = None


@attrs.frozen(kw_only=True, eq=False)
class Frames:
    """The table of a chain of n joints, all joints at 0, in the frame in which the axes are given.

    Attributes:
        first: (4, 4) frame 0.
        rows: n rows.
        poses: n poses (4, 4) of the frames 1 to n.
        leaning: (n - 1) sine of the angle between the axes of the joints i and i+1; 0 where they are parallel.
    """

    first: Array
    rows: tuple[Row, ...]
    poses: tuple[Array, ...]
    leaning: tuple[float, ...]


def frames_of(joints: Sequence[Array], axes: Sequence[Array], X_BT: Array, size: float) -> Frames:
    """Return the frames of a chain of joint axes.

    The z axes point as the joint axes do, so joint positions keep their signs. The last frame is that of the tool where
    its z axis is on the last joint axis, as that of a flange is; else it is the one before it, moved by the last joint.

    Args:
        joints: n poses (4, 4) of frames on the axes.
        axes: n unit vectors (3,).
        X_BT: (4, 4) pose of the tool.
        size: of the arm; lengths are rounded beside it [m].

    Source:
        Denavit & Hartenberg (1955).
    """
    first = X = homogeneous(_first_rotation(joints[0][:3, :3], axes[0]), joints[0][:3, 3])
    rows, poses, leaning = [], [], []
    for joint, axis in zip(joints[1:], axes[1:], strict=True):
        row = _row(X, joint[:3, 3], axis, size * ROUNDING)
        behind = X @ homogeneous(elementary_rotation(2, row.theta), (0.0, 0.0, row.d)) @ twist(row.alpha, row.a)
        if np.linalg.norm(behind[:3, 3] - joint[:3, 3]) > size:
            behind = homogeneous(_rotation_on_axis(axis, X[:3, 2], joint[:3, :3]), joint[:3, 3])
            row = Row(fixed=cleared_pose(inverse(X) @ behind, size, _NOISE))
        lean = float(np.linalg.norm(np.cross(X[:3, 2], axis)))
        leaning.append(lean if lean > ROUNDING else 0.0)
        X = behind
        rows.append(row)
        poses.append(X)
    last = _row_to_tool(inverse(X) @ X_BT, size * ROUNDING)
    flange = X if last == Row() else X_BT
    return Frames(first=first, rows=(*rows, last), poses=(*poses, flange), leaning=tuple(leaning))


def dh_form(
    origins: Sequence[Array], axes: Sequence[Array], joints: Sequence[Joint], links: Sequence[Link], tool: Array
) -> tuple[Array, list[Joint], list[Link], Array]:
    """Turn joints that are given by their frames and axes, as in URDF, into the rows of a table.

    Args:
        origins: n poses (4, 4) of the frames of the joints, each in the frame before it, all joints at 0.
        axes: n unit vectors (3,), each in the frame of its joint.
        joints: n joints, without rows.
        links: n links in the frames of their joints.
        tool: (4, 4) pose of the tool in the last of these frames.

    Returns:
        The pose (4, 4) of frame 0, n joints, n links in the frames of the table, the tool (4, 4) in the last of them.
    """
    poses = list(accumulate(origins, np.matmul))
    X_BT = poses[-1] @ tool
    size = length_of(poses, X_BT)
    frames = frames_of(poses, [X[:3, :3] @ axis for X, axis in zip(poses, axes, strict=True)], X_BT, size)
    rows = [attrs.evolve(joint, **attrs.asdict(row)) for joint, row in zip(joints, frames.rows, strict=True)]
    steps = [cleared_pose(inverse(X) @ pose, size) for X, pose in zip(frames.poses, poses, strict=True)]
    carried = [
        carry(link, X) if link.mass else attrs.evolve(carry(link, X), com=np.zeros(3))
        for link, X in zip(links, steps, strict=True)
    ]
    return cleared_pose(frames.first, size), rows, carried, cleared_pose(steps[-1] @ tool, size)


def length_of(joints: Sequence[Array], X_BT: Array) -> float:
    """Return the distance of the farthest of the joints and the tip from the base; 1 m where all are at one point."""
    origins = np.array([*(X[:3, 3] for X in joints), X_BT[:3, 3]])
    return float(np.linalg.norm(origins, axis=-1).max()) or 1.0


def cleared(array: Array, size: float, rounding: float = ROUNDING) -> Array:
    """Return an array without the rounding that stands in place of zeros, beside numbers of some size."""
    return np.where(np.abs(array) <= size * rounding, 0.0, array)


def cleared_pose(X: Array, size: float, rounding: float = ROUNDING) -> Array:
    """Return a pose (4, 4) in which the zeros and ones of right angles, and lengths of 0, are exact.

    A cosine is one where nothing stands beside it: one near it says little, 1e-11 is that of 4e-6 rad.
    """
    R = cleared(X[:3, :3], 1.0, rounding)
    alone = np.count_nonzero(R, axis=1) == 1
    R[alone] = np.sign(R[alone])
    return homogeneous(R, cleared(X[:3, 3], size, rounding))


def _rotation_on_axis(axis: Array, before: Array, R: Array) -> Array:
    """Return the rotation (3, 3) of a frame on an axis, its x along the common normal with the axis before it.

    So errors of the four numbers, which calibration looks for, are there as in a row of the table.
    """
    normal = np.cross(before, axis)
    length = float(np.linalg.norm(normal))
    return _first_rotation(R, axis) if length <= ROUNDING else _rotation_from_axes(normal / length, axis)


def _first_rotation(R: Array, z: Array) -> Array:
    """Return the rotation (3, 3) of frame 0: its x along that axis of the joint's own frame which fits best."""
    largest = int(np.abs(R.T @ z).argmax())
    return _rotation_from_axes(R[:, (largest + 1) % 3], z)


def _rotation_from_axes(x: Array, z: Array) -> Array:
    """Return the rotation (3, 3) of a frame with this z axis, whose x axis is as near to another as can be."""
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _row(X: Array, p: Array, u: Array, tiny: float) -> Row:
    """Return the row that leads from frame X to a frame on the line through p along u."""
    x, z, lever = X[:3, 0], X[:3, 2], p - X[:3, 3]
    across, c = np.cross(z, u), float(z @ u)
    s = float(np.linalg.norm(across))
    if s <= ROUNDING:
        aside = lever - (lever @ z) * z
        a = float(np.linalg.norm(aside))
        normal = aside / a if a > tiny else x
        alpha, d = 0.0 if c > 0 else math.pi, float(lever @ z)
    else:
        normal = across / s
        a, alpha, d = float(lever @ normal), math.atan2(s, c), float(np.cross(lever, u) @ across) / s**2
    # The normal has two directions. The nearer one to the x axis before it keeps theta small; failing that, a > 0.
    nearer = float(x @ normal)
    if nearer < -ROUNDING or (nearer <= ROUNDING and a < -tiny):
        normal, a, alpha = -normal, -a, -alpha if s > ROUNDING else alpha
    theta = math.atan2(float(np.cross(x, normal) @ z), float(x @ normal))
    a, d = (0.0 if abs(length) <= tiny else length for length in (a, d))
    return Row(theta=_rounded_to_right_angle(theta), d=d, a=a, alpha=_rounded_to_right_angle(alpha))


def _row_to_tool(X: Array, tiny: float) -> Row:
    """Return the row that leads to a tool (4, 4), seen from the frame before it, if its z axis is on the joint axis."""
    if np.linalg.norm(X[:2, 3]) > tiny or np.linalg.norm(X[:2, 2]) > ROUNDING:
        return Row()
    theta = _rounded_to_right_angle(math.atan2(float(X[1, 0]), float(X[0, 0])))
    d = 0.0 if abs(X[2, 3]) <= tiny else float(X[2, 3])
    return Row(theta=theta, d=d, alpha=0.0 if X[2, 2] > 0 else math.pi)


def _rounded_to_right_angle(angle: float) -> float:
    """Return an angle, the multiple of a right angle where it is one but for rounding."""
    whole = round(angle / _RIGHT_ANGLE) * _RIGHT_ANGLE
    return whole + 0.0 if abs(angle - whole) <= ROUNDING else angle
