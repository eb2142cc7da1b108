"""The least distance of bodies on motions, against another library at many configurations."""

import numpy as np

from armwright.compiled.arm import compile_arm
from armwright.motion.quintic_polynomials import quintic
from armwright.physics.cell_bodies import Body
from armwright.physics.clearance import RESOLUTION, ClearanceChecker, PlacedArm, Window
from armwright.spatial.shapes import Solid
from oracles.arms import random_arm, random_configurations, random_pose
from oracles.solids import coal_distance, coal_shape, random_shape
from samples import Sample

ITERATED = 1e-5
# Libraries may differ in how deep an overlap is: only distances apart are compared.
WITHIN = 0.3


def test_bounds_hold(sample: Sample) -> None:
    """The least distance is one that occurs, and none is below the bound; of bodies of one arm too."""
    found, looks = 0, 2000 if sample.whole else 200
    for rng in sample.cases(200):
        arm = random_arm(rng, int(rng.integers(2, 7)))
        fast, base = compile_arm(arm, quickly=True), random_pose(rng)
        motion = quintic(*random_configurations(arm, rng, 2), 1.0)
        bodies = [
            Body("link", Solid(shape=random_shape(rng), pose=random_pose(rng)), "ARM_1", link)
            for link in range(arm.n + 1)
        ]
        bodies += [Body("body", Solid(shape=random_shape(rng), pose=random_pose(rng))) for _ in range(2)]
        pairs = [(0, arm.n), (arm.n - 1, arm.n), (arm.n, arm.n + 1), (1, arm.n + 2)]
        checker = ClearanceChecker({"ARM_1": PlacedArm(fast, base)}, bodies, pairs)
        window = Window(0.0, 1.0, np.arange(len(pairs)), np.zeros(len(pairs)))

        least = checker.least({"ARM_1": motion}, [window], WITHIN)

        frames = base @ fast.link_poses(motion(np.linspace(0, 1, looks)))
        shapes = [coal_shape(body.solid.shape) for body in bodies]
        poses = [[X[body.link] @ body.solid.pose if body.arm else body.solid.pose for body in bodies] for X in frames]
        nearest = min(coal_distance(shapes[i], placed[i], shapes[j], placed[j]) for placed in poses for i, j in pairs)
        assert least.bound <= WITHIN
        if nearest > 0:
            assert least.bound <= nearest + ITERATED
        if least.closest is None:
            assert nearest >= WITHIN - ITERATED
        elif least.closest.distance > 0:
            found += 1
            (i, j), t = least.closest.bodies, least.closest.time
            X = (base @ fast.link_poses(motion(np.array([t]))))[0]
            at = [X[bodies[k].link] @ bodies[k].solid.pose if bodies[k].arm else bodies[k].solid.pose for k in (i, j)]
            assert abs(coal_distance(shapes[i], at[0], shapes[j], at[1]) - least.closest.distance) <= ITERATED
            assert least.closest.distance <= max(nearest / 0.9, nearest + RESOLUTION) + ITERATED
    assert found or not sample.whole
