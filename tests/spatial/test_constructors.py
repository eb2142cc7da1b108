"""Poses from positions and orientations, in each of the usual forms."""

import numpy as np
import pytest

import armwright
from armwright.errors import InvalidValueError, ShapeError, UnknownNameError
from armwright.spatial import from_zyz, pose, to_rpy

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
    ],
    ids=str,
)
def test_refused(arguments: dict[str, object], error: type[Exception], message: str) -> None:
    """What is no orientation is refused, with what was expected."""
    with pytest.raises(error, match=message):
        pose((0, 0, 0), **arguments)  # type: ignore[arg-type]
