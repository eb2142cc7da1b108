"""Closed forms for every arm of a build, however its table of numbers is written; three parallel axes."""

import math

import attrs
import numpy as np
import pytest

from armwright.arm.limits import Limits
from armwright.arm.load import load_arm
from armwright.arm.model import Arm, Joint
from armwright.arrays import Array
from armwright.errors import UnsupportedArmError
from armwright.kinematics.forward_kinematics import forward, link_poses, per_joint, stack
from armwright.kinematics.inverse_kinematics.branch_angles import branch_angles
from armwright.kinematics.inverse_kinematics.builds import BRANCHES
from armwright.kinematics.inverse_kinematics.closed_forms import closed_form_of
from armwright.kinematics.inverse_kinematics.recognise import find_geometry
from armwright.kinematics.inverse_kinematics.solution import Outcome
from armwright.kinematics.inverse_kinematics.solve import inverse, inverse_branches
from armwright.kinematics.jacobians import jacobian
from armwright.spatial.poses import homogeneous
from armwright.tracing.graph import Graph
from oracles.arms import random_arm, random_configurations, random_pose
from oracles.graphs import evaluate

SAME_CONFIGURATION = 1e-9  # two configurations are equal where the Jacobian is regular
RESIDUAL = 1e-12  # a pose met, in m and rad
RIGHT = np.pi / 2
SLIDE = Limits(lower=0.2, upper=1.0)
TURN = Limits(lower=-np.pi, upper=np.pi)


def _joint(rng: np.random.Generator, *, d: float = 0.0, a: float = 0.0, twists: tuple[float, ...]) -> Joint:
    return Joint(kind="revolute", theta=rng.uniform(-3, 3), d=d, a=a, alpha=rng.choice(twists), limits=TURN)


def _wrist(rng: np.random.Generator, fore: float) -> list[Joint]:
    """A spherical wrist with any signs, and beyond it any last frame."""
    return [
        _joint(rng, d=fore, twists=(RIGHT, -RIGHT)),
        _joint(rng, twists=(RIGHT, -RIGHT)),
        _joint(rng, d=0.08, a=0.1, twists=(0.3,)),
    ]


def _random_build(rng: np.random.Generator, family: str) -> Arm:
    """An arm of a family with random signs, offsets, shoulder, forearm, base and tool."""
    ahead = rng.choice((0.0, 0.15))
    first = _joint(rng, d=0.3, a=ahead, twists=(RIGHT, -RIGHT))
    upper = _joint(rng, d=0.1, a=rng.choice((0.4, -0.4)), twists=(0.0, np.pi))
    if family == "puma":
        joints = [first, upper, _joint(rng, d=0.05, a=0.03, twists=(RIGHT, -RIGHT, 0.7)), *_wrist(rng, 0.35)]
    elif family == "stanford":
        second = _joint(rng, d=0.15, a=rng.choice((0.0, 0.05)), twists=(RIGHT, -RIGHT))
        slide = Joint(kind="prismatic", theta=rng.uniform(-3, 3), alpha=rng.choice((0.0, RIGHT)), limits=SLIDE)
        joints = [first, second, slide, *_wrist(rng, 0.0)]
    else:
        joints = [
            first,
            upper,
            _joint(rng, d=0.05, a=0.33, twists=(0.0, np.pi)),
            _joint(rng, d=0.11, a=rng.choice((0.0, 0.05)), twists=(RIGHT, -RIGHT)),
            _joint(rng, d=0.09, twists=(RIGHT, -RIGHT)),
            _joint(rng, d=0.08, a=0.1, twists=(0.3,)),
        ]
    return Arm(name=family, joints=joints, base=random_pose(rng), tool=random_pose(rng))


