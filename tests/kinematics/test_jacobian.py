"""The Jacobian on the way: its time derivative, the twist of the tool, manipulability."""

import numpy as np
import pinocchio as pin
import pytest

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.errors import InvalidValueError, ShapeError, UnknownNameError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.jacobians import Axes, jacobian, jacobian_rate, tool_twist
from armwright.kinematics.manipulability_index import manipulability
from oracles.arms import random_arm, random_configurations
from oracles.catalogue import FEW, NAMES
from oracles.with_pinocchio import pinocchio_model

ROUNDING = 1e-10  # agreement with an oracle that multiplies the same matrices in another order, arms of a few metres
REFERENCE = {"base": pin.LOCAL_WORLD_ALIGNED, "tool": pin.LOCAL}


@pytest.fixture
def elbow() -> Arm:
    """A planar arm of two links, one metre and half a metre long."""
    return Arm(name="elbow", joints=[Joint(kind="revolute", a=1.0), Joint(kind="revolute", a=0.5)])


def _against_pinocchio(arm: Arm, rng: np.random.Generator) -> None:
    model, data, tool = pinocchio_model(arm)
    for _ in range(3):
        q, qd = rng.uniform(-3, 3, size=(2, arm.n))
        pin.computeJointJacobiansTimeVariation(model, data, q, qd)
        pin.updateFramePlacements(model, data)
        for frame, reference in REFERENCE.items():
            expected = pin.getFrameJacobianTimeVariation(model, data, tool, reference).reshape(6, arm.n)
            twist = pin.getFrameVelocity(model, data, tool, reference).vector

            np.testing.assert_allclose(jacobian_rate(arm, q, qd, frame), expected, atol=ROUNDING)  # type: ignore[arg-type]
            pin.forwardKinematics(model, data, q, qd)
            np.testing.assert_allclose(tool_twist(arm, q, qd, frame), twist, atol=ROUNDING)  # type: ignore[arg-type]


@pytest.mark.drawn(FEW)
@pytest.mark.parametrize("name", NAMES)
def test_rate_of_catalogue_arms_against_pinocchio(name: str, rng: np.random.Generator) -> None:
    """Pinocchio finds the same time derivative of the Jacobian and the same twist, in base and in tool axes."""
    _against_pinocchio(load_arm(name), rng)


@pytest.mark.parametrize("frame", ["base", "tool"])
def test_rate_is_the_slope_of_the_jacobian(frame: Axes, rng: np.random.Generator) -> None:
    """Along a motion the Jacobian changes by its rate times the time, to second order."""
    arm = load_arm("stanford")
    q, qd = random_configurations(arm, rng, 1)[0], rng.uniform(-1, 1, size=6)
    step = 1e-5

    slope = (jacobian(arm, q + step * qd, frame) - jacobian(arm, q - step * qd, frame)) / (2 * step)

    np.testing.assert_allclose(jacobian_rate(arm, q, qd, frame), slope, atol=1e-8)  # step² times third derivatives


def test_centripetal_acceleration(elbow: Arm) -> None:
    """A stretched arm turning at 2 rad/s about its base pulls its hand, 1.5 m away, inwards at 1.5 · 2² m/s²."""
    acceleration = jacobian_rate(elbow, [0.0, 0.0], [2.0, 0.0]) @ [2.0, 0.0]

    np.testing.assert_allclose(acceleration, (-6.0, 0, 0, 0, 0, 0), atol=ROUNDING)


def test_twist_of_a_turning_base(elbow: Arm) -> None:
    """Turning at 2 rad/s the hand, 1.5 m away, moves at 3 m/s sideways, in base axes and, the arm at 0, in its own."""
    for frame in ("base", "tool"):
        twist = tool_twist(elbow, [0.0, 0.0], [2.0, 0.0], frame)  # type: ignore[arg-type]

        np.testing.assert_allclose(twist, (0, 3.0, 0, 0, 0, 2.0), atol=ROUNDING)


def test_many_rates_at_once(rng: np.random.Generator) -> None:
    """Leading axes come back unchanged, one configuration goes with many speeds, every row is what it is alone."""
    arm = load_arm("puma560")
    q, qd = random_configurations(arm, rng, 1)[0], rng.normal(size=(2, 3, 6))

    rates = jacobian_rate(arm, q, qd, "tool")

    assert rates.shape == (2, 3, 6, 6)
    assert tool_twist(arm, q, qd).shape == (2, 3, 6)
    np.testing.assert_allclose(rates[1, 2], jacobian_rate(arm, q, qd[1, 2], "tool"), atol=ROUNDING)


