"""Singular configurations, their cause, and bounded rates through them."""

import attrs
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.errors import InvalidValueError, ShapeError, UnsupportedArmError
from armwright.kinematics.damped_least_squares import damped_rates
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from armwright.kinematics.jacobians import jacobian, tool_twist
from armwright.kinematics.singularity_analysis import singularities, singularity_factors
from oracles.arms import random_arm, random_configurations, random_pose
from samples import examples

ROUNDING = 1e-10
PUMA, STANFORD, UR5 = load_arm("puma560"), load_arm("stanford"), load_arm("ur5")
ARMS = {"puma560": PUMA, "stanford": STANFORD, "stanford-jpl": load_arm("stanford-jpl"), "ur5": UR5}
# In each of these configurations just one factor vanishes. The PUMA's elbow is straight where tan q3 = d4 / a3, its
# wrist centre beside the first axis where a2·c2 + a3·c23 + d4·s23 = 0; the Stanford's boom is vertical where q2 = 0.
ELBOW = np.arctan2(0.433, -0.02)
BENT = ELBOW - 1.0
RAISED = np.arctan2(0.432 - 0.02 * np.cos(BENT) + 0.433 * np.sin(BENT), -0.02 * np.sin(BENT) - 0.433 * np.cos(BENT))
SINGULAR = {
    "PUMA wrist": (PUMA, (0.3, 0.4, 0.5, 0.6, 0.0, 0.7), "wrist"),
    "PUMA elbow": (PUMA, (0.3, 0.4, ELBOW, 0.6, 0.5, 0.7), "elbow"),
    "PUMA shoulder": (PUMA, (0.3, RAISED, BENT, 0.6, 0.5, 0.7), "shoulder"),
    "Stanford wrist": (STANFORD, (0.3, 0.4, 0.5, 0.6, 0.0, 0.7), "wrist"),
    "Stanford shoulder": (STANFORD, (0.3, 0.0, 0.5, 0.6, 0.5, 0.7), "shoulder"),
    "UR5 wrist": (UR5, (0.3, -1.0, 0.8, 0.6, 0.0, 0.7), "wrist"),
    "UR5 elbow": (UR5, (0.3, -1.0, 0.0, 0.6, 0.5, 0.7), "elbow"),
}


def test_factors_of_the_puma(rng: np.random.Generator) -> None:
    """They are the seed's: a2·c2 + a3·c23 + d4·s23, d4·c3 - a3·s3 and s5, with the lengths of its table."""
    q = random_configurations(PUMA, rng, 50)
    a2, a3, d4 = 0.432, -0.02, 0.433
    _, q2, q3, _, q5, _ = q.T
    expected = [
        a2 * np.cos(q2) + a3 * np.cos(q2 + q3) + d4 * np.sin(q2 + q3),
        d4 * np.cos(q3) - a3 * np.sin(q3),
        np.sin(q5),
    ]

    np.testing.assert_allclose(singularity_factors(PUMA, q), np.stack(expected, axis=-1), atol=ROUNDING)


def test_factors_of_the_stanford_arm(rng: np.random.Generator) -> None:
    """They are the boom's reach d3·s2, its length d3, and s5."""
    q = random_configurations(STANFORD, rng, 50)
    expected = [q[:, 2] * np.sin(q[:, 1]), q[:, 2], np.sin(q[:, 4])]

    np.testing.assert_allclose(singularity_factors(STANFORD, q), np.stack(expected, axis=-1), atol=ROUNDING)


@pytest.mark.parametrize("name", ARMS)
def test_determinant_is_the_product(name: str, rng: np.random.Generator) -> None:
    """The determinant of the Jacobian is their product, times the upper arm where there is one, or minus that.

    The sign is one for all configurations; base and tool do not enter.
    """
    arm = attrs.evolve(ARMS[name], base=random_pose(rng), tool=random_pose(rng))
    q = rng.uniform(-3, 3, size=(500, 6))

    determinant = np.linalg.det(jacobian(arm, q))
    product = singularity_factors(arm, q).prod(axis=-1) * (find_geometry(arm).upper_arm or 1.0)  # type: ignore[union-attr]

    sign = np.sign(determinant[0] * product[0])
    np.testing.assert_allclose(determinant, sign * product, atol=ROUNDING)
    assert np.abs(determinant).max() > 0.05


@pytest.mark.parametrize("case", SINGULAR)
def test_cause_is_named(case: str) -> None:
    """At each singular configuration the one factor that vanishes is named, and a twist and a joint motion with it."""
    arm, q, cause = SINGULAR[case]
    found = singularities(arm, q)

    assert found.singular
    assert found.near == (cause,)
    assert len(found.lost) == len(found.idle) == 1
    # No joint motion moves the hand along the lost direction, and the idle one does not move it at all.
    np.testing.assert_allclose(found.lost @ jacobian(arm, q), 0, atol=ROUNDING)
    np.testing.assert_allclose(jacobian(arm, q) @ found.idle.T, 0, atol=ROUNDING)
    assert np.linalg.norm(found.lost) == pytest.approx(1)
    assert np.linalg.norm(found.idle) == pytest.approx(1)


