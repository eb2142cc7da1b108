"""Rotations: how far from one a matrix is, the nearest one, the rotation between two, and interpolation."""

from __future__ import annotations

import math

import numpy as np

from armwright.arrays import Array, ArrayLike, leading_axes, of_shape
from armwright.errors import InvalidValueError

# Below this angle sin(angle)/angle is 1 to the last bit, so the axis needs no division by the angle.
_TINY_ANGLE = 1e-12
# Beyond this cosine the axis of a rotation comes from its symmetric part.
_NEAR_HALF_TURN = -0.99
_UNIT = np.eye(3)


def exact_cosine(angle: float) -> float:
    """Return cos(angle), exactly 0 or ±1 at the multiples of a right angle.

    Twist angles of real arms are right angles; the zeros they leave are structure, not rounding.
    """
    return _exact(math.cos(angle))


def exact_sine(angle: float) -> float:
    """Return sin(angle), exactly 0 or ±1 at the multiples of a right angle."""
    return _exact(math.sin(angle))


def _exact(value: float) -> float:
    return round(value) + 0.0 if abs(value - round(value)) < 1e-15 else value


def elementary_rotation(axis: int, angle: float) -> Array:
    """Return the rotation (3, 3) about x, y or z, axis 0 to 2, by an angle [rad]; right angles are exact."""
    c, s = exact_cosine(angle), exact_sine(angle)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[j, j], R[j, k], R[k, j], R[k, k] = c, 0.0 - s, s, c
    return R


def orthonormality_error(R: ArrayLike) -> Array:
    """Return how far R is from a rotation.

    Args:
        R: (..., 3, 3).

    Returns:
        (...) the largest entry of |Rᵀ R - 1|; plus 2 where the determinant is negative (a mirror image).
    """
    R = of_shape(R, (3, 3), "rotation")
    error = np.abs(np.swapaxes(R, -1, -2) @ R - _UNIT).max(axis=(-2, -1))
    mirrored: Array = np.where(np.linalg.det(R) < 0, 2.0, 0.0)
    return np.asarray(error + mirrored)


def nearest_rotation(R: ArrayLike) -> Array:
    """Return the rotation closest to R in the Frobenius norm.

    Args:
        R: (..., 3, 3) nearly a rotation, such as one typed with few digits.

    Returns:
        (..., 3, 3).

    Source:
        Higham (1986): the polar factor, with the last singular direction reversed where the determinant is negative.
    """
    U, _, Vt = np.linalg.svd(of_shape(R, (3, 3), "rotation"))
    signs = np.ones(U.shape[:-1])
    signs[..., 2] = np.sign(np.linalg.det(U @ Vt))
    return np.asarray((U * signs[..., None, :]) @ Vt)


def rotation_vector(R: ArrayLike) -> Array:
    """Return axis times angle of R.

    Args:
        R: (..., 3, 3) rotations.

    Returns:
        (..., 3) rotation vectors [rad], of length at most pi.
    """
    R = of_shape(R, (3, 3), "rotation")
    if R.ndim == 2 and (vector := _single_rotation_vector(R)) is not None:
        return vector
    skew = np.empty(R.shape[:-1])
    skew[..., 0] = R[..., 2, 1] - R[..., 1, 2]
    skew[..., 1] = R[..., 0, 2] - R[..., 2, 0]
    skew[..., 2] = R[..., 1, 0] - R[..., 0, 1]
    skew /= 2
    sine = np.sqrt(np.add.reduce(skew * skew, axis=-1))
    cosine = (R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2] - 1) / 2
    angle = np.arctan2(sine, cosine)
    small = sine < _TINY_ANGLE
    factor = np.where(small, 1.0, angle / np.where(small, 1.0, sine))
    vector = skew * factor[..., None]
    # Near 180° the skew part vanishes, and the axis is the largest column of the symmetric part.
    half = cosine < _NEAR_HALF_TURN
    if np.any(half):
        symmetric = (R + np.swapaxes(R, -1, -2)) / 2 - cosine[..., None, None] * np.eye(3)
        column = np.argmax(np.diagonal(symmetric, axis1=-2, axis2=-1), axis=-1)
        axis = np.take_along_axis(symmetric, column[..., None, None], axis=-1)[..., 0]
        # Of the other rows the column is not used, and may be 0.
        axis /= np.where(half[..., None], np.linalg.norm(axis, axis=-1, keepdims=True), 1.0)
        facing = np.where(np.sum(axis * skew, axis=-1) < 0, -1.0, 1.0)
        vector = np.where(half[..., None], axis * (facing * angle)[..., None], vector)
    return np.asarray(vector)


