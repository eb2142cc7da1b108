"""Straight paths with rounded corners."""

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.errors import InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.certified_motion import CertifiedMotion
from armwright.motion.continuity_report import continuity
from armwright.motion.obstruction import PathError
from armwright.motion.path import Path
from armwright.motion.rounded_corners import rounded_move
from armwright.spatial.poses import homogeneous

ARM = load_arm("stanford")
DOWN = np.diag((1.0, -1.0, -1.0))
DEVIATION = 1e-4


def start() -> np.ndarray:
    from armwright.kinematics.inverse_kinematics.solve import inverse

    return inverse(ARM, homogeneous(DOWN, (0.45, 0.0, 0.25))).best.q


def corner(blend: float, *places: tuple[float, float, float]) -> CertifiedMotion:
    q = start()
    path = Path(poses=np.stack([forward(ARM, q), *(homogeneous(DOWN, place) for place in places)]))
    return rounded_move(ARM, path, q, blend=blend, deviation=DEVIATION, speed=100.0).motion


@pytest.mark.parametrize("blend", [0.005, 0.02, 0.05])
def test_a_corner_is_left_no_sooner_than_allowed(blend: float) -> None:
    """Farther from the corner than the blend the tool is on the straight lines, and it passes it at less than that."""
    A, B, C = (0.45, 0.0, 0.25), (0.45, 0.2, 0.25), (0.45, 0.2, 0.10)
    move = corner(blend, B, C)
    hand = forward(ARM, move.trajectory(np.linspace(0, move.trajectory.duration, 2001)))[:, :3, 3]
    away = np.linalg.norm(hand - B, axis=1)
    first = np.linalg.norm(np.cross(hand - A, np.subtract(B, A) / 0.2), axis=1)
    second = np.linalg.norm(np.cross(hand - B, np.subtract(C, B) / 0.15), axis=1)
    off = np.minimum(first, second)

    assert off[away > blend + 1e-3].max() <= DEVIATION * 1.01
    assert 0.05 * blend < away.min() < blend
    assert off.max() <= move.certificate.deviation
    np.testing.assert_allclose(hand[-1], C, atol=1e-9)


def test_no_stop_at_the_corner() -> None:
    """Position, speed and acceleration have no jump, and the tool never stands still on the way."""
    move = corner(0.03, (0.45, 0.2, 0.25), (0.45, 0.2, 0.10))
    t = np.linspace(0.1, 0.9, 500) * move.trajectory.duration

    assert continuity(move.trajectory).order >= 2
    assert np.abs(move.trajectory(t, 1)).max(axis=1).min() > 0.01


def test_limits() -> None:
    """Speeds and accelerations of the joints stay inside their limits, exactly."""
    move = corner(0.03, (0.45, 0.2, 0.25), (0.45, 0.2, 0.10))

    assert (move.trajectory.peaks(1) <= ARM.limits.speed * (1 + 1e-9)).all()
    assert (move.trajectory.peaks(2) <= ARM.limits.acceleration * (1 + 1e-9)).all()


def test_a_short_line_is_rounded_from_its_middle() -> None:
    """A blend longer than the lines begins at their middle."""
    move = corner(5.0, (0.45, 0.1, 0.25), (0.45, 0.1, 0.15))

    assert move.certificate.deviation > 0.005
    np.testing.assert_allclose(move.trajectory(0.0), start(), atol=1e-9)


def test_equal_poses_count_once() -> None:
    """A point given twice is one corner."""
    once = corner(0.02, (0.45, 0.1, 0.25), (0.45, 0.1, 0.15))
    twice = corner(0.02, (0.45, 0.1, 0.25), (0.45, 0.1, 0.25), (0.45, 0.1, 0.15))

    assert twice.trajectory.duration == pytest.approx(once.trajectory.duration)


def test_refused() -> None:
    """A blend of nothing is refused, and so is a corner out of reach, with the reason."""
    with pytest.raises(InvalidValueError, match="blend: expected more than 0 m"):
        corner(0.0, (0.45, 0.1, 0.25), (0.45, 0.1, 0.15))
    with pytest.raises(PathError):
        corner(0.02, (9.0, 0.1, 0.25), (0.45, 0.1, 0.15))
