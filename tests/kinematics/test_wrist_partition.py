"""The Jacobian of a PUMA in blocks, and its inverse."""

import attrs
import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm
from armwright.arrays import Array
from armwright.errors import UnsupportedArmError
from armwright.kinematics.differential import SingularConfigurationError
from armwright.kinematics.forward_kinematics import link_poses
from armwright.kinematics.jacobians import jacobian
from armwright.kinematics.wrist_partition import wrist_partitioned_inverse, wrist_partitioned_jacobian
from oracles.arms import random_pose

ROUNDING = 1e-12


def by_columns(arm: Arm, q: Array) -> Array:
    """The Jacobian of the wrist centre, worked out from the axes of the joints and turned into frame 3 of the table."""
    frames = link_poses(arm, q)
    wrist, R = frames[4, :3, 3], frames[3, :3, :3]
    columns = [[*(R.T @ np.cross(X[:3, 2], wrist - X[:3, 3])), *(R.T @ X[:3, 2])] for X in frames[:6]]
    return np.array(columns).T


def test_as_from_the_axes(rng: np.random.Generator) -> None:
    """Along the axes of frame 3 at the wrist centre, the columns are those that the joint axes make."""
    arm = load_arm("puma560")
    moved = attrs.evolve(arm, base=random_pose(rng), tool=random_pose(rng))
    q = rng.uniform(-3, 3, size=(50, 6))
    for one in (arm, moved):
        J = wrist_partitioned_jacobian(one, q)
        np.testing.assert_allclose(J, [by_columns(one, row) for row in q], atol=ROUNDING)
        assert not J[:, :3, 3:].any()


def test_the_inverse_of_the_blocks(rng: np.random.Generator) -> None:
    """The inverse by blocks is the inverse that LU gives, and turns twists of the tool into joint velocities."""
    arm = load_arm("puma560")
    q = rng.uniform(-3, 3, size=(200, 6))
    J, inverse = wrist_partitioned_jacobian(arm, q), wrist_partitioned_inverse(arm, q)
    good = np.linalg.cond(J) < 1e4
    assert good.sum() > 150
    np.testing.assert_allclose(inverse[good], np.linalg.inv(J[good]), rtol=1e-9, atol=1e-9)
    qd = rng.uniform(-1, 1, size=6)
    # The tool of this PUMA is its wrist centre: the twist of the tool, turned into the forearm.
    R = link_poses(arm, q[0])[3, :3, :3]
    v, w = np.split(jacobian(arm, q[0]) @ qd, 2)
    np.testing.assert_allclose(inverse[0] @ np.concatenate([R.T @ v, R.T @ w]), qd, atol=1e-9)


@pytest.mark.parametrize(
    ("q", "factor"),
    [((0.1, 0.2, 0.3, 0.4, 0.0, 0.5), "wrist"), ((0.1, 0.2, np.arctan2(0.433, -0.02), 0, 1, 0), "elbow")],
)
def test_singular(q: tuple[float, ...], factor: str) -> None:
    """Where a factor of the determinant vanishes there is no inverse, and the factor is named."""
    arm = load_arm("puma560")
    with pytest.raises(SingularConfigurationError, match=f"singular at the {factor}: its factor of the determinant is"):
        wrist_partitioned_inverse(arm, q)


def test_other_arms() -> None:
    """An arm built otherwise has no such blocks."""
    with pytest.raises(
        UnsupportedArmError, match=r"'ur5': no wrist-partitioned Jacobian; expected an arm built like pu"
    ):
        wrist_partitioned_jacobian(load_arm("ur5"), np.zeros(6))
