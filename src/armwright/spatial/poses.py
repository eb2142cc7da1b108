"""Poses: homogeneous matrices, their twelve numbers, their inverse, the straight path between two."""

from __future__ import annotations

import numpy as np

from armwright.arrays import Array, ArrayLike, exact_shape, floats, leading_axes, of_shape
from armwright.errors import InvalidValueError
from armwright.spatial.rotations import orthonormality_error, rotation_from_vector, rotation_vector

# A pose is computed from typed numbers; this much off a rotation is rounding, more is a mistake.
_ROUNDING = 1e-9


def one_pose(value: ArrayLike, what: str = "pose") -> Array:
    """Return ``value`` as a read-only pose (4, 4): the converter of fields that hold one.

    Raises:
        ShapeError: it is not (4, 4).
        InvalidValueError: it has no rotation in it, or its last row is not 0 0 0 1.
    """
    X = exact_shape(value, (4, 4), what)
    if orthonormality_error(X[:3, :3]) > _ROUNDING or not np.array_equal(X[3], (0, 0, 0, 1)):
        raise InvalidValueError(
            f"{what}: expected a homogeneous transformation (rotation, position, last row 0 0 0 1), got {X.tolist()}"
        )
    return X


def homogeneous(R: ArrayLike, p: ArrayLike) -> Array:
    """Join a rotation (..., 3, 3) and a position (..., 3) [m] to a pose (..., 4, 4); leading axes are broadcast."""
    R, p = of_shape(R, (3, 3), "rotation"), of_shape(p, (3,), "position")
    lead = leading_axes("rotation and position", (R, p), (R.shape[:-2], p.shape[:-1]))
    X = np.zeros((*lead, 4, 4))
    X[..., :3, :3] = R
    X[..., :3, 3] = p
    X[..., 3, 3] = 1.0
    return X


def inverse(X_AB: ArrayLike) -> Array:
    """Return X_BA, (..., 4, 4), without solving: from the transposed rotation and the rotated position."""
    X_AB = of_shape(X_AB, (4, 4), "pose")
    R_BA = np.swapaxes(X_AB[..., :3, :3], -1, -2)
    return homogeneous(R_BA, -(R_BA @ X_AB[..., :3, 3:])[..., 0])


def position_text(p: Array) -> str:
    """Return the text of a position (3,) in the base frame, in millimetres."""
    x, y, z = p * 1e3
    return f"({x:.1f}, {y:.1f}, {z:.1f}) mm from the base"


def inverse_pose(X_AB: Array) -> Array:
    """Return the inverse (4, 4) of one pose that is known to be one: nothing is checked."""
    X_BA = np.eye(4)
    R_BA = X_AB[:3, :3].T
    X_BA[:3, :3] = R_BA
    X_BA[:3, 3] = -(R_BA @ X_AB[:3, 3])
    return X_BA


def from_noap(numbers: ArrayLike) -> Array:
    """Return the pose (..., 4, 4) whose columns n, o, a, p are written out in (..., 12) numbers."""
    columns = of_shape(numbers, (12,), "n, o, a, p")
    columns = np.swapaxes(columns.reshape(*columns.shape[:-1], 4, 3), -1, -2)
    return homogeneous(columns[..., :3], columns[..., 3])


def to_noap(X: ArrayLike) -> Array:
    """Return the columns n, o, a, p of a pose one after the other, (..., 12)."""
    X = of_shape(X, (4, 4), "pose")
    return np.ascontiguousarray(np.swapaxes(X[..., :3, :], -1, -2)).reshape(*X.shape[:-2], 12)


def between(X_A: ArrayLike, X_B: ArrayLike, s: ArrayLike) -> Array:
    """Return poses on the straight path from X_A to X_B: position on the line, rotation about a fixed axis.

    Args:
        X_A: (4, 4) where s = 0.
        X_B: (4, 4) where s = 1.
        s: (...) fractions of the path.

    Returns:
        (..., 4, 4).
    """
    X_A, X_B, s = exact_shape(X_A, (4, 4), "X_A"), exact_shape(X_B, (4, 4), "X_B"), floats(s, "s")
    rotation = rotation_vector(X_A[:3, :3].T @ X_B[:3, :3])
    R = X_A[:3, :3] @ rotation_from_vector(s[..., None] * rotation)
    p = X_A[:3, 3] + s[..., None] * (X_B[:3, 3] - X_A[:3, 3])
    return homogeneous(R, p)