def _single_rotation_vector(R: Array) -> Array | None:
    """Return the rotation vector of a single rotation (3, 3), many times as fast; None where it is close to 180°."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = R.tolist()
    x, y, z, cosine = (zy - yz) / 2, (xz - zx) / 2, (yx - xy) / 2, (xx + yy + zz - 1) / 2
    if cosine < _NEAR_HALF_TURN:
        return None
    sine = math.sqrt(x * x + y * y + z * z)
    factor = 1.0 if sine < _TINY_ANGLE else math.atan2(sine, cosine) / sine
    return np.array([x * factor, y * factor, z * factor])


def rotation_from_vector(w: ArrayLike) -> Array:
    """Return the rotation by |w| about w.

    Args:
        w: (..., 3) rotation vectors [rad].

    Returns:
        (..., 3, 3).

    Source:
        Rodrigues (1840).
    """
    w = of_shape(w, (3,), "rotation vector")
    angle = np.linalg.norm(w, axis=-1)[..., None, None]
    small = angle < _TINY_ANGLE
    safe = np.where(small, 1.0, angle)
    W = skew_matrix(w)
    first = np.where(small, 1.0, np.sin(angle) / safe)
    # 1 - cos loses all digits for small angles; half-angle sines keep them.
    second = np.where(small, 0.5, 2 * (np.sin(angle / 2) / safe) ** 2)
    return np.asarray(np.eye(3) + first * W + second * (W @ W))


def skew_matrix(w: Array) -> Array:
    """Return the matrices (..., 3, 3) that take v to the cross products w × v, for vectors w (..., 3)."""
    x, y, z = np.moveaxis(w, -1, 0)
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)


def rotation_with_z(z: Array) -> Array:
    """Return a rotation (3, 3) whose z axis is a vector (3,) of length 1; its x axis is any that is across."""
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def angle_between(R_A: ArrayLike, R_B: ArrayLike) -> Array:
    """Return the angle of the rotation from R_A to R_B, (...) [rad]; leading axes are broadcast."""
    R_A, R_B = of_shape(R_A, (3, 3), "rotation"), of_shape(R_B, (3, 3), "rotation")
    leading_axes("rotations", (R_A, R_B), (R_A.shape[:-2], R_B.shape[:-2]))
    R_AB = np.swapaxes(R_A, -1, -2) @ R_B
    return np.asarray(np.linalg.norm(rotation_vector(R_AB), axis=-1))


def unit_vectors(value: ArrayLike, size: int, what: str) -> Array:
    """Return vectors (..., size) of length 1 in the directions of others, however long these are.

    Raises:
        InvalidValueError: a vector is 0.
    """
    vectors = of_shape(value, (size,), what)
    largest = np.abs(vectors).max(axis=-1, keepdims=True, initial=0.0)
    if not np.all(largest > 0):
        raise InvalidValueError(f"{what}: expected a vector that is not 0")
    # A power of two changes no digit, and no square overflows or vanishes.
    scaled = np.ldexp(vectors, -np.frexp(largest)[1])
    return np.asarray(scaled / np.linalg.norm(scaled, axis=-1, keepdims=True))


def rotation_from_quaternion(quaternion: ArrayLike) -> Array:
    """Return the rotation of a quaternion w, x, y, z, which is made a unit one.

    Args:
        quaternion: (..., 4), not 0.

    Returns:
        (..., 3, 3).

    Raises:
        InvalidValueError: a quaternion is 0.
    """
    unit = unit_vectors(quaternion, 4, "quaternion")
    V = skew_matrix(unit[..., 1:])
    return np.asarray(np.eye(3) + 2 * (unit[..., 0, None, None] * V + V @ V))