@pytest.mark.parametrize("case", SINGULAR)
@pytest.mark.parametrize("step", [1e-3, 1e-6, 1e-9])
def test_near_and_not_so_near(case: str, step: float) -> None:
    """A step away the factor is in proportion to the step, and called near below a hundredth of its scale."""
    arm, q, cause = SINGULAR[case]
    moving = {"wrist": 4, "elbow": 2, "shoulder": 1}[cause]
    beside = np.array(q)
    beside[moving] += step

    factor = next(factor for factor in singularities(arm, beside, threshold=1e-2).factors if factor.name == cause)

    assert factor.near
    assert 0.05 * step < abs(factor.value) < 2 * step
    beside[moving] = q[moving] + 0.2
    assert not singularities(arm, beside, threshold=1e-2).singular


def test_shoulder_singularity_of_the_stanford_arm_by_hand() -> None:
    """With the boom upright at q = 0 the wrist centre stands 0.5 m above the shoulder and d2 beside the axis.

    Joint 1 moves it along -x, as joint 2 does along x, and the boom along z: nothing moves it along y. Joint 1 takes
    back what joint 2 gives where d2·qd1 = d3·qd2.
    """
    arm = attrs.evolve(STANFORD, tool=np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -0.26289], [0, 0, 0, 1.0]]))

    found = singularities(arm, [0, 0, 0.5, 0.3, 0.6, 0])

    np.testing.assert_allclose(np.abs(found.lost), [[0, 1, 0, 0, 0, 0]], atol=ROUNDING)
    idle = found.idle[0] / found.idle[0, 1]
    assert idle[0] == pytest.approx(0.5 / 0.15367)


def test_other_arms_by_singular_values() -> None:
    """A planar arm of two joints never has four of the six directions; straight or bent, it keeps the other two."""
    elbow = Arm(name="elbow", joints=[Joint(kind="revolute", a=1.0), Joint(kind="revolute", a=0.5)])

    straight, bent = singularities(elbow, [0.0, 0.0]), singularities(elbow, [0.0, 1.0])

    assert not bent.singular
    assert bent.lost.shape == (4, 6)
    assert bent.idle.shape == (0, 2)
    # Straight, the two columns (0, 1.5, 1) and (0, .5, 1) still differ by their turns: the arm keeps rank 2.
    assert not straight.singular
    assert np.abs(straight.lost @ jacobian(elbow, [0.0, 0.0])).max() < ROUNDING


def test_parallel_slides_are_singular() -> None:
    """Two slides along one line: one of them does nothing that the other cannot undo."""
    rail = Arm(name="rail", joints=[Joint(kind="prismatic"), Joint(kind="prismatic")])

    found = singularities(rail, [0.1, 0.2])

    assert found.near == ("singular value 2",)
    assert found.lost.shape == (5, 6)
    np.testing.assert_allclose(np.abs(found.idle), [[np.sqrt(0.5), np.sqrt(0.5)]], atol=ROUNDING)
    assert found.idle[0, 0] == pytest.approx(-found.idle[0, 1])


def test_redundant_arm_always_has_an_idle_motion(rng: np.random.Generator) -> None:
    """Seven joints: nothing is lost in a common configuration, and one joint motion leaves the hand alone."""
    arm = random_arm(rng, 7)
    q = random_configurations(arm, rng, 1)[0]

    found = singularities(arm, q)

    assert not found.singular
    assert found.lost.shape == (0, 6)
    assert found.idle.shape == (1, 7)
    np.testing.assert_allclose(tool_twist(arm, q, found.idle[0]), 0, atol=ROUNDING)


def test_two_causes_at_once() -> None:
    """Elbow and wrist straight together are both named, and cost two directions where axis 5 is parallel to axis 2.

    Elsewhere the wrist cannot make the turn that would keep the hand still while the straight arm rocks: one motion
    does nothing, and the determinant vanishes twice over.
    """
    aligned = singularities(PUMA, (0.3, 0.4, ELBOW, 0.0, 0.0, 0.7))
    turned = singularities(PUMA, (0.3, 0.4, ELBOW, 0.6, 0.0, 0.7))

    assert aligned.near == turned.near == ("elbow", "wrist")
    assert len(aligned.lost) == 2
    assert len(turned.lost) == 1


