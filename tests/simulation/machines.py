"""Small machines whose motion one can calculate, and what every simulated motion must obey."""

import attrs
import numpy as np

from armwright.arm.limits import Limits
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Link, Motor
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.simulation.result import JointState, Simulation, Status
from oracles.arms import random_arm

# Energy that a ledger may miss, beside the energies in it: what the fixed step leaves, far above rounding.
BALANCE = 1e-9


def free(arm: Arm) -> Arm:
    """The arm without friction and without limits."""
    return attrs.evolve(
        arm,
        joints=[attrs.evolve(joint, limits=Limits()) for joint in arm.joints],
        motors=[Motor(inertia=motor.inertia) for motor in arm.motors],
    )


def pendulum(**motor: float) -> Arm:
    """2 kg half a metre from a level axis; at q = 0 it points sideways, at -90 deg down."""
    return Arm(
        name="pendulum",
        joints=[Joint(kind="revolute", a=0.5)],
        links=[Link(mass=2.0)],
        motors=[Motor(**motor)],
        gravity=(0.0, -STANDARD_GRAVITY, 0.0),
    )


def block(mass: float = 2.0, lower: float = -10.0, upper: float = 10.0, **motor: float) -> Arm:
    """A block on a level rail."""
    return Arm(
        name="block",
        joints=[Joint(kind="prismatic", limits=Limits(lower=lower, upper=upper))],
        links=[Link(mass=mass)],
        motors=[Motor(**motor)],
        gravity=(0.0, -STANDARD_GRAVITY, 0.0),
    )


def lift(**motor: float) -> Arm:
    """3 kg on an upward slide with stops at 0 and 2 m."""
    return Arm(
        name="lift",
        joints=[Joint(kind="prismatic", limits=Limits(lower=0.0, upper=2.0))],
        links=[Link(mass=3.0)],
        motors=[Motor(**motor)],
    )


def balanced(found: Simulation) -> None:
    assert found.status is Status.FINISHED
    scale = max(1.0, np.abs(found.energy).max(), found.heat.max(), found.work.max())
    assert np.abs(found.energy_imbalance).max() < BALANCE * scale


def lawful(arm: Arm, found: Simulation) -> None:
    """Newton's law holds at every moment, held joints stand still, and friction is against the motion."""
    bare = attrs.evolve(arm, motors=[Motor(inertia=motor.inertia) for motor in arm.motors])
    taken = inverse_dynamics(bare, found.q, found.qd, found.qdd)
    given = found.tau + found.friction + found.hold
    np.testing.assert_allclose(given, taken, atol=1e-9 * max(1.0, np.abs(taken).max()))
    held = found.state != JointState.MOVES
    assert not found.qd[held].any()
    assert not found.qdd[held].any()
    assert not found.friction[held].any()
    assert not found.hold[~held].any()
    assert (found.friction * found.qd <= 0).all()
    stuck = found.state == JointState.STICKS
    forward = np.broadcast_to([motor.coulomb_forward for motor in arm.motors], stuck.shape)
    backward = np.broadcast_to([motor.coulomb_backward for motor in arm.motors], stuck.shape)
    assert (found.hold[stuck] >= -forward[stuck] - 1e-8).all()
    assert (found.hold[stuck] <= backward[stuck] + 1e-8).all()
    assert (np.diff(found.heat, axis=0) >= -1e-12).all()


def rough(rng: np.random.Generator, joints: int) -> Arm:
    """A random arm with friction that differs by joint and direction, narrow stops and weak drives."""
    arm = random_arm(rng, joints)
    inertia, viscous, forward, backward = rng.uniform(0, 1, size=(4, joints)) * np.array([[0.5], [2], [10], [10]])
    forward[rng.random(joints) < 0.3] = 0.0
    return attrs.evolve(
        arm,
        joints=[
            attrs.evolve(joint, limits=Limits(lower=-low, upper=high, effort=20.0))
            for joint, low, high in zip(arm.joints, *rng.uniform(0.05, 1, size=(2, joints)), strict=True)
        ],
        motors=[
            Motor(inertia=a, viscous=b, coulomb_forward=c, coulomb_backward=d)
            for a, b, c, d in zip(inertia, viscous, forward, backward, strict=True)
        ],
    )
