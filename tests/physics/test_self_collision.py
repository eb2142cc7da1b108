"""Which bodies of an arm may not meet one another: the rule, against another library in every configuration."""

from collections.abc import Sequence
from itertools import pairwise

import attrs
import numpy as np
import pytest

from armwright.arm.collision_pairs import CollisionPairs
from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link
from armwright.arrays import Array
from armwright.kinematics.forward_kinematics import link_poses
from armwright.physics.cell_bodies import Body, arm_bodies
from armwright.physics.clearance import RESOLUTION
from armwright.physics.self_collision import random_configurations, self_pairs, touch_bounds
from armwright.spatial.poses import homogeneous
from armwright.spatial.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere, farthest
from oracles.arms import random_arm, random_pose
from oracles.catalogue import FEW, NAMES
from oracles.solids import coal_distance, coal_shape, random_shape
from samples import Sample

# Distances of convex solids are found by iteration.
ITERATED = 1e-5
LIMITS = Limits(lower=-2, upper=2)
TETRAHEDRON = Mesh(
    vertices=[[0.1, 0, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0], [0, 0, 0.2]],
    faces=[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
)


def built(rng: np.random.Generator, joints: int) -> Arm:
    """A small arm of joints near one another, some links of which look like nothing, and others like several solids."""
    arm = random_arm(rng, joints)
    scale = rng.choice([0.0, 0.1, 0.4], size=(joints, 2))
    rows = [attrs.evolve(x, d=x.d * s, a=x.a * t) for x, (s, t) in zip(arm.joints, scale, strict=True)]
    links = []
    for _ in range(joints):
        poses = [random_pose(rng) for _ in range(rng.integers(0, 4))]
        near = [homogeneous(X[:3, :3], X[:3, 3] * 0.05) for X in poses]
        links.append(Link(solids=[Solid(shape=random_shape(rng), pose=X) for X in near]))
    return attrs.evolve(arm, joints=rows, links=links, base_solids=[Solid(shape=random_shape(rng))])


def touching(arm: Arm, bodies: Sequence[Body], a: int, b: int, q: Array) -> float:
    """The distance of two bodies of an arm in a configuration, by coal."""
    frames = link_poses(arm, q)
    return min(
        coal_distance(
            coal_shape(x.solid.shape), frames[a] @ x.solid.pose, coal_shape(y.solid.shape), frames[b] @ y.solid.pose
        )
        for x in bodies
        for y in bodies
        if (x.link, y.link) == (a, b)
    )


@pytest.mark.drawn(0.1)
def test_pairs_of_random_arms(sample: Sample) -> None:
    """Left out are neighbours and pairs that touch in all configurations; every other pair is apart in one of them."""
    wrong = always = apart = 0
    arms = 60
    for rng in sample.cases(arms):
        arm = built(rng, int(rng.integers(2, 6)))
        bodies, everywhere = arm_bodies(arm.name, arm), random_configurations(arm)
        pairs = self_pairs(arm)

        present = sorted({body.link for body in bodies})
        neighbours = list(pairwise(present))
        assert [x.bodies for x in pairs.left_out if x.reason.startswith("neighbours")] == neighbours
        for a, b in (x.bodies for x in pairs.left_out if x.reason.startswith("touch")):
            always += 1
            distances = [touching(arm, bodies, a, b, q) for q in everywhere[:: 1 if sample.whole else 40]]
            wrong += max(distances) > RESOLUTION + ITERATED
        for a, b in pairs.checked:
            apart += 1
            wrong += not any(touching(arm, bodies, a, b, q) > RESOLUTION - ITERATED for q in everywhere)
        assert len(pairs.checked) + len(pairs.left_out) == len(present) * (len(present) - 1) // 2
    sample.record("pairs of bodies, left out or checked wrongly", always + apart, wrong, always=always)
    assert wrong == 0
    assert apart > 0


@pytest.mark.parametrize("shape", [Sphere(radius=0.5), Cylinder(radius=0.1, length=1), Box(size=(0.3, 0.2, 1))])
def test_a_pair_that_is_seldom_apart(shape: Sphere | Cylinder | Box) -> None:
    """A pair that touches in all but 1 of 1000 configurations is checked; one that touches in all is not."""
    # Solids 1 m high, one of which a slide lifts above the other: they part at its upper end.
    solid, small = [Solid(shape=shape)], [Solid(shape=Sphere(radius=0.01))]
    for upper, checked in ((1.0015, True), (1.0004, False)):
        joints = [
            Joint(kind="revolute", limits=LIMITS),
            Joint(kind="prismatic", limits=Limits(lower=0, upper=upper)),
        ]
        arm = Arm(name="lift", joints=joints, links=[Link(solids=small), Link(solids=solid)], base_solids=solid)

        pairs = self_pairs(arm)

        assert ((0, 2) in pairs.checked) is checked


@pytest.mark.drawn(0.1)
def test_what_capsules_tell(sample: Sample) -> None:
    """Solids that touch for sure do, and solids that may not do not: in poses near contact, by coal."""
    wrong, told, poses = 0, 0, 40
    for rng in sample.cases(300):
        one, other = (Solid(shape=random_shape(rng), pose=random_pose(rng)) for _ in range(2))
        frames = np.array([random_pose(rng) for _ in range(poses)])
        others = np.array([random_pose(rng) for _ in range(poses)])
        # The origins of the solids are as far apart as a part of their sizes.
        size = farthest(one.shape) + farthest(other.shape)
        apart = (others @ other.pose)[:, :3, 3] - (frames @ one.pose)[:, :3, 3]
        wanted = rng.uniform(0, size, (poses, 1)) * apart / np.linalg.norm(apart, axis=1, keepdims=True)
        others[:, :3, 3] += wanted - apart

        surely, maybe = touch_bounds(one, other, frames, others)

        shapes = coal_shape(one.shape), coal_shape(other.shape)
        distances = np.array(
            [
                coal_distance(shapes[0], X @ one.pose, shapes[1], Y @ other.pose)
                for X, Y in zip(frames, others, strict=True)
            ]
        )
        wrong += int((surely & (distances > RESOLUTION + ITERATED)).sum())
        wrong += int((~maybe & (distances < RESOLUTION - ITERATED)).sum())
        told += int((surely | ~maybe).sum())
        assert not (surely & ~maybe).any()
    sample.record("touching solids told by capsules", told, wrong)
    assert wrong == 0
    assert told > 0


def test_nothing_is_known_of_the_inside_of_a_mesh() -> None:
    """A mesh may have a hole: that a body is at its origin does not tell that they touch."""
    mesh, ball = Solid(shape=TETRAHEDRON), Solid(shape=Sphere(radius=0.01))

    surely, maybe = touch_bounds(mesh, ball, np.eye(4)[None], np.eye(4)[None])

    assert (surely.tolist(), maybe.tolist()) == ([False], [True])


def test_links_that_look_like_nothing() -> None:
    """The bodies before and behind links without solids are neighbours, and it is said why."""
    ball = Link(solids=[Solid(shape=Sphere(radius=0.05))])
    joints = [Joint(kind="revolute", a=0.3, limits=LIMITS)] * 6
    arm = Arm(name="gaps", joints=joints, links=[ball, Link(), ball, Link(), Link(), ball])

    pairs = self_pairs(arm)

    assert [(x.bodies, x.reason) for x in pairs.left_out] == [
        ((1, 3), "neighbours: link 2 between them without solids"),
        ((3, 6), "neighbours: links 4 to 5 between them without solids"),
    ]
    assert pairs.checked == ((1, 6),)


def test_what_the_tool_holds() -> None:
    """A gripper is fixed to the last link, and is checked against the others; a wide one always meets the wrist."""
    ball = Link(solids=[Solid(shape=Sphere(radius=0.05))])
    joints = [Joint(kind="revolute", a=0.3, limits=LIMITS)] * 3
    # The gripper is in the frame of the last link, wherever the tool is.
    arm = Arm(name="held", joints=joints, links=[ball] * 3, tool=homogeneous(np.eye(3), (2.0, 0.0, 0.0)))
    bodies = arm_bodies("held", arm)

    def pairs_with(size: float) -> tuple[tuple[tuple[int, int], ...], list[tuple[int, int]]]:
        palm = Body("palm", Solid(shape=Box(size=(size, size, 0.1))), "held", 3)
        pairs = self_pairs(arm, bodies, [palm])
        return pairs.checked, [x.bodies for x in pairs.left_out]

    assert pairs_with(0.1) == (((1, 3), (1, 4), (2, 4)), [(1, 2), (2, 3), (3, 4)])
    assert pairs_with(0.7) == (((1, 3), (1, 4)), [(1, 2), (2, 3), (2, 4), (3, 4)])


def test_the_arm_file_has_the_last_word() -> None:
    """A pair of the file is checked though its bodies are neighbours or always touch, or left out though they part."""
    ball = Link(solids=[Solid(shape=Sphere(radius=0.05))])
    arm = Arm(name="file", joints=[Joint(kind="revolute", a=0.3, limits=LIMITS)] * 4, links=[ball] * 4)
    arm = attrs.evolve(arm, collisions=CollisionPairs(leave_out=[(4, 1)], check=[(1, 2)]))

    pairs = self_pairs(arm)

    assert pairs.checked == ((1, 2), (1, 3), (2, 4))
    assert ((1, 4), "left out by the arm file") in pairs.left_out


@pytest.mark.parametrize("shape", [TETRAHEDRON, Box(size=(0.1, 0.1, 0.2)), Cylinder(radius=0.05, length=0.3)])
def test_solids_about_one_point(shape: Mesh | Box | Cylinder) -> None:
    """Solids that all hold the centre of a wrist always touch, of whatever form; a longer wrist parts them."""
    joint = Joint(kind="revolute", alpha=np.pi / 2, limits=LIMITS)
    wrist = Arm(name="wrist", joints=[joint] * 3, links=[Link(solids=[Solid(shape=shape)])] * 3)
    longer = attrs.evolve(wrist, joints=[joint, attrs.evolve(joint, a=0.6), joint])

    assert self_pairs(wrist).checked == ()
    assert self_pairs(longer).checked == ((1, 3),)


# Configurations that these arms reach: their ready positions, stretched out, and folded [deg], [m].
REACHED = {
    "puma560": [
        (0, -90, 90, 0, 0, 0),
        (0, 0, 0, 0, 0, 0),
        (0, 0, 90, 0, 0, 0),
        (0, -45, 180, 0, 45, 0),
        (90, 0, 180, 0, 99, 0),
    ],
    "ur5": [(0, -90, 0, -90, 0, 0), (0, 0, 0, 0, 0, 0), (0, -90, 90, -90, -90, 0), (0, -60, 120, -150, -90, 0)],
    "stanford": [(0, 90, 0.14, 0, 0, 0), (0, 90, 0.5, 0, 0, 0), (0, 135, 0.6, 0, 45, 0), (90, 45, 1.1, 90, -90, 0)],
}


@pytest.mark.parametrize("name", REACHED)
def test_configurations_that_arms_reach(name: str) -> None:
    """No checked bodies of an arm of the catalogue meet where the real arm stands every day."""
    arm = load_arm(name)
    bodies, pairs = arm_bodies(name, arm), self_pairs(arm)
    for position in REACHED[name]:
        q = np.where(arm.revolute, np.deg2rad(position), position)
        for a, b in pairs.checked:
            assert touching(arm, bodies, a, b, q) > 0, (position, a, b)


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_bodies_of_the_catalogue_hang_together(name: str, rng: np.random.Generator) -> None:
    """Wherever the joints are, each body of an arm touches the next one, but for the gaps of public files.

    A guessed slide begins where it is at its lower limit, and leaves the link before it behind.
    """
    arm = load_arm(name)
    gap = 0.1 * sum(joint.span() for joint in arm.joints)
    bodies = arm_bodies(name, arm)
    present = sorted({body.link for body in bodies})
    for q in random_configurations(arm)[rng.integers(0, 10_000, 5)]:
        for a, b in pairwise(present):
            if not arm.joints[b - 1].revolute and not arm.links[b - 1].solids:
                continue
            assert touching(arm, bodies, a, b, q) < gap, (a, b)


def test_the_same_every_time(rng: np.random.Generator) -> None:
    """The pairs of an arm are the same whenever they are asked for, and pairs of a capsule are those of its parts."""
    arm = built(rng, 4)

    assert self_pairs(arm) == self_pairs(arm)

    capsule = Solid(shape=Capsule(radius=0.04, length=0.2))
    ends = [homogeneous(np.eye(3), (0, 0, z)) for z in (-0.1, 0.1)]
    parts = [Solid(shape=Cylinder(radius=0.04, length=0.2)), *(Solid(shape=Sphere(radius=0.04), pose=X) for X in ends)]
    whole = attrs.evolve(arm, links=[Link(solids=[capsule])] * 4)
    split = attrs.evolve(arm, links=[Link(solids=parts)] * 4)
    assert self_pairs(whole) == self_pairs(split)
