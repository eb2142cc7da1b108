"""Friction of all kinds and springs at the joints, in the dynamics and in what is compiled."""

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link, Motor, Spring
from armwright.arrays import Array
from armwright.compiled.arm import compile_arm
from armwright.compiled.quantities import emit_quantity
from armwright.dynamics.accelerations import forward_dynamics, toacc
from armwright.dynamics.derivatives import forward_dynamics_derivatives, inverse_dynamics_derivatives
from armwright.dynamics.energy import potential_energy
from armwright.dynamics.equation_of_motion import terms
from armwright.dynamics.identification import base_parameters, base_regressor, parameter_names
from armwright.dynamics.inertia_matrix import mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.regressors import dynamic_parameters, regressor
from armwright.dynamics.shares import coriolis_efforts, gravity_efforts
from armwright.errors import InvalidValueError, KindError
from oracles.arms import of_all_kinds, random_arm, random_configurations, with_all_friction, with_springs
from oracles.catalogue import FEW_WITH_MASSES, WITH_MASSES
from oracles.with_pinocchio import pinocchio_model
from samples import Sample

AGREEMENT = 1e-12  # relative to the largest number
OF_INVERSE = 1e-9  # where the inverse of a mass matrix enters
OF_DIFFERENCE = 1e-6  # of a quotient of differences


def expected_friction(motor: Motor, v: Array) -> Array:
    """The law, as one writes it down."""
    sign, size = np.sign(v), np.abs(v)
    coulomb = np.where(v > 0, motor.coulomb_forward, motor.coulomb_backward)
    fades = np.exp(-((size / motor.stribeck_speed) ** 2)) if motor.stribeck_speed else 0.0
    root = np.where(size < 1e-4, size * 1e-4 ** (-2 / 3), size ** (1 / 3))
    magnitude = motor.viscous * size + coulomb + motor.stribeck * fades + motor.cube_root * root
    return motor.offset + sign * magnitude


def random_sprung_arm(rng: np.random.Generator, joints: int) -> Arm:
    return with_springs(with_all_friction(of_all_kinds(random_arm(rng, joints), rng), rng), rng)


def states(arm: Arm, rng: np.random.Generator, count: int) -> tuple[Array, Array, Array]:
    """States of which some are slow, and the first is at rest."""
    qd, qdd = rng.normal(size=(2, count, arm.n))
    qd *= rng.choice([1.0, 0.1], size=(count, 1))
    qd[0] = 0.0
    return random_configurations(arm, rng, count), qd, qdd


def near(found: Array, expected: Array, tolerance: float = AGREEMENT) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * max(1.0, np.abs(expected).max()))


def test_law(sample: Sample) -> None:
    """Efforts are those of Pinocchio for the links, and for drives and springs those of the law, moving or at rest."""
    for rng in sample.cases(100):
        arm = random_sprung_arm(rng, int(rng.integers(1, 8)))
        q, qd, qdd = states(arm, rng, 4)
        links = [pin.rnea(*pinocchio_model(arm)[:2], *state).copy() for state in zip(q, qd, qdd, strict=True)]
        friction = np.stack([expected_friction(motor, v) for motor, v in zip(arm.motors, qd.T, strict=True)], axis=-1)
        springs = np.stack([x.spring.stiffness * (p - x.spring.rest) for x, p in zip(arm.joints, q.T, strict=True)]).T

        tau = inverse_dynamics(arm, q, qd, qdd)

        near(tau, links + arm.motor_values("inertia") * qdd + friction + springs)
        near(inverse_dynamics(arm, q, qd, qdd, drives=False), links + springs)
        found = terms(arm, q, qd, qdd)
        near(found.total, tau)
        near(found.friction, friction)
        near(found.spring, springs)
    sample.record("friction of all kinds and springs in the efforts of random arms", sample.count(100), 0)


def test_forward_dynamics_is_the_inverse(sample: Sample) -> None:
    """The efforts of a motion cause its accelerations, by both algorithms."""
    for rng in sample.cases(60):
        arm = random_sprung_arm(rng, int(rng.integers(1, 8)))
        q, qd, qdd = states(arm, rng, 4)
        tau = inverse_dynamics(arm, q, qd, qdd)

        condition = max(1.0, float(np.linalg.cond(mass_matrix(arm, q)).max()) / 1e4)
        for by in (forward_dynamics, toacc):
            near(by(arm, q, qd, tau), qdd, OF_INVERSE * condition)


