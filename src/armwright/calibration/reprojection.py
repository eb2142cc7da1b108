"""The pose of a board from its corners in one picture, by least squares over the distances in the picture.

A small motion of a frame is a twist: a translation along its axes, and a rotation about them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armwright.arrays import Array
from armwright.extras import opencv
from armwright.spatial.lens import Lens
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector, rotation_vector, skew_matrix

# Gauss and Newton's steps of a pose, and when no more are needed [m], [rad].
_STEPS, _SETTLED = 30, 1e-9
# Of the two poses that fit a flat board, the worse is tried too if its residuals are not as many times as large.
_CLEARLY_WORSE = 3.0


class BoardPose(NamedTuple):
    """The pose of a board that fits a picture best.

    Attributes:
        pose: (4, 4) of the board in the frame of the camera.
        residuals: (c, 2) of its corners, seen minus expected [px].
        information: (6, 6) of a twist of the board: the inverse of its covariance if pixels had a variance of 1.
    """

    pose: Array
    residuals: Array
    information: Array


def moved(X: Array, twist: Array) -> Array:
    """Return poses (..., 4, 4), each moved by a twist (..., 6) along and about its own axes."""
    result = np.array(X)
    result[..., :3, :3] = X[..., :3, :3] @ rotation_from_vector(twist[..., 3:])
    result[..., :3, 3] += (X[..., :3, :3] @ twist[..., :3, None])[..., 0]
    return result


def twist_between(X: Array, Y: Array) -> Array:
    """Return the twist (..., 6) that moves one pose (..., 4, 4) to another: the inverse of ``moved``."""
    R = np.swapaxes(X[..., :3, :3], -1, -2)
    translation = (R @ (Y[..., :3, 3] - X[..., :3, 3])[..., None])[..., 0]
    return np.concatenate([translation, rotation_vector(R @ Y[..., :3, :3])], axis=-1)


def moved_points(points: Array) -> Array:
    """Return the derivatives (..., 3, 6) of points (..., 3) of a body, in its frame, by a twist of the body."""
    identity = np.broadcast_to(np.eye(3), (*points.shape[:-1], 3, 3))
    return np.concatenate([identity, -skew_matrix(points)], axis=-1)


def transformed(X: Array, points: Array) -> Array:
    """Return points (..., 3) in another frame, whose pose (..., 4, 4) sees their own."""
    return np.asarray((X[..., :3, :3] @ points[..., None])[..., 0] + X[..., :3, 3])


def board_pose(lens: Lens, points: Array, pixels: Array) -> BoardPose:
    """Return the pose of a board that fits a picture best, without a guess: by OpenCV, and refined.

    Args:
        lens: of the camera.
        points: (c, 3) of the board, in its plane z = 0 [m].
        pixels: (c, 2) where they are seen.

    Raises:
        MissingExtraError: OpenCV is not installed.

    Source:
        Collins & Bartoli (2014), Infinitesimal plane-based pose estimation.
    """
    cv2 = opencv("calibrating a camera")
    _, rotations, translations, errors = cv2.solvePnPGeneric(
        points, pixels, lens.matrix, lens.distortion, flags=cv2.SOLVEPNP_IPPE
    )
    candidates = []
    limit = _CLEARLY_WORSE * float(np.min(errors))
    for rotation, translation, error in zip(rotations, translations, np.ravel(errors), strict=True):
        if error > limit:
            continue
        X = homogeneous(rotation_from_vector(np.ravel(rotation)), np.ravel(translation))
        candidates.append(refined_board_pose(lens, points, pixels, X))
    return min(candidates, key=lambda fit: float(np.sum(fit.residuals**2)))


def refined_board_pose(lens: Lens, points: Array, pixels: Array, X_CO: Array) -> BoardPose:
    """Return the pose of a board that fits a picture best, by Gauss and Newton's steps.

    Args:
        lens: of the camera.
        points: (c, 3) of the board [m].
        pixels: (c, 2) where they are seen.
        X_CO: (4, 4) its pose in the frame of the camera, roughly.
    """
    for _ in range(_STEPS):
        seen = transformed(X_CO, points)
        by_point, _ = lens.derivatives(seen)
        J = (by_point @ X_CO[:3, :3] @ moved_points(points)).reshape(-1, 6)
        residuals = pixels - lens.project(seen)
        information = J.T @ J
        step = np.asarray(np.linalg.lstsq(J, residuals.ravel())[0], dtype=np.float64)
        X_CO = moved(X_CO, step)
        if np.abs(step).max() < _SETTLED:
            break
    return BoardPose(X_CO, pixels - lens.project(transformed(X_CO, points)), information)