def test_lost_directions_are_measured_with_their_turn_in_metres() -> None:
    """With a length of 0.5 m a lost twist is 1 m/s long, its turn counting half, and still at a right angle to all."""
    q = (0.3, 0.4, 0.5, 0.6, 0.0, 0.7)
    lost = singularities(PUMA, q, length=0.5).lost[0]

    assert np.hypot(np.linalg.norm(lost[:3]), 0.5 * np.linalg.norm(lost[3:])) == pytest.approx(1.0)
    np.testing.assert_allclose((lost * (1, 1, 1, 0.25, 0.25, 0.25)) @ jacobian(PUMA, q), 0, atol=ROUNDING)


def test_refusals(rng: np.random.Generator) -> None:
    """Arms without known factors, many configurations at once and senseless thresholds are refused with what to do."""
    with pytest.raises(UnsupportedArmError, match=r"'random': .* use the singular values"):
        singularity_factors(random_arm(rng, 6), np.zeros(6))
    with pytest.raises(ShapeError, match=r"q: expected shape \(6,\), got \(2, 6\)"):
        singularities(PUMA, np.zeros((2, 6)))
    with pytest.raises(InvalidValueError, match="threshold: expected a fraction of the scale between 0 and 1, got 2"):
        singularities(PUMA, np.zeros(6), threshold=2)
    with pytest.raises(InvalidValueError, match="damping: expected a singular value above 0"):
        damped_rates(PUMA, np.zeros(6), np.zeros(6), damping=0.0)


ANGLE = st.floats(-np.pi, np.pi)
SPEED = st.floats(-10, 10)


@settings(max_examples=examples(200))
@given(
    st.sampled_from(sorted(ARMS)),
    st.tuples(*[ANGLE] * 6),
    st.tuples(*[SPEED] * 6),
    st.floats(1e-4, 1.0),
    st.floats(0.1, 2.0),
)
def test_damped_rates_are_bounded(
    name: str, q: tuple[float, ...], twist: tuple[float, ...], damping: float, length: float
) -> None:
    """Whatever the configuration, singular ones included, the rates are no longer than |twist| / damping."""
    found = damped_rates(ARMS[name], q, twist, damping=damping, length=length)

    assert np.linalg.norm(found.rates) <= found.bound * (1 + 1e-9)
    assert found.bound == pytest.approx(
        np.hypot(np.linalg.norm(twist[:3]), length * np.linalg.norm(twist[3:])) / damping
    )
    np.testing.assert_allclose(tool_twist(ARMS[name], q, found.rates) + found.error, twist, atol=1e-6)


@pytest.mark.parametrize("case", SINGULAR)
def test_error_of_damped_rates(case: str) -> None:
    """At a singular configuration only the lost direction is left undone; nearby the stated part of it."""
    arm, q, cause = SINGULAR[case]
    lost = singularities(arm, q).lost[0]
    twist = np.array((0.1, -0.2, 0.15, 0.3, 0.1, -0.2))

    error = damped_rates(arm, q, twist, damping=0.02).error
    np.testing.assert_allclose(
        error, lost * (lost @ twist), atol=1e-3
    )  # other directions are damped a little, if at all

    beside = np.array(q)
    beside[{"wrist": 4, "elbow": 2, "shoulder": 1}[cause]] += 0.01
    U, sigma, _ = np.linalg.svd(jacobian(arm, beside))
    damping = 2 * sigma[-1]
    assert damping < sigma[-2]
    left = damped_rates(arm, beside, twist, damping=damping).error
    np.testing.assert_allclose(left, U[:, -1] * (U[:, -1] @ twist) * (1 - 0.25) / (1 + 0.25), atol=ROUNDING)


def test_regular_configurations_are_not_damped(rng: np.random.Generator) -> None:
    """Where the smallest singular value is above the damping the twist is met, in base and tool axes, many at once."""
    q = random_configurations(PUMA, rng, 200)
    regular = np.linalg.svd(jacobian(PUMA, q), compute_uv=False)[:, -1] > 0.05
    twist = rng.normal(size=(200, 6))

    base, tool = damped_rates(PUMA, q, twist), damped_rates(PUMA, q, twist, frame="tool")

    assert regular.sum() > 50
    np.testing.assert_allclose(base.error[regular], 0, atol=ROUNDING)
    np.testing.assert_allclose(tool_twist(PUMA, q, tool.rates, "tool")[regular], twist[regular], atol=ROUNDING)
    assert (base.smallest > 0.05).sum() == regular.sum()


def test_gain_is_smooth_where_damping_begins() -> None:
    """Just above and just below the singular value at which damping begins, the rates are the same."""
    q = (0.3, 0.4, 0.5, 0.6, 0.2, 0.7)
    twist = np.ones(6)
    smallest = float(damped_rates(PUMA, q, twist).smallest)

    below = damped_rates(PUMA, q, twist, damping=smallest * (1 + 1e-7)).rates
    above = damped_rates(PUMA, q, twist, damping=smallest * (1 - 1e-7)).rates

    np.testing.assert_allclose(below, above, rtol=1e-6)
