"""Orientations in the words of controllers: written and read by two ways, both beside SciPy."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armwright.export.checkers import orientations as checker
from armwright.export.writers.orientations import quaternion, rotation_vector, zyx_angles

ROUNDING = 5e-9  # near a half turn entries of a matrix know an angle to the root of their own rounding
EXACT = 1e-15

# Half turns about axes and diagonals, quarter turns of the second angle, and rotations beside them.
EDGES = [
    np.eye(3),
    *(Rotation.from_rotvec(np.pi * np.eye(3)[i]).as_matrix().round() for i in range(3)),
    *(Rotation.from_rotvec(np.pi / np.sqrt(2) * np.array(v)).as_matrix() for v in ((1, 1, 0), (1, 0, -1), (0, -1, 1))),
    *(Rotation.from_euler("ZYX", (a, b, 0), degrees=True).as_matrix() for a in (-170, -30, 0, 90) for b in (-90, 90)),
]


def beside(R: np.ndarray, size: float, rng: np.random.Generator) -> np.ndarray:
    """A rotation that differs by a small angle."""
    return Rotation.from_rotvec(size * rng.standard_normal(3)).as_matrix() @ R


def rotations(rng: np.random.Generator) -> np.ndarray:
    """Any rotation, or one at or beside an edge."""
    kind = rng.integers(3)
    if kind == 0:
        return Rotation.random(random_state=rng).as_matrix()
    R = EDGES[rng.integers(len(EDGES))]
    return R if kind == 1 else beside(R, 10.0 ** rng.uniform(-16, -3), rng)


@pytest.mark.share(0.01)
def test_written_and_read(sample: Any) -> None:
    """What is written of an orientation is that of SciPy, and what is read of it is the orientation."""
    worst, count = 0.0, sample.count(100_000)
    for rng in sample.cases(count):
        R = rotations(rng)
        w, x, y, z = quaternion(R)
        apart = [
            Rotation.from_matrix(R.T @ Rotation.from_quat([x, y, z, w]).as_matrix()).magnitude(),
            checker.angle_apart(R, checker.from_quaternion((w, x, y, z))),
            checker.angle_apart(R, Rotation.from_rotvec(rotation_vector(R)).as_matrix()),
            checker.angle_apart(R, checker.from_rotation_vector(rotation_vector(R))),
            checker.angle_apart(R, Rotation.from_euler("ZYX", zyx_angles(R), degrees=True).as_matrix()),
            checker.angle_apart(R, checker.from_zyx_degrees(zyx_angles(R))),
        ]
        worst = max(worst, *apart)
        assert max(apart) < ROUNDING, (R.tolist(), apart)
        assert w >= 0
        assert np.linalg.norm(rotation_vector(R)) <= np.pi * (1 + EXACT)
    sample.record("orientations written and read", count, 0, worst=worst)


@pytest.mark.parametrize("axis", range(3))
def test_half_turns_are_exact(axis: int) -> None:
    """A tool that points straight down has an axis without rounding, whichever it is."""
    vector = np.pi * np.eye(3)[axis]
    R = 2 * np.outer(vector, vector) / np.pi**2 - np.eye(3)

    assert rotation_vector(R) == vector.tolist()
    assert quaternion(R) == (0.0, *np.eye(3)[axis].tolist())
    assert rotation_vector(R + 1e-17) == pytest.approx(vector.tolist(), abs=EXACT)


@pytest.mark.parametrize("b", [-90.0, 90.0])
@pytest.mark.parametrize("a", [0.0, 30.0, -135.0, 180.0])
def test_quarter_turns_of_b_are_exact(a: float, b: float) -> None:
    """Where B is a quarter turn, C is 0 and A is the whole rest."""
    R = Rotation.from_euler("ZYX", (a, b, 0.0), degrees=True).as_matrix()

    assert zyx_angles(R) == pytest.approx((a, b, 0.0), abs=1e-12)


@pytest.mark.parametrize("turn", [1e-3, 1.0, np.pi / 2, np.pi, 3.5])
def test_elementary_rotations_of_the_checker(turn: float) -> None:
    """The checker's rotations about single axes are SciPy's."""
    for axis in range(3):
        np.testing.assert_allclose(
            checker.turn(axis, turn), Rotation.from_rotvec(turn * np.eye(3)[axis]).as_matrix(), atol=EXACT
        )


def test_angle_between_orientations() -> None:
    """The angle of the checker is that of SciPy, for small angles and half turns too."""
    rng = np.random.default_rng(4)
    for size in (0.0, 1e-12, 1e-6, 0.3, np.pi):
        vector = rng.standard_normal(3)
        S = Rotation.from_rotvec(size * vector / np.linalg.norm(vector)).as_matrix()
        R = Rotation.random(random_state=rng).as_matrix()

        assert checker.angle_apart(R, R @ S) == pytest.approx(size, abs=1e-7 if size == np.pi else 1e-15 + 1e-9 * size)