@pytest.mark.parametrize("family", ["puma", "stanford", "parallel"])
@pytest.mark.parametrize("number", range(8))
def test_any_table_of_a_build_is_solved(family: str, number: int) -> None:
    """Random twist signs, offsets of angles, shoulders, forearms, bases, tools: 500 configurations each are found."""
    rng = np.random.default_rng(number)
    arm = _random_build(rng, family)
    q = random_configurations(arm, rng, 500)
    X = forward(arm, q)
    regular = np.linalg.svd(jacobian(arm, q), compute_uv=False)[:, -1] > 1e-3

    found, _ = inverse_branches(arm, X, q)

    assert find_geometry(arm).family == family  # type: ignore[union-attr]
    assert np.abs(found - q[:, None]).max(axis=-1).min(axis=-1)[regular].max() < SAME_CONFIGURATION
    np.testing.assert_allclose(forward(arm, found), np.broadcast_to(X[:, None], (500, 8, 4, 4)), atol=RESIDUAL)


@pytest.mark.parametrize("number", range(8))
@pytest.mark.parametrize("family", ["puma", "parallel"])
def test_two_tables_of_one_arm(family: str, number: int) -> None:
    """Reversing an axis and its joint changes the numbers and not the arm: the configurations are the same."""
    rng = np.random.default_rng(number)
    arm = _random_build(rng, family)
    # Turn the axis of joint 4 over: half a turn about x before and after, and theta and d count the other way.
    third, fourth = arm.joints[2], arm.joints[3]
    over = attrs.evolve(
        arm,
        joints=[
            *arm.joints[:2],
            attrs.evolve(third, alpha=third.alpha + np.pi),
            attrs.evolve(fourth, theta=-fourth.theta, d=-fourth.d, alpha=fourth.alpha - np.pi),
            *arm.joints[4:],
        ],
    )
    mirror = np.array((1, 1, 1, -1, 1, 1))
    q = random_configurations(arm, rng, 20)
    X = forward(arm, q)
    np.testing.assert_allclose(forward(over, q * mirror), X, atol=RESIDUAL)

    for hand, near in zip(X, q, strict=True):
        one, two = inverse(arm, hand, near), inverse(over, hand, near * mirror)

        assert len(one.branches) == len(two.branches)
        configurations = np.array([branch.q * mirror for branch in two])
        for branch in one:
            # Of two images at half a turn either way both are right.
            turned = np.abs(np.angle(np.exp(1j * (configurations - branch.q)))).max(axis=-1)
            assert turned.min() < 1e-6


def test_arms_without_a_closed_form(rng: np.random.Generator) -> None:
    """Skew axes, of five, six or seven joints, and a wrist with an offset are none of the builds; all are told so."""
    puma = load_arm("puma560")
    offset = attrs.evolve(puma, joints=[*puma.joints[:4], attrs.evolve(puma.joints[4], a=0.05), puma.joints[5]])
    for arm in (random_arm(rng, 6), random_arm(rng, 5), random_arm(rng, 7), offset):
        assert find_geometry(arm) is None
        with pytest.raises(UnsupportedArmError, match=r"no closed-form .* built like puma560, .* a SCARA"):
            inverse_branches(arm, np.eye(4))


def test_a_shoulder_ahead_of_its_axis_reaches_farther() -> None:
    """With joint 2 0.2 m ahead of the first axis a PUMA without offsets reaches 0.2 m farther, and is told so."""
    puma = load_arm("puma560")
    ahead = [attrs.evolve(puma.joints[0], a=0.2), puma.joints[1], attrs.evolve(puma.joints[2], d=0.0), *puma.joints[3:]]
    arm = attrs.evolve(puma, joints=ahead)
    reach = 0.2 + 0.432 + math.hypot(0.02, 0.433)

    assert find_geometry(arm).max_reach == pytest.approx(reach)  # type: ignore[union-attr]
    solution = inverse(arm, homogeneous(np.eye(3), (reach + 0.5, 0.0, 0.0)))
    assert solution.outcome is Outcome.OUT_OF_REACH
    assert solution.distance == pytest.approx(0.5, abs=1e-9)
    np.testing.assert_allclose(solution.nearest_pose[:3, 3], (reach, 0, 0), atol=1e-6)  # flat at its least


