"""Rotations and poses."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from armwright.errors import KindError, ShapeError
from armwright.spatial.poses import between, from_noap, homogeneous, inverse, to_noap
from armwright.spatial.rotations import (
    angle_between,
    nearest_rotation,
    orthonormality_error,
    rotation_from_quaternion,
    rotation_from_vector,
    rotation_vector,
)
from oracles.arms import random_pose

ROUNDING = 1e-12


@pytest.mark.parametrize("angle", [0.0, 1e-13, 1e-9, 1e-4, 1.0, 3.0, np.pi - 1e-4, np.pi - 1e-9, np.pi])
def test_rotation_vector_there_and_back(angle: float, rng: np.random.Generator) -> None:
    """The vector of a turn gives the turn back, from nothing to half a turn."""
    axes = rng.normal(size=(200, 3))
    w = angle * axes / np.linalg.norm(axes, axis=-1, keepdims=True)

    R = rotation_from_vector(w)

    np.testing.assert_allclose(rotation_from_vector(rotation_vector(R)), R, atol=ROUNDING)
    np.testing.assert_allclose(np.linalg.norm(rotation_vector(R), axis=-1), angle, atol=ROUNDING)


def test_against_scipy(rng: np.random.Generator) -> None:
    """SciPy turns by the same vector into the same matrix."""
    w = rng.normal(size=(100, 3))

    np.testing.assert_allclose(rotation_from_vector(w), Rotation.from_rotvec(w).as_matrix(), atol=ROUNDING)
    np.testing.assert_allclose(
        rotation_vector(rotation_from_vector(w)),
        Rotation.from_matrix(rotation_from_vector(w)).as_rotvec(),
        atol=ROUNDING,
    )


def test_nearest_rotation(rng: np.random.Generator) -> None:
    """No rotation of many tried is nearer to a disturbed one than the nearest; a mirror image becomes a rotation."""
    M = rotation_from_vector(rng.normal(size=3)) + 0.1 * rng.normal(size=(3, 3))
    nearest = nearest_rotation(M)
    others = nearest @ rotation_from_vector(0.05 * rng.normal(size=(500, 3)))

    assert orthonormality_error(nearest) < ROUNDING
    assert np.linalg.norm(nearest - M) <= np.linalg.norm(others - M, axis=(-2, -1)).min()
    assert np.linalg.det(nearest_rotation(np.diag((1.0, 1.0, -1.0)))) == pytest.approx(1)


def test_mirror_image_is_no_rotation() -> None:
    """A matrix with determinant -1 is far from a rotation though its columns are orthonormal."""
    assert orthonormality_error(np.diag((1.0, 1.0, -1.0))) >= 2


def test_inverse_pose(rng: np.random.Generator) -> None:
    """A pose times its inverse is no motion, also for many at once."""
    X = np.stack([random_pose(rng) for _ in range(5)])

    np.testing.assert_allclose(X @ inverse(X), np.broadcast_to(np.eye(4), X.shape), atol=ROUNDING)


def test_twelve_numbers_go_column_by_column() -> None:
    """The report's t1 is no turn and a step of (-1, -1, -1)."""
    X = from_noap((1, 0, 0, 0, 1, 0, 0, 0, 1, -1, -1, -1))

    np.testing.assert_array_equal(X[:3, :3], np.eye(3))
    np.testing.assert_array_equal(X[:3, 3], (-1, -1, -1))
    np.testing.assert_array_equal(to_noap(X), (1, 0, 0, 0, 1, 0, 0, 0, 1, -1, -1, -1))


def test_between_is_straight_and_even(rng: np.random.Generator) -> None:
    """Places lie evenly on the line; orientations are SciPy's spherical interpolation."""
    A, B = random_pose(rng), random_pose(rng)
    s = np.linspace(0, 1, 7)

    X = between(A, B, s)

    np.testing.assert_allclose(X[:, :3, 3], A[:3, 3] + s[:, None] * (B[:3, 3] - A[:3, 3]), atol=ROUNDING)
    slerp = Slerp([0, 1], Rotation.from_matrix([A[:3, :3], B[:3, :3]]))
    np.testing.assert_allclose(X[:, :3, :3], slerp(s).as_matrix(), atol=ROUNDING)
    assert angle_between(A[:3, :3], X[3, :3, :3]) == pytest.approx(angle_between(A[:3, :3], B[:3, :3]) / 2)


def test_no_turn_beside_half_a_turn() -> None:
    """In one array no turn at all and half a turn about x are read side by side, without a division by zero."""
    vectors = rotation_vector([np.eye(3), np.diag((1.0, -1.0, -1.0))])

    np.testing.assert_allclose(np.abs(vectors), [(0, 0, 0), (np.pi, 0, 0)], atol=ROUNDING)


def test_shape_is_checked() -> None:
    """Three numbers are no pose."""
    with pytest.raises(ShapeError, match=r"pose: expected a shape ending in \(4, 4\), got \(3,\)"):
        inverse(np.zeros(3))
    with pytest.raises(KindError, match="rotation: expected numbers, got 'abc'"):
        homogeneous("abc", np.zeros(3))


def test_rotation_from_quaternion(rng: np.random.Generator) -> None:
    """A quaternion w, x, y, z of any length is the rotation that SciPy makes of it; many at once as one by one."""
    many = rng.standard_normal((4, 5, 4))

    R = rotation_from_quaternion(many)

    expected = Rotation.from_quat(many.reshape(-1, 4), scalar_first=True).as_matrix()
    np.testing.assert_allclose(R.reshape(-1, 3, 3), expected, atol=1e-15)
    np.testing.assert_array_equal(rotation_from_quaternion(many[1, 2]), R[1, 2])
