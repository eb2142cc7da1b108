"""The stick figure of an arm on its page."""

import numpy as np
import pytest

from armwright.arm.load import load_arm
from armwright.kinematics.forward_kinematics import link_poses
from armwright.report.stick_figure import skeleton_points
from oracles.arms import random_configurations

ROUNDING = 1e-12


@pytest.mark.parametrize("name", ["puma560", "stanford", "ur5"])
def test_links_follow_the_axes(name: str, rng: np.random.Generator) -> None:
    """From joint to joint the figure goes along the axis of the joint, and then at a right angle to it."""
    arm = load_arm(name)
    poses = link_poses(arm, random_configurations(arm, rng, 20))

    corners = skeleton_points(arm, poses)

    for i in range(arm.n):
        z = poses[:, i, :3, 2]
        along, across = corners[:, 2 * i + 2] - corners[:, 2 * i + 1], corners[:, 2 * i + 3] - corners[:, 2 * i + 2]
        np.testing.assert_allclose(np.cross(along, z), 0.0, atol=ROUNDING)
        np.testing.assert_allclose(np.sum(across * z, axis=-1), 0.0, atol=ROUNDING)
