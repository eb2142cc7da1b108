"""Inverse kinematics of arms without a closed form: few joints, skew ones, many."""

import attrs
import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.errors import InvalidValueError
from armwright.kinematics.forward_kinematics import forward
from armwright.kinematics.inverse_kinematics.candidates import POSE_TOLERANCE
from armwright.kinematics.inverse_kinematics.numeric import numeric_inverse
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from armwright.kinematics.inverse_kinematics.revolutions import mid_range
from armwright.kinematics.inverse_kinematics.solution import NoSolutionError, Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse
from armwright.kinematics.jacobians import jacobian
from armwright.spatial.poses import homogeneous
from oracles.arms import random_arm, random_configurations
from samples import Sample

# Slow: a half of its tests is drawn.
pytestmark = pytest.mark.part(0.1)

# Where the slope is regular the last step leaves nothing but rounding, of arms ten metres long [m] and [rad].
RESIDUAL = 1e-12
# Two configurations are equal: a hundred times the rounding where the Jacobian's condition is 1e8.
SAME_CONFIGURATION = 1e-6
TURN = Limits(lower=-np.pi, upper=np.pi)
RIGHT = np.pi / 2
# Seven joints, a shoulder, an elbow and a wrist that are each spherical.
SEVEN = Arm(
    name="seven",
    joints=[
        Joint(kind="revolute", d=d, alpha=alpha, limits=Limits(lower=-2.9, upper=2.9))
        for d, alpha in [(0.34, -RIGHT), (0, RIGHT), (0.4, RIGHT), (0, -RIGHT), (0.4, -RIGHT), (0, RIGHT), (0.126, 0)]
    ],
)


@pytest.fixture
def elbow() -> Arm:
    """A planar arm of two links, one metre and half a metre long."""
    return Arm(
        name="elbow",
        joints=[Joint(kind="revolute", a=1.0, limits=TURN), Joint(kind="revolute", a=0.5, limits=TURN)],
    )


@pytest.mark.parametrize("joints", [1, 2, 3, 4, 5])
@pytest.mark.drawn(0.4)
def test_short_arms_find_their_configuration_again(joints: int, sample: Sample) -> None:
    """With fewer than six joints, skew and of both kinds, the only configuration of a pose is found without a hint."""
    for rng in sample.cases(20):
        arm = random_arm(rng, joints)
        # Four prismatic joints move the tool in three directions: every configuration of theirs is singular.
        while sum(joint.kind == "prismatic" for joint in arm.joints) > 3:
            arm = random_arm(rng, joints)
        for q in random_configurations(arm, rng, 5):
            solution = inverse(arm, forward(arm, q))

            assert solution.outcome is Outcome.SOLVED
            assert min(np.abs(branch.q - q).max() for branch in solution) < SAME_CONFIGURATION
            assert all(max(b.position_error, b.rotation_error) < RESIDUAL for b in solution)
    sample.record(f"configurations of skew arms of {joints} joints found again, 5 each", sample.count(20), 0)


@pytest.mark.share(0.2)
def test_six_skew_turns_find_their_configuration_again(rng: np.random.Generator, sample: Sample) -> None:
    """With six skew axes every solution reaches the pose, and in nine of ten cases the original one is among them.

    Such an arm may have sixteen configurations, and no number of starts is sure to find all.
    """
    again, arms = 0, sample.count(5)
    for _ in range(arms):
        arm = random_arm(rng, 6)
        arm = attrs.evolve(arm, joints=[attrs.evolve(joint, kind="revolute", limits=TURN) for joint in arm.joints])
        assert find_geometry(arm) is None
        for q in random_configurations(arm, rng, 4):
            solution = inverse(arm, forward(arm, q))

            assert solution.outcome is Outcome.SOLVED
            assert all(max(b.position_error, b.rotation_error) < RESIDUAL for b in solution)
            again += int(min(np.abs(branch.q - q).max() for branch in solution) < SAME_CONFIGURATION)
    assert again >= 0.9 * 4 * arms - 1


