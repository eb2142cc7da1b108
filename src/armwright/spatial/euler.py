"""ZYZ Euler angles: R = Rz(phi) Ry(theta) Rz(psi), as in the wrist of a PUMA; and roll, pitch, yaw."""

from __future__ import annotations

import math

import numpy as np

from armwright.arrays import Array, ArrayLike, exact_shape, of_shape
from armwright.spatial.rotations import elementary_rotation

# Below this sine of theta only phi + psi, or phi - psi, is determined.
_SINGULAR = 1e-9


def from_zyz(angles: ArrayLike) -> Array:
    """Return rotations (..., 3, 3) from angles (..., 3): phi, theta, psi [rad]."""
    phi, theta, psi = np.moveaxis(of_shape(angles, (3,), "ZYZ angles"), -1, 0)
    c1, s1, c2, s2, c3, s3 = np.cos(phi), np.sin(phi), np.cos(theta), np.sin(theta), np.cos(psi), np.sin(psi)
    rows = [
        [c1 * c2 * c3 - s1 * s3, -c1 * c2 * s3 - s1 * c3, c1 * s2],
        [s1 * c2 * c3 + c1 * s3, -s1 * c2 * s3 + c1 * c3, s1 * s2],
        [-s2 * c3, s2 * s3, c2],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def to_zyz(R: ArrayLike) -> Array:
    """Return the ZYZ angles of rotations.

    Args:
        R: (..., 3, 3).

    Returns:
        (..., 3): phi, theta, psi [rad], theta from 0 to pi, the others from -pi to pi. Where theta is 0 or pi, and
        only the sum or the difference of the others is determined, phi is 0.

    Source:
        Paul (1981) ch. 3.
    """
    R = of_shape(R, (3, 3), "rotation")
    sine = np.hypot(R[..., 0, 2], R[..., 1, 2])
    singular = sine < _SINGULAR
    phi = np.where(singular, 0.0, np.arctan2(R[..., 1, 2], R[..., 0, 2]))
    theta = np.arctan2(sine, R[..., 2, 2])
    c, s = np.cos(phi), np.sin(phi)
    # After rotating back by phi the second column is that of the last rotation.
    psi = np.arctan2(c * R[..., 1, 0] - s * R[..., 0, 0], c * R[..., 1, 1] - s * R[..., 0, 1])
    return np.stack([phi, theta, psi], axis=-1)


def next_zyz(R: ArrayLike, near: ArrayLike) -> Array:
    """Return the ZYZ angles (3,) of one rotation (3, 3) that are nearest to others (3,).

    Both solutions, theta and -theta, and revolutions are considered; where theta is 0 or pi, phi stays as it is near.
    """
    R, last = of_shape(R, (3, 3), "rotation"), of_shape(near, (3,), "near")
    phi, theta, psi = to_zyz(R)
    if np.sin(theta) < _SINGULAR:
        psi = psi - (last[0] - phi) * np.sign(np.cos(theta))
        phi = last[0]
    solutions = np.array([(phi, theta, psi), (phi + np.pi, -theta, psi + np.pi)])
    solutions += 2 * np.pi * np.round((last - solutions) / (2 * np.pi))
    return np.asarray(solutions[np.abs(solutions - last).sum(axis=1).argmin()])


def matlab_zyz(R: ArrayLike) -> Array:
    """Return the ZYZ angles of rotations as MATLAB's ``rotm2eul(R, 'ZYZ')`` gives them: theta from -pi to 0.

    Nothing is checked of the rotations: they may be typed with a few digits.

    Args:
        R: (..., 3, 3).

    Returns:
        (..., 3): phi, theta, psi [rad]; phi is 0 where theta is 0 or -pi.

    Source:
        Shoemake, "Euler angle conversion", Graphics Gems IV (1994), read with the sequence in reverse and all signs
        changed, as MATLAB does.
    """
    R = of_shape(R, (3, 3), "rotation")
    sine = np.hypot(R[..., 2, 0], R[..., 2, 1])
    singular = sine < 10 * np.finfo(np.float64).eps
    phi = np.where(singular, 0.0, -np.arctan2(R[..., 1, 2], -R[..., 0, 2]))
    psi = np.where(singular, -np.arctan2(-R[..., 1, 0], R[..., 1, 1]), -np.arctan2(R[..., 2, 1], R[..., 2, 0]))
    return np.stack([phi, -np.arctan2(sine, R[..., 2, 2]), psi], axis=-1)


def from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation (3, 3) about the fixed axes x, y and z by three angles [rad]; right angles are exact."""
    return elementary_rotation(2, yaw) @ elementary_rotation(1, pitch) @ elementary_rotation(0, roll)


def to_rpy(R: ArrayLike) -> Array:
    """Return roll, pitch and yaw (3,) of a rotation (3, 3), to the last digits also where pitch is a right angle [rad].

    They are rotations about the fixed axes x, then y, then z. Where pitch is a right angle, yaw and roll share an axis.
    Roll is read from the remaining rotation after removing yaw, so any yaw will do.
    """
    R = exact_shape(R, (3, 3), "rotation")
    level = math.hypot(R[0, 0], R[1, 0])
    c, s = (R[0, 0] / level, R[1, 0] / level) if level else (1.0, 0.0)
    tilted = np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))) @ R
    roll, pitch = math.atan2(-tilted[1, 2], tilted[1, 1]), math.atan2(-tilted[2, 0], tilted[0, 0])
    return np.array((roll, pitch, math.atan2(s, c)))
