"""Friction of all kinds and springs in a world, against the law itself and mechanics by hand."""

import hashlib
from collections.abc import Callable
from typing import Any

import attrs
import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link, Motor, Spring
from armwright.arrays import Array
from armwright.cell.control import Servo
from armwright.cell.model import Cell, CellArm
from armwright.compiled.arm import compile_arm
from armwright.motion.quintic_polynomials import quintic
from armwright.physics.friction import SpeedFriction, constant_efforts
from armwright.physics.plant import add_arm, arm_indices, finish, new_world
from armwright.physics.world import PhysicsCell
from oracles.arms import random_arm, with_springs
from samples import Sample

EXACT = 1e-12
INERTIA = 0.5
FRICTION = {"coulomb_forward": 2.5, "coulomb_backward": 1.5, "stribeck": 1.2, "stribeck_speed": 0.05, "offset": -0.4}


def wheel(spring: Spring | None = None, **motor: float) -> Arm:
    """A wheel about an upright axis."""
    return Arm(
        name="wheel",
        joints=[Joint(kind="revolute", spring=spring or Spring())],
        links=[Link(mass=1.0, inertia=np.eye(3) * INERTIA)],
        motors=[Motor(**motor)],
        gravity=(0, 0, 0),
    )


class World:
    """An arm alone in a world, driven by a function of time, position and speed."""

    def __init__(self, arm: Arm, timestep: float = 1e-3) -> None:
        spec = new_world(arm.gravity, timestep)
        self.model = finish(spec, (add_arm(spec, "A", arm, np.eye(4)),))
        self.data, self.indices = mujoco.MjData(self.model), arm_indices(self.model, "A", arm.n)
        self._friction = SpeedFriction(arm, self.indices)
        self.data.qfrc_applied[self.indices.speeds] = constant_efforts(arm)

    def run(self, duration: float, drive: Callable[[float, float, float], float]) -> Array:
        """Let time go by; return times, positions and speeds of the first joint, (steps, 3)."""
        rows, data = [], self.data
        for _ in range(round(duration / self.model.opt.timestep)):
            data.ctrl[self.indices.motors] = drive(data.time, data.qpos[0], data.qvel[0])
            self._friction.set(self.model, data)
            mujoco.mj_step(self.model, data)
            rows.append((data.time, data.qpos[0], data.qvel[0]))
        return np.array(rows)


def test_break_away() -> None:
    """A joint breaks away at both bounds, which Stribeck friction widens and an offset shifts, and then runs away."""
    low, high = Motor(**FRICTION).break_away
    for bound, outward in ((low, -1.0), (high, 1.0)):
        still = World(wheel(**FRICTION)).run(1.0, lambda _t, _q, _v, effort=bound - 0.05 * outward: effort)
        # MuJoCo's friction is a soft constraint: below the bound it creeps.
        assert np.abs(still[:, 2]).max() < 0.01
        moved = World(wheel(**FRICTION)).run(1.0, lambda _t, _q, _v, effort=bound + 0.1 * outward: effort)
        # Stribeck friction is gone in the end.
        acceleration = np.diff(moved[-100:, 2]).mean() / 1e-3
        assert acceleration * outward == pytest.approx((0.1 + 1.2) / INERTIA, rel=0.01)


@pytest.mark.parametrize("effort", [4.0, 8.0, -5.0])
def test_speed_under_a_steady_effort(effort: float) -> None:
    """A wheel runs as fast as the law says: where friction takes all of the effort."""
    sign = np.sign(effort)

    def friction(v: float) -> float:
        dry = (2.5 if v > 0 else 1.5) + 1.2 * np.exp(-((v / 0.05) ** 2))
        return float(sign * dry + 0.3 * v + 0.8 * np.cbrt(v) - 0.4)

    speed = brentq(lambda v: friction(v) - effort, sign * 0.2, sign * 100)
    reached = World(wheel(viscous=0.3, cube_root=0.8, **FRICTION)).run(12.0, lambda *_: effort)
    assert reached[-1, 2] == pytest.approx(speed, rel=2e-3)


def test_the_cube_root_of_speed() -> None:
    """A wheel that only this friction slows stops at 3/2 J v^(2/3) / c, without chatter."""
    world = World(wheel(cube_root=2.0))
    world.data.qvel[0] = 1.0
    rows = world.run(0.6, lambda *_: 0.0)

    expected = np.maximum(1.0 - 2 / 3 * 2.0 / INERTIA * rows[:, 0], 0.0) ** 1.5
    np.testing.assert_allclose(rows[:, 2], expected, atol=5e-3)
    assert (rows[:, 2] >= 0).all()
    assert rows[-1, 2] < 1e-9