def test_potential_of_springs(sample: Sample) -> None:
    """The efforts that hold an arm at rest are the slope of its energy, and speeds add nothing to those of springs."""
    for rng in sample.cases(40):
        arm = random_sprung_arm(rng, int(rng.integers(1, 7)))
        q, qd, _ = states(arm, rng, 3)
        step = 1e-5 * np.eye(arm.n)
        slope = (potential_energy(arm, q[:, None] + step) - potential_energy(arm, q[:, None] - step)) / 2e-5

        near(gravity_efforts(arm, q), slope, OF_DIFFERENCE)
        bare = attrs.evolve(arm, joints=[attrs.evolve(joint, spring=Spring()) for joint in arm.joints])
        np.testing.assert_array_equal(coriolis_efforts(arm, q, qd), coriolis_efforts(bare, q, qd))
        np.testing.assert_array_equal(mass_matrix(arm, q), mass_matrix(bare, q))


def test_derivatives(sample: Sample) -> None:
    """They are quotients of differences; at rest dry friction has none."""
    for rng in sample.cases(30):
        arm = random_sprung_arm(rng, int(rng.integers(1, 6)))
        q, qd, qdd = (x[1:] for x in states(arm, rng, 3))
        # Nowhere so slow that a difference reaches across rest.
        qd = np.sign(qd) * np.maximum(np.abs(qd), 0.02)
        found = inverse_dynamics_derivatives(arm, q, qd, qdd)
        step = 1e-6 * np.eye(arm.n)
        for k, derivative in enumerate((found.dq, found.dqd)):
            ahead, behind = ([x[:, None] for x in (q, qd, qdd)] for _ in range(2))
            ahead[k], behind[k] = ahead[k] + step, behind[k] - step
            slope = (inverse_dynamics(arm, *ahead) - inverse_dynamics(arm, *behind)) / 2e-6
            near(derivative, np.swapaxes(slope, -1, -2), 1e-5)
        accelerations = forward_dynamics_derivatives(arm, q, qd, inverse_dynamics(arm, q, qd, qdd))
        condition = float(np.linalg.cond(found.M).max())
        near(found.M @ accelerations.dq, -found.dq, 1e-13 * condition)
        near(found.M @ accelerations.dqd, -found.dqd, 1e-13 * condition)

        rest = np.zeros(arm.n)
        slope = arm.motor_values("viscous") + arm.motor_values("cube_root") * 1e-4 ** (-2 / 3)
        near(inverse_dynamics_derivatives(arm, q[0], rest, qdd[0]).dqd, np.diag(slope))


def test_regressor(sample: Sample) -> None:
    """The regressor times the parameters gives the efforts, with all parameters and with the base parameters."""
    for rng in sample.cases(40):
        arm = random_sprung_arm(rng, int(rng.integers(1, 6)))
        motion = states(arm, rng, 6)
        motion[1][0] = 0.1  # not at rest: there an offset is none of dry friction's
        tau = inverse_dynamics(arm, *motion)
        theta, base = dynamic_parameters(arm), base_parameters(arm)

        assert len(parameter_names(arm)) == len(theta) == regressor(arm, *motion).shape[-1]
        near(regressor(arm, *motion) @ theta, tau)
        near(base_regressor(arm, *motion) @ (base.combinations @ theta), tau, 1e-10)
        compiled = compile_arm(arm, quickly=True)
        near(compiled.regressor(*motion) @ theta, tau)


def test_names_of_parameters() -> None:
    """Parameters of friction and springs that an arm has are named behind those that all arms have."""
    wheel = Arm(name="wheel", joints=[Joint(kind="revolute")], links=[Link(mass=1.0, inertia=np.eye(3))])
    names = parameter_names(wheel)
    assert names[10:] == ["rotor1", "viscous1", "forward1", "backward1"]
    motor = Motor(offset=0.5, stribeck=2.0, stribeck_speed=0.1, cube_root=3.0)
    joint = Joint(kind="revolute", spring=Spring(stiffness=4.0, rest=0.25))
    full = attrs.evolve(wheel, joints=[joint], motors=[motor])
    assert parameter_names(full)[14:] == ["offset1", "stribeck1", "cube_root1", "stiffness1", "preload1"]
    np.testing.assert_array_equal(dynamic_parameters(full)[14:], (0.5, 2.0, 3.0, 4.0, 1.0))
    # Dry friction of both directions and a constant effort cannot be told apart in motion.
    assert not {"offset1", "preload1"} & {*base_parameters(full).names}
    assert {"stribeck1", "cube_root1", "stiffness1"} <= {*base_parameters(full).names}
    with pytest.raises(KindError, match="expected an Arm"):
        parameter_names(2)  # type: ignore[arg-type]


