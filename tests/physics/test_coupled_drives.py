"""Coupled drives as tendons of MuJoCo: a world, its servo and its file, against armwright's equations."""

from pathlib import Path

import attrs
import mujoco
import numpy as np
import pytest

from armwright.arm import Arm, Coupling, Joint, Limits, Link, Motor, load_arm, load_mjcf
from armwright.cell.control import Sensors, Servo
from armwright.cell.model import Cell, CellArm
from armwright.dynamics import forward_dynamics, inverse_dynamics, mass_matrix
from armwright.errors import FileFormatError
from armwright.motion.quintic_polynomials import quintic
from armwright.physics.friction import SpeedFriction, constant_efforts
from armwright.physics.mjcf import arm_mjcf
from armwright.physics.plant import add_arm, arm_indices, finish, new_world
from armwright.physics.world import PhysicsCell
from oracles.arms import coupled, random_arm
from samples import Sample

EXACT = 1e-11


def unlimited(arm: Arm) -> Arm:
    return attrs.evolve(arm, joints=[attrs.evolve(joint, limits=Limits()) for joint in arm.joints])


def with_smooth_friction(arm: Arm, rng: np.random.Generator) -> Arm:
    """Friction without jumps, for which MuJoCo needs no constraint."""
    names = ("inertia", "viscous", "cube_root", "offset")
    motors = [Motor(**dict(zip(names, rng.uniform(0.1, 2.0, size=4), strict=True))) for _ in range(arm.n)]
    return attrs.evolve(arm, motors=motors)


def test_equations_of_motion(sample: Sample) -> None:
    """Masses, and accelerations that efforts of the motors cause, are those of the arm: MuJoCo computes them itself."""
    for rng in sample.cases(60):
        arm = coupled(with_smooth_friction(unlimited(random_arm(rng, int(rng.integers(2, 8)))), rng), rng)
        coupling = arm.coupling
        assert coupling is not None
        spec = new_world(arm.gravity, 1e-3)
        model = finish(spec, (add_arm(spec, "A", arm, np.eye(4)),))
        data, indices, M = mujoco.MjData(model), arm_indices(model, "A", arm.n), np.zeros((arm.n, arm.n))
        q, qd, tau = rng.normal(size=(3, arm.n))
        data.qpos[indices.positions], data.qvel[indices.speeds] = q, qd
        data.ctrl[indices.motors] = coupling.drive_efforts(tau)
        data.qfrc_applied[indices.speeds] = constant_efforts(arm)
        SpeedFriction(arm, indices).set(model, data)
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, M)

        expected, qdd = mass_matrix(arm, q), forward_dynamics(arm, q, qd, tau)
        np.testing.assert_allclose(M, expected, rtol=0, atol=EXACT * np.abs(expected).max())
        condition = max(1.0, float(np.linalg.cond(expected)) / 1e3)
        np.testing.assert_allclose(data.qacc, qdd, rtol=0, atol=EXACT * condition * max(1.0, np.abs(qdd).max()))
    sample.record("arms with coupled drives whose motion is MuJoCo's", sample.count(60), 0)


def belt(**limits: float) -> Arm:
    """Two level links of which drive 2 holds the outer one to the ground by a belt, without weight."""
    body = Link(mass=1.0, com=(-0.1, 0, 0), inertia=np.eye(3) * 0.02)
    return Arm(
        name="belt",
        joints=[Joint(kind="revolute", a=0.4), Joint(kind="revolute", a=0.3)],
        links=[body, body],
        motors=[Motor(inertia=0.1), Motor(inertia=0.1, coulomb_forward=1.0, coulomb_backward=1.0)],
        coupling=Coupling(matrix=[[1, 0], [-1, 1]], limits=[Limits(), Limits(**limits)] if limits else []),
        gravity=(0, 0, 0),
    )


def test_dry_friction_of_a_drive() -> None:
    """Dry friction of a drive holds the drive: where the shoulder turns, the outer link keeps its direction."""
    spec = new_world(np.zeros(3), 1e-3)
    model = finish(spec, (add_arm(spec, "A", belt(), np.eye(4)),))
    data, indices = mujoco.MjData(model), arm_indices(model, "A", 2)
    assert indices.tendons.tolist() == [-1, 0]
    for _ in range(300):
        data.ctrl[indices.motors] = 0.3, 0.0
        mujoco.mj_step(model, data)

    turned = data.qpos[0]
    assert turned > 0.03
    assert abs(data.qpos[0] + data.qpos[1]) < 0.02 * turned


def test_limits_of_a_drive() -> None:
    """A drive stops at its own limits, whatever its joint does, and gives no more than its largest effort."""
    spec = new_world(np.zeros(3), 1e-3)
    model = finish(spec, (add_arm(spec, "A", belt(lower=-0.2, upper=0.2, effort=2.0), np.eye(4)),))
    data, indices = mujoco.MjData(model), arm_indices(model, "A", 2)
    for _ in range(1500):
        data.ctrl[indices.motors] = 0.0, 50.0
        mujoco.mj_step(model, data)

    assert data.actuator_force[indices.motors[1]] == 2.0
    assert data.qpos.sum() == pytest.approx(0.2, abs=0.01)


