"""Poses from what a person writes: a position, and an orientation in any of the usual forms."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from armwright.arrays import Array, ArrayLike, leading_axes, of_shape
from armwright.errors import InvalidValueError, one_of
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import (
    orthonormality_error,
    rotation_from_quaternion,
    rotation_from_vector,
    unit_vectors,
)

# Entries of a typed rotation may be off by so much; more is a mistake.
_TYPED = 1e-6
_SEQUENCES = tuple(
    f"{first}{second}{third}"
    for axes in ("XYZ", "xyz")
    for first, second, third in product(axes, repeat=3)
    if second not in (first, third)
)


def pose(
    position: ArrayLike = (0.0, 0.0, 0.0),
    *,
    rotation: ArrayLike | None = None,
    quaternion: ArrayLike | None = None,
    rpy: ArrayLike | None = None,
    euler: ArrayLike | None = None,
    sequence: str = "ZYZ",
    axis: ArrayLike | None = None,
    angle: ArrayLike | None = None,
) -> Array:
    """Return the pose of a position and an orientation; leading axes are broadcast.

    Args:
        position: (..., 3) [m].
        rotation: (..., 3, 3) rotation matrices.
        quaternion: (..., 4) w, x, y, z, which are normalized.
        rpy: (..., 3) roll, pitch, yaw [rad] about the fixed axes x, y, z, as in URDF.
        euler: (..., 3) Euler angles [rad] about the axes of ``sequence``.
        sequence: of three axes: capital letters are the moving axes, such as ``ZYZ``; small ones about the fixed
            axes, such as ``xyz``.
        axis: (..., 3) of a rotation by ``angle``; of any length but 0.
        angle: (...) [rad].

    Returns:
        X: (..., 4, 4); without an orientation that of the frame itself.

    Raises:
        InvalidValueError: more than one orientation is given, a matrix is no rotation, or an axis or quaternion is 0.
        ShapeError: an array has another shape.

    Example:
        ``pose((0.4, 0, 0.2), rpy=(np.pi, 0, 0))`` is 0.4 m ahead and 0.2 m up, the tool pointing down.
    """
    forms = {
        "rotation": rotation,
        "quaternion": quaternion,
        "rpy": rpy,
        "euler": euler,
        "axis and angle": axis if axis is not None else angle,
    }
    chosen = [name for name, value in forms.items() if value is not None]
    if len(chosen) > 1:
        raise InvalidValueError(f"expected one orientation, got {' and '.join(chosen)}")
    if (axis is None) != (angle is None):
        raise InvalidValueError(f"expected axis and angle together, got only {'angle' if axis is None else 'axis'}")
    if rotation is not None:
        R = of_shape(rotation, (3, 3), "rotation")
        if (error := float(np.max(orthonormality_error(R), initial=0.0))) > _TYPED:
            message = f"expected an orthonormal matrix with determinant 1, got an orthonormality error of {error:.2g}"
            raise InvalidValueError(f"rotation: {message}")
    elif quaternion is not None:
        R = rotation_from_quaternion(quaternion)
    elif rpy is not None:
        R = _euler(rpy, "xyz", "rpy")
    elif euler is not None:
        R = _euler(euler, one_of("sequence", sequence, _SEQUENCES), "Euler angles")
    elif axis is not None and angle is not None:
        axes, angles = unit_vectors(axis, 3, "axis"), of_shape(angle, (), "angle")
        leading_axes("axis and angle", (axes, angles), (axes.shape[:-1], angles.shape))
        R = rotation_from_vector(axes * angles[..., None])
    else:
        R = np.eye(3)
    return homogeneous(R, of_shape(position, (3,), "position"))


def _euler(angles: ArrayLike, sequence: str, what: str) -> Array:
    typed = of_shape(angles, (3,), what)
    matrices = Rotation.from_euler(sequence, typed.reshape(-1, 3)).as_matrix()
    return np.asarray(matrices.reshape(*typed.shape[:-1], 3, 3))
