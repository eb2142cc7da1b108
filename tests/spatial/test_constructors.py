"""Poses from positions and orientations, in each of the usual forms."""

from collections.abc import Callable

import numpy as np
import pytest

import armwright
from armwright.errors import InvalidValueError, KindError, ShapeError, UnknownNameError
from armwright.spatial import angle_between, between, from_zyz, homogeneous, pose, rotation_from_quaternion, to_rpy

ROUNDING = 1e-14
DOWN = np.diag((1.0, -1.0, -1.0))
POSITION = (0.4, 0.0, 0.2)


@pytest.mark.parametrize(
    "orientation",
    [
        {"rpy": (np.pi, 0, 0)},
        {"euler": (np.pi / 2, np.pi, -np.pi / 2)},
        {"euler": (np.pi, 0, 0), "sequence": "XYZ"},
        {"axis": (2, 0, 0), "angle": np.pi},
        {"quaternion": (0, 3, 0, 0)},
        {"rotation": DOWN},
    ],
    ids=" ".join,
)
def test_pointing_down(orientation: dict[str, object]) -> None:
    """Half a rotation about x makes the tool point down, however it is written."""
    X = pose(POSITION, **orientation)  # type: ignore[arg-type]

    np.testing.assert_allclose(X[:3, :3], DOWN, atol=ROUNDING)
    assert X[:3, 3].tolist() == list(POSITION)
    assert X[3].tolist() == [0, 0, 0, 1]


def test_forms_agree() -> None:
    """The angles that are read from a pose give the pose again, for many poses at once."""
    angles = np.random.default_rng(7).uniform(-1.5, 1.5, (5, 2, 3))
    X = pose(np.ones((2, 3)), euler=angles)

    assert X.shape == (5, 2, 4, 4)
    np.testing.assert_allclose(X[..., :3, :3], from_zyz(angles), atol=ROUNDING)
    for each in X.reshape(-1, 4, 4):
        np.testing.assert_allclose(pose((1, 1, 1), rpy=to_rpy(each[:3, :3])), each, atol=ROUNDING)


def test_a_pose_is_reached() -> None:
    """What is constructed is a goal of inverse kinematics."""
    arm = armwright.load_arm("puma560")
    solution = armwright.kinematics.inverse(arm, pose((0.4, 0.2, -0.1), rpy=(np.pi, 0, 0.3)))

    assert solution.allowed


def test_no_orientation() -> None:
    """Without an orientation a pose has that of its frame."""
    assert pose((1, 2, 3))[:3, :3].tolist() == np.eye(3).tolist()


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"rpy": (0, 0, 0), "quaternion": (1, 0, 0, 0)}, InvalidValueError, "one orientation, got quaternion and rpy"),
        ({"axis": (0, 0, 1)}, InvalidValueError, "axis and angle together, got only axis"),
        ({"angle": 1.0}, InvalidValueError, "axis and angle together, got only angle"),
        ({"axis": (0, 0, 0), "angle": 1.0}, InvalidValueError, "axis: expected a vector that is not 0"),
        ({"quaternion": (0, 0, 0, 0)}, InvalidValueError, "quaternion: expected a vector that is not 0"),
        ({"rotation": np.eye(3) * 2}, InvalidValueError, "rotation: expected an orthonormal matrix"),
        ({"rotation": np.diag((1, 1, -1))}, InvalidValueError, "rotation: expected an orthonormal matrix"),
        ({"euler": (0, 0, 0), "sequence": "ZYY"}, UnknownNameError, "ZYY"),
        ({"rpy": (0, 0)}, ShapeError, "rpy"),
        ({"rpy": (0, 0, np.nan)}, InvalidValueError, "rpy"),
        ({"rpy": np.zeros((3, 3)), "position": np.zeros((2, 3))}, ShapeError, "rotation and position: leading axes"),
        ({"axis": np.ones((3, 3)), "angle": (1, 2)}, ShapeError, "axis and angle: leading axes"),
    ],
    ids=str,
)
def test_refused(arguments: dict[str, object], error: type[Exception], message: str) -> None:
    """What is no orientation is refused, with what was expected."""
    with pytest.raises(error, match=message):
        pose(**arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize("length", [1e-300, 1e-150, 1e150, 1e300])
def test_directions_of_any_length(length: float) -> None:
    """An axis or a quaternion may be of any length but 0."""
    axis, quaternion = np.array((1.0, 2.0, 2.0)), np.array((0.5, -0.5, 0.5, 0.5))
    assert pose(axis=axis * length, angle=1.0) == pytest.approx(pose(axis=axis, angle=1.0), abs=1e-15)
    assert pose(quaternion=quaternion * length) == pytest.approx(pose(quaternion=quaternion), abs=1e-15)


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: rotation_from_quaternion((0, 0, 0, 0)), InvalidValueError, "quaternion: expected a vector"),
        (lambda: angle_between(np.ones((2, 3, 3)), np.ones((3, 3, 3))), ShapeError, "rotations: leading axes"),
        (lambda: homogeneous(np.ones((2, 3, 3)), np.zeros((3, 3))), ShapeError, "rotation and position: leading axes"),
        (lambda: between(np.eye(4), np.eye(4)[None], 0.5), ShapeError, "X_B"),
        (lambda: between(np.eye(4), np.eye(4), "half"), KindError, "s: expected numbers"),
        (lambda: to_rpy(np.ones((2, 3, 3))), ShapeError, "rotation: expected shape"),
        (lambda: to_rpy("R"), KindError, "rotation: expected numbers"),
    ],
)
def test_refused_by_the_other_functions(call: Callable[[], object], error: type[Exception], message: str) -> None:
    """What has another shape or kind is refused by name."""
    with pytest.raises(error, match=message):
        call()
