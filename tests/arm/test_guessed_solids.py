"""Guessed capsules of an arm: they go from joint to joint without a gap."""

import numpy as np
import pytest

from armwright.arm.guessed_solids import guessed_radii, guessed_solids
from armwright.arm.load import load_arm
from armwright.arm.positions import ranges
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import link_poses
from armwright.spatial.shapes import Capsule, Sphere
from oracles.arms import random_arm
from oracles.catalogue import FEW, NAMES


def ends_of(shape: Capsule | Sphere, X: Array) -> list[Array]:
    if isinstance(shape, Sphere):
        return [X[:3, 3]]
    return [X[:3, 3] + side * shape.length / 2 * X[:3, 2] for side in (-1, 1)]


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_a_chain_of_capsules(name: str, rng: np.random.Generator) -> None:
    """Each link of a revolute arm begins within the guessed radius of the axis of its joint, and ends at its frame."""
    arm = load_arm(name)
    for q in rng.uniform(*ranges(arm), size=(5, arm.n)):
        frames = link_poses(arm, q)
        for i, solids in enumerate(guessed_solids(arm)):
            points = [p for solid in solids for p in ends_of(solid.shape, frames[i + 1] @ solid.pose)]
            axis, origin = frames[i, :3, 2], frames[i, :3, 3]
            away = [np.linalg.norm(np.cross(p - origin, axis)) for p in points]
            near = guessed_radii(arm)[i] * 0.1 + 1e-12
            assert all(solid.guessed for solid in solids)
            assert min(away) <= near
            assert min(np.linalg.norm(p - frames[i + 1, :3, 3]) for p in points) <= near


def test_radii(rng: np.random.Generator) -> None:
    """Links become thinner towards the tool, and an arm of twice the size is twice as thick."""
    radii = guessed_radii(random_arm(rng, 5))

    assert (np.diff(radii) < 0).all()
    assert radii[-1] == pytest.approx(radii[0] / 2)
