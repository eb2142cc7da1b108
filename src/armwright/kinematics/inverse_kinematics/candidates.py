"""Ranking configurations: residuals, limits, duplicates, order, and one word on the whole."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from armwright.arm.model import Arm
from armwright.arrays import LARGEST, Array, ArrayLike, of_shape
from armwright.errors import InvalidValueError, ShapeError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.revolutions import joint_distance, same_configuration
from armwright.kinematics.inverse_kinematics.solution import Branch, InverseSolution, Outcome, violations
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import angle_between, nearest_rotation, orthonormality_error

# A pose typed with a few digits is turned into a rotation up to this error; beyond it is a mistake.
_TYPED_ROTATION = 2e-2
# What remains of a rotation after a chain of products.
_COMPUTED = 1e-14
# The last row of a pose is 0 0 0 1 but for the rounding of a product.
_LAST_ROW = 1e-9
# A position this far outside counts as the edge of the reach: six typed digits of a metre [m]; an orientation this far
# off likewise [rad].
POSE_TOLERANCE = 2e-6


class Candidate(NamedTuple):
    """A configuration (n,) with its name, the joints that are free there, and of seven joints the swivel."""

    q: Array
    label: str
    free: tuple[int, ...] = ()
    swivel: float | None = None


def exact_pose(X_BT: ArrayLike) -> Array:
    """Return one pose (4, 4), its rotation made exact.

    Raises:
        ShapeError: it is not (4, 4).
        InvalidValueError: it is no pose, not even one typed with two digits.
    """
    X = of_shape(X_BT, (4, 4), "pose", LARGEST)
    if X.ndim == 2 and _is_computed(X):
        return X
    X, error = _typed_poses(X)
    if X.ndim != 2:
        raise ShapeError(f"pose: expected one pose, shape (4, 4), got {X.shape}; inverse_branches takes arrays of them")
    # A rotation that was computed is as exact as one can be; what is typed is off by far more.
    if float(error) < _COMPUTED:
        return X
    return homogeneous(nearest_rotation(X[:3, :3]), X[:3, 3])


def _is_computed(X: Array) -> bool:
    """Whether a pose (4, 4) is as exact as one can be; what is not is looked at more closely."""
    (a, d, g, _), (b, e, h, _), (c, f, i, _), last = X.tolist()
    square = abs(a * a + b * b + c * c - 1), abs(d * d + e * e + f * f - 1), abs(g * g + h * h + i * i - 1)
    mixed = abs(a * d + b * e + c * f), abs(a * g + b * h + c * i), abs(d * g + e * h + f * i)
    determinant = (b * f - c * e) * g + (c * d - a * f) * h + (a * e - b * d) * i
    return last == [0.0, 0.0, 0.0, 1.0] and bool(max(*square, *mixed) < _COMPUTED and determinant > 0)


def typed_poses(X_BT: ArrayLike) -> Array:
    """Return poses (..., 4, 4), read-only, as they were typed.

    Raises:
        KindError: they are something else than real numbers.
        ShapeError: the last axes are not (4, 4).
        InvalidValueError: a number is not finite, a last row is not 0 0 0 1, or a rotation none, not even one typed
            with two digits.
    """
    return _typed_poses(X_BT)[0]


def _typed_poses(X_BT: ArrayLike) -> tuple[Array, Array]:
    """Return poses as ``typed_poses`` does, and how far their rotations (...) are from exact ones."""
    X = of_shape(X_BT, (4, 4), "pose", LARGEST)
    wrong = np.flatnonzero(np.abs(X[..., 3, :] - (0, 0, 0, 1)).max(axis=-1).ravel() > _LAST_ROW)
    if len(wrong):
        first = X.reshape(-1, 4, 4)[wrong[0]]
        hint = "; is it transposed?" if first[3, :3].any() and not first[:3, 3].any() else ""
        raise InvalidValueError(f"pose: expected 0 0 0 1 as the last row, got {first[3].tolist()}{hint}")
    error = orthonormality_error(X[..., :3, :3])
    worst = float(np.max(error, initial=0.0))
    if worst > _TYPED_ROTATION:
        R = X.reshape(-1, 4, 4)[error.argmax(), :3, :3]
        hint = "; it is a mirror image: one axis is reversed" if np.linalg.det(R) < 0 else ""
        raise InvalidValueError(
            f"pose: expected a rotation, orthonormal to {_TYPED_ROTATION}, got one with an error of {worst:.3g}: "
            f"{R.tolist()}{hint}"
        )
    return X, error


def pose_errors(arm: Arm, q: Array, X: Array) -> tuple[Array, Array]:
    """Return the errors of configurations against a pose: distances (...) [m] and angles (...) [rad]."""
    X_q = forward(arm, q)
    return np.linalg.norm(X_q[..., :3, 3] - X[..., :3, 3], axis=-1), angle_between(X[..., :3, :3], X_q[..., :3, :3])


def rank(
    arm: Arm, X: Array, candidates: Iterable[Candidate], near: Array, *, apart: float, X_near: Array | None = None
) -> InverseSolution:
    """Return the solution made of candidate configurations.

    Args:
        arm: the arm.
        X: (4, 4) the pose asked for.
        candidates: configurations that meet it or, out of reach, come near it; duplicates are dropped.
        near: (n,) where the arm is; the nearest configuration comes first.
        apart: configurations closer than this are one [rad] or [m].
        X_near: (4, 4) the pose in reach nearest to the one asked for; None when that itself is in reach.
    """
    distinct: list[Candidate] = []
    for candidate in candidates:
        if not any(same_configuration(arm, candidate.q, other.q, apart) for other in distinct):
            distinct.append(candidate)
    distances, angles = pose_errors(arm, np.array([candidate.q for candidate in distinct]), X)
    branches = [
        Branch(
            q=q,
            label=label,
            violations=violations(arm, q),
            free=free,
            position_error=float(distance),
            rotation_error=float(angle),
            swivel=swivel,
        )
        for (q, label, free, swivel), distance, angle in zip(distinct, distances, angles, strict=True)
    ]
    branches.sort(key=lambda branch: (not branch.allowed, joint_distance(arm, near, branch.q)))
    allowed = [branch for branch in branches if branch.allowed]
    if X_near is not None:
        outcome = Outcome.OUT_OF_REACH
    elif not allowed:
        outcome = Outcome.OUT_OF_LIMITS
    else:
        outcome = Outcome.SINGULAR if all(branch.free for branch in allowed) else Outcome.SOLVED
    nearest = X if X_near is None else X_near
    return InverseSolution(
        arm=arm,
        outcome=outcome,
        branches=tuple(branches),
        distance=float(np.linalg.norm(nearest[:3, 3] - X[:3, 3])),
        rotation_error=float(angle_between(X[:3, :3], nearest[:3, :3])),
        nearest_pose=nearest,
    )