def coupled_puma(**motor: float) -> Arm:
    arm = load_arm("puma560")
    C = np.eye(6)
    C[4, 3], C[5, 3], C[5, 4] = -0.1, 0.05, 0.2
    C[2, 1] = -1.0
    motors = [attrs.evolve(each, **motor) for each in arm.motors]
    return attrs.evolve(arm, motors=motors, coupling=Coupling(matrix=C))


@pytest.mark.parametrize("sensors", [Sensors(), Sensors(counts=1e5)])
def test_a_servo_of_coupled_drives(sensors: Sensors) -> None:
    """The servo follows a motion with friction in coupled drives; what is recorded are efforts at the joints."""
    arm = coupled_puma(stribeck=0.5, stribeck_speed=0.05, cube_root=0.2, offset=0.3)
    start = np.array([0.3, -0.4, 0.2, 0.0, 0.5, 0.0])
    cell = Cell(
        name="coupled", arms={"ARM_1": CellArm(arm=arm, start=start, servo=Servo(), sensors=sensors)}, period=1e-3
    )
    world, move = PhysicsCell(cell), quintic(start, start + 0.4, 1.0)
    world.start_motion("ARM_1", move, 0.0, np.zeros(3))
    world.advance(1.2)

    assert np.abs(world.configuration("ARM_1", world.now) - (start + 0.4)).max() < 5e-4
    (stream,) = world.observations().measured
    during = (stream.t > 0.2) & (stream.t < 0.8)
    planned = inverse_dynamics(arm, *(move(stream.t[during], order) for order in range(3)))
    difference = np.abs(stream.tau[during] - planned).mean(axis=0)
    assert (difference < 0.1 * np.abs(planned).max(axis=0) + 0.3).all()


def test_file(tmp_path: Path) -> None:
    """The file of an arm with coupled drives has tendons, moves as the arm, and is read as the same arm."""
    arm, path = unlimited(coupled_puma()), tmp_path / "arm.xml"
    path.write_text(arm_mjcf(arm).text, encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(path))
    data, M = mujoco.MjData(model), np.zeros((6, 6))

    assert [model.tendon(i).name for i in range(model.ntendon)] == ["drive3", "drive5", "drive6"]
    data.qpos[:] = 0.3
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, M)
    heaviest = mass_matrix(arm, np.full(6, 0.3)).max()
    # Massless links of this arm are padded in the file.
    np.testing.assert_allclose(M, mass_matrix(arm, np.full(6, 0.3)), rtol=0, atol=1e-3 * heaviest)
    np.testing.assert_allclose(M[1:, 2], mass_matrix(arm, np.full(6, 0.3))[1:, 2], rtol=0, atol=1e-3 * heaviest)
    again = load_mjcf(path)
    assert again.coupling is not None
    assert arm.coupling is not None
    np.testing.assert_allclose(again.coupling.matrix, arm.coupling.matrix, atol=1e-12)
    np.testing.assert_allclose(mass_matrix(again, np.full(6, 0.3)), M, atol=1e-9 * heaviest)


def test_limits_in_a_file(tmp_path: Path) -> None:
    """Limits of joints and of drives come back from a file, each where it was, and the friction of the drives."""
    C = np.eye(6)
    C[2, 1] = -1.0
    drives = [Limits()] * 2 + [Limits(lower=-1.5, upper=1.0, effort=40.0), Limits(effort=9.0), Limits(), Limits()]
    arm = attrs.evolve(load_arm("ur5"), coupling=Coupling(matrix=C, limits=drives))
    arm = attrs.evolve(
        arm, motors=[Motor(inertia=0.1, viscous=i, coulomb_forward=i, coulomb_backward=i) for i in range(6)]
    )
    path = tmp_path / "arm.xml"
    path.write_text(arm_mjcf(arm).text, encoding="utf-8")

    again = load_mjcf(path)

    assert again.coupling == arm.coupling
    assert again.motors == arm.motors
    np.testing.assert_array_equal(again.limits.effort, arm.limits.effort)
    np.testing.assert_allclose(again.limits.upper, arm.limits.upper)


def test_drives_of_locked_joints(tmp_path: Path) -> None:
    """A drive of a joint that is held is none of the arm, which is said with the name of its tendon."""
    path = tmp_path / "arm.xml"
    path.write_text(arm_mjcf(belt()).text, encoding="utf-8")

    with pytest.raises(FileFormatError, match="the tendon 'drive2' is a drive of joints that are not all moved by the"):
        load_mjcf(path, lock=["joint1"])