@pytest.mark.parametrize("family", ["puma", "stanford", "parallel"])
@pytest.mark.drawn(0.34)
def test_nearest_pose_is_nearest_for_any_build(family: str) -> None:
    """No pose of that orientation which the arm reaches is nearer than the one said to be nearest; that is reached."""
    rng = np.random.default_rng(3)
    arm = _random_build(rng, family)
    arm = attrs.evolve(arm, base=np.eye(4), joints=[attrs.evolve(joint, limits=TURN) for joint in arm.joints])
    geometry = find_geometry(arm)
    assert geometry is not None
    out = 0
    for _ in range(20):
        # Places near the first axis, and beyond the reach.
        near_axis = geometry.X_BS[:3, 3] + rng.normal(size=3) * (0.05, 0.05, 0.3)
        X = random_pose(rng)
        X[:3, 3] = near_axis - X[:3, :3] @ geometry.p_TW
        if family != "stanford" and rng.random() < 0.5:
            X[:3, 3] += 1.3 * rng.normal(size=3)
        solution = inverse(arm, X)
        if solution.outcome is not Outcome.OUT_OF_REACH:
            continue
        out += 1
        assert solution.rotation_error < RESIDUAL
        assert inverse(arm, solution.nearest_pose).branches[0].position_error < RESIDUAL
        # Any other pose in reach of that orientation: steps from the nearest one that shorten the way must all fail.
        way = X[:3, 3] - solution.nearest_pose[:3, 3]
        for step in rng.normal(size=(20, 3)) * 0.02:
            if np.linalg.norm(way - step) < 0.999 * np.linalg.norm(way):
                nearer = homogeneous(X[:3, :3], solution.nearest_pose[:3, 3] + step)
                assert inverse(arm, nearer).outcome is Outcome.OUT_OF_REACH
    assert out >= 3


@pytest.mark.parametrize("name", ["puma560", "stanford", "ur5"])
def test_the_equations_can_be_traced(name: str, rng: np.random.Generator) -> None:
    """Run on traced scalars the equations of every branch leave a graph that gives what they give for floats."""
    geometry = find_geometry(load_arm(name))
    assert geometry is not None
    for signs in BRANCHES:
        inputs = Graph().inputs(18)
        traced = branch_angles(geometry, inputs[:3], [inputs[i : i + 3] for i in (3, 6, 9)], signs, inputs[12:])
        p, R, near = rng.uniform(-0.4, 0.4, size=3), random_pose(rng)[:3, :3], rng.normal(size=6)

        values = evaluate(inputs[0].graph, [x.node for x in traced.angles], [*p, *R.ravel(), *near])

        plain = branch_angles(geometry, p.tolist(), R.tolist(), signs, near.tolist())
        apart = np.angle(np.exp(1j * (np.array(values) - plain.angles)))  # half a turn either way is one
        np.testing.assert_allclose(apart, 0, atol=RESIDUAL)


@pytest.fixture
def ur5() -> Arm:
    """The catalogue's arm with three parallel axes."""
    return load_arm("ur5")


def test_ur5_finds_every_configuration_again(ur5: Arm, rng: np.random.Generator) -> None:
    """Of 5000 configurations of the UR5 each is among its own branches, and each branch meets the pose."""
    q = rng.uniform(-np.pi, np.pi, size=(5000, 6))
    X = forward(ur5, q)
    regular = np.linalg.svd(jacobian(ur5, q), compute_uv=False)[:, -1] > 1e-3

    found, _ = inverse_branches(ur5, X, q)

    assert regular.mean() > 0.95
    assert np.abs(found - q[:, None]).max(axis=-1).min(axis=-1)[regular].max() < SAME_CONFIGURATION
    np.testing.assert_allclose(forward(ur5, found), np.broadcast_to(X[:, None], (5000, 8, 4, 4)), atol=RESIDUAL)


