"""The first guess of a hand-eye calibration in closed form, and whether the motions of the tool determine it.

Of a camera on the tool the poses E of the tool and C of the board in the frame of the camera obey E X C = Z, with the
pose X of the camera on the tool and Z of the board in the base frame. Beside the arm, the same holds with the inverse
of E: X is then the pose of the camera in the base frame, and Z that of the board on the tool.

Source:
    Park & Martin (1994), Robot sensor calibration: solving AX = XB on the Euclidean group; Rousseeuw (1984) for the
    least median of squares.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from armwright.arrays import Array
from armwright.errors import ContradictionError, InvalidValueError, TooFewError
from armwright.spatial.poses import homogeneous, inverse
from armwright.spatial.rotations import nearest_rotation, rotation_vector

MIN_PICTURES = 3
# How far the tool must rotate, about a second axis too [rad].
MIN_ROTATION = math.radians(5)
# Three pictures that rotate by less about a second axis are no guess [rad].
_LEAST_ROTATION = math.radians(1)
# How many triples of pictures are tried.
_MAX_TRIPLES = 150
# A discrepancy of a millimetre counts as one of two milliradians [m/rad].
_LENGTH = 0.5


def check_motions(X_BE: Array, *, eye_in_hand: bool) -> None:
    """Refuse poses of the tool that leave a part of the calibration open.

    Args:
        X_BE: (m, 4, 4) poses of the tool in the base frame.
        eye_in_hand: whether the camera is on the tool.

    Raises:
        TooFewError: there are too few poses.
        InvalidValueError: the tool rotates too little, or about a single direction only.
    """
    if len(X_BE) < MIN_PICTURES:
        raise TooFewError(f"expected {MIN_PICTURES} pictures or more with joint positions, got {len(X_BE)}")
    R, first = X_BE[:, :3, :3], X_BE[0, :3, :3]
    # A direction that is fixed on the tool of the first picture, or in the base frame.
    rotations = rotation_vector(first.T @ R if eye_in_hand else R @ first.T)
    largest = float(np.linalg.norm(rotations, axis=1).max())
    needed = f"expected rotations of {math.degrees(MIN_ROTATION):.0f} degrees or more, better 30, about two directions"
    if largest < MIN_ROTATION:
        raise InvalidValueError(
            f"the tool rotates by {math.degrees(largest):.2g} degrees at most between the pictures, which leaves the "
            f"position of the camera open; {needed}"
        )
    _, _, axes = np.linalg.svd(rotations)
    across = float(np.abs(rotations @ axes[1:].T).max())
    if across < MIN_ROTATION:
        axis = axes[0] * np.sign(axes[0][np.argmax(np.abs(axes[0]))])
        direction = ", ".join(f"{value:z.2f}" for value in axis)
        frame = "tool" if eye_in_hand else "base"
        raise InvalidValueError(
            f"all rotations of the tool are about the direction ({direction}) of the {frame} frame, and only "
            f"{math.degrees(across):.2g} degrees about another, so that the position of the camera along this "
            f"direction is not determined; {needed}"
        )


def hand_eye_start(E: Array, C: Array) -> tuple[Array, Array, Array]:
    """Return a first guess that a minority of wrong pictures does not move.

    Args:
        E: (m, 4, 4) poses of the tool, or their inverses; see above.
        C: (m, 4, 4) poses of the board in the frame of the camera.

    Returns:
        X and Z, (4, 4), and the discrepancies of the pictures (m,) [m].

    Raises:
        ContradictionError: the board does not rotate as the tool does.
    """
    guesses = []
    for chosen in _triples(len(E)):
        X = closed_form(E[chosen], C[chosen])
        if X is None:
            continue
        boards = E @ X @ C
        Z = _mean_pose(boards[chosen])
        guesses.append((float(np.median(_discrepancies(boards, Z))), X, Z))
    if not guesses:
        raise ContradictionError(
            "the board rotates less in the pictures than the tool does: are these the joint positions of the pictures, "
            "and is the camera on the tool, or beside the arm, as stated?"
        )
    _, X, Z = min(guesses, key=lambda guess: guess[0])
    near = np.argsort(_discrepancies(E @ X @ C, Z))[: max(MIN_PICTURES, (len(E) + 1) // 2)]
    # The better half of the pictures together is more accurate than three.
    better = closed_form(E[near], C[near])
    if better is not None:
        X, Z = better, _mean_pose((E @ better @ C)[near])
    return X, Z, _discrepancies(E @ X @ C, Z)


def closed_form(E: Array, C: Array) -> Array | None:
    """Return X (4, 4) of E X C = Z for all pictures, by least squares; None where they do not determine it.

    The rotation follows from the rotation vectors of motions between pictures, and the position from it.
    """
    i, j = np.triu_indices(len(E), 1)
    A, B = inverse(E[j]) @ E[i], C[j] @ inverse(C[i])
    a, b = rotation_vector(A[:, :3, :3]), rotation_vector(B[:, :3, :3])
    U, s, Vt = np.linalg.svd(a.T @ b)
    if s[1] < _LEAST_ROTATION**2:
        return None
    R = U @ np.diag([1, 1, np.sign(np.linalg.det(U @ Vt))]) @ Vt
    rows = (A[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    right = (R @ B[:, :3, 3, None])[..., 0] - A[:, :3, 3]
    return homogeneous(R, np.linalg.lstsq(rows, right.ravel())[0])


# ---- inside --------------------------------------------------------------------------------------------------------


def _triples(count: int) -> list[list[int]]:
    """Return triples of pictures: all, or random ones, always the same."""
    if math.comb(count, 3) <= _MAX_TRIPLES:
        return [list(triple) for triple in itertools.combinations(range(count), 3)]
    rng = np.random.default_rng(0)
    return [rng.choice(count, 3, replace=False).tolist() for _ in range(_MAX_TRIPLES)]


def _mean_pose(X: Array) -> Array:
    return homogeneous(nearest_rotation(X[:, :3, :3].sum(axis=0)), X[:, :3, 3].mean(axis=0))


def _discrepancies(boards: Array, Z: Array) -> Array:
    """Return (m,) how far poses are from one, rotations as arcs of a usual length [m]."""
    angles = rotation_vector(Z[:3, :3].T @ boards[:, :3, :3])
    return np.asarray(np.sqrt(np.sum((boards[:, :3, 3] - Z[:3, 3]) ** 2 + (_LENGTH * angles) ** 2, axis=1)))
