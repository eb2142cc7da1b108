"""The regressor of the dynamics."""

import attrs
import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint, Link, Motor
from armwright.arrays import Array
from armwright.dynamics.newton_euler import inverse_dynamics
from armwright.dynamics.regressors import dynamic_parameters, regressor
from armwright.errors import InvalidValueError, UnsupportedArmError
from oracles.arms import of_all_kinds, random_arm, random_configurations
from oracles.with_pinocchio import pinocchio_model
from samples import Sample

AGREEMENT = 1e-12  # relative to the largest number


def _motion(arm: Arm, rng: np.random.Generator, count: int) -> tuple[Array, Array, Array]:
    qd, qdd = rng.normal(size=(2, count, arm.n))
    qd[0] = 0.0  # at rest there is no dry friction
    return random_configurations(arm, rng, count), qd, qdd


def test_times_the_parameters(sample: Sample) -> None:
    """The regressor times the parameters of an arm gives its efforts, of every kind of joint, drives included."""
    for rng in sample.cases(100):
        plain = random_arm(rng, int(rng.integers(1, 8)))
        for arm in (plain, of_all_kinds(plain, rng)):
            motion = _motion(arm, rng, 5)
            expected = inverse_dynamics(arm, *motion)

            Y = regressor(arm, *motion)

            assert Y.shape == (5, arm.n, 14 * arm.n)
            found = Y @ dynamic_parameters(arm)
            np.testing.assert_allclose(found, expected, rtol=0, atol=AGREEMENT * max(1.0, np.abs(expected).max()))
    sample.record("regressor times parameters is inverse dynamics, random arms", 2 * sample.count(100), 0)


def test_of_the_geometry_alone(rng: np.random.Generator) -> None:
    """Another arm of the same geometry has the same regressor, to the bit."""
    arm = random_arm(rng, 4)
    motion = _motion(arm, rng, 3)
    heavier = attrs.evolve(arm, links=random_arm(rng, 4).links, motors=[Motor(viscous=3.0)] * 4)

    np.testing.assert_array_equal(regressor(arm, *motion), regressor(heavier, *motion))


def _moments(parameters: Array) -> Array:
    """The integral of (r, 1) (r, 1)ᵀ over the mass of a body, (4, 4), of its ten parameters in Pinocchio's order."""
    m, x, y, z, xx, xy, yy, xz, yz, zz = parameters
    I, h = np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))), np.array((x, y, z))
    return np.block([[np.trace(I) / 2 * np.eye(3) - I, h[:, None]], [h[None, :], np.array([[m]])]])


def _parameters(P: Array) -> Array:
    I = np.trace(P[:3, :3]) * np.eye(3) - P[:3, :3]
    return np.array([P[3, 3], *P[:3, 3], I[0, 0], I[0, 1], I[1, 1], I[0, 2], I[1, 2], I[2, 2]])


def test_against_pinocchio(rng: np.random.Generator) -> None:
    """Pinocchio's regressor, of bodies about their joints, is the same for bodies about the frames of their links."""
    for _ in range(5):
        arm = random_arm(rng, 5)
        arm = attrs.evolve(arm, joints=[attrs.evolve(joint, fixed=arm.tool) for joint in arm.joints])
        model, data, _ = pinocchio_model(arm)
        q, qd, qdd = (x[1] for x in _motion(arm, rng, 2))
        theirs = pin.computeJointTorqueRegressor(model, data, q, qd, qdd)
        ours = regressor(arm, q, qd, qdd)[:, :50]
        scale = np.abs(theirs).max()
        for k, joint in enumerate(arm.joints):
            X = np.eye(4)
            X[:2, :2] = ((np.cos(joint.theta), -np.sin(joint.theta)), (np.sin(joint.theta), np.cos(joint.theta)))
            X[2, 3] = joint.d
            X = X @ joint.behind
            about_joint = np.array([_parameters(X @ _moments(unit) @ X.T) for unit in np.eye(10)]).T
            expected = (theirs[:, 10 * k : 10 * k + 10] @ about_joint)[:, [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]]
            np.testing.assert_allclose(ours[:, 10 * k : 10 * k + 10], expected, rtol=0, atol=AGREEMENT * scale)


def test_order_of_the_parameters() -> None:
    """A slide along x and a turn behind it: each parameter of the second link stands where the page says."""
    link = Link(mass=2.0, com=(0.1, 0.2, 0.3), inertia=np.diag((0.3, 0.4, 0.5)))
    motor = Motor(inertia=1.0, viscous=2.0, coulomb_forward=3.0, coulomb_backward=4.0)
    arm = Arm(
        name="two", joints=[Joint(kind="prismatic"), Joint(kind="revolute")], links=[Link(), link], motors=[motor] * 2
    )

    theta = dynamic_parameters(arm)

    # About the origin of the frame: I_xx = 0.3 + 2 (0.2² + 0.3²), I_xy = -2 · 0.1 · 0.2, and so on.
    of_link = [2.0, 0.2, 0.4, 0.6, 0.56, -0.04, -0.06, 0.6, -0.12, 0.6]
    np.testing.assert_allclose(theta, [*[0.0] * 10, *of_link, 1, 2, 3, 4, 1, 2, 3, 4], atol=1e-15)
    Y = regressor(arm, [0.0, 0.0], [-0.5, 0.7], [1.0, 2.0])
    np.testing.assert_array_equal(Y[:, 20:], [[1.0, -0.5, 0.0, -1.0, 0, 0, 0, 0], [0, 0, 0, 0, 2.0, 0.7, 1.0, 0.0]])
    # The slide lifts the mass of the second link against gravity; its turning inertia is I_zz.
    np.testing.assert_allclose(Y[0, [0, 10]], 1.0 + 9.80665)
    assert Y[1, 19] == 2.0


def test_mistakes() -> None:
    """Unknown masses and numbers that are none are refused."""
    arm = load_arm("stanford")

    with pytest.raises(UnsupportedArmError, match="unknown"):
        dynamic_parameters(attrs.evolve(arm, links=[Link(unknown="not said")] * 6))
    with pytest.raises(InvalidValueError, match="qd: every number must be finite"):
        regressor(arm, np.zeros(6), np.full(6, np.inf), np.zeros(6))