@pytest.mark.parametrize("joints", [1, 3, 14])
def test_compiled(joints: int, rng: np.random.Generator) -> None:
    """Kernels give the numbers of the plain functions, of long arms too, where they loop over the links."""
    arm = random_sprung_arm(rng, joints)
    compiled = compile_arm(arm, quickly=True)
    q, qd, qdd = states(arm, rng, 20)
    tau = inverse_dynamics(arm, q, qd, qdd)

    near(compiled.inverse_dynamics(q, qd, qdd), tau)
    near(compiled.gravity_efforts(q), gravity_efforts(arm, q))
    near(compiled.potential_energy(q), potential_energy(arm, q))
    M, bias = compiled.mass_and_bias(q, qd)
    links = inverse_dynamics(arm, q, qd, 0 * qd, drives=False)
    near(bias, links)
    near(compiled.bias(q, qd), links)
    condition = max(1.0, float(np.linalg.cond(M).max()) / 1e4)
    near(compiled.forward_dynamics(q, qd, tau), qdd, OF_INVERSE * condition)
    if joints < 5:
        for found, expected in zip(
            compiled.inverse_dynamics_derivatives(q, qd, qdd),
            inverse_dynamics_derivatives(arm, q, qd, qdd),
            strict=True,
        ):
            near(found, expected)


@pytest.mark.drawn(FEW_WITH_MASSES)
@pytest.mark.parametrize("name", WITH_MASSES)
def test_arms_without_them_pay_nothing(name: str) -> None:
    """The code of an arm that has none of this has no operation more than that of its viscous and dry friction."""
    arm = load_arm(name)
    operations = emit_quantity(arm, "inverse_dynamics").operations
    assert not {"exp", "cbrt"} & {*operations}
    # Two choices for each joint with dry friction, and none for others.
    dry = sum(motor.coulomb_forward > 0 or motor.coulomb_backward > 0 for motor in arm.motors)
    assert operations.get("select", 0) == 2 * dry
    one = [attrs.evolve(arm.motors[0], cube_root=1.0, stribeck=1.0, stribeck_speed=0.1), *arm.motors[1:]]
    more = emit_quantity(attrs.evolve(arm, motors=one), "inverse_dynamics").operations
    assert (more["exp"], more["cbrt"]) == (1, 1)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ({"stribeck": 2.0}, "motor: stribeck of 2 needs a stribeck_speed above 0, at which 1/e of it is left"),
        ({"stribeck": -1.0, "stribeck_speed": 0.1}, "motor: stribeck must be 0 or more, got -1"),
        ({"cube_root": -1.0}, "motor: cube_root must be 0 or more, got -1"),
        ({"offset": np.inf}, "motor: offset must be finite, got inf"),
    ],
)
def test_drives_that_cannot_be(numbers: dict[str, float], message: str) -> None:
    """Friction that gives energy is refused."""
    with pytest.raises(InvalidValueError) as caught:
        Motor(**numbers)
    assert str(caught.value) == message


def test_springs_that_cannot_be() -> None:
    """Springs that push away are refused, and what is no spring."""
    with pytest.raises(InvalidValueError, match="spring: stiffness must be 0 or more, got -3"):
        Spring(stiffness=-3)
    with pytest.raises(InvalidValueError, match="spring: rest must be finite, got nan"):
        Spring(stiffness=3, rest=np.nan)
    with pytest.raises(KindError, match="joint: expected spring to be a Spring, got 3"):
        Joint(kind="revolute", spring=3)  # type: ignore[arg-type]


def test_break_away_of_a_motor() -> None:
    """A free joint rests between two efforts."""
    motor = Motor(coulomb_forward=2.0, coulomb_backward=1.0, stribeck=0.5, stribeck_speed=0.1, offset=-0.25)
    assert motor.break_away == (-1.75, 2.25)