@pytest.mark.parametrize("name", ["puma560", "stanford", "ur5"])
@pytest.mark.drawn(0.34)
def test_against_the_closed_form(name: str, rng: np.random.Generator) -> None:
    """Where both are to be had, what is found step by step is among the closed form's branches, and most are found."""
    arm = load_arm(name)
    arm = attrs.evolve(arm, joints=[attrs.evolve(joint, limits=TURN) for joint in arm.joints]) if name == "ur5" else arm
    found = known = 0
    for q in random_configurations(arm, rng, 5):
        if np.linalg.svd(jacobian(arm, q), compute_uv=False)[-1] < 1e-2:
            continue
        X = forward(arm, q)
        exact = np.array([branch.q for branch in inverse(arm, X).allowed])
        searched = numeric_inverse(arm, X, mid_range(arm))

        assert searched.outcome is Outcome.SOLVED
        for branch in searched:
            turned = np.abs(np.angle(np.exp(1j * (exact - branch.q)))) if name == "ur5" else np.abs(exact - branch.q)
            assert turned.max(axis=-1).min() < SAME_CONFIGURATION
        found, known = found + len(searched.branches), known + len(exact)
    assert found > 0.8 * known


@pytest.mark.share(0.5)
def test_seven_joints(rng: np.random.Generator, sample: Sample) -> None:
    """A redundant arm meets every pose; the configuration nearest to where it is comes first, and that is very near."""
    for q in random_configurations(SEVEN, rng, sample.count(10)):
        near = np.clip(q + rng.normal(scale=0.05, size=7), -2.9, 2.9)

        solution = inverse(SEVEN, forward(SEVEN, q), near)

        assert solution.outcome is Outcome.SOLVED
        assert len(solution.allowed) > 1
        assert all(max(b.position_error, b.rotation_error) < RESIDUAL for b in solution)
        ways = [np.linalg.norm(branch.q - near) for branch in solution.allowed]
        assert ways[0] == min(ways)
        assert ways[0] < 3 * np.linalg.norm(q - near)
        assert solution.best.label.startswith("shoulder ")


def test_examples_of_many_joints_are_apart(rng: np.random.Generator) -> None:
    """Of the endless configurations of eight joints no two that are given are nearly the same."""
    joints = [Joint(kind="revolute", d=0.1, a=0.2, alpha=alpha, limits=TURN) for alpha in rng.uniform(0.5, 2.5, size=8)]
    arm = Arm(name="eight", joints=joints)
    q = random_configurations(arm, rng, 1)[0]

    solution = inverse(arm, forward(arm, q), q)

    found = np.array([branch.q for branch in solution])
    apart = np.abs(np.remainder(found[:, None] - found + np.pi, 2 * np.pi) - np.pi).max(axis=-1)
    assert len(found) > 3
    assert apart[~np.eye(len(found), dtype=bool)].min() >= 0.1
    np.testing.assert_allclose(found[0], q, atol=1e-9)


def test_the_same_question_has_the_same_answer() -> None:
    """There is no chance in it: asked twice, it gives the same bits."""
    X = forward(SEVEN, np.linspace(-1, 1, 7))

    one, two = inverse(SEVEN, X), inverse(SEVEN, X)

    assert [branch.q.tolist() for branch in one] == [branch.q.tolist() for branch in two]


def test_two_elbows_of_a_planar_arm(elbow: Arm) -> None:
    """Position and orientation leave a planar 2R arm one solution: the other elbow rotates the tool otherwise."""
    solution = inverse(elbow, forward(elbow, [0.3, 1.1]))

    (only,) = solution
    np.testing.assert_allclose(only.q, (0.3, 1.1), atol=SAME_CONFIGURATION)


