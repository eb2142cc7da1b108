"""Forward kinematics and the Jacobian."""

import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.errors import InvalidValueError, ShapeError
from armwright.kinematics.forward_kinematics import forward, link_poses
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.kinematics.jacobians import jacobian
from armwright.spatial.poses import homogeneous
from armwright.spatial.rotations import nearest_rotation
from oracles.arms import random_configurations
from oracles.catalogue import FEW, NAMES
from oracles.with_pinocchio import pinocchio_model

ROUNDING = 1e-10  # agreement with an oracle that multiplies the same matrices in another order
# The seed's rotations are typed with two digits and off a rotation by 1e-2 (R Rᵀ); its angles solve for them so.
SEED_DIGITS = 1e-2
SEED_PLACE = 1e-5  # its whole centimetres, from angles with four digits of a degree [m]

# Seed 002, test poses A, B, C: joint angles [deg], rotation, place [cm].
SEED_POSES = {
    "A": (
        (-100.4577, 70.6108, 48.3997, 0, 60.9896, 29.2746),
        ((0.64, 0.77, 0), (0.77, -0.64, 0), (0, 0, -1)),
        (5, -55, -60),
    ),
    "B": (
        (-52.1158, -1.4358, 30.2060, 58.6166, 11.4781, 3.2859),
        ((0.87, -0.10, 0.48), (0.29, 0.90, -0.34), (-0.40, 0.43, 0.81)),
        (50, -40, 40),
    ),
    "C": (
        (0.0955, 65.7969, 14.3196, 15.3377, -20.1730, 29.5160),
        ((0.41, -0.29, 0.87), (0.69, 0.71, -0.09), (-0.60, 0.64, 0.49)),
        (60, 15, -30),
    ),
}


@pytest.fixture
def elbow() -> Arm:
    """A planar arm of two links, one metre and half a metre long."""
    return Arm(name="elbow", joints=[Joint(kind="revolute", a=1.0), Joint(kind="revolute", a=0.5)])


def test_right_angle(elbow: Arm) -> None:
    """At q = (90 deg, -90 deg) the elbow sits one metre up the y axis and the hand half a metre beside it."""
    poses = link_poses(elbow, [np.pi / 2, -np.pi / 2])

    np.testing.assert_allclose(poses[1, :3, 3], (0.0, 1.0, 0.0), atol=ROUNDING)
    np.testing.assert_allclose(poses[2, :3, 3], (0.5, 1.0, 0.0), atol=ROUNDING)


@pytest.mark.parametrize("name", SEED_POSES)
def test_poses_of_the_seed(name: str) -> None:
    """The PUMA stands where the seed's tables say, to the printed digits."""
    q, R, p = SEED_POSES[name]

    X = forward(load_arm("puma560-seed"), np.radians(q))

    np.testing.assert_allclose(X[:3, :3], R, atol=SEED_DIGITS)
    np.testing.assert_allclose(X[:3, 3] * 100, p, atol=100 * SEED_PLACE)


@pytest.mark.parametrize("name", SEED_POSES)
def test_angles_of_the_seed(name: str) -> None:
    """The printed pose, its rotation made one, is solved by the printed angles to the digits it was typed with."""
    q, R, p = SEED_POSES[name]
    X = homogeneous(nearest_rotation(R), np.array(p) / 100)

    best = inverse(load_arm("puma560-seed"), X, near=np.radians(q)).best

    np.testing.assert_allclose(np.degrees(best.q), q, atol=1.0)


def test_a_slide_moves_along_its_axis() -> None:
    """The Stanford arm at q2 = 90 deg holds its boom level: pulling it out by 0.2 m moves the hand by 0.2 m."""
    stanford = load_arm("stanford")
    short, long = forward(stanford, [[0, np.pi / 2, 0.4, 0, 0, 0], [0, np.pi / 2, 0.6, 0, 0, 0]])

    np.testing.assert_allclose(long[:3, 3] - short[:3, 3], (0.2, 0.0, 0.0), atol=ROUNDING)


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_catalogue_against_pinocchio(name: str, rng: np.random.Generator) -> None:
    """Pinocchio puts the tool of every catalogue arm in the same place, and moves it the same way."""
    _compare(load_arm(name), rng)


def _compare(arm: Arm, rng: np.random.Generator) -> None:
    model, data, tool = pinocchio_model(arm)
    lower, upper = np.maximum(arm.limits.lower, -3), np.minimum(arm.limits.upper, 3)
    for q in rng.uniform(lower, upper, size=(5, arm.n)):
        pin.framesForwardKinematics(model, data, q)
        base = pin.computeFrameJacobian(model, data, q, tool, pin.LOCAL_WORLD_ALIGNED).reshape(6, arm.n)
        own = pin.computeFrameJacobian(model, data, q, tool, pin.LOCAL).reshape(6, arm.n)

        np.testing.assert_allclose(forward(arm, q), data.oMf[tool].homogeneous, atol=ROUNDING)
        np.testing.assert_allclose(jacobian(arm, q), base, atol=ROUNDING)
        np.testing.assert_allclose(jacobian(arm, q, "tool"), own, atol=ROUNDING)


def test_many_configurations_at_once(rng: np.random.Generator) -> None:
    """Leading axes come back unchanged, and every row is what it is alone."""
    arm = load_arm("stanford")
    q = random_configurations(arm, rng, 6).reshape(2, 3, 6)

    X, J = forward(arm, q), jacobian(arm, q)

    assert X.shape == (2, 3, 4, 4)
    assert J.shape == (2, 3, 6, 6)
    np.testing.assert_allclose(X[1, 2], forward(arm, q[1, 2]), atol=ROUNDING)
    np.testing.assert_allclose(J[1, 2], jacobian(arm, q[1, 2]), atol=ROUNDING)
    assert forward(arm, np.empty((0, 6))).shape == (0, 4, 4)


def test_jacobian_is_the_slope_of_forward(rng: np.random.Generator) -> None:
    """A small step of one joint moves the hand by its column times the step, to second order."""
    arm = load_arm("puma560")
    q = random_configurations(arm, rng, 1)[0]
    step = 1e-6

    slope = (forward(arm, q + step * np.eye(6)) - forward(arm, q - step * np.eye(6)))[:, :3, 3].T / (2 * step)

    np.testing.assert_allclose(jacobian(arm, q)[:3], slope, atol=1e-9)


def test_wrong_number_of_joints() -> None:
    """Five numbers for six joints are refused with both counts."""
    with pytest.raises(ShapeError, match=r"expected 6 numbers .* got shape \(5,\)"):
        forward(load_arm("puma560"), np.zeros(5))


def test_not_a_number() -> None:
    """NaN is refused at the door."""
    with pytest.raises(InvalidValueError, match="finite"):
        forward(load_arm("puma560"), [0, 0, np.nan, 0, 0, 0])


def test_unknown_frame() -> None:
    """A Jacobian has base or tool axes, nothing else."""
    with pytest.raises(InvalidValueError, match="'base' or 'tool', got 'world'"):
        jacobian(load_arm("puma560"), np.zeros(6), "world")  # type: ignore[arg-type]