def test_ur5_labels_say_how_the_arm_stands(ur5: Arm, rng: np.random.Generator) -> None:
    """The elbow called up is above the line from shoulder to joint 4; left and right are half a turn of joint 1 or so.

    Eight labels, each once, where all eight configurations exist.
    """
    full = 0
    for q in rng.uniform(-np.pi, np.pi, size=(60, 6)):
        solution = inverse(ur5, forward(ur5, q), q)
        labels = [branch.label for branch in solution]
        assert len(set(labels)) == len(labels)
        full += len(labels) == 8
        for branch in solution:
            frames = link_poses(ur5, branch.q)[:, :3, 3]
            shoulder, elbow, end = frames[1], frames[2], frames[3]
            span = end - shoulder
            chord = shoulder + span * ((elbow - shoulder) @ span) / (span @ span)
            # Above in the plane of the arm: seen at a right angle to the chord.
            lift = (elbow - chord) @ np.array((0, 0, 1.0))
            if abs(lift) > 1e-6:
                assert ("elbow up" in branch.label) == (lift > 0), (branch.label, lift)
    assert full > 20


def test_ur5_straight_wrist_keeps_joint_6(ur5: Arm) -> None:
    """With joint 5 at 0 the axes 2, 3, 4 and 6 are parallel: joint 6 stays where it was, the other three make up."""
    q = np.radians([20, -70, 80, -40, 0, 30])
    X = forward(ur5, q)

    free = [branch for branch in inverse(ur5, X, near=q + np.radians([0, 0, 0, 0, 0, 20])) if branch.free]

    assert [branch.free for branch in free] == [(2, 3, 4, 6)] * 2
    for branch in free:
        np.testing.assert_allclose(np.degrees(branch.q[[0, 4, 5]]), (20, 0, 50), atol=1e-6)
        np.testing.assert_allclose(forward(ur5, branch.q), X, atol=RESIDUAL)


def test_ur5_straight_wrist_stays_in_reach(ur5: Arm) -> None:
    """With the arm stretched and joint 5 straight above its end only one place of joint 6 leaves the hand in reach.

    The 94.65 mm beyond joint 4 then point on along the arm. Turned to anywhere else they would ask for more arm than
    there is, so joint 6 takes that place wherever it was.
    """
    lengths = []
    for q4 in (np.pi / 2, -np.pi / 2):
        frames = link_poses(ur5, [0.3, -0.5, 0.0, q4, 0.0, 0.5])[:, :3, 3]
        lengths.append((np.linalg.norm((frames[5] - frames[1]) * (1, 0, 1)), q4))
    q = np.array((0.3, -0.5, 0.0, max(lengths)[1], 0.0, 0.5))
    X = forward(ur5, q)

    free = [branch for branch in inverse(ur5, X, near=q - (0, 0, 0, 0, 0, 2.0)) if branch.free]

    assert [branch.free for branch in free] == [(2, 3, 4, 6)]  # elbow up and down are one, stretched
    np.testing.assert_allclose(free[0].q, q, atol=1e-6)  # half the digits: the arm is at the edge of its reach
    assert free[0].position_error < RESIDUAL


def test_ur5_out_of_reach(ur5: Arm) -> None:
    """Straight above its base axis the UR5's wrist cannot be: the plane of the arm runs 109.15 mm beside the axis."""
    solution = inverse(ur5, homogeneous(np.diag((1.0, -1.0, -1.0)), (0.0, 0.0, 0.3)))

    assert solution.outcome is Outcome.OUT_OF_REACH
    assert solution.distance == pytest.approx(0.10915, abs=1e-9)