def test_out_of_reach_of_a_short_arm(elbow: Arm) -> None:
    """A pose straight ahead, 0.5 m beyond the stretched arm, is 500 mm out of reach, and stretched is the nearest."""
    solution = inverse(elbow, homogeneous(np.eye(3), (2.0, 0.0, 0.0)))

    assert solution.outcome is Outcome.OUT_OF_REACH
    assert solution.distance == pytest.approx(0.5, abs=1e-6)
    np.testing.assert_allclose(solution.nearest_pose, homogeneous(np.eye(3), (1.5, 0, 0)), atol=1e-5)
    with pytest.raises(NoSolutionError, match=r"^the pose is 500\.0 mm out of reach of 'elbow'; the nearest in reach"):
        _ = solution.best


def test_a_pose_out_of_the_plane(elbow: Arm) -> None:
    """Lifted 0.2 m out of its plane and tilted by 0.1 rad about x a pose of a planar arm is so far out of reach."""
    c, s = np.cos(0.1), np.sin(0.1)
    tilt = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    X = forward(elbow, [0.0, 0.0])
    X[2, 3] = 0.2
    X[:3, :3] = tilt @ X[:3, :3]

    solution = inverse(elbow, X)

    assert solution.outcome is Outcome.OUT_OF_REACH
    assert solution.distance == pytest.approx(0.2, abs=1e-6)
    assert solution.rotation_error == pytest.approx(0.1, abs=1e-6)
    assert "200.0 mm and 5.73 deg out of reach" in solution.explain()


def test_out_of_limits_is_another_answer(elbow: Arm) -> None:
    """A pose that takes joint 2 to 63 degrees, where it ends at 30, is in reach and out of the limits."""
    short = attrs.evolve(
        elbow, joints=[elbow.joints[0], attrs.evolve(elbow.joints[1], limits=Limits(lower=0, upper=0.5))]
    )

    solution = inverse(short, forward(elbow, [0.3, 1.1]))

    assert solution.outcome is Outcome.OUT_OF_LIMITS
    assert [violation.joint for violation in solution.branches[0].violations] == [2]
    np.testing.assert_allclose(solution.branches[0].q, (0.3, 1.1), atol=SAME_CONFIGURATION)


def test_a_configuration_at_its_limits(rng: np.random.Generator) -> None:
    """A pose that only a configuration with a joint at the end of its range has is solved, and is not out of limits."""
    for _ in range(10):
        q = rng.uniform(-2.5, 2.5, size=7)
        joint = rng.integers(7)
        q[joint] = 2.9 * rng.choice((-1, 1))
        stiff = Limits(lower=-2.9, upper=2.9)
        joints = [
            attrs.evolve(one, limits=Limits(lower=q[i] - 1e-4, upper=q[i] + 1e-4) if i != joint else stiff)
            for i, one in enumerate(SEVEN.joints)
        ]
        arm = attrs.evolve(SEVEN, joints=joints)

        solution = inverse(arm, forward(arm, q))

        assert solution.outcome is Outcome.SOLVED
        assert solution.best.violations == ()


def test_whole_turns_come_inside_the_limits() -> None:
    """A joint that turns from 200 to 500 degrees is found at 400 where 40 would do."""
    post = Arm(name="post", joints=[Joint(kind="revolute", a=1.0, limits=Limits(lower=3.5, upper=8.7))])

    best = inverse(post, forward(post, [np.radians(400)])).best

    assert np.degrees(best.q[0]) == pytest.approx(400)


