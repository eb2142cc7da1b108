"""Newton-Euler inverse dynamics."""

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Link, Motor
from armwright.dynamics.newton_euler import inverse_dynamics, newton_euler
from armwright.errors import ShapeError
from armwright.kinematics.jacobians import jacobian
from oracles.arms import random_arm
from oracles.catalogue import FEW, NAMES
from oracles.with_pinocchio import pinocchio_model

AGREEMENT = 1e-10  # relative to the largest effort


def _compare(arm: Arm, rng: np.random.Generator) -> None:
    model, data, _ = pinocchio_model(arm)
    for q, qd, qdd in rng.uniform(-2, 2, size=(10, 3, arm.n)):
        expected = pin.rnea(model, data, q, qd, qdd)

        tau = inverse_dynamics(arm, q, qd, qdd, drives=False)

        np.testing.assert_allclose(tau, expected, atol=AGREEMENT * max(1.0, np.abs(expected).max()))


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_catalogue_against_pinocchio(name: str, rng: np.random.Generator) -> None:
    """Pinocchio asks the same efforts of the links of every catalogue arm."""
    _compare(load_arm(name), rng)


def test_pendulum_by_hand() -> None:
    """Holding 2 kg half a metre out takes m g r; swinging it up at 3 rad/s² takes m r² more for each rad/s²."""
    pendulum = Arm(
        name="pendulum",
        joints=[Joint(kind="revolute", a=0.5)],
        links=[Link(mass=2.0)],
        gravity=(0.0, -STANDARD_GRAVITY, 0.0),
    )

    assert inverse_dynamics(pendulum, [0.0], [0.0], [0.0])[0] == pytest.approx(2 * STANDARD_GRAVITY * 0.5)
    assert inverse_dynamics(pendulum, [np.pi / 2], [7.0], [3.0])[0] == pytest.approx(2 * 0.25 * 3)


def test_lifting_takes_a_positive_effort() -> None:
    """An upward slide that holds 3 kg pushes up with its weight."""
    lift = Arm(name="lift", joints=[Joint(kind="prismatic")], links=[Link(mass=3.0)])

    assert inverse_dynamics(lift, [0.2], [0.0], [0.0])[0] == pytest.approx(3 * STANDARD_GRAVITY)


def test_outside_wrench_by_virtual_work(rng: np.random.Generator) -> None:
    """A force and moment on the tool relieve the joints by the transposed Jacobian times them."""
    arm = random_arm(rng, 6)
    q, qd, qdd, wrench = (*rng.normal(size=(3, 6)), rng.normal(size=6))

    relief = inverse_dynamics(arm, q, qd, qdd) - inverse_dynamics(arm, q, qd, qdd, wrench=wrench)

    np.testing.assert_allclose(relief, jacobian(arm, q).T @ wrench, atol=1e-10)


def test_power_balance(rng: np.random.Generator) -> None:
    """Without gravity, effort times speed is the change of the kinetic energy, which a small step in time shows."""
    arm = attrs.evolve(random_arm(rng, 6), gravity=np.zeros(3))
    q, qd, qdd = rng.normal(size=(3, 6))
    zero = np.zeros(6)

    def energy(t: float) -> float:
        position, speed = q + t * qd + t * t / 2 * qdd, qd + t * qdd
        momentum = inverse_dynamics(arm, position, zero, speed)  # M(q) qd
        return float(speed @ momentum) / 2

    step = 1e-5
    power = (energy(step) - energy(-step)) / (2 * step)
    assert inverse_dynamics(arm, q, qd, qdd) @ qd == pytest.approx(power, rel=1e-7)


def test_drives_by_hand() -> None:
    """A drive adds rotor inertia times acceleration, viscous friction, and dry friction against the motion."""
    joint = Arm(
        name="drive",
        joints=[Joint(kind="revolute")],
        motors=[Motor(inertia=2.0, viscous=3.0, coulomb_forward=0.5, coulomb_backward=0.7)],
    )
    speeds = np.array([[1.0], [-1.0], [0.0]])

    tau = inverse_dynamics(joint, np.zeros((3, 1)), speeds, np.full((3, 1), 10.0))

    np.testing.assert_allclose(tau[:, 0], (20 + 3 + 0.5, 20 - 3 - 0.7, 20))


def test_floats_and_arrays_are_one_equation(rng: np.random.Generator) -> None:
    """The equation over plain floats and over arrays gives the same efforts."""
    arm = load_arm("stanford")
    q, qd, qdd = rng.normal(size=(3, 4, 6))

    many = inverse_dynamics(arm, q, qd, qdd, drives=False)

    for k in range(4):
        scalars = newton_euler(arm, q[k].tolist(), qd[k].tolist(), qdd[k].tolist())
        np.testing.assert_allclose(scalars, many[k], rtol=1e-13, atol=1e-13)


def test_shapes_that_do_not_fit() -> None:
    """Four positions and three speeds are refused with their shapes."""
    with pytest.raises(ShapeError, match=r"leading axes must broadcast together, got \(4, 6\), \(3, 6\), \(6,\)"):
        inverse_dynamics(load_arm("stanford"), np.zeros((4, 6)), np.zeros((3, 6)), np.zeros(6))