def test_stick_and_slip() -> None:
    """A wheel pulled slowly by a spring sticks and slips with Stribeck friction, and follows without."""

    def pulled(**motor: float) -> Array:
        dry = {"coulomb_forward": 0.5, "coulomb_backward": 0.5, "viscous": 2.0}
        return World(wheel(**dry, **motor)).run(8.0, lambda t, q, _v: 30.0 * (0.03 * t - q))

    without, slips = pulled()[:, 2], pulled(stribeck=1.0, stribeck_speed=0.1)[:, 2]
    np.testing.assert_allclose(without[4000:], 0.03, atol=1e-3)
    assert without.max() < 0.05
    assert slips.max() > 0.12
    assert np.quantile(slips[4000:], 0.3) < 0.004
    # Several slips, each of which begins at a low speed.
    assert np.count_nonzero((slips[1:] > 0.06) & (slips[:-1] <= 0.06)) >= 3


def test_equations_of_arms_with_springs(sample: Sample) -> None:
    """Bias efforts of worlds are those of arms with springs at joints of both kinds."""
    for rng in sample.cases(60):
        arm = with_springs(random_arm(rng, int(rng.integers(1, 7))), rng)
        world, compiled = World(arm), compile_arm(arm, quickly=True)
        q, qd = rng.uniform(-2, 2, arm.n), rng.normal(size=arm.n)
        world.data.qpos[world.indices.positions], world.data.qvel[world.indices.speeds] = q, qd
        mujoco.mj_forward(world.model, world.data)

        bias = compiled.bias(q, qd)
        found = world.data.qfrc_bias - world.data.qfrc_passive
        np.testing.assert_allclose(found, bias, rtol=0, atol=EXACT * max(1.0, np.abs(bias).max()) * 10)


def test_a_wheel_on_a_spring() -> None:
    """It swings about the position of rest with the frequency of mechanics."""
    world = World(wheel(Spring(stiffness=8.0, rest=0.3)), 1e-4)
    world.data.qpos[0] = 0.8
    rows = world.run(1.5, lambda *_: 0.0)
    np.testing.assert_allclose(rows[:, 1], 0.3 + 0.5 * np.cos(4.0 * rows[:, 0]), atol=1e-3)


# ---- in a cell -------------------------------------------------------------------------------------------------------


def rubbing(law: str = "computed torque", period: float = 1e-3) -> Cell:
    """A PUMA whose drives have every kind of friction, and springs at two joints."""
    arm = load_arm("puma560")
    motors = [
        attrs.evolve(
            motor, viscous=0.5, offset=0.3, stribeck=motor.coulomb_forward / 2, stribeck_speed=0.05, cube_root=0.5
        )
        for motor in arm.motors
    ]
    joints = [
        attrs.evolve(joint, spring=Spring(stiffness=20.0, rest=0.2)) if i in (1, 2) else joint
        for i, joint in enumerate(arm.joints)
    ]
    arm = attrs.evolve(arm, motors=motors, joints=joints)
    start = np.array([0.3, -0.4, 0.2, 0.0, 0.5, 0.0])
    return Cell(name="rubbing", arms={"ARM_1": CellArm(arm=arm, start=start, servo=Servo(law=law))}, period=period)


def driven(cell: Cell, hardware: PhysicsCell | None = None) -> PhysicsCell:
    world = PhysicsCell(cell) if hardware is None else hardware
    start = cell.arms["ARM_1"].start
    move = quintic(start, start + 0.4, 1.0)
    world.start_motion("ARM_1", move, 0.0, np.zeros(3))
    world.advance(1.2)
    return world


@pytest.mark.parametrize("law", ["computed torque", "pd"])
def test_a_servo_that_knows_the_law(law: str) -> None:
    """The servo follows a motion as well as without this friction, and stays where the arm was sent."""
    cell = rubbing(law)
    world = driven(cell)
    end = cell.arms["ARM_1"].start + 0.4
    bound = 2e-4 if law == "computed torque" else 5e-3
    assert np.abs(world.configuration("ARM_1", world.now) - end).max() < bound


def test_same_bits_beside_another() -> None:
    """Two copies of a world that go by turns have the bits of each alone: nothing of one stays in the other."""

    def digest(world: PhysicsCell) -> str:
        data: Any = world._data
        return hashlib.sha256(np.concatenate([data.qpos, data.qvel, data.qacc]).tobytes()).hexdigest()

    cell = rubbing(period=2e-3)
    alone = driven(cell)
    first = PhysicsCell(cell)
    second = first.copy()
    start = cell.arms["ARM_1"].start
    first.start_motion("ARM_1", quintic(start, start + 0.4, 1.0), 0.0, np.zeros(3))
    second.start_motion("ARM_1", quintic(start, start - 0.3, 0.7), 0.0, np.zeros(3))
    for k in range(1, 61):
        first.advance(0.02 * k)
        second.advance(0.02 * k)
    assert digest(first) == digest(alone) != digest(second)
