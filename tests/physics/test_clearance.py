"""Whether bodies meet on motions, against another library at many configurations of each."""

import numpy as np

from armwright.compiled.arm import compile_arm
from armwright.motion.quintic_polynomials import quintic
from armwright.physics.cell_bodies import Body
from armwright.physics.clearance import RESOLUTION, ClearanceChecker, PlacedArm
from armwright.spatial.shapes import Box, Solid, Sphere
from oracles.arms import random_arm, random_configurations, random_pose
from oracles.solids import coal_distance, coal_shape, random_shape
from samples import Sample

# Distances of convex solids are found by iteration.
ITERATED = 1e-5


def test_moves_among_bodies(sample: Sample) -> None:
    """No contact of a random arm with random bodies is missed, and none is told that is not as near as it says."""
    missed = invented = contacts = 0
    moves, looks = (1000, 2000) if sample.whole else (8, 200)
    for k in range(moves):
        rng = np.random.default_rng([sample.seed, k])
        arm = random_arm(rng, int(rng.integers(1, 7)))
        fast, base = compile_arm(arm, quickly=True), random_pose(rng)
        motion = quintic(*random_configurations(arm, rng, 2), 1.0)
        frames = base @ fast.link_poses(motion(np.linspace(0, 1, 7)))
        bodies = []
        for link in range(1, arm.n + 1):
            X = random_pose(rng)
            X[:3, 3] *= 0.1
            bodies.append(Body("link", Solid(shape=random_shape(rng), pose=X), "ARM_1", link))
        for _ in range(4):
            X = random_pose(rng)
            X[:3, 3] = frames[rng.integers(7), rng.integers(1, arm.n + 1), :3, 3] + rng.normal(size=3) * 0.3
            bodies.append(Body("body", Solid(shape=random_shape(rng), pose=X)))
        pairs = [(i, arm.n + j) for i in range(arm.n) for j in range(4)]

        contact = ClearanceChecker({"ARM_1": PlacedArm(fast, base)}, bodies, pairs).first_contact({"ARM_1": motion})

        shapes = [coal_shape(body.solid.shape) for body in bodies]
        frames = base @ fast.link_poses(motion(np.linspace(0, 1, looks)))
        nearest = min(
            coal_distance(shapes[i], X[bodies[i].link] @ bodies[i].solid.pose, shapes[j], bodies[j].solid.pose)
            for X in frames
            for i, j in pairs
        )
        contacts += contact is not None
        missed += contact is None and nearest < -ITERATED
        invented += contact is not None and nearest > RESOLUTION + ITERATED
    sample.record("contacts on moves of random arms, missed", moves, missed)
    assert (missed, invented) == (0, 0)
    assert 0 < contacts < moves


def test_a_thin_plate() -> None:
    """A plate of a millimetre that the tip of a lever passes at full speed is seen, when it is reached."""
    from armwright.arm.model import Arm, Joint

    arm = Arm(name="lever", joints=[Joint(kind="revolute", a=1.0)])
    fast = compile_arm(arm, quickly=True)
    plate = np.eye(4)
    plate[:3, 3] = 0.0, 1.0, 0.0
    tip = Body("tip", Solid(shape=Sphere(radius=0.01)), "ARM_1", 1)
    wall = Body("wall", Solid(shape=Box(size=(0.001, 0.3, 0.3)), pose=plate))
    checker = ClearanceChecker({"ARM_1": PlacedArm(fast, np.eye(4))}, [tip, wall], [(0, 1)])
    motion = quintic([0.0], [np.pi], 0.2)

    contact = checker.first_contact({"ARM_1": motion})

    assert contact is not None
    x = np.cos(motion(contact.time)[0])
    assert 0.0105 - 2 * RESOLUTION <= x <= 0.0105 + 2 * RESOLUTION
    assert checker.first_contact({"ARM_1": quintic([0.0], [1.5], 0.2)}) is None
    assert checker.first_contact({"ARM_1": quintic([0.0], [1.5], 0.2)}, margin=0.1) is not None
