"""The PUMA of roboticstoolbox and the one here: one arm, whose joint positions count from elsewhere."""

import numpy as np

from armwright.arm.load import load_arm
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import forward

# The table of roboticstoolbox.models.DH.Puma560, as its source has it: d [m], a [m], alpha [rad].
HEIGHT = 0.672
THEIRS = (
    (HEIGHT, 0.0, np.pi / 2),
    (0.0, 0.4318, 0.0),
    (0.15005, 0.0203, -np.pi / 2),
    (0.4318, 0.0, np.pi / 2),
    (0.0, 0.0, -np.pi / 2),
    (0.0, 0.0, 0.0),
)
# The same table with the lengths of this package.
SAME_LENGTHS = (
    (0.0, 0.0, np.pi / 2),
    (0.0, 0.432, 0.0),
    (0.149, 0.020, -np.pi / 2),
    (0.433, 0.0, np.pi / 2),
    (0.0, 0.0, -np.pi / 2),
    (0.0, 0.0, 0.0),
)
# docs/translation.md: what is to be added to a position here.
OFFSETS = np.pi * np.array([1, 1, 1, 0, 0, 1])


def standard(table: tuple[tuple[float, float, float], ...], q: Array) -> Array:
    """The tool pose of a table of turning joints, multiplied out from its meaning: Rz(q) Tz(d) Tx(a) Rx(alpha)."""
    X = np.eye(4)
    for angle, (d, a, alpha) in zip(q, table, strict=True):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        X = X @ [[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]]
        X = X @ [[1, 0, 0, a], [0, ca, -sa, 0], [0, sa, ca, 0], [0, 0, 0, 1]]
    return X


def test_the_map_between_zeros(rng: np.random.Generator) -> None:
    """With the offsets of the page both tables are one arm: the same pose for the same lengths, to rounding."""
    arm = load_arm("puma560")
    for q in rng.uniform(-np.pi, np.pi, size=(200, 6)):
        np.testing.assert_allclose(standard(SAME_LENGTHS, q + OFFSETS), forward(arm, q), atol=1e-12)


def test_the_published_lengths(rng: np.random.Generator) -> None:
    """With its own lengths the other's tool is as turned, and 3.2 mm away at most, its base being on the floor."""
    arm = load_arm("puma560")
    lift = np.array((0.0, 0.0, HEIGHT))
    worst = 0.0
    for q in rng.uniform(-np.pi, np.pi, size=(500, 6)):
        theirs, ours = standard(THEIRS, q + OFFSETS), forward(arm, q)
        np.testing.assert_allclose(theirs[:3, :3], ours[:3, :3], atol=1e-12)
        worst = max(worst, float(np.linalg.norm(theirs[:3, 3] - lift - ours[:3, 3])))
    assert worst < 3.2e-3
    assert not np.allclose(standard(THEIRS, np.full(6, 0.3)), forward(arm, np.full(6, 0.3)), atol=0.1)
