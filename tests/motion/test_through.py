"""Through frames without a stop."""

from itertools import pairwise

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.errors import ShapeError
from armwright.kinematics.forward_kinematics import forward
from armwright.motion.obstruction import PathError
from armwright.motion.through import through_frames
from armwright.spatial.poses import homogeneous

ARM = load_arm("stanford")
START = np.array((0.1, 1.0, 0.5, 0.2, 0.9, 0.1))


def frames() -> np.ndarray:
    """Three frames, 100 mm apart."""
    X = forward(ARM, START)
    return np.stack(
        [homogeneous(X[:3, :3], X[:3, 3] + np.array(way) * 0.1) for way in ((1, 0, 0), (1, 1, 0), (1, 1, 1))]
    )


def test_through_without_a_stop() -> None:
    """From rest to rest the tool passes each frame between, on the move, and stays within the bound it comes with."""
    found = through_frames(ARM, START, frames())
    move = found.trajectory
    t = np.linspace(0, move.duration, 4001)
    X = forward(ARM, move(t))

    np.testing.assert_allclose(move(0.0, 1), 0, atol=1e-12)
    np.testing.assert_allclose(move(move.duration, 1), 0, atol=1e-9)
    np.testing.assert_allclose(X[-1], frames()[-1], atol=1e-8)
    corners = np.concatenate([forward(ARM, START)[None], frames()])[:, :3, 3]
    for goal in corners[1:-1]:
        gap = np.linalg.norm(X[:, :3, 3] - goal, axis=1)
        at = int(gap.argmin())
        assert gap[at] < 1e-4
        assert np.linalg.norm(move(float(t[at]), 1)) > 0.05
    legs = [(a, (b - a) / np.linalg.norm(b - a), np.linalg.norm(b - a)) for a, b in pairwise(corners)]
    away = [
        np.linalg.norm(X[:, :3, 3] - (a + np.clip((X[:, :3, 3] - a) @ u, 0, length)[:, None] * u), axis=1)
        for a, u, length in legs
    ]
    assert np.min(away, axis=0).max() <= found.certificate.deviation


def test_what_is_refused() -> None:
    """One frame is no way through frames, and what keeps the arm from a frame is named."""
    with pytest.raises(ShapeError, match="poses: expected two or more"):
        through_frames(ARM, START, frames()[:1])
    far = frames()
    far[1, 0, 3] = 5.0
    with pytest.raises(PathError, match="in the closest, joint 3 would be at 48"):
        through_frames(ARM, START, far)