def test_free_joints_of_a_singular_configuration() -> None:
    """Of two coaxial joints at the end of a short arm each may turn if the other turns back: one family, one branch."""
    arm = Arm(
        name="coaxial",
        joints=[
            Joint(kind="revolute", a=0.5, alpha=RIGHT, limits=TURN),
            Joint(kind="revolute", alpha=RIGHT, limits=TURN),
            Joint(kind="revolute", d=0.3, limits=TURN),
            Joint(kind="revolute", d=0.1, limits=TURN),
        ],
    )

    solution = inverse(arm, forward(arm, [0.2, 1.0, 0.4, 0.5]), near=[0.2, 1.0, 0.7, 0.0])

    assert solution.outcome is Outcome.SINGULAR
    assert all(branch.free == (3, 4) for branch in solution)
    assert solution.best.q[2] + solution.best.q[3] == pytest.approx(0.9)


@pytest.mark.parametrize("size", [0.01, 0.3, 10.0])
def test_joints_that_do_the_same(size: float) -> None:
    """Three slides of a telescope on a short arm, or two joints on one axis behind a slide: each step has an answer.

    The damping is not lost beside what is large there.
    """
    slide = Joint(kind="prismatic")
    telescope = [slide, slide, slide, Joint(kind="revolute", a=size, alpha=RIGHT)]
    crane = [
        Joint(kind="prismatic", a=0.17 * size, alpha=-RIGHT),
        Joint(kind="revolute"),
        Joint(kind="revolute", a=0.09 * size, alpha=RIGHT),
        Joint(kind="revolute", alpha=0.765),
        Joint(kind="prismatic", d=0.49 * size),
    ]
    for joints, free in ((telescope, (1, 2, 3)), (crane, (2, 3))):
        arm = Arm(name="alike", joints=joints)
        q = np.array([0.3, 0.2, -0.4, 0.5, 0.2])[: arm.n] * np.where(arm.revolute, 1.0, size)
        solution = inverse(arm, forward(arm, q))

        assert solution.outcome is Outcome.SINGULAR
        assert all(set(free) <= set(branch.free) for branch in solution)
        assert solution.best.position_error < RESIDUAL * max(size, 1.0)


def test_a_stretched_arm_is_not_free(elbow: Arm) -> None:
    """Stretched out a planar arm of three joints has an idle motion to first order, and no second configuration."""
    three = attrs.evolve(
        elbow, joints=[*elbow.joints, elbow.joints[1]], links=elbow.links[:1] * 3, motors=elbow.motors[:1] * 3
    )

    solution = inverse(three, forward(three, [0.3, 0.0, 0.0]))

    assert solution.outcome is Outcome.SOLVED
    assert len(solution.branches) == 1
    np.testing.assert_allclose(solution.best.q, (0.3, 0, 0), atol=1e-4)  # half of the digits are left at the edge


@pytest.mark.share(0.4)
def test_typed_poses_of_a_short_arm(rng: np.random.Generator, sample: Sample) -> None:
    """A pose typed with six digits is off the few that an arm of four joints has, by less than counts, and solved."""
    arm = load_arm("ntu-3r")
    for q in rng.uniform(-1.5, 1.5, size=(sample.count(20), arm.n)):
        solution = inverse(arm, np.round(forward(arm, q), 6))

        assert solution.outcome in (Outcome.SOLVED, Outcome.SINGULAR)
        assert solution.best.position_error < POSE_TOLERANCE


def test_arms_without_limits(rng: np.random.Generator) -> None:
    """Joints without limits are searched one turn, or one arm's length, either way; they need not be there."""
    arm = Arm(
        name="free",
        joints=[
            Joint(kind="revolute", a=0.3, alpha=0.4),
            Joint(kind="prismatic", theta=0.3, alpha=1.0),
            Joint(kind="revolute", d=0.2, a=0.1, alpha=-0.8),
        ],
    )
    for q in rng.uniform(-0.5, 0.5, size=(10, 3)):
        assert inverse(arm, forward(arm, q)).outcome is Outcome.SOLVED


def test_not_a_rotation() -> None:
    """A pose whose rotation part is no rotation is refused here as well."""
    with pytest.raises(InvalidValueError, match="orthonormal"):
        inverse(SEVEN, np.diag((1.0, 2.0, 1.0, 1.0)))
