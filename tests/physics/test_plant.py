"""Arms as bodies of a world, against armwright's own dynamics, and against mechanics by hand."""

from typing import Any

import attrs
import mujoco
import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link, Motor
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.dynamics.energy import kinetic_energy, potential_energy
from armwright.errors import UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward
from armwright.physics.friction import dry_offsets
from armwright.physics.plant import ArmIndices, add_arm, arm_indices, finish, new_world
from oracles.arms import of_all_kinds, random_arm, random_pose
from oracles.catalogue import FEW_WITH_MASSES, WITH_MASSES
from samples import Sample

# What the product of some dozen transforms loses.
EXACT = 1e-12


def in_a_world(arm: Arm, base: Array | None = None, timestep: float = 1e-3) -> tuple[Any, Any, ArmIndices]:
    """A world with one arm: its model, its data, where the arm is in them."""
    base = np.eye(4) if base is None else base
    # Gravity is specified along the axes of the base frame.
    spec = new_world(base[:3, :3] @ arm.gravity, timestep)
    model = finish(spec, (add_arm(spec, "A", arm, base),))
    return model, mujoco.MjData(model), arm_indices(model, "A", arm.n)


def check_equations(arm: Arm, rng: np.random.Generator, states: int, base: Array | None = None) -> None:
    """Mass matrix, bias and tool pose of the world are those of the compiled arm."""
    model, data, indices = in_a_world(arm, base)
    compiled = compile_arm(arm, quickly=True)
    for _ in range(states):
        q = rng.uniform(np.maximum(arm.limits.lower, -3), np.minimum(arm.limits.upper, 3))
        qd = rng.normal(size=arm.n)
        data.qpos[indices.positions], data.qvel[indices.speeds] = q, qd
        mujoco.mj_forward(model, data)
        M = np.zeros((arm.n, arm.n))
        mujoco.mj_fullM(model, data, M)

        expected, bias = compiled.mass_and_bias(q, qd)
        X = (np.eye(4) if base is None else base) @ forward(arm, q)
        np.testing.assert_allclose(M, expected, rtol=0, atol=EXACT * np.abs(expected).max())
        scale = np.abs(bias).max() + np.abs(expected).max()
        np.testing.assert_allclose(data.qfrc_bias, bias, rtol=0, atol=EXACT * scale)
        np.testing.assert_allclose(
            data.site("A/tool").xpos, X[:3, 3], rtol=0, atol=EXACT * (1 + np.abs(X[:3, 3]).max())
        )
        np.testing.assert_allclose(data.site("A/tool").xmat.reshape(3, 3), X[:3, :3], rtol=0, atol=EXACT)


@pytest.mark.drawn(FEW_WITH_MASSES)
@pytest.mark.parametrize("name", WITH_MASSES)
def test_equations_of_the_catalogue(name: str, sample: Sample) -> None:
    """The world moves an arm of the catalogue as its own equations say, on the floor and under the ceiling."""
    rng, states = np.random.default_rng(sample.seed), 200 if sample.whole else 20
    check_equations(load_arm(name), rng, states)
    check_equations(load_arm(name), rng, states, np.diag((1.0, -1.0, -1.0, 1.0)))


def test_equations_of_random_arms(sample: Sample) -> None:
    """So it does with joints of both kinds, skew axes, massless links, fixed transforms, and bases turned anyhow."""
    arms = 200 if sample.whole else 12
    for k in range(arms):
        rng = np.random.default_rng([sample.seed, k])
        arm = random_arm(rng, int(rng.integers(1, 8)))
        check_equations(of_all_kinds(arm, rng) if k % 2 else arm, rng, 10, random_pose(rng))
    sample.record("arms in a world against their own equations", arms, 0)


def test_two_sided_dry_friction() -> None:
    """A joint breaks away above the friction of its direction, and not below."""
    arm = Arm(
        name="wheel",
        joints=[Joint(kind="revolute")],
        links=[Link(mass=1.0, inertia=np.eye(3) * 0.5)],
        motors=[Motor(coulomb_forward=2.5, coulomb_backward=1.5)],
        gravity=(0, 0, 0),
    )
    for effort, moves in ((2.4, False), (2.6, True), (-1.4, False), (-1.6, True)):
        model, data, indices = in_a_world(arm)
        data.qfrc_applied[indices.speeds] = dry_offsets(arm)
        data.ctrl[indices.motors] = effort
        mujoco.mj_step(model, data, 1000)
        friction = 2.5 if effort > 0 else -1.5
        expected = (effort - friction) / 0.5 if moves else 0.0  # after a second
        # MuJoCo's friction is a soft constraint: below the bound it creeps.
        assert data.qvel[0] == pytest.approx(expected, abs=0.01), effort


def test_energy_of_a_swinging_arm() -> None:
    """An arm that swings without friction keeps its energy to a thousandth of what is exchanged over a second."""
    arm = load_arm("puma560")
    free = attrs.evolve(arm, motors=tuple(Motor(inertia=motor.inertia) for motor in arm.motors))
    free = attrs.evolve(free, joints=tuple(attrs.evolve(joint, limits=Limits()) for joint in free.joints))
    model, data, indices = in_a_world(free)
    q = np.array([0.3, 0.5, -0.4, 0.2, 0.6, 0.1])
    data.qpos[indices.positions] = q

    def energy() -> float:
        # The speed after a step is that of its middle.
        speed = data.qvel[indices.speeds]
        position = data.qpos[indices.positions] - speed * model.opt.timestep / 2
        return float(kinetic_energy(free, position, speed) + potential_energy(free, position))

    before, kinetic = energy(), 0.0
    for _ in range(1000):
        mujoco.mj_step(model, data)
        kinetic = max(kinetic, float(kinetic_energy(free, data.qpos[indices.positions], data.qvel[indices.speeds])))
    assert abs(energy() - before) < 1e-3 * kinetic


def test_an_arm_without_masses() -> None:
    """An arm whose joints move no mass is refused, and its link is named."""
    with pytest.raises(UnsupportedArmError, match="joint 3 moves no mass: specify mass and inertia of link 3"):
        in_a_world(load_arm("ntu-3r"))