def test_branches_that_a_pose_has_not_repeat_one_it_has(ur5: Arm, rng: np.random.Generator) -> None:
    """Of 2000 poses many have fewer than eight solutions; the array of eight holds only solutions of the pose."""
    X = forward(ur5, rng.uniform(-np.pi, np.pi, size=(2000, 6)))

    q, _ = inverse_branches(ur5, X)

    different = np.array([len(np.unique(np.round(rows, 6), axis=0)) for rows in q])
    assert (different < 8).mean() > 0.2
    assert (different % 2 == 0).mean() > 0.99
    np.testing.assert_allclose(forward(ur5, q), np.broadcast_to(X[:, None], (2000, 8, 4, 4)), atol=RESIDUAL)


def _on_axis(arm: Arm, rng: np.random.Generator) -> Array:
    """A configuration of an elbow arm without side offset whose wrist centre is on the first axis."""
    q = rng.uniform(-1, 1, size=6)
    q[2] = np.radians(100)
    geometry = find_geometry(arm)
    assert geometry is not None
    # Turn joint 2 until the wrist centre, at a fixed distance now, is above joint 2.
    _, q3 = geometry.angles(q.tolist())[1:3]
    u = geometry.upper_arm + geometry.forearm[0] * np.cos(q3) + geometry.forearm[1] * np.sin(q3)
    v = geometry.forearm[0] * np.sin(q3) - geometry.forearm[1] * np.cos(q3)
    q[1] = np.arctan2(u, v)  # u cos - v sin = 0
    return q


def test_wrist_above_the_first_axis_keeps_joint_1(rng: np.random.Generator) -> None:
    """Without side offset and with the wrist on the first axis joint 1 is free with the wrist: it stays as it was."""
    puma = load_arm("puma560")
    arm = attrs.evolve(puma, joints=[*puma.joints[:2], attrs.evolve(puma.joints[2], d=0.0), *puma.joints[3:]])
    q = _on_axis(arm, rng)
    X = forward(arm, q)
    assert np.hypot(*X[:2, 3]) < RESIDUAL

    near = q + np.array((0.5, 0, 0, 0, 0, 0))
    solution = inverse(attrs.evolve(arm, joints=[attrs.evolve(joint, limits=TURN) for joint in arm.joints]), X, near)

    assert solution.outcome is Outcome.SINGULAR
    assert all(set(branch.free) >= {1, 4, 5, 6} for branch in solution)
    assert solution.best.q[0] == pytest.approx(near[0])
    assert all(max(branch.position_error, branch.rotation_error) < RESIDUAL for branch in solution)
    assert len(solution.branches) == 4  # left and right are one there


def test_free_joint_moves_on_to_bring_the_others_inside() -> None:
    """The Stanford's joints 4 and 6 end at 175 degrees: where their sum is 180 degrees joint 4 may not stay at 0."""
    arm = load_arm("stanford")
    X = forward(arm, np.radians([10, 60, 0, 90, 0, 90]) + np.array((0, 0, 0.6, 0, 0, 0)))

    near = np.array((np.radians(10), np.radians(60), 0.6, 0, 0, 0))

    best = inverse(arm, X, near).best

    assert best.free == (4, 6)
    np.testing.assert_allclose(forward(arm, best.q), X, atol=RESIDUAL)
    assert abs(math.degrees(best.q[3])) == pytest.approx(5.0, abs=0.5)  # the least it must move, to a step


@pytest.mark.parametrize("name", ["puma560", "stanford", "ur5"])
def test_one_branch_is_one_of_eight(name: str, rng: np.random.Generator) -> None:
    """A branch solved by itself has the joint positions that it has among all eight, of singular poses too."""
    arm = load_arm(name)
    form = closed_form_of(arm)
    for q in random_configurations(arm, rng, 5):
        q[4] = rng.choice((q[4], 0.0))
        X, near = forward(arm, q), rng.uniform(-3, 3, (3, arm.n))
        place = ([X[i, :3].tolist() for i in range(3)], X[:3, 3].tolist(), per_joint(near))
        for i, expected in enumerate(form.branches(arm, *place).q):
            found = form.branch(arm, *place, i).q
            np.testing.assert_array_equal(stack(found, (3,)), stack(expected, (3,)))
