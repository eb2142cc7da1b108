"""Arms to test with: random ones of every kind of joint."""

import attrs
import numpy as np

from armwright.arm.coupling import Coupling
from armwright.arm.limits import Limits
from armwright.arm.model import Arm, Joint, Link, Motor, Spring
from armwright.arrays import Array
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import rotation_from_vector


def random_pose(rng: np.random.Generator) -> Array:
    return homogeneous(rotation_from_vector(rng.normal(size=3)), rng.normal(size=3))


def random_link(rng: np.random.Generator) -> Link:
    """A body made of a dozen point masses, so that its tensor is one that a body can have."""
    points, masses = rng.normal(scale=0.2, size=(12, 3)), rng.uniform(0.05, 0.4, size=12)
    com = masses @ points / masses.sum()
    r = points - com
    inertia = np.einsum(
        "k,kij->ij", masses, np.einsum("kl,kl,ij->kij", r, r, np.eye(3)) - np.einsum("ki,kj->kij", r, r)
    )
    return Link(mass=masses.sum(), com=com, inertia=inertia)


def random_arm(rng: np.random.Generator, joints: int) -> Arm:
    """An arm with joints of both kinds, skew axes, any base, tool and gravity."""
    limits = Limits(lower=-3, upper=3, speed=2, acceleration=5, effort=100)
    return Arm(
        name="random",
        joints=[
            Joint(
                kind="revolute" if rng.random() < 0.6 else "prismatic",
                theta=rng.normal(),
                d=rng.normal(),
                a=rng.normal(),
                alpha=rng.normal(),
                limits=limits,
            )
            for _ in range(joints)
        ],
        links=[random_link(rng) for _ in range(joints)],
        motors=[Motor(inertia=rng.uniform(0, 0.5)) for _ in range(joints)],
        base=random_pose(rng),
        tool=random_pose(rng),
        gravity=rng.normal(scale=9, size=3),
    )


def squared(arm: Arm, rng: np.random.Generator) -> Arm:
    """The arm with the geometry that builders like: right angles, and lengths that are often nothing."""
    quarter = np.pi / 2
    return attrs.evolve(
        arm,
        joints=[
            attrs.evolve(
                joint,
                theta=quarter * rng.integers(-2, 3),
                d=joint.d * rng.integers(0, 2),
                a=joint.a * rng.integers(0, 2),
                alpha=quarter * rng.integers(-2, 3),
            )
            for joint in arm.joints
        ],
    )


def random_configurations(arm: Arm, rng: np.random.Generator, count: int) -> Array:
    """Configurations spread evenly over the limits, (count, n)."""
    return rng.uniform(arm.limits.lower, arm.limits.upper, size=(count, arm.n))


def of_all_kinds(arm: Arm, rng: np.random.Generator) -> Arm:
    """The arm with fixed transforms at some joints, links that weigh nothing in between, and drives with friction."""
    joints = [attrs.evolve(x, fixed=random_pose(rng)) if rng.random() < 0.5 else x for x in arm.joints]
    links = [Link() if i + 1 < arm.n and rng.random() < 0.3 else link for i, link in enumerate(arm.links)]
    names = ("inertia", "viscous", "coulomb_forward", "coulomb_backward")
    motors = [Motor(**dict(zip(names, rng.uniform(0.1, 2.0, size=4), strict=True))) for _ in range(arm.n)]
    return attrs.evolve(arm, joints=joints, links=links, motors=motors)


def with_all_friction(arm: Arm, rng: np.random.Generator) -> Arm:
    """The arm with drives that have every kind of friction, or some kinds at some joints."""
    numbers = rng.uniform(0.1, 2.0, size=(arm.n, 8)) * (rng.random((arm.n, 8)) < 0.7)
    names = ("inertia", "viscous", "coulomb_forward", "coulomb_backward", "stribeck", "cube_root", "offset")
    motors = []
    for motor, row in zip(arm.motors, numbers, strict=True):
        values = dict(zip(names, row, strict=False))
        values["offset"] *= rng.choice([-1, 1])
        motors.append(attrs.evolve(motor, **values, stribeck_speed=rng.uniform(0.1, 1.0)))
    return attrs.evolve(arm, motors=motors)


def with_springs(arm: Arm, rng: np.random.Generator) -> Arm:
    """The arm with springs at most of its joints, one at the first at least."""
    joints = [
        attrs.evolve(joint, spring=Spring(stiffness=rng.uniform(1.0, 20.0), rest=rng.normal()))
        if i == 0 or rng.random() < 0.7
        else joint
        for i, joint in enumerate(arm.joints)
    ]
    return attrs.evolve(arm, joints=joints)


def coupled(arm: Arm, rng: np.random.Generator, limits: tuple[Limits, ...] = ()) -> Arm:
    """The arm with drives that move several joints each, but for some that move their own alone."""
    while True:
        C = np.diag(rng.uniform(0.5, 2.0, size=arm.n) * rng.choice([-1, 1], size=arm.n))
        alone = rng.random(arm.n) < 0.3
        C[alone, alone] = 1.0
        C += (rng.random((arm.n, arm.n)) < 0.3) * rng.normal(size=(arm.n, arm.n)) * ~np.eye(arm.n, dtype=bool) * ~alone
        if np.linalg.cond(C) < 20 and not np.array_equal(C, np.eye(arm.n)):
            return attrs.evolve(arm, coupling=Coupling(matrix=C, limits=limits))
