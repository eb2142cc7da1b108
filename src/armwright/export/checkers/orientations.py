"""Rotations out of what controllers write, by elementary rotations and products of quaternions alone."""

import math
from typing import TypeAlias

import numpy as np

from armwright.arrays import Array, ArrayLike

_Quaternion: TypeAlias = tuple[float, float, float, float]
_UNITS: tuple[_Quaternion, ...] = ((0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def turn(axis: int, angle: float) -> Array:
    """Return the rotation (3, 3) about an axis of coordinates, 0 to 2, by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[i, i], R[j, j], R[i, j], R[j, i] = c, c, -s, s
    return R


def from_zyx_degrees(angles: ArrayLike) -> Array:
    """Return the rotation (3, 3) of angles [deg] about Z, the new Y and the new X."""
    a, b, c = np.deg2rad(np.asarray(angles, dtype=float))
    return np.asarray(turn(2, a) @ turn(1, b) @ turn(0, c))


def from_quaternion(numbers: ArrayLike) -> Array:
    """Return the rotation (3, 3) of a quaternion w, x, y, z, which need not be of length one.

    Each column is what q v q* makes of a unit vector.
    """
    w, x, y, z = np.asarray(numbers, dtype=float).tolist()
    size = math.sqrt(w * w + x * x + y * y + z * z)
    q = (w / size, x / size, y / size, z / size)
    back = (q[0], -q[1], -q[2], -q[3])
    columns = [_product(_product(q, unit), back)[1:] for unit in _UNITS]
    return np.array(columns).T


def from_rotation_vector(numbers: ArrayLike) -> Array:
    """Return the rotation (3, 3) about an axis by its length [rad].

    Source:
        Rodrigues (1840), of half the angle: a quaternion.
    """
    vector = np.asarray(numbers, dtype=float)
    angle = float(np.sqrt(vector @ vector))
    part = np.sinc(angle / (2 * np.pi)) / 2
    return from_quaternion([np.cos(angle / 2), *(part * vector)])


def angle_apart(R: Array, S: Array) -> float:
    """Return the angle between two orientations (3, 3) [rad]."""
    return float(2.0 * np.arcsin(min(1.0, np.sqrt(((R - S) ** 2).sum() / 8.0))))


def _product(p: _Quaternion, q: _Quaternion) -> _Quaternion:
    """Return the product of two quaternions w, x, y, z."""
    (a, b, c, d), (w, x, y, z) = p, q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )
