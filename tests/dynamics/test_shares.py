"""Mass matrix, gravity and Coriolis efforts."""

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import STANDARD_GRAVITY, Arm, Joint, Link, Motor
from armwright.dynamics.inertia_matrix import composite_rigid_body, mass_matrix
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.shares import coriolis_efforts, gravity_efforts
from armwright.errors import ShapeError
from oracles.arms import random_arm, random_configurations
from oracles.catalogue import FEW, NAMES
from oracles.with_pinocchio import pinocchio_model

AGREEMENT = 1e-10  # relative to the largest number


def _agree(ours: np.ndarray, theirs: np.ndarray) -> None:
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=AGREEMENT * max(1.0, np.abs(theirs).max()))


def _compare(arm: Arm, rng: np.random.Generator) -> None:
    model, data, _ = pinocchio_model(arm)
    for q, qd in rng.uniform(-2, 2, size=(5, 2, arm.n)):
        upper = np.triu(pin.crba(model, data, q))
        gravity = pin.computeGeneralizedGravity(model, data, q).copy()

        _agree(mass_matrix(arm, q, drives=False), upper + np.triu(upper, 1).T)
        _agree(gravity_efforts(arm, q), gravity)
        _agree(coriolis_efforts(arm, q, qd), pin.nonLinearEffects(model, data, q, qd) - gravity)


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_catalogue_against_pinocchio(name: str, rng: np.random.Generator) -> None:
    """Pinocchio finds the same mass matrix, gravity and Coriolis efforts of every catalogue arm."""
    _compare(load_arm(name), rng)


def test_shares_add_up(rng: np.random.Generator) -> None:
    """Inertia, speeds and gravity are all there is to an arm without friction."""
    arm = random_arm(rng, 6)
    q, qd, qdd = rng.normal(size=(3, 7, 6))

    inertial = np.einsum("kij,kj->ki", mass_matrix(arm, q), qdd)

    _agree(inertial + coriolis_efforts(arm, q, qd) + gravity_efforts(arm, q), inverse_dynamics(arm, q, qd, qdd))


def test_two_links_by_hand() -> None:
    """Two point masses on two rods: the mass matrix of the textbook, with the cosine of the elbow in it."""
    arm = Arm(
        name="elbow",
        joints=[Joint(kind="revolute", a=0.5), Joint(kind="revolute", a=0.3)],
        links=[Link(mass=2.0), Link(mass=1.5)],
        motors=[Motor(inertia=0.2), Motor(inertia=0.1)],
    )
    c2, far, near = np.cos(0.7), 1.5 * 0.3**2, 3.5 * 0.5**2
    side = 1.5 * 0.5 * 0.3 * c2

    M = mass_matrix(arm, [0.4, 0.7])

    np.testing.assert_allclose(M, [[near + far + 2 * side + 0.2, far + side], [far + side, far + 0.1]], rtol=1e-14)


def test_mass_matrix_is_positive(rng: np.random.Generator) -> None:
    """No motion is without kinetic energy, so every eigenvalue of every catalogue arm is above zero."""
    for name in ("puma560", "stanford", "stanford-jpl"):
        arm = load_arm(name)

        assert np.linalg.eigvalsh(mass_matrix(arm, random_configurations(arm, rng, 50))).min() > 0


def test_base_that_falls_freely(rng: np.random.Generator) -> None:
    """An arm on a base that falls as fast as everything else has no weight."""
    arm = random_arm(rng, 5)
    weightless = attrs.evolve(arm, gravity=np.zeros(3))
    q, qd, qdd = rng.normal(size=(3, 5))

    tau = inverse_dynamics(arm, q, qd, qdd, base_acceleration=arm.gravity)

    _agree(tau, inverse_dynamics(weightless, q, qd, qdd))


def test_base_that_accelerates() -> None:
    """A lift that rises with 2 m/s² makes a mass on an upward slide heavier by 2 N per kilogram."""
    lift = Arm(name="lift", joints=[Joint(kind="prismatic")], links=[Link(mass=3.0)])

    tau = inverse_dynamics(lift, [0.0], [0.0], [0.0], base_acceleration=(0.0, 0.0, 2.0))

    assert tau[0] == pytest.approx(3 * (STANDARD_GRAVITY + 2))


def test_base_acceleration_of_wrong_shape() -> None:
    """A base accelerates along three axes."""
    with pytest.raises(ShapeError, match=r"base_acceleration: expected a shape ending in \(3,\), got \(2,\)"):
        inverse_dynamics(load_arm("stanford"), np.zeros(6), np.zeros(6), np.zeros(6), base_acceleration=(0.0, 1.0))


def test_leading_axes_stay() -> None:
    """A grid of configurations comes back as a grid of mass matrices, each that of its configuration alone."""
    arm = load_arm("puma560")
    q = np.linspace(-1, 1, 36).reshape(2, 3, 6)

    M = mass_matrix(arm, q)

    assert M.shape == (2, 3, 6, 6)
    np.testing.assert_allclose(M[1, 2], mass_matrix(arm, q[1, 2]), rtol=1e-13, atol=1e-15)
    alone = np.array(composite_rigid_body(arm, q[1, 2].tolist())) + np.diag([motor.inertia for motor in arm.motors])
    np.testing.assert_array_equal(mass_matrix(arm, q[1, 2]), alone)


def test_speeds_that_do_not_fit() -> None:
    """Two positions and three speeds are refused with their shapes."""
    with pytest.raises(ShapeError, match=r"q, qd: leading axes must broadcast together, got \(2, 6\), \(3, 6\)"):
        coriolis_efforts(load_arm("stanford"), np.zeros((2, 6)), np.zeros((3, 6)))