def test_leading_axes_must_fit() -> None:
    """Two configurations and three speeds are refused with both shapes."""
    with pytest.raises(ShapeError, match=r"leading axes must broadcast together, got \(2, 6\), \(3, 6\)"):
        jacobian_rate(load_arm("puma560"), np.zeros((2, 6)), np.zeros((3, 6)))


def test_unknown_axes() -> None:
    """A rate has base or tool axes, nothing else."""
    with pytest.raises(InvalidValueError, match="'base' or 'tool', got 'wrist'"):
        jacobian_rate(load_arm("puma560"), np.zeros(6), np.zeros(6), "wrist")  # type: ignore[arg-type]


def test_manipulability_of_the_elbow(elbow: Arm) -> None:
    """Two links of 1 m and 0.5 m at an angle of 30 degrees span |l1 l2 sin 30°| = 0.25 m²; stretched out, nothing."""
    # Seen in the plane: the third linear row of a planar arm is empty, and two joints leave two singular values.
    bent, straight = manipulability(elbow, [[0.4, np.pi / 6], [0.4, 0.0]], motion="linear")

    assert bent == pytest.approx(0.25)
    assert straight == pytest.approx(0.0, abs=ROUNDING)


def test_isotropic_elbow() -> None:
    """A planar arm with links √2 : 1 is isotropic where the elbow angle is 135 degrees (Salisbury & Craig 1982)."""
    arm = Arm(name="finger", joints=[Joint(kind="revolute", a=np.sqrt(2)), Joint(kind="revolute", a=1.0)])

    best = manipulability(arm, [0.3, np.radians(135)], measure="inverse-condition", motion="linear")

    assert best == pytest.approx(1.0)


def test_yoshikawa_is_the_determinant(rng: np.random.Generator) -> None:
    """For six joints it is |det J|, and a length of 2 m counts each of the three angular rows twice."""
    arm = load_arm("puma560")
    q = random_configurations(arm, rng, 20)

    np.testing.assert_allclose(manipulability(arm, q), np.abs(np.linalg.det(jacobian(arm, q))), atol=ROUNDING)
    np.testing.assert_allclose(manipulability(arm, q, length=2.0), 8 * manipulability(arm, q), atol=ROUNDING)


def test_redundant_arm(rng: np.random.Generator) -> None:
    """With seven joints it is the root of det(J Jᵀ)."""
    arm = random_arm(rng, 7)
    q = random_configurations(arm, rng, 5)
    J = jacobian(arm, q)

    expected = np.sqrt(np.linalg.det(J @ np.swapaxes(J, -1, -2)))

    np.testing.assert_allclose(manipulability(arm, q), expected, rtol=1e-9)


def test_smallest_is_the_worst_direction(rng: np.random.Generator) -> None:
    """No joint speeds of length 1 move the tool slower than the smallest singular value, and some come near."""
    arm = load_arm("stanford")
    q = random_configurations(arm, rng, 1)[0]
    qd = rng.normal(size=(200_000, 6))
    qd /= np.linalg.norm(qd, axis=-1, keepdims=True)

    speeds = np.linalg.norm(qd @ jacobian(arm, q).T, axis=-1)
    smallest = manipulability(arm, q, measure="smallest")

    assert smallest <= speeds.min() <= smallest + 0.1 * speeds.max()


def test_manipulability_does_not_depend_on_the_base(rng: np.random.Generator) -> None:
    """It is the same on a turned and shifted base."""
    import attrs

    from oracles.arms import random_pose

    arm = load_arm("stanford")
    q = random_configurations(arm, rng, 5)
    moved = attrs.evolve(arm, base=random_pose(rng))

    np.testing.assert_allclose(manipulability(arm, q), manipulability(moved, q), atol=ROUNDING)
    assert not np.allclose(forward(arm, q), forward(moved, q))


def test_unknown_measure() -> None:
    """A slip of the name is answered with the nearest and all the others."""
    arm = load_arm("puma560")
    with pytest.raises(UnknownNameError, match=r"no measure 'yosikawa'. Did you mean 'yoshikawa'\? Known: inverse-con"):
        manipulability(arm, np.zeros(6), measure="yosikawa")  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match=r"no motion 'linar'\. Did you mean 'linear'"):
        manipulability(arm, np.zeros(6), motion="linar")  # type: ignore[arg-type]
    with pytest.raises(InvalidValueError, match="length: expected a characteristic length above 0"):
        manipulability(arm, np.zeros(6), length=0.0)


def test_manipulability_without_motion() -> None:
    """A tool on the axis of the only joint cannot be displaced: its inverse condition number is 0."""
    arm = Arm(name="pin", joints=[Joint(kind="revolute")])

    assert manipulability(arm, [0.3], measure="inverse-condition", motion="linear") == 0.0
